"""Rolling friction on the device: after all contacts are solved.

A body with n contacts on which it rolls lends each of them an n-th of its mass, as in
``contact_impulses``.
"""

from corporeal.mpm import formulas
from corporeal.mpm.cuda.layout import (
    FULL,
    LANES,
    PUSHING,
    RUBBING,
    TOUCHES,
    D,
    Sheet,
    wp,
)
from corporeal.mpm.cuda.layout_bodies import Rigid
from corporeal.mpm.cuda.layout_contact import Contacts
from corporeal.mpm.formulas.one_lane import brake

wp.set_module_options(formulas.options(max_unroll=0))


@wp.func
def most_of(c: Contacts, t: int):
    """Greatest moment of a contact, c J_n [N m s]; 0 where nothing rolls."""
    most = D(0.0)
    if c.active[t] > 0 and c.meet[t] < 0:
        if c.rolls[t] == 1:
            push = wp.dot(c.impulse[t] + c.struck[t], wp.vec3d(c.normal[t]))
            most = c.rolling[c.fa[t], c.fc[t]] * wp.max(push, D(0.0))
    return most


@wp.func
def yields(r: Rigid, s: Sheet, field: int):
    """Whether a side can be moved: no plane, and no body with prescribed motion."""
    free = field < s.bodies
    if free:
        free = r.path_count[field] == 0
    return free


@wp.func
def spin_of(r: Rigid, s: Sheet, field: int):
    """ω of a side [rad/s]."""
    if field < s.bodies:
        return r.spin[field]
    return wp.vec3d(D(0.0))


@wp.func
def light_of(r: Rigid, s: Sheet, field: int):
    """1/M of a side's share [1/kg]."""
    if yields(r, s, field):
        return r.light[field] * D(wp.max(r.busy[field], 1))
    return D(0.0)


@wp.func
def inertia_of(r: Rigid, s: Sheet, field: int):
    """I⁻¹ of a side's share [1/(kg m²)]."""
    if yields(r, s, field):
        return r.inertia[field] * D(wp.max(r.busy[field], 1))
    return wp.mat33d(D(0.0))


@wp.func
def arm_of(c: Contacts, r: Rigid, s: Sheet, t: int, field: int):
    """Place of contact less the centre of a side [m]."""
    if field < s.bodies:
        return c.point[t] - r.centre[field]
    return wp.vec3d(D(0.0))


@wp.func
def hand(r: Rigid, s: Sheet, t: int, field: int, arm: wp.vec3d, M: wp.vec3d, f: wp.vec3d):
    """Give a side its part, at the end of the kernel; book what a mover has to do."""
    if yields(r, s, field):
        wp.atomic_add(r.speed_change, field, f * r.light[field])
        wp.atomic_add(r.moment_change, field, M + wp.cross(arm, f))
    elif field < s.bodies:
        wp.atomic_add(s.loss, PUSHING, t % LANES, -wp.dot(M, r.spin[field]))
    return 0


@wp.kernel
def count_rolling(c: Contacts, r: Rigid, s: Sheet, stride: int):
    """Count the contacts on which each body rolls."""
    if s.flag[FULL] == 2:
        return
    for t in range(wp.tid(), s.flag[TOUCHES], stride):
        if most_of(c, t) > D(0.0):
            wp.atomic_add(r.busy, c.fa[t], 1)
            if c.fc[t] < s.bodies:
                wp.atomic_add(r.busy, c.fc[t], 1)


@wp.kernel
def brake_rolling(c: Contacts, r: Rigid, s: Sheet, stride: int):
    """Take spin from what rolls, as far as c J_n reaches."""
    if s.flag[FULL] == 2:
        return
    for t in range(wp.tid(), s.flag[TOUCHES], stride):
        most = most_of(c, t)
        if most > D(0.0):
            fa = c.fa[t]
            fc = c.fc[t]
            arm_a = arm_of(c, r, s, t, fa)
            arm_c = arm_of(c, r, s, t, fc)
            done = brake(
                light_of(r, s, fa),
                inertia_of(r, s, fa),
                arm_a,
                light_of(r, s, fc),
                inertia_of(r, s, fc),
                arm_c,
                spin_of(r, s, fa) - spin_of(r, s, fc),
                wp.vec3d(c.normal[t]),
                c.impulse[t] + c.struck[t],
                c.friction[fa, fc],
                most,
            )
            M = wp.vec3d(done[0], done[1], done[2])
            f = wp.vec3d(done[3], done[4], done[5])
            hand(r, s, t, fa, arm_a, -M, -f)
            hand(r, s, t, fc, arm_c, M, f)
            c.impulse[t] = c.impulse[t] + f
            wp.atomic_add(s.loss, RUBBING, t % LANES, done[6])


@wp.kernel
def slow_down(r: Rigid, s: Sheet):
    """Let bodies have what they were given."""
    b = wp.tid()
    if s.flag[FULL] == 2:
        return
    if r.stiff[b] == 1 and r.path_count[b] == 0:
        r.speed[b] = r.speed[b] + r.speed_change[b]
        r.moment[b] = r.moment[b] + r.moment_change[b]
        r.spin[b] = r.inertia[b] * r.moment[b]
    r.speed_change[b] = wp.vec3d(D(0.0))
    r.moment_change[b] = wp.vec3d(D(0.0))
    r.busy[b] = 0

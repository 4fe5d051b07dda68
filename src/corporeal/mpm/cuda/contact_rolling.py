"""Rolling friction on the device: after all contacts are solved.

A body with n contacts on which it rolls lends each of them an n-th of its mass, as in ``contact_impulses``.
"""

from corporeal.mpm import formulas
from corporeal.mpm.cuda.layout import (
    FLAG_FULL,
    FLAG_TOUCHES,
    LOSS_FRICTION,
    LOSS_LANES,
    LOSS_PUSH_WORK,
    D,
    StepGlobals,
    wp,
)
from corporeal.mpm.cuda.layout_bodies import DeviceRigidBodies
from corporeal.mpm.cuda.layout_contact import DeviceContacts
from corporeal.mpm.formulas.one_lane import rolling_brake

wp.set_module_options(formulas.formula_options(max_unroll=0))


@wp.func
def max_rolling_moment(c: DeviceContacts, t: int):
    """Greatest moment of a contact, c J_n [N m s]; 0 where nothing rolls."""
    most = D(0.0)
    if c.active[t] > 0 and c.meet[t] < 0:
        if c.rolls[t] == 1:
            push = wp.dot(c.impulse[t] + c.struck[t], wp.vec3d(c.normal[t]))
            most = c.rolling_resistance[c.fa[t], c.fc[t]] * wp.max(push, D(0.0))
    return most


@wp.func
def can_move(r: DeviceRigidBodies, s: StepGlobals, field: int):
    """Whether a side can be moved: no plane, and no body with prescribed motion."""
    free = field < s.bodies
    if free:
        free = r.path_count[field] == 0
    return free


@wp.func
def spin_of(r: DeviceRigidBodies, s: StepGlobals, field: int):
    """ω of a side [rad/s]."""
    if field < s.bodies:
        return r.spin[field]
    return wp.vec3d(D(0.0))


@wp.func
def inverse_mass_share(r: DeviceRigidBodies, s: StepGlobals, field: int):
    """1/M of a side's share [1/kg]."""
    if can_move(r, s, field):
        return r.light[field] * D(wp.max(r.busy[field], 1))
    return D(0.0)


@wp.func
def inverse_inertia_share(r: DeviceRigidBodies, s: StepGlobals, field: int):
    """I⁻¹ of a side's share [1/(kg m²)]."""
    if can_move(r, s, field):
        return r.inertia[field] * D(wp.max(r.busy[field], 1))
    return wp.mat33d(D(0.0))


@wp.func
def arm_of(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, t: int, field: int):
    """Place of contact less the centre of a side [m]."""
    if field < s.bodies:
        return c.point[t] - r.centre[field]
    return wp.vec3d(D(0.0))


@wp.func
def give_brake(r: DeviceRigidBodies, s: StepGlobals, t: int, field: int, arm: wp.vec3d, M: wp.vec3d, f: wp.vec3d):
    """Give a side its part, at the end of the kernel; book what a mover has to do."""
    if can_move(r, s, field):
        wp.atomic_add(r.speed_change, field, f * r.light[field])
        wp.atomic_add(r.moment_change, field, M + wp.cross(arm, f))
    elif field < s.bodies:
        wp.atomic_add(s.loss, LOSS_PUSH_WORK, t % LOSS_LANES, -wp.dot(M, r.spin[field]))
    return 0


@wp.kernel
def count_rolling(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, stride: int):
    """Count the contacts on which each body rolls."""
    if s.flag[FLAG_FULL] == 2:
        return
    for t in range(wp.tid(), s.flag[FLAG_TOUCHES], stride):
        if max_rolling_moment(c, t) > D(0.0):
            wp.atomic_add(r.busy, c.fa[t], 1)
            if c.fc[t] < s.bodies:
                wp.atomic_add(r.busy, c.fc[t], 1)


@wp.kernel
def brake_rolling(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, stride: int):
    """Take spin from what rolls, as far as c J_n reaches."""
    if s.flag[FLAG_FULL] == 2:
        return
    for t in range(wp.tid(), s.flag[FLAG_TOUCHES], stride):
        most = max_rolling_moment(c, t)
        if most > D(0.0):
            fa = c.fa[t]
            fc = c.fc[t]
            arm_a = arm_of(c, r, s, t, fa)
            arm_c = arm_of(c, r, s, t, fc)
            done = rolling_brake(
                inverse_mass_share(r, s, fa),
                inverse_inertia_share(r, s, fa),
                arm_a,
                inverse_mass_share(r, s, fc),
                inverse_inertia_share(r, s, fc),
                arm_c,
                spin_of(r, s, fa) - spin_of(r, s, fc),
                wp.vec3d(c.normal[t]),
                c.impulse[t] + c.struck[t],
                c.friction[fa, fc],
                most,
            )
            M = wp.vec3d(done[0], done[1], done[2])
            f = wp.vec3d(done[3], done[4], done[5])
            give_brake(r, s, t, fa, arm_a, -M, -f)
            give_brake(r, s, t, fc, arm_c, M, f)
            c.impulse[t] = c.impulse[t] + f
            wp.atomic_add(s.loss, LOSS_FRICTION, t % LOSS_LANES, done[6])


@wp.kernel
def apply_brakes(r: DeviceRigidBodies, s: StepGlobals):
    """Let bodies have what they were given."""
    b = wp.tid()
    if s.flag[FLAG_FULL] == 2:
        return
    if r.stiff[b] == 1 and r.path_count[b] == 0:
        r.speed[b] = r.speed[b] + r.speed_change[b]
        r.moment[b] = r.moment[b] + r.moment_change[b]
        r.spin[b] = r.inertia[b] * r.moment[b]
    r.speed_change[b] = wp.vec3d(D(0.0))
    r.moment_change[b] = wp.vec3d(D(0.0))
    r.busy[b] = 0

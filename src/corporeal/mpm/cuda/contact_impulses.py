"""What contacts transmit on the device: impulses, and the books.

Nodes of deformable fields are independent of one another: each is solved by its own thread with
projected Gauss–Seidel. Rigid bodies couple many nodes. There every sweep is a Jacobi sweep in which
a body with n busy contacts lends each of them an n-th of its mass (mass splitting, Tonge et al.
2012, "Mass splitting for jitter-free parallel rigid body simulation"): it converges whatever the
order of threads, and each impulse moves the whole body, so momentum is exact. Impacts of rigid
bodies come first, in rounds of such sweeps: see ``contact_rounds``.
"""

from corporeal.mpm import constants, formulas
from corporeal.mpm.constants import (
    FIELDS_AT_NODE,
    JACOBI_STILL,
    JACOBI_SWEEPS,
    JACOBI_SWEEPS_OF_A_HIT,
    JACOBI_SWEEPS_OF_A_HOLD,
    SWEEPS,
    VAST,
)
from corporeal.mpm.cuda.arena import meet
from corporeal.mpm.cuda.contact import mean_of
from corporeal.mpm.cuda.contact_nodes import curve_of
from corporeal.mpm.cuda.contact_surface import replaced
from corporeal.mpm.cuda.layout import (
    DT,
    FULL,
    HITS,
    HOLDS,
    IMPACTING,
    LANES,
    MEETS,
    NODES,
    PAIRS,
    PUSHING,
    RUBBING,
    STIFF,
    STRIKING,
    SWEEPING,
    SWEPT,
    SWEPT_NOW,
    TOUCHES,
    D,
    Grid,
    Sheet,
    wp,
)
from corporeal.mpm.cuda.layout_bodies import Rigid
from corporeal.mpm.cuda.layout_contact import Contacts
from corporeal.mpm.cuda.rigid import softness_at, speed_at
from corporeal.mpm.formulas.one_lane_contact import (
    closing_speed,
    dragged,
    push_of,
    touched,
    within_cone,
)

wp.set_module_options(formulas.options(max_unroll=0))

SMALLEST_SLIP = wp.constant(D(constants.SMALLEST_SLIP))


@wp.func
def side_speed(c: Contacts, r: Rigid, s: Sheet, t: int, entry: int, field: int):
    """Velocity of one side of a contact [m/s]."""
    if field >= s.bodies:
        return wp.vec3d(D(0.0))
    if r.stiff[field] == 1:
        return speed_at(r, field, c.point[t])
    return c.velocity[entry]


@wp.func
def slip_of(c: Contacts, r: Rigid, s: Sheet, t: int):
    """Slip and approach together: u = v_a - v_c [m/s]."""
    a = side_speed(c, r, s, t, c.a[t], c.fa[t])
    return a - side_speed(c, r, s, t, c.c[t], c.fc[t])


@wp.func
def side_before(c: Contacts, r: Rigid, g: Grid, s: Sheet, t: int, entry: int, field: int):
    """Velocity of one side as the step began, before its forces [m/s]."""
    if field >= s.bodies:
        return wp.vec3d(D(0.0))
    if r.stiff[field] == 1:
        return speed_at(r, field, c.point[t]) - s.kick[field]
    v = g.old[c.slot[entry]]
    return wp.vec3d(D(v[0]), D(v[1]), D(v[2]))


@wp.func
def side_softness(c: Contacts, r: Rigid, s: Sheet, t: int, entry: int, field: int, n: wp.vec3d):
    """1/m_eff of one side; a rigid body is shared among its busy contacts."""
    if field >= s.bodies:
        return D(0.0)
    if r.stiff[field] == 1:
        return softness_at(r, field, c.point[t], n) * D(wp.max(r.busy[field], 1))
    return c.light[entry]


@wp.func
def softness_of(c: Contacts, r: Rigid, s: Sheet, t: int, n: wp.vec3d):
    """1/m_eff of a contact along n [1/kg]."""
    a = side_softness(c, r, s, t, c.a[t], c.fa[t], n)
    return a + side_softness(c, r, s, t, c.c[t], c.fc[t], n)


@wp.func
def give(c: Contacts, r: Rigid, s: Sheet, t: int, entry: int, field: int, J: wp.vec3d):
    """Give an impulse to one side: nodes at once, rigid bodies at the end of the sweep."""
    if field < s.bodies:
        if r.path_count[field] > 0:
            return 0
        if r.stiff[field] == 1:
            wp.atomic_add(r.speed_change, field, J * r.light[field])
            moment = wp.cross(c.point[t] - r.centre[field], J)
            wp.atomic_add(r.moment_change, field, moment)
        else:
            c.velocity[entry] = c.velocity[entry] + J * c.light[entry]
    return 0


@wp.func
def relax(c: Contacts, r: Rigid, s: Sheet, t: int):
    """One projection of one contact onto its Coulomb cone; by how much it changed [m/s]."""
    u = slip_of(c, r, s, t)
    n = wp.vec3d(c.normal[t])
    un = wp.dot(u, n)
    J = c.impulse[t]
    old = wp.dot(J, n)
    soft = softness_of(c, r, s, t, n)
    new = push_of(old, un, c.target[t], soft)
    c.turn[t] = D(0.0)
    if new == D(0.0) and wp.length_sq(J) == D(0.0) and c.span[t] == D(0.0):
        return float(0.0)
    slide = u - un * n
    rub = J - old * n
    size = wp.length(slide)
    along = soft
    if size > SMALLEST_SLIP:
        along = softness_of(c, r, s, t, slide / size)
        rub = rub + slide / along
    grip = c.friction[c.fa[t], c.fc[t]] * D(1 - c.slips[t])
    given = within_cone(grip, new, n, rub)
    if c.span[t] > D(0.0):
        given = dragged(along, c.span[t], curve_of(c, r, s, t), new, n, rub)
    change = given - J
    c.impulse[t] = given
    c.turn[t] = -wp.dot(change, given - c.last_impulse[t]) * soft
    give(c, r, s, t, c.a[t], c.fa[t], -change)
    give(c, r, s, t, c.c[t], c.fc[t], change)
    return float(wp.length(change) * soft)


# ---------------------------------------------------------------- before


@wp.func
def put(c: Contacts, r: Rigid, g: Grid, s: Sheet, t: int):
    """Put a contact of two rigid bodies that meet at a node where both of them are."""
    rigid = c.meet[t] >= 0 and c.c[t] >= 0
    if rigid:
        rigid = r.stiff[c.fa[t]] == 1 and r.stiff[c.fc[t]] == 1
    if rigid:
        # What is round all over has no edges.
        a = mean_of(c, g, s, c.a[t]) * D(r.edged[c.fa[t]])
        other = mean_of(c, g, s, c.c[t]) * D(r.edged[c.fc[t]])
        shift = touched(c.face, a, other, wp.vec3d(c.normal[t]))
        c.point[t] = c.point[t] + shift * s.dx
    return 0


@wp.func
def prepare(c: Contacts, r: Rigid, g: Grid, s: Sheet, t: int):
    """Normal speed that a contact may keep, and whether it is of a rigid pair."""
    if replaced(r, c, s, t):
        c.gap[t] = VAST
    put(c, r, g, s, t)
    if c.gap[t] < VAST or c.span[t] > D(0.0):
        gap = D(c.gap[t])
        fa = c.fa[t]
        fc = c.fc[t]
        c.active[t] = 1
        before = side_before(c, r, g, s, t, c.a[t], fa)
        c.before[t] = before - side_before(c, r, g, s, t, c.c[t], fc)
        c.target[t] = closing_speed(gap, s.clock[DT]) - c.inward[t]
        c.struck[t] = wp.vec3d(D(0.0))
        if r.stiff[fa] == 1 and fc < s.bodies:
            if r.stiff[fc] == 1:
                wp.atomic_max(s.flag, HITS, 1)
    return 0


# ---------------------------------------------------------------- the sweeps


@wp.kernel
def begin_contact(c: Contacts, r: Rigid, g: Grid, s: Sheet, stride: int):
    """Prepare all contacts, and solve every node that no rigid body takes part in."""
    if s.flag[FULL] == 2:
        return
    for k in range(wp.tid(), s.flag[MEETS], stride):
        for t in range(c.first[k], c.last[k]):
            prepare(c, r, g, s, t)
        if c.stiff[k] == 0:
            solve_node(c, r, s, k)
    for t in range(s.flag[NODES] + wp.tid(), s.flag[TOUCHES], stride):
        prepare(c, r, g, s, t)
    if wp.tid() == 0:
        s.flag[IMPACTING] = 0
        if s.flag[STIFF] > 0:
            s.flag[IMPACTING] = 1


@wp.func
def solve_node(c: Contacts, r: Rigid, s: Sheet, k: int):
    """Sweep over a node's contacts until nothing changes."""
    for _ in range(SWEEPS):
        moved = float(0.0)
        for t in range(c.first[k], c.last[k]):
            if c.active[t] > 0:
                moved += relax(c, r, s, t)
        if moved == 0.0 or c.last[k] - c.first[k] == 1:
            break
    return 0


@wp.func
def count(c: Contacts, r: Rigid, s: Sheet, t: int):
    """Note whether a contact wants something of its bodies in this sweep."""
    if c.active[t] == SWEPT_NOW:
        fa = c.fa[t]
        fc = c.fc[t]
        n = wp.vec3d(c.normal[t])
        busy = wp.length_sq(c.impulse[t]) > D(0.0) or c.span[t] > D(0.0)
        busy = busy or wp.dot(slip_of(c, r, s, t), n) > c.target[t]
        if busy and r.stiff[fa] == 1:
            wp.atomic_add(r.busy, fa, 1)
        if busy and fc < s.bodies:
            if r.stiff[fc] == 1:
                wp.atomic_add(r.busy, fc, 1)
    return 0


@wp.func
def hasten(c: Contacts, t: int, more: wp.float64):
    """Carry an impulse on in the direction that it took in the last sweep."""
    J = c.impulse[t]
    c.impulse[t] = J + more * (J - c.last_impulse[t])
    c.last_impulse[t] = J
    return 0


@wp.kernel
def count_busy(c: Contacts, r: Rigid, s: Sheet, stride: int):
    """Carry everything on, and count the contacts that share each rigid body in this sweep."""
    more = s.pace[1]
    for k in range(wp.tid(), s.flag[MEETS], stride):
        if c.stiff[k] == 1:
            for q in range(c.number[k]):
                e = k * FIELDS_AT_NODE + q
                v = c.velocity[e]
                c.velocity[e] = v + more * (v - c.last_velocity[e])
                c.last_velocity[e] = v
            for t in range(c.first[k], c.last[k]):
                hasten(c, t, more)
                count(c, r, s, t)
    for t in range(wp.tid(), s.flag[TOUCHES], stride):
        if c.meet[t] < 0:
            hasten(c, t, more)
            count(c, r, s, t)


@wp.kernel
def sweep(c: Contacts, r: Rigid, s: Sheet, stride: int):
    """One sweep over the nodes and points that rigid bodies take part in."""
    for k in range(wp.tid(), s.flag[MEETS], stride):
        if c.stiff[k] == 1:
            for t in range(c.first[k], c.last[k]):
                if c.active[t] == SWEPT_NOW:
                    wp.atomic_max(s.change, 0, relax(c, r, s, t))
                    wp.atomic_add(s.pace, 2, c.turn[t])
    for t in range(wp.tid(), s.flag[TOUCHES], stride):
        if c.meet[t] < 0 and c.active[t] == SWEPT_NOW:
            wp.atomic_max(s.change, 0, relax(c, r, s, t))
            wp.atomic_add(s.pace, 2, c.turn[t])


@wp.func
def quicken(s: Sheet):
    """Nesterov's pace; from the start again where the last sweep went back on its way."""
    t = s.pace[0]
    s.pace[1] = D(0.0)
    s.pace[0] = D(1.0)
    if s.pace[2] <= D(0.0):
        s.pace[0] = D(0.5) * (D(1.0) + wp.sqrt(D(1.0) + D(4.0) * t * t))
        s.pace[1] = (t - D(1.0)) / s.pace[0]
    s.pace[2] = D(0.0)
    return s.pace[1]


@wp.kernel
def apply(r: Rigid, s: Sheet, lanes: int):
    """Let rigid bodies have what they were given; go on while it was much. One group."""
    lane = wp.tid()
    if lane == 0:
        n = s.flag[SWEPT] + 1
        s.flag[SWEPT] = n
        limit = JACOBI_SWEEPS
        if s.flag[HITS] > 0:
            limit = JACOBI_SWEEPS_OF_A_HIT
        if s.flag[HOLDS] > 0:
            limit = JACOBI_SWEEPS_OF_A_HOLD
        moved = s.change[0]
        s.change[0] = 0.0
        s.pace[3] = quicken(s)
        if moved == 0.0 or n >= limit or (n >= SWEEPS and moved < JACOBI_STILL * s.cell):
            s.flag[SWEEPING] = 0
            s.pace[3] = D(0.0)
    meet()
    more = s.pace[3]
    for b in range(lane, s.bodies, lanes):
        if r.stiff[b] == 1 and r.path_count[b] == 0:
            speed = r.speed[b] + r.speed_change[b]
            moment = r.moment[b] + r.moment_change[b]
            r.speed[b] = speed + more * (speed - r.last_speed[b])
            r.moment[b] = moment + more * (moment - r.last_moment[b])
            r.spin[b] = r.inertia[b] * r.moment[b]
            r.last_speed[b] = speed
            r.last_moment[b] = moment
            r.speed_change[b] = wp.vec3d(D(0.0))
            r.moment_change[b] = wp.vec3d(D(0.0))
            r.busy[b] = 0


# ---------------------------------------------------------------- after


@wp.func
def hand_back(g: Grid, c: Contacts, r: Rigid, k: int):
    """Give a node's fields their velocities after contact."""
    for q in range(c.number[k]):
        e = k * FIELDS_AT_NODE + q
        if r.stiff[c.field[e]] == 0:
            v = wp.vec3(c.velocity[e])
            g.node[c.slot[e]] = wp.vec4(g.node[c.slot[e]][0], v[0], v[1], v[2])
    return 0


@wp.func
def react(c: Contacts, r: Rigid, s: Sheet, t: int, field: int, J: wp.vec3d):
    """Book what a contact's impulse on a body that has a prescribed motion takes of its mover."""
    if r.path_count[field] > 0:
        work = wp.dot(J, speed_at(r, field, c.point[t]))
        wp.atomic_add(s.loss, PUSHING, t % LANES, -work)
        wp.atomic_sub(s.external, field, J)
    return 0


@wp.func
def met(s: Sheet, a: int, b: int):
    """List a pair that met in this step, once."""
    if s.marked[a, b] == 0:
        if wp.atomic_max(s.marked, a, b, 1) == 0:
            s.met[wp.atomic_add(s.flag, PAIRS, 1)] = a * s.marked.shape[0] + b
    return 0


@wp.func
def note(c: Contacts, r: Rigid, s: Sheet, t: int):
    """Add up what a contact exchanged."""
    n = wp.vec3d(c.normal[t])
    J = c.impulse[t] + c.struck[t]
    size = wp.dot(J, n)
    if c.active[t] > 0 and (size > D(0.0) or c.span[t] > D(0.0)):
        fa = c.fa[t]
        fc = c.fc[t]
        mean = D(0.5) * (c.before[t] + slip_of(c, r, s, t))
        wp.atomic_add(s.loss, RUBBING, t % LANES, wp.dot(J - size * n, mean))
        taken = size * wp.dot(n, mean)
        wp.atomic_add(s.loss, STRIKING, t % LANES, taken)
        wp.atomic_add(s.impact_of_pair, fa, fc, taken)
        wp.atomic_add(s.impact_of_pair, fc, fa, taken)
        met(s, fa, fc)
        wp.atomic_add(s.step_impulse, fa, fc, size)
        wp.atomic_add(s.step_place, fa, fc, size * c.point[t])
        react(c, r, s, t, fa, -J)
        if fc >= s.bodies:
            wp.atomic_sub(s.plane_impulse, fc - s.bodies, fa, J)
        else:
            react(c, r, s, t, fc, J)
    return 0


@wp.kernel
def end_contact(g: Grid, c: Contacts, r: Rigid, s: Sheet, stride: int):
    """Give nodes their velocities, and add up what every pair exchanged."""
    if s.flag[FULL] == 2:
        return
    for k in range(wp.tid(), s.flag[MEETS], stride):
        hand_back(g, c, r, k)
    for t in range(wp.tid(), s.flag[TOUCHES], stride):
        note(c, r, s, t)

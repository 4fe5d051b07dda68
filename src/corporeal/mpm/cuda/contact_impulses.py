"""Contact impulses on the device, with ledgers.

Nodes of deformable fields are independent of one another: each is solved by its own thread with projected Gauss–Seidel.
Rigid bodies couple many nodes. There every sweep is a Jacobi sweep in which a body with n busy contacts lends each of
them an n-th of its mass (mass splitting, Tonge et al. 2012, "Mass splitting for jitter-free parallel rigid body
simulation"): it converges whatever the order of threads, and each impulse moves the whole body, so momentum is exact.
Impacts of rigid bodies come first, in rounds of such sweeps: see ``contact_rounds``.
"""

from corporeal.mpm import constants, formulas
from corporeal.mpm.constants import (
    FIELDS_AT_NODE,
    JACOBI_IMPACT_SWEEPS,
    JACOBI_SUPPORTED_IMPACT_SWEEPS,
    JACOBI_SWEEPS,
    JACOBI_TOLERANCE_DX,
    SWEEPS,
    VAST,
)
from corporeal.mpm.cuda.block_arena import wait_for_group
from corporeal.mpm.cuda.contact import mean_of
from corporeal.mpm.cuda.contact_nodes import curve_of
from corporeal.mpm.cuda.contact_surface import is_replaced
from corporeal.mpm.cuda.layout import (
    CLOCK_DT,
    CONTACT_SWEPT,
    FLAG_FULL,
    FLAG_HITS,
    FLAG_HOLDS,
    FLAG_IMPACTING,
    FLAG_MEETS,
    FLAG_NODES,
    FLAG_PAIRS,
    FLAG_STIFF,
    FLAG_SWEEPING,
    FLAG_SWEPT,
    FLAG_TOUCHES,
    LOSS_FRICTION,
    LOSS_IMPACT,
    LOSS_LANES,
    LOSS_PUSH_WORK,
    BlockGrid,
    D,
    StepGlobals,
    wp,
)
from corporeal.mpm.cuda.layout_bodies import DeviceRigidBodies
from corporeal.mpm.cuda.layout_contact import DeviceContacts
from corporeal.mpm.cuda.rigid import softness_at, speed_at
from corporeal.mpm.formulas.one_lane_contact import (
    closing_speed,
    drag_impulse,
    normal_impulse,
    touching_offset,
    within_cone,
)

wp.set_module_options(formulas.formula_options(max_unroll=0))

MIN_SLIP_SPEED = wp.constant(D(constants.MIN_SLIP_SPEED))


@wp.func
def side_speed(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, t: int, entry: int, field: int):
    """Velocity of one side of a contact [m/s]."""
    if field >= s.bodies:
        return wp.vec3d(D(0.0))
    if r.stiff[field] == 1:
        return speed_at(r, field, c.point[t])
    return c.velocity[entry]


@wp.func
def contact_slip(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, t: int):
    """Slip and approach together: u = v_a - v_c [m/s]."""
    a = side_speed(c, r, s, t, c.a[t], c.fa[t])
    return a - side_speed(c, r, s, t, c.c[t], c.fc[t])


@wp.func
def side_before(c: DeviceContacts, r: DeviceRigidBodies, g: BlockGrid, s: StepGlobals, t: int, entry: int, field: int):
    """Velocity of one side as the step began, before its forces [m/s]."""
    if field >= s.bodies:
        return wp.vec3d(D(0.0))
    if r.stiff[field] == 1:
        return speed_at(r, field, c.point[t]) - s.kick[field]
    v = g.old[c.slot[entry]]
    return wp.vec3d(D(v[0]), D(v[1]), D(v[2]))


@wp.func
def side_softness(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, t: int, entry: int, field: int, n: wp.vec3d):
    """1/m_eff of one side; a rigid body is shared among its busy contacts."""
    if field >= s.bodies:
        return D(0.0)
    if r.stiff[field] == 1:
        return softness_at(r, field, c.point[t], n) * D(wp.max(r.busy[field], 1))
    return c.light[entry]


@wp.func
def softness_of(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, t: int, n: wp.vec3d):
    """1/m_eff of a contact along n [1/kg]."""
    a = side_softness(c, r, s, t, c.a[t], c.fa[t], n)
    return a + side_softness(c, r, s, t, c.c[t], c.fc[t], n)


@wp.func
def give_contact_impulse(
    c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, t: int, entry: int, field: int, J: wp.vec3d
):
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
def relax_contact(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, t: int):
    """One projection of one contact onto its Coulomb cone; by how much it changed [m/s]."""
    u = contact_slip(c, r, s, t)
    n = wp.vec3d(c.normal[t])
    un = wp.dot(u, n)
    J = c.impulse[t]
    old = wp.dot(J, n)
    soft = softness_of(c, r, s, t, n)
    new = normal_impulse(old, un, c.target[t], soft)
    c.turn[t] = D(0.0)
    if new == D(0.0) and wp.length_sq(J) == D(0.0) and c.span[t] == D(0.0):
        return float(0.0)
    slide = u - un * n
    rub = J - old * n
    size = wp.length(slide)
    along = soft
    if size > MIN_SLIP_SPEED:
        along = softness_of(c, r, s, t, slide / size)
        rub = rub + slide / along
    grip = c.friction[c.fa[t], c.fc[t]] * D(1 - c.slips[t])
    given = within_cone(grip, new, n, rub)
    if c.span[t] > D(0.0):
        given = drag_impulse(along, c.span[t], curve_of(c, r, s, t), new, n, rub)
    change = given - J
    c.impulse[t] = given
    c.turn[t] = -wp.dot(change, given - c.last_impulse[t]) * soft
    give_contact_impulse(c, r, s, t, c.a[t], c.fa[t], -change)
    give_contact_impulse(c, r, s, t, c.c[t], c.fc[t], change)
    return float(wp.length(change) * soft)


@wp.func
def add_rigid_contact(c: DeviceContacts, r: DeviceRigidBodies, g: BlockGrid, s: StepGlobals, t: int):
    """Put a contact of two rigid bodies that meet at a node where both of them are."""
    rigid = c.meet[t] >= 0 and c.c[t] >= 0
    if rigid:
        rigid = r.stiff[c.fa[t]] == 1 and r.stiff[c.fc[t]] == 1
    if rigid:
        # What is round all over has no edges.
        a = mean_of(c, g, s, c.a[t]) * D(r.edged[c.fa[t]])
        other = mean_of(c, g, s, c.c[t]) * D(r.edged[c.fc[t]])
        shift = touching_offset(c.face, a, other, wp.vec3d(c.normal[t]))
        c.point[t] = c.point[t] + shift * s.dx
    return 0


@wp.func
def prepare_contact(c: DeviceContacts, r: DeviceRigidBodies, g: BlockGrid, s: StepGlobals, t: int):
    """Normal speed that a contact may keep, and whether it is of a rigid pair."""
    if is_replaced(r, c, s, t):
        c.gap[t] = VAST
    add_rigid_contact(c, r, g, s, t)
    if c.gap[t] < VAST or c.span[t] > D(0.0):
        gap = D(c.gap[t])
        fa = c.fa[t]
        fc = c.fc[t]
        c.active[t] = 1
        before = side_before(c, r, g, s, t, c.a[t], fa)
        c.before[t] = before - side_before(c, r, g, s, t, c.c[t], fc)
        c.target[t] = closing_speed(gap, s.clock[CLOCK_DT]) - c.inward[t]
        c.struck[t] = wp.vec3d(D(0.0))
        if r.stiff[fa] == 1 and fc < s.bodies:
            if r.stiff[fc] == 1:
                wp.atomic_max(s.flag, FLAG_HITS, 1)
    return 0


@wp.kernel
def begin_contact(c: DeviceContacts, r: DeviceRigidBodies, g: BlockGrid, s: StepGlobals, stride: int):
    """Prepare all contacts, and solve every node that no rigid body takes part in."""
    if s.flag[FLAG_FULL] == 2:
        return
    for k in range(wp.tid(), s.flag[FLAG_MEETS], stride):
        for t in range(c.first[k], c.last[k]):
            prepare_contact(c, r, g, s, t)
        if c.stiff[k] == 0:
            solve_node(c, r, s, k)
    for t in range(s.flag[FLAG_NODES] + wp.tid(), s.flag[FLAG_TOUCHES], stride):
        prepare_contact(c, r, g, s, t)
    if wp.tid() == 0:
        s.flag[FLAG_IMPACTING] = 0
        if s.flag[FLAG_STIFF] > 0:
            s.flag[FLAG_IMPACTING] = 1


@wp.func
def solve_node(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, k: int):
    """Sweep over a node's contacts until nothing changes."""
    for _ in range(SWEEPS):
        moved = float(0.0)
        for t in range(c.first[k], c.last[k]):
            if c.active[t] > 0:
                moved += relax_contact(c, r, s, t)
        if moved == 0.0 or c.last[k] - c.first[k] == 1:
            break
    return 0


@wp.func
def count_contact(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, t: int):
    """Note whether a contact wants something of its bodies in this sweep."""
    if c.active[t] == CONTACT_SWEPT:
        fa = c.fa[t]
        fc = c.fc[t]
        n = wp.vec3d(c.normal[t])
        busy = wp.length_sq(c.impulse[t]) > D(0.0) or c.span[t] > D(0.0)
        busy = busy or wp.dot(contact_slip(c, r, s, t), n) > c.target[t]
        if busy and r.stiff[fa] == 1:
            wp.atomic_add(r.busy, fa, 1)
        if busy and fc < s.bodies:
            if r.stiff[fc] == 1:
                wp.atomic_add(r.busy, fc, 1)
    return 0


@wp.func
def extrapolate_impulse(c: DeviceContacts, t: int, more: wp.float64):
    """Carry an impulse on in the direction that it took in the last sweep."""
    J = c.impulse[t]
    c.impulse[t] = J + more * (J - c.last_impulse[t])
    c.last_impulse[t] = J
    return 0


@wp.kernel
def count_busy(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, stride: int):
    """Carry everything on, and count the contacts that share each rigid body in this sweep."""
    more = s.pace[1]
    for k in range(wp.tid(), s.flag[FLAG_MEETS], stride):
        if c.stiff[k] == 1:
            for q in range(c.number[k]):
                e = k * FIELDS_AT_NODE + q
                v = c.velocity[e]
                c.velocity[e] = v + more * (v - c.last_velocity[e])
                c.last_velocity[e] = v
            for t in range(c.first[k], c.last[k]):
                extrapolate_impulse(c, t, more)
                count_contact(c, r, s, t)
    for t in range(wp.tid(), s.flag[FLAG_TOUCHES], stride):
        if c.meet[t] < 0:
            extrapolate_impulse(c, t, more)
            count_contact(c, r, s, t)


@wp.kernel
def sweep_contacts(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, stride: int):
    """One sweep over the nodes and points that rigid bodies take part in."""
    for k in range(wp.tid(), s.flag[FLAG_MEETS], stride):
        if c.stiff[k] == 1:
            for t in range(c.first[k], c.last[k]):
                if c.active[t] == CONTACT_SWEPT:
                    wp.atomic_max(s.change, 0, relax_contact(c, r, s, t))
                    wp.atomic_add(s.pace, 2, c.turn[t])
    for t in range(wp.tid(), s.flag[FLAG_TOUCHES], stride):
        if c.meet[t] < 0 and c.active[t] == CONTACT_SWEPT:
            wp.atomic_max(s.change, 0, relax_contact(c, r, s, t))
            wp.atomic_add(s.pace, 2, c.turn[t])


@wp.func
def update_momentum(s: StepGlobals):
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
def apply_rigid_impulses(r: DeviceRigidBodies, s: StepGlobals, lanes: int):
    """Let rigid bodies have what they were given; go on while it was much. One group."""
    lane = wp.tid()
    if lane == 0:
        n = s.flag[FLAG_SWEPT] + 1
        s.flag[FLAG_SWEPT] = n
        limit = JACOBI_SWEEPS
        if s.flag[FLAG_HITS] > 0:
            limit = JACOBI_IMPACT_SWEEPS
        if s.flag[FLAG_HOLDS] > 0:
            limit = JACOBI_SUPPORTED_IMPACT_SWEEPS
        moved = s.change[0]
        s.change[0] = 0.0
        s.pace[3] = update_momentum(s)
        if moved == 0.0 or n >= limit or (n >= SWEEPS and moved < JACOBI_TOLERANCE_DX * s.cell):
            s.flag[FLAG_SWEEPING] = 0
            s.pace[3] = D(0.0)
    wait_for_group()
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


@wp.func
def write_velocities(g: BlockGrid, c: DeviceContacts, r: DeviceRigidBodies, k: int):
    """Give a node's fields their velocities after contact."""
    for q in range(c.number[k]):
        e = k * FIELDS_AT_NODE + q
        if r.stiff[c.field[e]] == 0:
            v = wp.vec3(c.velocity[e])
            g.node[c.slot[e]] = wp.vec4(g.node[c.slot[e]][0], v[0], v[1], v[2])
    return 0


@wp.func
def book_mover_impulse(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, t: int, field: int, J: wp.vec3d):
    """Book what a contact's impulse on a body that has a prescribed motion takes of its mover."""
    if r.path_count[field] > 0:
        work = wp.dot(J, speed_at(r, field, c.point[t]))
        wp.atomic_add(s.loss, LOSS_PUSH_WORK, t % LOSS_LANES, -work)
        wp.atomic_sub(s.external, field, J)
    return 0


@wp.func
def list_pair(s: StepGlobals, a: int, b: int):
    """List a pair that met in this step, once."""
    if s.marked[a, b] == 0:
        if wp.atomic_max(s.marked, a, b, 1) == 0:
            s.met[wp.atomic_add(s.flag, FLAG_PAIRS, 1)] = a * s.marked.shape[0] + b
    return 0


@wp.func
def book_contact(c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, t: int):
    """Add up what a contact exchanged."""
    n = wp.vec3d(c.normal[t])
    J = c.impulse[t] + c.struck[t]
    size = wp.dot(J, n)
    if c.active[t] > 0 and (size > D(0.0) or c.span[t] > D(0.0)):
        fa = c.fa[t]
        fc = c.fc[t]
        mean = D(0.5) * (c.before[t] + contact_slip(c, r, s, t))
        wp.atomic_add(s.loss, LOSS_FRICTION, t % LOSS_LANES, wp.dot(J - size * n, mean))
        taken = size * wp.dot(n, mean)
        wp.atomic_add(s.loss, LOSS_IMPACT, t % LOSS_LANES, taken)
        wp.atomic_add(s.impact_of_pair, fa, fc, taken)
        wp.atomic_add(s.impact_of_pair, fc, fa, taken)
        list_pair(s, fa, fc)
        wp.atomic_add(s.step_impulse, fa, fc, size)
        wp.atomic_add(s.step_place, fa, fc, size * c.point[t])
        book_mover_impulse(c, r, s, t, fa, -J)
        if fc >= s.bodies:
            wp.atomic_sub(s.plane_impulse, fc - s.bodies, fa, J)
        else:
            book_mover_impulse(c, r, s, t, fc, J)
    return 0


@wp.kernel
def end_contact(g: BlockGrid, c: DeviceContacts, r: DeviceRigidBodies, s: StepGlobals, stride: int):
    """Give nodes their velocities, and add up what every pair exchanged."""
    if s.flag[FLAG_FULL] == 2:
        return
    for k in range(wp.tid(), s.flag[FLAG_MEETS], stride):
        write_velocities(g, c, r, k)
    for t in range(wp.tid(), s.flag[FLAG_TOUCHES], stride):
        book_contact(c, r, s, t)

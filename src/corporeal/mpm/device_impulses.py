"""What contacts transmit on the device: impulses, and the books.

Nodes of deformable fields are independent of one another: each is solved by its own thread with
projected Gauss–Seidel. Rigid bodies couple many nodes. There every sweep is a Jacobi sweep in which
a body with n busy contacts lends each of them an n-th of its mass (mass splitting, Tonge et al.
2012, "Mass splitting for jitter-free parallel rigid body simulation"): it converges whatever the
order of threads, and each impulse moves the whole body, so momentum is exact.
"""

from corporeal.mpm.device_layout import (
    DT,
    FULL,
    HITS,
    LANES,
    MEETS,
    MOST,
    RUBBING,
    STIFF,
    SWEEPING,
    SWEEPS,
    TIME,
    TOUCHES,
    Contacts,
    D,
    Grid,
    Rigid,
    Sheet,
    wp,
)
from corporeal.mpm.device_rigid import softness_at, speed_at

wp.set_module_options({"enable_backward": False, "max_unroll": 0})

SLOWEST = wp.constant(D(0.05))
"""Slower approaches [m/s] don't rebound."""
PATCH = wp.constant(D(0.1))
"""Contacts of a hit pair nearer than this [dx] rebound with it."""
NODE_SWEEPS = wp.constant(10)
FEWEST_SWEEPS = wp.constant(10)
MOST_SWEEPS = wp.constant(100)
MOST_SWEEPS_OF_A_HIT = wp.constant(400)
FINE = wp.constant(1.0e-4)
"""Sweeping ends when no contact changes its velocity by more than this times dx/s."""
FAR = wp.constant(1.0e29)


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
    new = wp.max(D(0.0), old + (un - c.target[t]) / soft)
    c.turn[t] = D(0.0)
    if new == D(0.0) and wp.length_sq(J) == D(0.0):
        return float(0.0)
    slide = u - un * n
    rub = J - old * n
    size = wp.length(slide)
    if size > D(1e-14):
        rub = rub + slide / softness_of(c, r, s, t, slide / size)
    most = c.friction[c.fa[t], c.fc[t]] * new
    length = wp.length(rub)
    if length > most:
        rub = rub * (most / length)
    change = new * n + rub - J
    c.impulse[t] = J + change
    c.turn[t] = -wp.dot(change, J + change - c.last_impulse[t]) * soft
    give(c, r, s, t, c.a[t], c.fa[t], -change)
    give(c, r, s, t, c.c[t], c.fc[t], change)
    return float(wp.length(change) * soft)


# ---------------------------------------------------------------- before


@wp.func
def is_stiff(r: Rigid, s: Sheet, field: int):
    """Whether a side is a rigid body or a plane."""
    if field >= s.bodies:
        return True
    return r.stiff[field] == 1


@wp.kernel
def prepare(c: Contacts, r: Rigid, g: Grid, s: Sheet, stride: int):
    """Normal speed that each contact may keep, and which rigid pairs are hit."""
    if s.flag[FULL] == 2:
        return
    dt = s.clock[DT]
    for t in range(wp.tid(), s.flag[TOUCHES], stride):
        if c.gap[t] > FAR:
            continue
        u = slip_of(c, r, s, t)
        n = wp.vec3d(c.normal[t])
        un = wp.dot(u, n)
        gap = D(c.gap[t])
        fa = c.fa[t]
        fc = c.fc[t]
        c.active[t] = 1
        c.before[t] = side_before(c, r, g, s, t, c.a[t], fa) - side_before(
            c, r, g, s, t, c.c[t], fc
        )
        c.target[t] = wp.max(gap, D(0.0)) / dt
        if r.stiff[fa] == 1 and is_stiff(r, s, fc):
            kick = s.kick[fa]
            if fc < s.bodies:
                kick = kick - s.kick[fc]
                wp.atomic_max(s.flag, HITS, 1)
            before = un - wp.dot(kick, n)
            if before > SLOWEST and c.restitution[fa, fc] > D(0.0):
                c.approach[t] = before
                if un * dt > gap:
                    c.active[t] = 2
                    wp.atomic_max(s.flag, HITS, 1)
                    c.hit[fa, fc] = 1
                elif gap < PATCH * s.dx:
                    c.active[t] = 2


@wp.kernel
def rebound(c: Contacts, s: Sheet, stride: int):
    """One impact is one event: all near contacts of a hit pair rebound."""
    if s.flag[FULL] == 2:
        return
    for t in range(wp.tid(), s.flag[TOUCHES], stride):
        if c.active[t] == 2:
            if c.hit[c.fa[t], c.fc[t]] == 1:
                c.target[t] = -c.restitution[c.fa[t], c.fc[t]] * c.approach[t]


# ---------------------------------------------------------------- the sweeps


@wp.kernel
def solve_nodes(c: Contacts, r: Rigid, s: Sheet, stride: int):
    """Solve every node that no rigid body takes part in."""
    if s.flag[FULL] == 2:
        return
    for k in range(wp.tid(), s.flag[MEETS], stride):
        if c.stiff[k] == 0:
            for _ in range(NODE_SWEEPS):
                moved = float(0.0)
                for t in range(c.first[k], c.last[k]):
                    if c.active[t] > 0:
                        moved += relax(c, r, s, t)
                if moved == 0.0 or c.last[k] - c.first[k] == 1:
                    break
        else:
            for q in range(c.number[k]):
                c.last_velocity[k * MOST + q] = c.velocity[k * MOST + q]
    if wp.tid() == 0:
        s.pace[0] = D(1.0)
        s.pace[1] = D(0.0)
        s.pace[2] = D(0.0)
        for b in range(s.bodies):
            r.last_speed[b] = r.speed[b]
            r.last_moment[b] = r.moment[b]
        s.flag[SWEEPING] = 0
        if s.flag[STIFF] > 0:
            s.flag[SWEEPING] = 1


@wp.func
def count(c: Contacts, r: Rigid, s: Sheet, t: int):
    """Note whether a contact wants something of its bodies in this sweep."""
    if c.active[t] > 0:
        fa = c.fa[t]
        fc = c.fc[t]
        n = wp.vec3d(c.normal[t])
        busy = wp.length_sq(c.impulse[t]) > D(0.0)
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
                e = k * MOST + q
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
                if c.active[t] > 0:
                    wp.atomic_max(s.change, 0, relax(c, r, s, t))
                    wp.atomic_add(s.pace, 2, c.turn[t])
    for t in range(wp.tid(), s.flag[TOUCHES], stride):
        if c.meet[t] < 0 and c.active[t] > 0:
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
def apply(r: Rigid, s: Sheet):
    """Let rigid bodies have what they were given; go on while it was much."""
    n = s.flag[SWEEPS] + 1
    s.flag[SWEEPS] = n
    limit = MOST_SWEEPS
    if s.flag[HITS] > 0:
        limit = MOST_SWEEPS_OF_A_HIT
    moved = s.change[0]
    s.change[0] = 0.0
    more = quicken(s)
    if moved == 0.0 or n >= limit or (n >= FEWEST_SWEEPS and moved < FINE * s.cell):
        s.flag[SWEEPING] = 0
        more = D(0.0)
    for b in range(s.bodies):
        if r.stiff[b] == 1:
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


@wp.kernel
def hand_back(g: Grid, c: Contacts, r: Rigid, s: Sheet, stride: int):
    """Give nodes their velocities after contact."""
    if s.flag[FULL] == 2:
        return
    for k in range(wp.tid(), s.flag[MEETS], stride):
        for q in range(c.number[k]):
            e = k * MOST + q
            if r.stiff[c.field[e]] == 0:
                v = wp.vec3(c.velocity[e])
                g.node[c.slot[e]] = wp.vec4(g.node[c.slot[e]][0], v[0], v[1], v[2])


@wp.kernel
def note(c: Contacts, r: Rigid, s: Sheet, stride: int):
    """Add up what every pair exchanged."""
    if s.flag[FULL] == 2:
        return
    for t in range(wp.tid(), s.flag[TOUCHES], stride):
        n = wp.vec3d(c.normal[t])
        J = c.impulse[t]
        size = wp.dot(J, n)
        if c.active[t] > 0 and size > D(0.0):
            fa = c.fa[t]
            fc = c.fc[t]
            mean = D(0.5) * (c.before[t] + slip_of(c, r, s, t))
            wp.atomic_add(s.loss, RUBBING, t % LANES, wp.dot(J - size * n, mean))
            wp.atomic_add(s.step_impulse, fa, fc, size)
            wp.atomic_add(s.step_place, fa, fc, size * c.point[t])
            if fc >= s.bodies:
                wp.atomic_sub(s.plane_impulse, fc - s.bodies, fa, J)


@wp.kernel
def enter_books(c: Contacts, s: Sheet):
    """Enter the step: who touched whom, how much, when and where."""
    a, b = wp.tid()
    if s.flag[FULL] == 2:
        return
    c.hit[a, b] = 0
    size = s.step_impulse[a, b]
    if size > D(0.0):
        if b < s.bodies:
            s.pair_impulse[a, b] = s.pair_impulse[a, b] + size
            s.pair_impulse[b, a] = s.pair_impulse[a, b]
        if not (s.first_contact[a, b] >= D(0.0)):
            place = s.step_place[a, b] / size
            s.first_contact[a, b] = s.clock[TIME]
            s.first_contact[b, a] = s.clock[TIME]
            s.contact_point[a, b] = place
            s.contact_point[b, a] = place
        s.last_contact[a, b] = s.clock[TIME]
        s.last_contact[b, a] = s.clock[TIME]
        s.step_impulse[a, b] = D(0.0)
        s.step_place[a, b] = wp.vec3d(D(0.0))

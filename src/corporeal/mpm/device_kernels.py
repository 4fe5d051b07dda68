"""One step on the device: the clock, particles to grid, grid to particles.

Same step as ``reference.ReferenceEngine.step``; see there for the formulas.
"""

from corporeal.mpm.device_grid import block_of, claim_around, find, node_of, splines
from corporeal.mpm.device_laws import answer, relieved, swelling
from corporeal.mpm.device_layout import (
    BODY,
    COUNT,
    DENSITY,
    DT,
    FORCED,
    FORGET,
    FULL,
    GOING,
    HITS,
    LANES,
    LARGEST,
    LAST,
    LOST,
    MEETS,
    PLASTIC,
    PUSHING,
    SLOWING,
    SMALLEST,
    STABLE,
    STIFF,
    SWEEPS,
    SWELLS,
    TIME,
    TOUCHES,
    UNTIL,
    VISCOSITY,
    VISCOUS,
    D,
    Grid,
    Loads,
    Particles,
    Rigid,
    Sheet,
    vec6,
    wp,
)

wp.set_module_options({"enable_backward": False, "max_unroll": 0})

RIGID_COURANT = wp.constant(D(0.05))
"""Largest fraction of a cell that a rigid body may cross in one step."""
FALL = wp.constant(D(0.1))
"""Largest step as a fraction of √(dx/g)."""
SUNK = wp.constant(-8.0)
"""A particle deeper than this in a wall [cells] has left the domain."""
FARTHEST = wp.constant(100000)
"""A particle farther than this from the origin [cells] has left the domain."""
TINY = wp.constant(D(1e-30))


# ---------------------------------------------------------------- the clock


@wp.func
def ramped(time: wp.float64, ramp: wp.float64):
    """∫ of gravity's share from 0 to time [s]."""
    if time < ramp:
        return D(0.5) * time * time / ramp
    return time - D(0.5) * ramp


@wp.func
def stable(s: Sheet, r: Rigid):
    """Largest stable step now [s]: dt = s dx/(c + |v|), and the falls of what is rigid."""
    limit = wp.min(s.longest, FALL * wp.sqrt(s.dx / wp.max(s.pull, TINY)))
    quick = D(s.fast[2]) + D(s.fast[3])
    limit = wp.min(limit, s.courant * s.dx / wp.max(quick, TINY))
    for b in range(s.bodies):
        if r.stiff[b] == 1:
            quick = wp.length(r.speed[b]) + wp.length(r.spin[b]) * r.radius[b]
            limit = wp.min(limit, RIGID_COURANT * s.dx / wp.max(quick, TINY))
    return limit


@wp.func
def plan(s: Sheet, r: Rigid):
    """Choose the next step, and what every body is given in it; or stop."""
    time = s.clock[TIME]
    left = s.clock[UNTIL] - time
    s.clock[STABLE] = stable(s, r)
    s.flag[GOING] = 0
    if left <= D(0.0) or s.flag[FULL] != 0 or s.flag[LOST] != 0:
        return 0
    count = wp.max(D(1.0), wp.ceil(left / s.clock[STABLE] - D(1e-9)))
    if s.clock[FORCED] == D(1.0):
        count = D(1.0)
    dt = left / count
    s.clock[LAST] = D(0.0)
    if count == D(1.0):
        s.clock[LAST] = D(1.0)
    s.clock[DT] = dt
    pull = s.gravity * (ramped(time + dt, s.ramp) - ramped(time, s.ramp))
    for b in range(s.bodies):
        span = wp.min(time + dt, s.end[b]) - wp.max(time, s.start[b])
        s.pushed[b] = s.push[b] * wp.max(D(0.0), span)
        s.kick[b] = pull + s.pushed[b]
    s.flag[MEETS] = 0
    s.flag[TOUCHES] = 0
    s.flag[STIFF] = 0
    s.flag[HITS] = 0
    s.flag[SWEEPS] = 0
    s.flag[GOING] = 1
    return 0


@wp.kernel
def begin(s: Sheet, r: Rigid):
    """Plan the first step up to UNTIL."""
    plan(s, r)


@wp.kernel
def tick(s: Sheet, r: Rigid, l: Loads):
    """Book a step that was taken, and plan the next one."""
    if s.flag[FULL] != 2:
        dt = s.clock[DT]
        s.clock[TIME] = s.clock[TIME] + dt
        if s.clock[LAST] == D(1.0):
            s.clock[TIME] = s.clock[UNTIL]
        s.clock[COUNT] = s.clock[COUNT] + D(1.0)
        s.clock[SMALLEST] = wp.min(s.clock[SMALLEST], dt)
        s.clock[LARGEST] = wp.max(s.clock[LARGEST], dt)
        for b in range(s.bodies):
            s.external[b] = s.external[b] + s.mass[b] * s.kick[b] + l.external[b]
        for i in range(2):
            s.fast[2 + i] = s.fast[i]
            s.fast[i] = 0.0
        s.loss[VISCOUS, 0] = s.loss[VISCOUS, 0] + l.loss[0]
    plan(s, r)


# ---------------------------------------------------------------- particles to grid


@wp.kernel
def scatter(p: Particles, g: Grid, l: Loads, s: Sheet, stride: int):
    """Sum mass, momentum, and momentum as it was."""
    dt = wp.float32(s.clock[DT])
    for i in range(wp.tid(), p.count, stride):
        cell = p.cell[i]
        home = p.home[i]
        if home < 0:
            home = find(g, p.field[i], block_of(cell))
            p.home[i] = home
        f = p.place[i]
        m = p.mass[i]
        row = p.kind[i]
        t = p.stress[i]
        B = m * p.affine[i]
        A = B + dt * wp.mat33(t[0], t[1], t[2], t[1], t[3], t[4], t[2], t[4], t[5])
        old = m * p.velocity[i]
        new = old + m * wp.vec3(s.kick[int(p.table[row, BODY])])
        new += l.blown[i] + l.pulled[i]
        w = splines(f)
        bulk = m * p.table[row, SWELLS] * swelling(p.strain[i])
        for x in range(3):
            for y in range(3):
                for z in range(3):
                    r = wp.vec3(float(x), float(y), float(z)) - f
                    n = w[0, x] * w[1, y] * w[2, z]
                    q = n * (new + A * r)
                    node = node_of(g, home, cell, x, y, z)
                    wp.atomic_add(g.node, node, wp.vec4(n * m, q[0], q[1], q[2]))
                    o = n * (old + B * r)
                    wp.atomic_add(g.old, node, wp.vec4(o[0], o[1], o[2], n * bulk))


@wp.kernel
def scatter_rigid(r: Rigid, g: Grid, s: Sheet, stride: int):
    """Sum the mass of rigid bodies: their grid is where others find them."""
    for i in range(wp.tid(), r.count, stride):
        cell = r.cell[i]
        if r.home[i] < 0:
            r.home[i] = find(g, r.body[i], block_of(cell))
        home = r.home[i]
        w = splines(r.place[i])
        for x in range(3):
            for y in range(3):
                for z in range(3):
                    n = r.mass[i] * w[0, x] * w[1, y] * w[2, z]
                    node = node_of(g, home, cell, x, y, z)
                    wp.atomic_add(g.node, node, wp.vec4(n, 0.0, 0.0, 0.0))


# ---------------------------------------------------------------- grid to particles


@wp.func
def book(s: Sheet, row: int, i: int, value: wp.float32):
    """Enter energy that was lost or given."""
    if value != 0.0:
        wp.atomic_add(s.loss, row, i % LANES, D(value))
    return 0


@wp.func
def heard(s: Sheet, what: int, value: wp.float32):
    """Keep a maximum."""
    if value > s.fast[what]:
        wp.atomic_max(s.fast, what, value)
    return 0


@wp.func
def inside(s: Sheet, cell: wp.vec3i, f: wp.vec3):
    """Whether a particle is where particles may be."""
    if wp.max(wp.max(wp.abs(cell[0]), wp.abs(cell[1])), wp.abs(cell[2])) > FARTHEST:
        return False
    x = wp.vec3(float(cell[0]), float(cell[1]), float(cell[2])) + f
    for w in range(s.planes):
        if wp.dot(x, wp.vec3(s.plane[w])) - wp.float32(s.offset[w] / s.dx) < SUNK:
            return False
    return True


@wp.func
def work_of(eta: wp.float32, B: wp.mat33, L: wp.mat33):
    """Power of the viscous stress η (B + Bᵀ) on the gradient L."""
    return eta * wp.ddot(B + wp.transpose(B), L)


@wp.kernel
def gather(p: Particles, g: Grid, l: Loads, s: Sheet, stride: int):
    """Velocities, affine parts, places, strain, return map and stress."""
    if s.flag[FULL] == 2:
        return
    dt = wp.float32(s.clock[DT])
    step = dt / s.cell
    for i in range(wp.tid(), p.count, stride):
        cell = p.cell[i]
        f = p.place[i]
        home = p.home[i]
        row = p.kind[i]
        w = splines(f)
        keep = 1.0 - wp.min(1.0, p.table[row, FORGET] * dt)
        blown = wp.length_sq(l.blown[i]) > 0.0
        swells = p.table[row, SWELLS] > 0.0
        bulk = float(0.0)
        v = wp.vec3(0.0)
        u = wp.vec3(0.0)
        L = wp.mat33(0.0)
        K = wp.mat33(0.0)
        for x in range(3):
            for y in range(3):
                for z in range(3):
                    n = w[0, x] * w[1, y] * w[2, z]
                    node = node_of(g, home, cell, x, y, z)
                    q = g.node[node]
                    arm = 4.0 * (wp.vec3(float(x), float(y), float(z)) - f)
                    now = n * wp.vec3(q[1], q[2], q[3])
                    v += now
                    L += wp.outer(now, arm)
                    if keep > 0.0 or blown or swells:
                        o = g.old[node]
                        was = n * wp.vec3(o[0], o[1], o[2])
                        bulk += n * o[3]
                        u += was
                        K += wp.outer(was, arm)
        B = p.affine[i]
        before = p.velocity[i]
        body = int(p.table[row, BODY])
        push = wp.vec3(s.pushed[body])
        if wp.length_sq(push) > 0.0:
            mean = before + 0.5 * wp.vec3(s.kick[body])
            book(s, PUSHING, i, p.mass[i] * wp.dot(push, mean))
        if blown:
            book(s, PUSHING, i, 0.5 * wp.dot(l.blown[i], u + v))
        C = L
        if keep > 0.0:
            C = L + keep * (B - K)
            p.velocity[i] = v + keep * (before - u)
        else:
            p.velocity[i] = v
        p.affine[i] = C
        H = p.strain[i]
        A = step * L
        a = answer(p, row, H + A + A * H, p.plastic[i], p.opened[i])
        if p.table[row, 0] > 2.5:
            T = p.motion[i]
            p.motion[i] = T + A + A * T
            p.plastic[i] = p.plastic[i] + wp.sqrt(2.0 / 3.0) * a.plastic
            p.opened[i] = a.opened
            book(s, PLASTIC, i, p.volume[i] * a.work)
        tau = a.tau
        if swells:
            more = relieved(p, row, a.strain, bulk - swelling(H))
            tau += wp.diag(wp.vec3(more))
        eta = p.table[row, VISCOSITY] / s.cell
        if eta > 0.0:
            J = wp.max(wp.determinant(wp.identity(n=3, dtype=wp.float32) + H), 0.0)
            book(s, VISCOUS, i, p.volume[i] * step * J * work_of(eta, B, L))
            J = wp.max(wp.determinant(wp.identity(n=3, dtype=wp.float32) + a.strain), 0.0)
            tau += J * eta * (C + wp.transpose(C))
        p.strain[i] = a.strain
        pull = -4.0 / s.cell * p.volume[i] * tau
        p.stress[i] = vec6(pull[0, 0], pull[0, 1], pull[0, 2], pull[1, 1], pull[1, 2], pull[2, 2])
        move(p, g, s, i, f + step * v)
        if p.lost[i] == 0:
            heard(s, 0, wp.length(p.velocity[i]))
            wave = wp.sqrt(a.stiffness / p.table[row, DENSITY]) * p.table[row, SLOWING]
            heard(s, 1, wave)


@wp.func
def move(p: Particles, g: Grid, s: Sheet, i: int, f: wp.vec3):
    """Put a particle at f [cells] from its lowest node."""
    cell = p.cell[i]
    shift = wp.vec3(wp.floor(f[0] - 0.5), wp.floor(f[1] - 0.5), wp.floor(f[2] - 0.5))
    good = wp.length(f) < 1.0e4 and wp.length_sq(p.velocity[i]) < 1.0e30
    good = good and wp.ddot(p.strain[i], p.strain[i]) < 1.0e30
    if good:
        moved = cell + wp.vec3i(int(shift[0]), int(shift[1]), int(shift[2]))
        good = inside(s, moved, f - shift)
        if good:
            p.place[i] = f - shift
            p.cell[i] = moved
            if not (block_of(moved) == block_of(cell)):
                p.home[i] = -1
                claim_around(s, g, p.field[i], moved)
    if not good:
        p.lost[i] = 1
        s.flag[LOST] = 1
    return 0

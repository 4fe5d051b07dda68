"""One step on the device: the clock, particles to grid, grid to particles.

Same step as ``reference.ReferenceEngine.step``; see there for the formulas.
"""

from corporeal.mpm import constants, formulas
from corporeal.mpm.constants import FARTHEST_STEP, SUNK, VAST
from corporeal.mpm.cuda.grid import block_of, claim_around, find, node_of
from corporeal.mpm.cuda.layout import (
    APEX,
    ASKED,
    BODY,
    BRANCH,
    BRANCHES,
    BULK,
    CONE,
    CONSISTENCY,
    COUNT,
    DENSITY,
    DT,
    FORCED,
    FORGET,
    FULL,
    GOING,
    HARD,
    HITS,
    INDEX,
    KEPT,
    LAMBDA,
    LANES,
    LARGEST,
    LAST,
    LAW,
    LOST,
    MEETS,
    MU,
    PLASTIC,
    PUSHING,
    RELAXATION,
    RIGID,
    ROUND,
    SHEAR,
    SMALLEST,
    STABLE,
    STIFF,
    STIFFENING,
    STRUCK,
    SWELLS,
    TIME,
    TOUCHES,
    UNTIL,
    VISCOUS,
    YIELD,
    D,
    Grid,
    Particles,
    Sheet,
    vec6,
    vec14,
    wp,
)
from corporeal.mpm.cuda.layout_bodies import Loads, Rigid
from corporeal.mpm.cuda.rows import (
    cell_at,
    fourteen_at,
    matrix_at,
    put_cell,
    put_fourteen,
    put_matrix,
    put_six,
    put_vector,
    symmetric_at,
    vector_at,
)
from corporeal.mpm.formulas.one_lane import (
    OPENED,
    PLASTIC_STRAIN,
    PLASTIC_WORK,
    STRAIN,
    WAVE,
    follow,
    liquid,
    mean_bulk,
    press,
    ramped,
    remembers,
    respond,
    splines,
    steps_kept,
)

wp.set_module_options(formulas.options(max_unroll=0))

RIGID_COURANT = wp.constant(D(constants.RIGID_COURANT))
FALL = wp.constant(D(constants.FALL))
STEP_ROUNDING = wp.constant(D(constants.STEP_ROUNDING))
TINY = wp.constant(D(constants.TINY))
FARTHEST = wp.constant(int(constants.FARTHEST))


# ---------------------------------------------------------------- the clock


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
    count = wp.max(D(1.0), wp.ceil(left / s.clock[STABLE] - STEP_ROUNDING))
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
        if r.path_count[b] > 0:
            s.kick[b] = wp.vec3d(D(0.0))
    s.flag[MEETS] = 0
    s.flag[TOUCHES] = 0
    s.flag[STIFF] = 0
    s.flag[HITS] = 0
    s.flag[ROUND] = 0
    s.flag[STRUCK] = 0
    s.flag[ASKED] = 0
    # Now and then all contacts are looked at anew: see physics/contact.py.
    if int(s.clock[COUNT]) % steps_kept(D(s.fast[2]) * dt / s.dx) == 0:
        s.flag[KEPT] = 0
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
        cell = cell_at(p.cell, i)
        home = p.home[i]
        if home < 0:
            home = find(g, p.field[i], block_of(cell))
            p.home[i] = home
        f = vector_at(p.place, i)
        m = p.mass[i]
        row = p.kind[i]
        B = m * matrix_at(p.affine, i)
        A = B + dt * symmetric_at(p.stress, i)
        old = m * vector_at(p.velocity, i)
        new = old + m * wp.vec3(s.kick[int(p.table[row, BODY])])
        new += vector_at(l.blown, i) + vector_at(l.pulled, i)
        w = splines(f)
        if p.table[row, SWELLS] > 0.0:
            shared = g.pool[p.cluster[i]]
            push = -4.0 / s.cell * p.volume[i] * dt * shared[1] / shared[0]
            A += wp.diag(wp.vec3(push))
        for x in range(3):
            for y in range(3):
                for z in range(3):
                    r = wp.vec3(float(x), float(y), float(z)) - f
                    n = w[0, x] * w[1, y] * w[2, z]
                    q = n * (new + A * r)
                    node = node_of(g, home, cell, x, y, z)
                    wp.atomic_add(g.node, node, wp.vec4(n * m, q[0], q[1], q[2]))
                    o = n * (old + B * r)
                    wp.atomic_add(g.old, node, wp.vec4(o[0], o[1], o[2], 0.0))


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
        if wp.dot(x, wp.vec3(s.plane[w])) - wp.float32(s.offset[w] / s.dx) < -SUNK:
            return False
    return True


@wp.func
def held(p: Particles, row: int, memory: vec14):
    """Kirchhoff stress of the Maxwell branches [Pa]."""
    tau = vec6()
    for b in range(BRANCHES):
        tau += press(p.table[row, SHEAR + b], p.table[row, BULK + b], memory, BRANCH * b)
    return wp.mat33(tau[0], tau[1], tau[2], tau[1], tau[3], tau[4], tau[2], tau[4], tau[5])


@wp.func
def relaxed(p: Particles, i: int, row: int, A: wp.mat33, memory: vec14, dt: wp.float32):
    """Carry the branches' strain along by A = dt ∇v, and forget; give their stress then [Pa]."""
    after = memory
    for b in range(BRANCHES):
        after = follow(A, dt, p.table[row, RELAXATION + b], after, BRANCH * b)
    put_fourteen(p.branch, i, after)
    return held(p, row, after)


@wp.kernel
def gather(p: Particles, g: Grid, l: Loads, s: Sheet, stride: int):
    """Velocities, affine parts, places, strain, return map and stress."""
    if s.flag[FULL] == 2:
        return
    dt = wp.float32(s.clock[DT])
    step = dt / s.cell
    for i in range(wp.tid(), p.count, stride):
        cell = cell_at(p.cell, i)
        f = vector_at(p.place, i)
        home = p.home[i]
        row = p.kind[i]
        w = splines(f)
        keep = 1.0 - wp.min(1.0, p.table[row, FORGET] * dt)
        blown = wp.length_sq(vector_at(l.blown, i)) > 0.0
        swells = p.table[row, SWELLS] > 0.0
        lam = p.table[row, LAMBDA]
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
                    if keep > 0.0 or blown:
                        o = g.old[node]
                        was = n * wp.vec3(o[0], o[1], o[2])
                        u += was
                        K += wp.outer(was, arm)
        B = matrix_at(p.affine, i)
        before = vector_at(p.velocity, i)
        body = int(p.table[row, BODY])
        push = wp.vec3(s.pushed[body])
        if wp.length_sq(push) > 0.0:
            mean = before + 0.5 * wp.vec3(s.kick[body])
            book(s, PUSHING, i, p.mass[i] * wp.dot(push, mean))
        if blown:
            book(s, PUSHING, i, 0.5 * wp.dot(vector_at(l.blown, i), u + v))
        C = L
        if keep > 0.0:
            C = L + keep * (B - K)
            put_vector(p.velocity, i, v + keep * (before - u))
        else:
            put_vector(p.velocity, i, v)
        put_matrix(p.affine, i, C)
        H = matrix_at(p.strain, i)
        # What belongs to a rigid body does not strain.
        A = (1.0 - p.table[row, RIGID]) * step * L
        law = p.table[row, LAW]
        if swells:
            # The rest of λ waits for what the whole cluster does.
            lam -= mean_bulk(law, p.table[row, MU], lam)
            p.grown[i] = wp.trace(A)
            wp.atomic_add(g.pool, p.cluster[i], wp.vec3(0.0, 0.0, p.volume[i] * p.grown[i]))
        a = respond(
            law,
            p.table[row, MU],
            lam,
            p.table[row, YIELD],
            p.table[row, HARD],
            p.table[row, CONE],
            p.table[row, APEX],
            p.table[row, CONSISTENCY] * wp.pow(dt, -p.table[row, INDEX]),
            p.table[row, INDEX],
            H + A + A * H,
            p.plastic[i],
            p.opened[i],
        )
        if remembers(law):
            T = matrix_at(p.motion, i)
            T = T + A + A * T
            if liquid(law):
                for x in range(3):
                    for y in range(3):
                        T[x, y] = a[STRAIN + 3 * x + y]
            put_matrix(p.motion, i, T)
            p.plastic[i] = p.plastic[i] + a[PLASTIC_STRAIN]
            p.opened[i] = a[OPENED]
            book(s, PLASTIC, i, p.volume[i] * a[PLASTIC_WORK])
        tau = wp.mat33(a[0], a[1], a[2], a[1], a[3], a[4], a[2], a[4], a[5])
        strain = wp.mat33(
            a[STRAIN],
            a[STRAIN + 1],
            a[STRAIN + 2],
            a[STRAIN + 3],
            a[STRAIN + 4],
            a[STRAIN + 5],
            a[STRAIN + 6],
            a[STRAIN + 7],
            a[STRAIN + 8],
        )
        if p.table[row, STIFFENING] > 1.0:
            memory = fourteen_at(p.branch, i)
            tau += relaxed(p, i, row, A, memory, dt)
            book(s, VISCOUS, i, p.volume[i] * wp.ddot(held(p, row, memory), A))
        put_matrix(p.strain, i, strain)
        p.bound[i] = a[WAVE]
        pull = -4.0 / s.cell * p.volume[i] * tau
        six = vec6(pull[0, 0], pull[0, 1], pull[0, 2], pull[1, 1], pull[1, 2], pull[2, 2])
        put_six(p.stress, i, six)
        move(p, g, s, i, f + step * v)
        if p.lost[i] == 0:
            heard(s, 0, wp.length(vector_at(p.velocity, i)))
            wave = wp.sqrt(a[WAVE] / p.table[row, DENSITY]) * p.table[row, STIFFENING]
            heard(s, 1, wave)


@wp.func
def move(p: Particles, g: Grid, s: Sheet, i: int, f: wp.vec3):
    """Put a particle at f [cells] from its lowest node."""
    cell = cell_at(p.cell, i)
    shift = wp.vec3(wp.floor(f[0] - 0.5), wp.floor(f[1] - 0.5), wp.floor(f[2] - 0.5))
    good = wp.length(f) < FARTHEST_STEP and wp.length_sq(vector_at(p.velocity, i)) < VAST
    good = good and wp.ddot(matrix_at(p.strain, i), matrix_at(p.strain, i)) < VAST
    if good:
        moved = cell + wp.vec3i(int(shift[0]), int(shift[1]), int(shift[2]))
        good = inside(s, moved, f - shift)
        if good:
            put_vector(p.place, i, f - shift)
            put_cell(p.cell, i, moved)
            if not (block_of(moved) == block_of(cell)):
                p.home[i] = -1
                claim_around(s, g, p.field[i], moved)
    if not good:
        p.lost[i] = 1
        s.flag[LOST] = 1
    return 0

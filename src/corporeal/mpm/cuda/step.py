"""Grid to particles on the device: they move, strain and answer.

Same step as ``reference.ReferenceEngine.step``; see there for the formulas.
"""

from corporeal.mpm import constants
from corporeal.mpm.constants import FARTHEST_STEP, SUNK, VAST
from corporeal.mpm.cuda import arena
from corporeal.mpm.cuda.arena import Seen, fetch, meet, receive, receive_afar
from corporeal.mpm.cuda.grid import block_of, claim_around
from corporeal.mpm.cuda.layout import (
    APEX,
    BODY,
    BRANCH,
    BRANCHES,
    BULK,
    CONE,
    CONSISTENCY,
    DENSITY,
    DT,
    FORGET,
    FULL,
    HARD,
    INDEX,
    LAMBDA,
    LANES,
    LAW,
    LOST,
    MU,
    PLASTIC,
    PUSHING,
    RELAXATION,
    RIGID,
    SHEAR,
    STIFFENING,
    STRAYS,
    SWELLS,
    TASKS,
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
from corporeal.mpm.cuda.layout_bodies import Loads
from corporeal.mpm.cuda.rows import (
    cell_at,
    fourteen_at,
    matrix_at,
    put_cell,
    put_fourteen,
    put_matrix,
    put_six,
    put_vector,
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
    remembers,
    respond,
)

wp.set_module_options(arena.options(max_unroll=0))

FARTHEST = wp.constant(int(constants.FARTHEST))


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
def gather(p: Particles, g: Grid, l: Loads, s: Sheet, stride: int, lanes: int):
    """Velocities, affine parts, places, strain, return map and stress: a group for each task."""
    if s.flag[FULL] == 2:
        return
    lane = wp.tid() % lanes
    for t in range(wp.tid() // lanes, s.flag[TASKS], stride // lanes):
        home = g.task_home[t]
        fetch(g.arena, g.node, g.old, g.near, home, lane, lanes)
        meet()
        for i in range(g.task_first[t] + lane, g.task_last[t], lanes):
            gather_one(p, g, l, s, i, home)
        meet()


@wp.func
def gather_one(p: Particles, g: Grid, l: Loads, s: Sheet, i: int, home: int):
    """Move one particle, and let it answer; home: its group's block."""
    dt = wp.float32(s.clock[DT])
    step = dt / s.cell
    cell = cell_at(p.cell, i)
    f = vector_at(p.place, i)
    row = p.kind[i]
    keep = 1.0 - wp.min(1.0, p.table[row, FORGET] * dt)
    given = wp.vec3(0.0)
    if l.acts == 1:
        given = vector_at(l.blown, i)
    blown = wp.length_sq(given) > 0.0
    swells = p.table[row, SWELLS] > 0.0
    lam = p.table[row, LAMBDA]
    old = int(0)
    if keep > 0.0 or blown:
        old = 1
    a = Seen()
    if p.home[i] == home:
        a = receive(g.arena, cell, f, old)
    else:
        a = receive_afar(g.node, g.old, g.near, p.home[i], cell, f, old)
    v = wp.vec3(a[0], a[1], a[2])
    L = wp.mat33(a[3], a[4], a[5], a[6], a[7], a[8], a[9], a[10], a[11])
    u = wp.vec3(a[12], a[13], a[14])
    K = wp.mat33(a[15], a[16], a[17], a[18], a[19], a[20], a[21], a[22], a[23])
    B = matrix_at(p.affine, i)
    before = vector_at(p.velocity, i)
    body = int(p.table[row, BODY])
    push = wp.vec3(s.pushed[body])
    if wp.length_sq(push) > 0.0:
        mean = before + 0.5 * wp.vec3(s.kick[body])
        book(s, PUSHING, i, p.mass[i] * wp.dot(push, mean))
    if blown:
        book(s, PUSHING, i, 0.5 * wp.dot(given, u + v))
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
    b = respond(
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
                    T[x, y] = b[STRAIN + 3 * x + y]
        put_matrix(p.motion, i, T)
        p.plastic[i] = p.plastic[i] + b[PLASTIC_STRAIN]
        p.opened[i] = b[OPENED]
        book(s, PLASTIC, i, p.volume[i] * b[PLASTIC_WORK])
    tau = wp.mat33(b[0], b[1], b[2], b[1], b[3], b[4], b[2], b[4], b[5])
    strain = wp.mat33(
        b[STRAIN],
        b[STRAIN + 1],
        b[STRAIN + 2],
        b[STRAIN + 3],
        b[STRAIN + 4],
        b[STRAIN + 5],
        b[STRAIN + 6],
        b[STRAIN + 7],
        b[STRAIN + 8],
    )
    if p.table[row, STIFFENING] > 1.0:
        memory = fourteen_at(p.branch, i)
        tau += relaxed(p, i, row, A, memory, dt)
        book(s, VISCOUS, i, p.volume[i] * wp.ddot(held(p, row, memory), A))
    put_matrix(p.strain, i, strain)
    p.bound[i] = b[WAVE]
    pull = -4.0 / s.cell * p.volume[i] * tau
    six = vec6(pull[0, 0], pull[0, 1], pull[0, 2], pull[1, 1], pull[1, 2], pull[2, 2])
    put_six(p.stress, i, six)
    move(p, g, s, i, home, f + step * v)
    if p.lost[i] == 0:
        heard(s, 0, wp.length(vector_at(p.velocity, i)))
        wave = wp.sqrt(b[WAVE] / p.table[row, DENSITY]) * p.table[row, STIFFENING]
        heard(s, 1, wave)
    return 0


@wp.func
def stray(p: Particles, g: Grid, s: Sheet, i: int, home: int, to: wp.vec3i):
    """Let a particle leave its block, and count who is not in the group's."""
    away = int(0)
    if not (to == g.where[home]):
        away = 1
    if p.home[i] != home:
        away -= 1
    if away != 0:
        wp.atomic_add(s.flag, STRAYS, away)
    p.home[i] = -1
    return 0


@wp.func
def move(p: Particles, g: Grid, s: Sheet, i: int, home: int, f: wp.vec3):
    """Put a particle at f [cells] from its lowest node; home: its group's block."""
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
                stray(p, g, s, i, home, block_of(moved))
                claim_around(s, g, p.field[i], moved)
    if not good:
        p.lost[i] = 1
        s.flag[LOST] = 1
    return 0

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
    seen = Seen()
    if p.home[i] == home:
        seen = receive(g.arena, cell, f, old)
    else:
        seen = receive_afar(g.node, g.old, g.near, p.home[i], cell, f, old)
    v = wp.vec3(seen[0], seen[1], seen[2])
    L = wp.mat33(seen[3], seen[4], seen[5], seen[6], seen[7], seen[8], seen[9], seen[10], seen[11])
    u = wp.vec3(seen[12], seen[13], seen[14])
    K = wp.mat33(
        seen[15], seen[16], seen[17], seen[18], seen[19], seen[20], seen[21], seen[22], seen[23]
    )
    B = matrix_at(p.affine, i)
    before = vector_at(p.velocity, i)
    body = int(p.table[row, BODY])
    push = wp.vec3(s.pushed[body])
    if wp.length_sq(push) > 0.0:
        mean = before + 0.5 * wp.vec3(s.kick[body])
        book(s, PUSHING, i, p.mass[i] * wp.dot(push, mean))
    if blown:
        book(s, PUSHING, i, 0.5 * wp.dot(given, u + v))
    after = v
    C = L
    if keep > 0.0:
        after = v + keep * (before - u)
        C = L + keep * (B - K)
    put_vector(p.velocity, i, after)
    put_matrix(p.affine, i, C)
    H = matrix_at(p.strain, i)
    # What belongs to a rigid body does not strain.
    A = (1.0 - p.table[row, RIGID]) * step * L
    law = p.table[row, LAW]
    if swells:
        # The rest of λ waits for what the whole cluster does.
        lam -= mean_bulk(law, p.table[row, MU], lam)
        grown = wp.trace(A)
        p.grown[i] = grown
        wp.atomic_add(g.pool, 2, p.cluster[i], p.volume[i] * grown)
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
    if swells:
        p.bound[i] = a[WAVE]
    pull = -4.0 / s.cell * p.volume[i] * tau
    six = vec6(pull[0, 0], pull[0, 1], pull[0, 2], pull[1, 1], pull[1, 2], pull[2, 2])
    put_six(p.stress, i, six)
    good = wp.length_sq(after) < VAST and wp.ddot(strain, strain) < VAST
    if good:
        good = move(p, g, s, i, home, cell, f + step * v)
    if good:
        heard(s, 0, wp.length(after))
        wave = wp.sqrt(a[WAVE] / p.table[row, DENSITY]) * p.table[row, STIFFENING]
        heard(s, 1, wave)
    else:
        p.lost[i] = 1
        s.flag[LOST] = 1
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
def move(p: Particles, g: Grid, s: Sheet, i: int, home: int, cell: wp.vec3i, f: wp.vec3):
    """Put a particle at f [cells] from its lowest node, if that is a place for particles."""
    shift = wp.vec3(wp.floor(f[0] - 0.5), wp.floor(f[1] - 0.5), wp.floor(f[2] - 0.5))
    good = wp.length(f) < FARTHEST_STEP
    if good:
        moved = cell + wp.vec3i(int(shift[0]), int(shift[1]), int(shift[2]))
        good = inside(s, moved, f - shift)
        if good:
            put_vector(p.place, i, f - shift)
            put_cell(p.cell, i, moved)
            if not (block_of(moved) == block_of(cell)):
                stray(p, g, s, i, home, block_of(moved))
                claim_around(s, g, p.field[i], moved)
    return good

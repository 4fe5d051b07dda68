"""Grid-to-particle transfer on the device.

Same step as ``reference.ReferenceEngine.step``; see there for the formulas.
"""

from corporeal.mpm import constants
from corporeal.mpm.constants import MAX_TRAVEL_PER_STEP_DX, MAX_WALL_DEPTH_DX, VAST
from corporeal.mpm.cuda import block_arena
from corporeal.mpm.cuda.block_arena import (
    ReceivedMotion,
    read_nodes,
    receive_from_nodes,
    receive_motion,
    wait_for_group,
)
from corporeal.mpm.cuda.block_grid import block_of, claim_blocks_around
from corporeal.mpm.cuda.channel_rows import (
    cell_at,
    fourteen_at,
    matrix_at,
    put_cell,
    put_fourteen,
    put_matrix,
    put_symmetric,
    put_vector,
    vector_at,
)
from corporeal.mpm.cuda.layout import (
    APEX,
    BRANCH_CHANNELS,
    BRANCHES,
    BULK,
    CLOCK_DT,
    CONE,
    CONSISTENCY,
    DENSITY,
    FLAG_FULL,
    FLAG_LOST,
    FLAG_STRAYS,
    FLAG_TASKS,
    FORGET,
    HARD,
    INDEX,
    LAMBDA,
    LAW,
    LOSS_LANES,
    LOSS_PLASTIC,
    LOSS_PUSH_WORK,
    LOSS_VISCOUS,
    MATERIAL_BODY,
    MU,
    RELAXATION,
    RIGID,
    SHEAR,
    STIFFENING,
    USES_MEAN_DILATATION,
    YIELD,
    BlockGrid,
    D,
    DeviceParticles,
    StepGlobals,
    vec6,
    vec14,
    wp,
)
from corporeal.mpm.cuda.layout_bodies import DeviceLoads
from corporeal.mpm.formulas.one_lane import (
    RESPONSE_OPENED,
    RESPONSE_PLASTIC_STRAIN,
    RESPONSE_PLASTIC_WORK,
    RESPONSE_STRAIN,
    RESPONSE_WAVE,
    advance_branch,
    branch_stress,
    law_has_branches,
    law_is_liquid,
    law_response,
    mean_bulk,
)

wp.set_module_options(block_arena.arena_options(max_unroll=0))

MAX_DISTANCE_FROM_ORIGIN_DX = wp.constant(int(constants.MAX_DISTANCE_FROM_ORIGIN_DX))


@wp.func
def book_loss(s: StepGlobals, row: int, i: int, value: wp.float32):
    """Enter energy that was lost or given."""
    if value != 0.0:
        wp.atomic_add(s.loss, row, i % LOSS_LANES, D(value))
    return 0


@wp.func
def raise_maximum(s: StepGlobals, what: int, value: wp.float32):
    """Keep a maximum."""
    if value > s.fast[what]:
        wp.atomic_max(s.fast, what, value)
    return 0


@wp.func
def is_inside(s: StepGlobals, cell: wp.vec3i, f: wp.vec3):
    """Whether a particle is where particles may be."""
    if wp.max(wp.max(wp.abs(cell[0]), wp.abs(cell[1])), wp.abs(cell[2])) > MAX_DISTANCE_FROM_ORIGIN_DX:
        return False
    x = wp.vec3(float(cell[0]), float(cell[1]), float(cell[2])) + f
    for w in range(s.planes):
        if wp.dot(x, wp.vec3(s.plane[w])) - wp.float32(s.offset[w] / s.dx) < -MAX_WALL_DEPTH_DX:
            return False
    return True


@wp.func
def maxwell_stress(p: DeviceParticles, row: int, memory: vec14):
    """Kirchhoff stress of the Maxwell branches [Pa]."""
    tau = vec6()
    for b in range(BRANCHES):
        tau += branch_stress(p.table[row, SHEAR + b], p.table[row, BULK + b], memory, BRANCH_CHANNELS * b)
    return wp.mat33(tau[0], tau[1], tau[2], tau[1], tau[3], tau[4], tau[2], tau[4], tau[5])


@wp.func
def relax_branches(p: DeviceParticles, i: int, row: int, A: wp.mat33, memory: vec14, dt: wp.float32):
    """Carry the branches' strain along by A = dt ∇v, and forget; give their stress then [Pa]."""
    after = memory
    for b in range(BRANCHES):
        after = advance_branch(A, dt, p.table[row, RELAXATION + b], after, BRANCH_CHANNELS * b)
    put_fourteen(p.branch, i, after)
    return maxwell_stress(p, row, after)


@wp.kernel
def gather(p: DeviceParticles, g: BlockGrid, l: DeviceLoads, s: StepGlobals, stride: int, lanes: int):
    """Velocities, affine parts, places, strain, return map and stress: a group for each task."""
    if s.flag[FLAG_FULL] == 2:
        return
    lane = wp.tid() % lanes
    for t in range(wp.tid() // lanes, s.flag[FLAG_TASKS], stride // lanes):
        home = g.task_home[t]
        read_nodes(g.arena, g.node, g.old, g.near, home, lane, lanes)
        wait_for_group()
        for i in range(g.task_first[t] + lane, g.task_last[t], lanes):
            gather_one(p, g, l, s, i, home)
        wait_for_group()


@wp.func
def gather_one(p: DeviceParticles, g: BlockGrid, l: DeviceLoads, s: StepGlobals, i: int, home: int):
    """Move one particle, and let it answer; home: its group's block."""
    dt = wp.float32(s.clock[CLOCK_DT])
    step = dt / s.cell
    cell = cell_at(p.cell, i)
    f = vector_at(p.place, i)
    row = p.kind[i]
    keep = 1.0 - wp.min(1.0, p.table[row, FORGET] * dt)
    given = wp.vec3(0.0)
    if l.acts == 1:
        given = vector_at(l.load_impulse, i)
    blown = wp.length_sq(given) > 0.0
    uses_mean_dilatation = p.table[row, USES_MEAN_DILATATION] > 0.0
    lam = p.table[row, LAMBDA]
    old = int(0)
    if keep > 0.0 or blown:
        old = 1
    seen = ReceivedMotion()
    if p.home[i] == home:
        seen = receive_motion(g.arena, cell, f, old)
    else:
        seen = receive_from_nodes(g.node, g.old, g.near, p.home[i], cell, f, old)
    v = wp.vec3(seen[0], seen[1], seen[2])
    L = wp.mat33(seen[3], seen[4], seen[5], seen[6], seen[7], seen[8], seen[9], seen[10], seen[11])
    u = wp.vec3(seen[12], seen[13], seen[14])
    K = wp.mat33(seen[15], seen[16], seen[17], seen[18], seen[19], seen[20], seen[21], seen[22], seen[23])
    B = matrix_at(p.affine, i)
    before = vector_at(p.velocity, i)
    body = int(p.table[row, MATERIAL_BODY])
    push = wp.vec3(s.pushed[body])
    if wp.length_sq(push) > 0.0:
        mean = before + 0.5 * wp.vec3(s.kick[body])
        book_loss(s, LOSS_PUSH_WORK, i, p.mass[i] * wp.dot(push, mean))
    if blown:
        book_loss(s, LOSS_PUSH_WORK, i, 0.5 * wp.dot(given, u + v))
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
    if uses_mean_dilatation:
        # The rest of λ waits for what the whole cluster does.
        lam -= mean_bulk(law, p.table[row, MU], lam)
        grown = wp.trace(A)
        p.grown[i] = grown
        wp.atomic_add(g.pool, 2, p.cluster[i], p.volume[i] * grown)
    a = law_response(
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
    if law_has_branches(law):
        T = matrix_at(p.motion, i)
        T = T + A + A * T
        if law_is_liquid(law):
            for x in range(3):
                for y in range(3):
                    T[x, y] = a[RESPONSE_STRAIN + 3 * x + y]
        put_matrix(p.motion, i, T)
        p.plastic[i] = p.plastic[i] + a[RESPONSE_PLASTIC_STRAIN]
        p.opened[i] = a[RESPONSE_OPENED]
        book_loss(s, LOSS_PLASTIC, i, p.volume[i] * a[RESPONSE_PLASTIC_WORK])
    tau = wp.mat33(a[0], a[1], a[2], a[1], a[3], a[4], a[2], a[4], a[5])
    strain = wp.mat33(
        a[RESPONSE_STRAIN],
        a[RESPONSE_STRAIN + 1],
        a[RESPONSE_STRAIN + 2],
        a[RESPONSE_STRAIN + 3],
        a[RESPONSE_STRAIN + 4],
        a[RESPONSE_STRAIN + 5],
        a[RESPONSE_STRAIN + 6],
        a[RESPONSE_STRAIN + 7],
        a[RESPONSE_STRAIN + 8],
    )
    if p.table[row, STIFFENING] > 1.0:
        memory = fourteen_at(p.branch, i)
        tau += relax_branches(p, i, row, A, memory, dt)
        book_loss(s, LOSS_VISCOUS, i, p.volume[i] * wp.ddot(maxwell_stress(p, row, memory), A))
    put_matrix(p.strain, i, strain)
    if uses_mean_dilatation:
        p.bound[i] = a[RESPONSE_WAVE]
    pull = -4.0 / s.cell * p.volume[i] * tau
    six = vec6(pull[0, 0], pull[0, 1], pull[0, 2], pull[1, 1], pull[1, 2], pull[2, 2])
    put_symmetric(p.stress, i, six)
    good = wp.length_sq(after) < VAST and wp.ddot(strain, strain) < VAST
    if good:
        good = place_particle(p, g, s, i, home, cell, f + step * v)
    if good:
        raise_maximum(s, 0, wp.length(after))
        wave = wp.sqrt(a[RESPONSE_WAVE] / p.table[row, DENSITY]) * p.table[row, STIFFENING]
        raise_maximum(s, 1, wave)
    else:
        p.lost[i] = 1
        s.flag[FLAG_LOST] = 1
    return 0


@wp.func
def mark_stray(p: DeviceParticles, g: BlockGrid, s: StepGlobals, i: int, home: int, to: wp.vec3i):
    """Let a particle leave its block, and count who is not in the group's."""
    away = int(0)
    if not (to == g.where[home]):
        away = 1
    if p.home[i] != home:
        away -= 1
    if away != 0:
        wp.atomic_add(s.flag, FLAG_STRAYS, away)
    p.home[i] = -1
    return 0


@wp.func
def place_particle(p: DeviceParticles, g: BlockGrid, s: StepGlobals, i: int, home: int, cell: wp.vec3i, f: wp.vec3):
    """Put a particle at f [cells] from its lowest node, if that is a place for particles."""
    shift = wp.vec3(wp.floor(f[0] - 0.5), wp.floor(f[1] - 0.5), wp.floor(f[2] - 0.5))
    good = wp.length(f) < MAX_TRAVEL_PER_STEP_DX
    if good:
        moved = cell + wp.vec3i(int(shift[0]), int(shift[1]), int(shift[2]))
        good = is_inside(s, moved, f - shift)
        if good:
            put_vector(p.place, i, f - shift)
            put_cell(p.cell, i, moved)
            if not (block_of(moved) == block_of(cell)):
                mark_stray(p, g, s, i, home, block_of(moved))
                claim_blocks_around(s, g, p.field[i], moved)
    return good

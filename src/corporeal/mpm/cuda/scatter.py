"""Particle-to-grid transfer on the device.

Same sums as ``reference.ReferenceEngine.step``; see there for the formulas.
"""

from corporeal.mpm.cuda import block_arena, layout
from corporeal.mpm.cuda.block_arena import (
    LayerSums,
    add_arena_to_nodes,
    add_layer_to_arena,
    add_mass_to_nodes,
    add_to_layer,
    add_to_nodes,
    clear_arena,
    first_in_cell,
    list_particle,
    next_in_cell,
    wait_for_group,
)
from corporeal.mpm.cuda.block_grid import block_of, find_block
from corporeal.mpm.cuda.channel_rows import cell_at, matrix_at, symmetric_at, vector_at
from corporeal.mpm.cuda.layout import (
    CLOCK_DT,
    FLAG_TASKS,
    MATERIAL_BODY,
    USES_MEAN_DILATATION,
    BlockGrid,
    DeviceParticles,
    StepGlobals,
    wp,
)
from corporeal.mpm.cuda.layout_bodies import DeviceLoads, DeviceRigidBodies

wp.set_module_options(block_arena.arena_options(max_unroll=0))


LAYERS_PER_CELL = wp.constant(3)
"""Of nodes that a cell's particles reach."""
CELLS_PER_BLOCK = wp.constant(layout.NODES_OF_BLOCK)


@wp.func
def particle_share(p: DeviceParticles, g: BlockGrid, l: DeviceLoads, s: StepGlobals, i: int):
    """What a particle gives: mass, momentum and its gradient a cell, impulse and its."""
    dt = wp.float32(s.clock[CLOCK_DT])
    m = p.mass[i]
    row = p.kind[i]
    momentum = m * vector_at(p.velocity, i)
    B = m * matrix_at(p.affine, i)
    impulse = m * wp.vec3(s.kick[int(p.table[row, MATERIAL_BODY])])
    S = dt * symmetric_at(p.stress, i)
    if l.acts == 1:
        impulse += vector_at(l.load_impulse, i) + vector_at(l.tether_impulse, i)
    if p.table[row, USES_MEAN_DILATATION] > 0.0:
        at = p.cluster[i]
        push = -4.0 / s.cell * p.volume[i] * dt * g.pool[1, at] / g.pool[0, at]
        S += wp.diag(wp.vec3(push))
    return m, momentum, B, impulse, S


@wp.func
def enlist_particle(p: DeviceParticles, g: BlockGrid, l: DeviceLoads, s: StepGlobals, i: int, home: int, number: int):
    """Put a particle on the list of its cell, or, where it has strayed, let it give at once."""
    cell = cell_at(p.cell, i)
    if p.home[i] < 0:
        p.home[i] = find_block(g, p.field[i], block_of(cell))
    if p.home[i] == home:
        list_particle(g.arena, cell, number)
    else:
        m, momentum, B, impulse, S = particle_share(p, g, l, s, i)
        f = vector_at(p.place, i)
        add_to_nodes(g.sum, g.near, p.home[i], cell, f, m, momentum, B, impulse, S)
    return 0


@wp.func
def scatter_layer(p: DeviceParticles, g: BlockGrid, l: DeviceLoads, s: StepGlobals, first: int, cell: int, layer: int):
    """Sum what a cell's particles give to one layer of nodes, and add it to the arena."""
    number = first_in_cell(g.arena, cell)
    if number < 0:
        return 0
    sums = LayerSums()
    while number >= 0:
        i = first + number
        m, momentum, B, impulse, S = particle_share(p, g, l, s, i)
        sums = add_to_layer(sums, layer, vector_at(p.place, i), m, momentum, B, impulse, S)
        number = next_in_cell(g.arena, number)
    add_layer_to_arena(g.arena, sums, cell, layer)
    return 0


@wp.kernel
def scatter(
    p: DeviceParticles, g: BlockGrid, r: DeviceRigidBodies, l: DeviceLoads, s: StepGlobals, stride: int, lanes: int
):
    """Sum mass, momentum and impulse: one group of threads for each task."""
    lane = wp.tid() % lanes
    clear_arena(g.arena, lane, lanes)
    wait_for_group()
    for t in range(wp.tid() // lanes, s.flag[FLAG_TASKS], stride // lanes):
        home = g.task_home[t]
        first = g.task_first[t]
        for i in range(first + lane, g.task_last[t], lanes):
            enlist_particle(p, g, l, s, i, home, i - first)
        wait_for_group()
        for k in range(lane, LAYERS_PER_CELL * CELLS_PER_BLOCK, lanes):
            scatter_layer(p, g, l, s, first, k % CELLS_PER_BLOCK, k // CELLS_PER_BLOCK)
        wait_for_group()
        add_arena_to_nodes(g.arena, g.sum, g.near, home, lane, lanes)
        wait_for_group()
    # The grid of rigid bodies is where others find them.
    for i in range(wp.tid(), r.count, stride):
        cell = r.cell[i]
        if r.home[i] < 0:
            r.home[i] = find_block(g, r.body[i], block_of(cell))
        add_mass_to_nodes(g.sum, g.near, r.home[i], cell, r.place[i], r.mass[i])

"""Particles to grid on the device.

Same sums as ``reference.ReferenceEngine.step``; see there for the formulas.
"""

from corporeal.mpm.cuda import arena, layout
from corporeal.mpm.cuda.arena import (
    Sums,
    empty,
    enlist,
    first_in,
    give,
    give_afar,
    give_mass,
    hand_over,
    leave,
    meet,
    next_of,
)
from corporeal.mpm.cuda.grid import block_of, find
from corporeal.mpm.cuda.layout import BODY, DT, SWELLS, TASKS, Grid, Particles, Sheet, wp
from corporeal.mpm.cuda.layout_bodies import Loads, Rigid
from corporeal.mpm.cuda.rows import cell_at, matrix_at, symmetric_at, vector_at

wp.set_module_options(arena.options(max_unroll=0))


LAYERS = wp.constant(3)
"""Of nodes that a cell's particles reach."""
CELLS = wp.constant(layout.NODES_OF_BLOCK)


@wp.func
def gift(p: Particles, g: Grid, l: Loads, s: Sheet, i: int):
    """What a particle gives: mass, momentum and its gradient a cell, impulse and its."""
    dt = wp.float32(s.clock[DT])
    m = p.mass[i]
    row = p.kind[i]
    momentum = m * vector_at(p.velocity, i)
    B = m * matrix_at(p.affine, i)
    impulse = m * wp.vec3(s.kick[int(p.table[row, BODY])])
    S = dt * symmetric_at(p.stress, i)
    if l.acts == 1:
        impulse += vector_at(l.blown, i) + vector_at(l.pulled, i)
    if p.table[row, SWELLS] > 0.0:
        at = p.cluster[i]
        push = -4.0 / s.cell * p.volume[i] * dt * g.pool[1, at] / g.pool[0, at]
        S += wp.diag(wp.vec3(push))
    return m, momentum, B, impulse, S


@wp.func
def sort_one(p: Particles, g: Grid, l: Loads, s: Sheet, i: int, home: int, number: int):
    """Put a particle on the list of its cell, or, where it has strayed, let it give at once."""
    cell = cell_at(p.cell, i)
    if p.home[i] < 0:
        p.home[i] = find(g, p.field[i], block_of(cell))
    if p.home[i] == home:
        enlist(g.arena, cell, number)
    else:
        m, momentum, B, impulse, S = gift(p, g, l, s, i)
        f = vector_at(p.place, i)
        give_afar(g.sum, g.near, p.home[i], cell, f, m, momentum, B, impulse, S)
    return 0


@wp.func
def scatter_layer(p: Particles, g: Grid, l: Loads, s: Sheet, first: int, cell: int, layer: int):
    """Sum what a cell's particles give to one layer of nodes, and add it to the arena."""
    number = first_in(g.arena, cell)
    if number < 0:
        return 0
    sums = Sums()
    while number >= 0:
        i = first + number
        m, momentum, B, impulse, S = gift(p, g, l, s, i)
        sums = give(sums, layer, vector_at(p.place, i), m, momentum, B, impulse, S)
        number = next_of(g.arena, number)
    leave(g.arena, sums, cell, layer)
    return 0


@wp.kernel
def scatter(p: Particles, g: Grid, r: Rigid, l: Loads, s: Sheet, stride: int, lanes: int):
    """Sum mass, momentum and impulse: one group of threads for each task."""
    lane = wp.tid() % lanes
    empty(g.arena, lane, lanes)
    meet()
    for t in range(wp.tid() // lanes, s.flag[TASKS], stride // lanes):
        home = g.task_home[t]
        first = g.task_first[t]
        for i in range(first + lane, g.task_last[t], lanes):
            sort_one(p, g, l, s, i, home, i - first)
        meet()
        for k in range(lane, LAYERS * CELLS, lanes):
            scatter_layer(p, g, l, s, first, k % CELLS, k // CELLS)
        meet()
        hand_over(g.arena, g.sum, g.near, home, lane, lanes)
        meet()
    # The grid of rigid bodies is where others find them.
    for i in range(wp.tid(), r.count, stride):
        cell = r.cell[i]
        if r.home[i] < 0:
            r.home[i] = find(g, r.body[i], block_of(cell))
        give_mass(g.sum, g.near, r.home[i], cell, r.place[i], r.mass[i])

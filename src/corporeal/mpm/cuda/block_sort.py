"""Counting sort of particles by block on the device, without host synchronisation or allocation.

Blocks that particles are in come first and are numbered as particles reach them, so that on the processor sorting what
is sorted changes nothing. A GPU's threads number them, and what is within one, in no fixed order.
"""

from corporeal.mpm.cuda.block_grid import block_of, claim_block, claim_blocks_around, find_block
from corporeal.mpm.cuda.channel_rows import cell_at
from corporeal.mpm.cuda.layout import (
    EMPTY_KEY,
    FLAG_BLOCKS,
    FLAG_FRESH,
    FLAG_FULL,
    FLAG_HOMES,
    FLAG_PLACED,
    FLAG_STEPPING,
    FLAG_STRAYS,
    FLAG_TASKS,
    TASK,
    BlockGrid,
    DeviceParticles,
    StepGlobals,
    wp,
)
from corporeal.mpm.cuda.layout_bodies import DeviceRigidBodies

wp.set_module_options({"enable_backward": False, "max_unroll": 0})


@wp.kernel
def clear_hash(g: BlockGrid, s: StepGlobals, stride: int):
    """Empty the hash."""
    for i in range(wp.tid(), g.mask + 1, stride):
        g.keys[i] = EMPTY_KEY
    for b in range(wp.tid(), g.room, stride):
        g.held_by[b] = 0
    if wp.tid() == 0:
        s.flag[FLAG_BLOCKS] = 0
        s.flag[FLAG_FULL] = 0
        s.flag[FLAG_FRESH] = 1
        s.flag[FLAG_TASKS] = 0
        s.flag[FLAG_PLACED] = 0
        s.flag[FLAG_STRAYS] = 0
        s.flag[FLAG_STEPPING] = 1


@wp.kernel
def claim_homes(p: DeviceParticles, g: BlockGrid, s: StepGlobals, stride: int):
    """Give every block that particles are in a slot."""
    for i in range(wp.tid(), p.count, stride):
        here = block_of(cell_at(p.cell, i))
        same = int(0)
        if i > 0 and p.field[i - 1] == p.field[i]:
            if block_of(cell_at(p.cell, i - 1)) == here:
                same = 1  # sorted once: the first of a block claims for all
        if same == 0:
            claim_block(s, g, p.field[i], here)


@wp.kernel
def count_homes(p: DeviceParticles, g: BlockGrid, s: StepGlobals, stride: int):
    """Count every block's particles, and number them."""
    for i in range(wp.tid(), p.count, stride):
        home = find_block(g, p.field[i], block_of(cell_at(p.cell, i)))
        p.home[i] = home
        if home >= 0:
            p.rank[i] = wp.atomic_add(g.held_by, home, 1)
    if wp.tid() == 0:
        s.flag[FLAG_HOMES] = s.flag[FLAG_BLOCKS]


@wp.kernel
def claim_reached(r: DeviceRigidBodies, g: BlockGrid, s: StepGlobals, stride: int):
    """Give every block its place and its tasks, and claim all blocks that anything reaches."""
    for b in range(wp.tid(), s.flag[FLAG_HOMES], stride):
        held = g.held_by[b]
        first = wp.atomic_add(s.flag, FLAG_PLACED, held)
        g.first[b] = first
        tasks = (held + TASK - 1) // TASK
        t = wp.atomic_add(s.flag, FLAG_TASKS, tasks)
        for k in range(tasks):
            g.task_home[t + k] = b
            g.task_first[t + k] = first + k * TASK
            g.task_last[t + k] = first + wp.min(held, (k + 1) * TASK)
        claim_blocks_around(s, g, g.field[b], 4 * g.where[b])
    for i in range(wp.tid(), r.count, stride):
        r.home[i] = -1
        claim_blocks_around(s, g, r.body[i], r.cell[i])


@wp.kernel
def write_sorted(p: DeviceParticles, g: BlockGrid, s: StepGlobals, first: int, stride: int):
    """Write some channels of all particles in order, beside where they are kept."""
    if s.flag[FLAG_FULL] != 0:
        return
    for i in range(wp.tid(), p.count, stride):
        to = g.first[p.home[i]] + p.rank[i]
        for k in range(wp.min(p.spare.shape[0], p.words.shape[0] - first)):
            p.spare[k, to] = p.words[first + k, i]


@wp.kernel
def keep_sorted(p: DeviceParticles, s: StepGlobals, first: int, stride: int):
    """Keep them so."""
    if s.flag[FLAG_FULL] != 0:
        return
    for i in range(wp.tid(), p.count, stride):
        for k in range(wp.min(p.spare.shape[0], p.words.shape[0] - first)):
            p.words[first + k, i] = p.spare[k, i]

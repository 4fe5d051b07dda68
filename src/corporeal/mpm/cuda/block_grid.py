"""Node blocks on the device: found by hashing, and linked.

A hash instead of a table with bounds: bodies may travel as far as they like, and nothing is laid out anew while they
do. Particles remember their block: the hash is asked only when they change it.
"""

from corporeal.mpm.constants import FIELDS_AT_NODE, MIN_NODE_MASS_KG
from corporeal.mpm.cuda import block_arena
from corporeal.mpm.cuda.block_arena import sum_at
from corporeal.mpm.cuda.layout import (
    ARENA_SUMS,
    EMPTY_KEY,
    FLAG_BLOCKS,
    FLAG_FRESH,
    FLAG_FULL,
    BlockGrid,
    StepGlobals,
    wp,
)

wp.set_module_options(block_arena.arena_options(max_unroll=0))

KEY_HALF_WIDTH = wp.constant(wp.int64(1 << 17))
KEY_FIELD_UNIT = wp.constant(wp.int64(1 << 54))
KEY_X_UNIT = wp.constant(wp.int64(1 << 36))
KEY_Y_UNIT = wp.constant(wp.int64(1 << 18))


@wp.func
def key_of(field: int, block: wp.vec3i):
    """One number for a field's block; 512 fields, 2¹⁸ blocks along each axis."""
    x = wp.int64(block[0]) + KEY_HALF_WIDTH
    y = wp.int64(block[1]) + KEY_HALF_WIDTH
    z = wp.int64(block[2]) + KEY_HALF_WIDTH
    return wp.int64(field) * KEY_FIELD_UNIT + x * KEY_X_UNIT + y * KEY_Y_UNIT + z


@wp.func
def start_of(key: wp.int64, mask: int):
    """Where a key's search begins (the finaliser of MurmurHash3)."""
    h = wp.uint64(key)
    h = (h ^ (h >> wp.uint64(33))) * wp.uint64(0xFF51AFD7ED558CCD)
    h = (h ^ (h >> wp.uint64(33))) * wp.uint64(0xC4CEB9FE1A85EC53)
    h = h ^ (h >> wp.uint64(33))
    return int(h & wp.uint64(mask))


@wp.func
def block_of(cell: wp.vec3i):
    """Return the block of a node."""
    return wp.vec3i(cell[0] >> 2, cell[1] >> 2, cell[2] >> 2)


@wp.func
def find_block(g: BlockGrid, field: int, block: wp.vec3i):
    """Slot of a block; -1: it has none."""
    key = key_of(field, block)
    h = start_of(key, g.mask)
    for _ in range(g.mask + 1):
        there = g.keys[h]
        if there == key:
            return g.slots[h]
        if there == EMPTY_KEY:
            break
        h = (h + 1) & g.mask
    return int(-1)


@wp.func
def claim_block(s: StepGlobals, g: BlockGrid, field: int, block: wp.vec3i):
    """Give a block a slot, if it has none.

    One look at each place at most: what another thread found to be full may not be seen here.
    """
    key = key_of(field, block)
    h = start_of(key, g.mask)
    for _ in range(g.mask + 1):
        there = g.keys[h]
        if there == EMPTY_KEY:
            if s.flag[FLAG_FULL] == 1:
                break
            there = wp.atomic_cas(g.keys, h, EMPTY_KEY, key)
            if there == EMPTY_KEY:
                slot = wp.atomic_add(s.flag, FLAG_BLOCKS, 1)
                s.flag[FLAG_FRESH] = 1
                if slot < g.room:
                    g.slots[h] = slot
                    g.where[slot] = block
                    g.field[slot] = field
                else:
                    wp.atomic_sub(s.flag, FLAG_BLOCKS, 1)
                    s.flag[FLAG_FULL] = 1
                break
        if there == key:
            break
        h = (h + 1) & g.mask
    return 0


@wp.func
def claim_blocks_around(s: StepGlobals, g: BlockGrid, field: int, cell: wp.vec3i):
    """Claim the eight blocks that particles of one block reach."""
    low = block_of(cell)
    for i in range(2):
        for j in range(2):
            for k in range(2):
                claim_block(s, g, field, low + wp.vec3i(i, j, k))
    return 0


@wp.func
def link_blocks(g: BlockGrid, s: StepGlobals, tid: int, stride: int):
    """Point every block to its neighbours and to other fields' blocks, if any are new."""
    blocks = s.flag[FLAG_BLOCKS]
    if s.flag[FLAG_FRESH] == 0:
        blocks = 0
    for b in range(tid, blocks, stride):
        at = g.where[b]
        for o in range(8):
            g.near[8 * b + o] = find_block(g, g.field[b], at + wp.vec3i(o >> 2, (o >> 1) & 1, o & 1))
        n = int(0)
        for f in range(g.fields):
            if f != g.field[b] and n < FIELDS_AT_NODE:
                other = find_block(g, f, at)
                if other >= 0:
                    g.partner[FIELDS_AT_NODE * b + n] = other
                    n += 1
        if n < FIELDS_AT_NODE:
            g.partner[FIELDS_AT_NODE * b + n] = -1
    return 0


@wp.kernel
def link_all_blocks(g: BlockGrid, s: StepGlobals, stride: int):
    """Link what was claimed while particles were sorted."""
    link_blocks(g, s, wp.tid(), stride)


@wp.kernel
def momentum_to_velocity(g: BlockGrid, s: StepGlobals, stride: int):
    """Momentum to velocity, with the step's impulses and without; all else begins again."""
    blocks = s.flag[FLAG_BLOCKS]
    for b in range(wp.tid(), blocks, stride):
        g.seen[b] = 0
    if wp.tid() == 0:
        s.flag[FLAG_FRESH] = 0
    for i in range(wp.tid(), 64 * blocks, stride):
        if g.fields > 1 or s.planes > 0:
            g.meet[i] = 0
            g.was[i] = 0
            g.held[i] = 0
        m = g.sum[sum_at(i, 0)]
        now = wp.vec4(0.0)
        old = wp.vec4(0.0)
        if m > MIN_NODE_MASS_KG:
            p = wp.vec3(g.sum[sum_at(i, 1)], g.sum[sum_at(i, 2)], g.sum[sum_at(i, 3)])
            j = wp.vec3(g.sum[sum_at(i, 4)], g.sum[sum_at(i, 5)], g.sum[sum_at(i, 6)])
            v = (p + j) / m
            u = p / m
            now = wp.vec4(m, v[0], v[1], v[2])
            old = wp.vec4(u[0], u[1], u[2], 0.0)
        g.node[i] = now
        g.old[i] = old
        for k in range(ARENA_SUMS):
            g.sum[sum_at(i, k)] = 0.0

"""Node blocks on the device: found by hashing, linked, cleared.

A hash instead of a table with bounds: bodies may travel as far as they like, and nothing is laid
out anew while they do. Particles remember their block: the hash is asked only when they change it.
"""

from corporeal.mpm.constants import FIELDS_AT_NODE, SMALLEST_MASS
from corporeal.mpm.cuda.layout import (
    BLOCKS,
    EMPTY,
    FRESH,
    FULL,
    Grid,
    Particles,
    Sheet,
    wp,
)
from corporeal.mpm.cuda.layout_bodies import Rigid
from corporeal.mpm.cuda.rows import cell_at

wp.set_module_options({"enable_backward": False, "max_unroll": 0})

HALF_WIDTH = wp.constant(wp.int64(1 << 17))
FIELD_UNIT = wp.constant(wp.int64(1 << 54))
X_UNIT = wp.constant(wp.int64(1 << 36))
Y_UNIT = wp.constant(wp.int64(1 << 18))


@wp.func
def key_of(field: int, block: wp.vec3i):
    """One number for a field's block; 512 fields, 2¹⁸ blocks along each axis."""
    x = wp.int64(block[0]) + HALF_WIDTH
    y = wp.int64(block[1]) + HALF_WIDTH
    z = wp.int64(block[2]) + HALF_WIDTH
    return wp.int64(field) * FIELD_UNIT + x * X_UNIT + y * Y_UNIT + z


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
    """Give the block that a node stands in."""
    return wp.vec3i(cell[0] >> 2, cell[1] >> 2, cell[2] >> 2)


@wp.func
def find(g: Grid, field: int, block: wp.vec3i):
    """Slot of a block; -1: it has none."""
    key = key_of(field, block)
    h = start_of(key, g.mask)
    slot = int(-2)
    while slot == -2:
        there = g.keys[h]
        if there == key:
            slot = g.slots[h]
        elif there == EMPTY:
            slot = -1
        h = (h + 1) & g.mask
    return slot


@wp.func
def claim(s: Sheet, g: Grid, field: int, block: wp.vec3i):
    """Give a block a slot, if it has none."""
    key = key_of(field, block)
    h = start_of(key, g.mask)
    looking = int(1)
    while looking == 1:
        there = g.keys[h]
        if there == EMPTY:
            there = wp.atomic_cas(g.keys, h, EMPTY, key)
            if there == EMPTY:
                slot = wp.atomic_add(s.flag, BLOCKS, 1)
                s.flag[FRESH] = 1
                if slot < g.room:
                    g.slots[h] = slot
                    g.where[slot] = block
                    g.field[slot] = field
                else:
                    wp.atomic_sub(s.flag, BLOCKS, 1)
                    s.flag[FULL] = 1
                looking = 0
        if there == key or s.flag[FULL] == 1:
            looking = 0
        h = (h + 1) & g.mask
    return 0


@wp.func
def claim_around(s: Sheet, g: Grid, field: int, cell: wp.vec3i):
    """Claim the eight blocks that particles of one block reach."""
    low = block_of(cell)
    for i in range(2):
        for j in range(2):
            for k in range(2):
                claim(s, g, field, low + wp.vec3i(i, j, k))
    return 0


@wp.func
def node_of(g: Grid, home: int, cell: wp.vec3i, i: int, j: int, k: int):
    """Index of one of the 27 nodes from ``cell`` on, which lies in block ``home``."""
    x = (cell[0] & 3) + i
    y = (cell[1] & 3) + j
    z = (cell[2] & 3) + k
    slot = g.near[8 * home + 4 * (x >> 2) + 2 * (y >> 2) + (z >> 2)]
    return 64 * slot + 16 * (x & 3) + 4 * (y & 3) + (z & 3)


@wp.kernel
def key_particles(
    p: Particles, keys: wp.array(dtype=wp.int64), order: wp.array(dtype=wp.int32), stride: int
):
    """Number particles by block, for sorting."""
    for i in range(wp.tid(), p.count, stride):
        keys[i] = key_of(p.field[i], block_of(cell_at(p.cell, i)))
        order[i] = i


@wp.kernel
def reorder(
    count: int,
    order: wp.array(dtype=wp.int32),
    values: wp.array2d(dtype=wp.int32),
    out: wp.array2d(dtype=wp.int32),
    stride: int,
):
    """Copy all channels in a new order."""
    for i in range(wp.tid(), count, stride):
        for k in range(values.shape[0]):
            out[k, i] = values[k, order[i]]


@wp.kernel
def forget(g: Grid, s: Sheet, stride: int):
    """Empty the hash."""
    for i in range(wp.tid(), g.mask + 1, stride):
        g.keys[i] = EMPTY
        if i == 0:
            s.flag[BLOCKS] = 0
            s.flag[FULL] = 0
            s.flag[FRESH] = 1


@wp.kernel
def claim_blocks(p: Particles, r: Rigid, g: Grid, s: Sheet, stride: int):
    """Claim the blocks of all particles."""
    for i in range(wp.tid(), p.count, stride):
        p.home[i] = -1
        low = block_of(cell_at(p.cell, i))
        same = int(0)
        if i > 0 and p.field[i - 1] == p.field[i]:
            if block_of(cell_at(p.cell, i - 1)) == low:
                same = 1  # sorted: the first of a block claims for all
        if same == 0:
            claim_around(s, g, p.field[i], cell_at(p.cell, i))
    for i in range(wp.tid(), r.count, stride):
        r.home[i] = -1
        claim_around(s, g, r.body[i], r.cell[i])


@wp.kernel
def link(g: Grid, s: Sheet, stride: int):
    """Point every block to its neighbours and to other fields' blocks, if any are new."""
    if s.flag[FRESH] == 0:
        return
    for b in range(wp.tid(), s.flag[BLOCKS], stride):
        at = g.where[b]
        for o in range(8):
            g.near[8 * b + o] = find(g, g.field[b], at + wp.vec3i(o >> 2, (o >> 1) & 1, o & 1))
        n = int(0)
        for f in range(g.fields):
            if f != g.field[b] and n < FIELDS_AT_NODE:
                other = find(g, f, at)
                if other >= 0:
                    g.partner[FIELDS_AT_NODE * b + n] = other
                    n += 1
        if n < FIELDS_AT_NODE:
            g.partner[FIELDS_AT_NODE * b + n] = -1


@wp.kernel
def clear(g: Grid, s: Sheet, stride: int):
    """Empty all nodes."""
    blocks = s.flag[BLOCKS]
    for i in range(wp.tid(), 64 * blocks, stride):
        g.node[i] = wp.vec4(0.0)
        g.old[i] = wp.vec4(0.0)
        g.meet[i] = 0
        g.was[i] = 0
        g.held[i] = 0
    for b in range(wp.tid(), blocks, stride):
        g.seen[b] = 0
    if wp.tid() == 0:
        s.flag[FRESH] = 0


@wp.kernel
def divide(g: Grid, s: Sheet, stride: int):
    """Momentum to velocity."""
    for i in range(wp.tid(), 64 * s.flag[BLOCKS], stride):
        a = g.node[i]
        if a[0] > SMALLEST_MASS:
            g.node[i] = wp.vec4(a[0], a[1] / a[0], a[2] / a[0], a[3] / a[0])
            g.old[i] = g.old[i] / a[0]
        else:
            g.node[i] = wp.vec4(0.0)
            g.old[i] = wp.vec4(0.0)

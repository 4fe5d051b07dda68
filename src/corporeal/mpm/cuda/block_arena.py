"""A block's nodes in a group's own memory, as functions that Warp kernels call: see ``arena.h``.

A group is the threads of one CUDA block, or the processor's one thread. Its threads call all of these with the same
block, each with its number ``lane`` among ``lanes``.
"""

from pathlib import Path
from typing import Any

from corporeal.mpm import formulas
from corporeal.mpm.cuda import layout
from corporeal.mpm.cuda.layout import wp

ARENA_HEADER = Path(__file__).with_name("block_arena.h").resolve()
ARENA_NUMBERS = "ARENA_SIDE ARENA_NODES NODES_OF_BLOCK ARENA_SUMS ARENA_MOTION TASK"
"""What the header knows of ``layout``."""
RECEIVED_NUMBERS = 24
"""Numbers that a particle receives: v, ∇v, u, ∇u, gradients of dx v in row order times 4."""
ReceivedMotion = wp.types.vector(length=RECEIVED_NUMBERS, dtype=wp.float32)
LAYER_SUMS = 9 * int(layout.ARENA_SUMS)
LayerSums = wp.types.vector(length=LAYER_SUMS, dtype=wp.float32)
"""Sums of a layer of nine nodes, node by node: see ``Layer`` in ``arena.h``."""


def arena_options(**others: Any) -> dict[str, Any]:
    """Options of a Warp module that uses the formulas and the arena."""
    numbers = {name: int(getattr(layout, name)) for name in ARENA_NUMBERS.split()}
    return formulas.formula_options(ARENA_HEADER, numbers=numbers, **others)


@wp.func_native("WP_TILE_SYNC();")
def wait_for_group():
    """Wait for all threads of the group."""
    ...


@wp.func_native("return mpm::Arena::node((const int *)near.data, home, x, y, z);")
def node_at(near: wp.array(dtype=wp.int32), home: int, x: int, y: int, z: int) -> int:
    """Index of a node, counted from the first of a block, in this or a block near it."""
    ...


@wp.func
def node_of(near: wp.array(dtype=wp.int32), home: int, cell: wp.vec3i, i: int, j: int, k: int):
    """Index of one of the 27 nodes from ``cell`` on, which lies in block ``home``."""
    return node_at(near, home, (cell[0] & 3) + i, (cell[1] & 3) + j, (cell[2] & 3) + k)


@wp.func_native("return mpm::Arena::sum(node, kind);")
def sum_at(node: int, kind: int) -> int:
    """Index of a node's sum of one kind."""
    ...


@wp.func_native("""
  float *own = mpm::Arena::memory((float *)arena.data);
  int *lists = mpm::Arena::lists((float *)arena.data);
  for (int k = lane; k < mpm::ARENA_SUMS * mpm::ARENA_NODES; k += lanes) own[k] = 0.0f;
  for (int k = lane; k < mpm::NODES_OF_BLOCK; k += lanes) lists[k] = -1;
""")
def clear_arena(arena: wp.array(dtype=wp.float32), lane: int, lanes: int):
    """Begin with sums of zero, and no particle in any cell."""
    ...


@wp.func_native("""
  int *lists = mpm::Arena::lists((float *)arena.data);
  const int at = 16 * (cell.c[0] & 3) + 4 * (cell.c[1] & 3) + (cell.c[2] & 3);
  lists[mpm::NODES_OF_BLOCK + number] = mpm::Arena::exchange(lists + at, number);
""")
def list_particle(arena: wp.array(dtype=wp.float32), cell: wp.vec3i, number: int):
    """Put a particle of the group's task, by its number there, on the list of its cell."""
    ...


@wp.func_native("return mpm::Arena::lists((float *)arena.data)[cell];")
def first_in_cell(arena: wp.array(dtype=wp.float32), cell: int) -> int:
    """Number of the first particle of a cell of the group's block; -1: none."""
    ...


@wp.func_native("return mpm::Arena::lists((float *)arena.data)[mpm::NODES_OF_BLOCK + number];")
def next_in_cell(arena: wp.array(dtype=wp.float32), number: int) -> int:
    """Number of the one after it; -1: none."""
    ...


@wp.func_native(f"""
  mpm::Gift gift(m, &momentum.c[0], &B.data[0][0], &impulse.c[0], &S.data[0][0], &f.c[0]);
  wp::vec_t<{LAYER_SUMS}, wp::float32> r = sums;
  mpm::Layer::add(&r.c[0], gift, layer, &f.c[0]);
  return r;
""")
def add_to_layer(
    sums: LayerSums,
    layer: int,
    f: wp.vec3,
    m: wp.float32,
    momentum: wp.vec3,
    B: wp.mat33,
    impulse: wp.vec3,
    S: wp.mat33,
) -> LayerSums:
    """Add what a particle gives to one layer of its nodes."""
    ...


@wp.func_native("mpm::Layer::leave(mpm::Arena::memory((float *)arena.data), &sums.c[0], cell, layer);")
def add_layer_to_arena(arena: wp.array(dtype=wp.float32), sums: LayerSums, cell: int, layer: int):
    """Add a cell's sums of one layer to the arena."""
    ...


@wp.func_native("""
  mpm::Gift gift(m, &momentum.c[0], &B.data[0][0], &impulse.c[0], &S.data[0][0], &f.c[0]);
  const mpm::There place = {(const int *)near.data, home};
  gift.scatter(mpm::Reach(&cell.c[0], &f.c[0]), (float *)sums.data, place);
""")
def add_to_nodes(
    sums: wp.array(dtype=wp.float32),
    near: wp.array(dtype=wp.int32),
    home: int,
    cell: wp.vec3i,
    f: wp.vec3,
    m: wp.float32,
    momentum: wp.vec3,
    B: wp.mat33,
    impulse: wp.vec3,
    S: wp.mat33,
):
    """Add a particle that has strayed to the nodes themselves."""
    ...


@wp.func_native("""
  const mpm::Reach to(&cell.c[0], &f.c[0]);
  const mpm::There place = {(const int *)near.data, home};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      for (int k = 0; k < 3; k++) {
        const int node = place.node(to.x + i, to.y + j, to.z + k);
        const float n = to.n[0][i] * to.n[1][j] * to.n[2][k];
        mpm::Arena::add((float *)sums.data + place.sum(node, 0), n * m);
      }
""")
def add_mass_to_nodes(
    sums: wp.array(dtype=wp.float32),
    near: wp.array(dtype=wp.int32),
    home: int,
    cell: wp.vec3i,
    f: wp.vec3,
    m: wp.float32,
):
    """Add the mass of a particle of a rigid body to the nodes themselves."""
    ...


@wp.func_native("""
  float *own = mpm::Arena::memory((float *)arena.data);
  for (int k = lane; k < mpm::ARENA_NODES; k += lanes) {
    if (own[k] > 0.0f) {
      const int node = mpm::Arena::node((const int *)near.data, home, k);
      float *sum = (float *)sums.data + mpm::Arena::sum(node, 0);
      for (int c = 0; c < mpm::ARENA_SUMS; c++)
        mpm::Arena::add(sum + mpm::NODES_OF_BLOCK * c, own[mpm::ARENA_NODES * c + k]);
    }
    for (int c = 0; c < mpm::ARENA_SUMS; c++) own[mpm::ARENA_NODES * c + k] = 0.0f;
  }
  int *lists = mpm::Arena::lists((float *)arena.data);
  for (int k = lane; k < mpm::NODES_OF_BLOCK; k += lanes) lists[k] = -1;
""")
def add_arena_to_nodes(
    arena: wp.array(dtype=wp.float32),
    sums: wp.array(dtype=wp.float32),
    near: wp.array(dtype=wp.int32),
    home: int,
    lane: int,
    lanes: int,
):
    """Add the arena's sums to the nodes that anything reached, and begin again."""
    ...


@wp.func_native("""
  float *own = mpm::Arena::memory((float *)arena.data);
  const float *now = (const float *)node.data, *before = (const float *)old.data;
  for (int k = lane; k < mpm::ARENA_NODES; k += lanes) {
    const mpm::Far far = {{(const int *)near.data, home}, now, before};
    const int at = mpm::Arena::node((const int *)near.data, home, k);
    for (int c = 0; c < mpm::ARENA_MOTION; c++) own[mpm::ARENA_NODES * c + k] = far.of(at, c);
  }
""")
def read_nodes(
    arena: wp.array(dtype=wp.float32),
    node: wp.array(dtype=wp.vec4),
    old: wp.array(dtype=wp.vec4),
    near: wp.array(dtype=wp.int32),
    home: int,
    lane: int,
    lanes: int,
):
    """Read the motion of all nodes that the group's block reaches, once."""
    ...


RETURN_RECEIVED = f"""
  wp::vec_t<{RECEIVED_NUMBERS}, wp::float32> r;
  for (int k = 0; k < 3; k++) r.c[k] = seen.v[k], r.c[12 + k] = seen.u[k];
  for (int k = 0; k < 9; k++) r.c[3 + k] = seen.L[k], r.c[15 + k] = seen.K[k];
  return r;
"""


@wp.func_native(
    """
  mpm::Seen seen;
  const mpm::Near motion = {mpm::Here(), mpm::Arena::memory((float *)arena.data)};
  seen.gather(mpm::Reach(&cell.c[0], &f.c[0]), &f.c[0], motion, before != 0);
"""
    + RETURN_RECEIVED
)
def receive_motion(arena: wp.array(dtype=wp.float32), cell: wp.vec3i, f: wp.vec3, before: int) -> ReceivedMotion:
    """What a particle of the group's block sees; ``before``: without forces too."""
    ...


@wp.func_native(
    """
  mpm::Seen seen;
  const float *now = (const float *)node.data, *without = (const float *)old.data;
  const mpm::Far motion = {{(const int *)near.data, home}, now, without};
  seen.gather(mpm::Reach(&cell.c[0], &f.c[0]), &f.c[0], motion, before != 0);
"""
    + RETURN_RECEIVED
)
def receive_from_nodes(
    node: wp.array(dtype=wp.vec4),
    old: wp.array(dtype=wp.vec4),
    near: wp.array(dtype=wp.int32),
    home: int,
    cell: wp.vec3i,
    f: wp.vec3,
    before: int,
) -> ReceivedMotion:
    """Look at the nodes themselves, for a particle that has strayed."""
    ...

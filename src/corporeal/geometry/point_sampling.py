"""Blue-noise sampling: jittered starts, dart throwing, repulsion."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Bool, Float, Int
from numba import njit

from corporeal.geometry.column_crossings import column_crossings, points_wound_around
from corporeal.geometry.cube_lattice import (
    NO_HOLE_SHADOW,
    CubeLattice,
    HoleShadow,
    cube_lattice_of,
    hole_shadow_of,
)
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh


def scatter_points(
    shape: QueryMesh, spacing: float, rng: np.random.Generator
) -> Float[np.ndarray, "N 3"]:
    """One jittered point per cube of ``spacing``, where it falls inside the shape.

    The cubes stand in a random frame, so that no row of them follows a face. Each point stands
    for spacing³.
    """
    lattice = cube_lattice_of(shape, spacing, rng)
    hole = NO_HOLE_SHADOW if shape.closed else None
    return np.concatenate([_scatter_in_slab(shape, slab, hole, rng) for slab in lattice.slabs()])


def scatter_points_by_slab(
    shape: QueryMesh, spacing: float, rng: np.random.Generator
) -> Iterator[Float[np.ndarray, "N 3"]]:
    """Return points as ``scatter_points`` does, slab by slab: of many points, not all need room at once.

    Where a mesh has small holes they are other points than those of ``scatter_points``, found
    faster.
    Those it leaves as they were: volumes of open meshes are counted by them, and change by up to
    1 % from draw to draw.
    """
    lattice = cube_lattice_of(shape, spacing, rng)
    hole = hole_shadow_of(shape, lattice)
    for slab in lattice.slabs():
        yield _scatter_in_slab(shape, slab, hole, rng)


def _scatter_in_slab(
    shape: QueryMesh, slab: CubeLattice, hole: HoleShadow | None, rng: np.random.Generator
) -> np.ndarray:
    if hole is None:
        return _scatter_by_blocks(shape, slab, rng)
    return _scatter_by_columns(shape, slab, hole, rng)


def _scatter_by_columns(
    shape: QueryMesh, lattice: CubeLattice, hole: HoleShadow, rng: np.random.Generator
) -> np.ndarray:
    """Count surfaces along one line per column of cubes: exact for closed meshes, and fast.

    Where the mesh is wound so that a column does not leave it as often as it enters, or near a
    hole, its points are asked one by one.
    """
    nx, ny, nz = lattice.counts
    column = np.indices((nx, ny)).transpose(1, 2, 0) + rng.uniform(0, 1, (nx, ny, 2))
    met = column_crossings(lattice.inner(shape.mesh.vertices), shape.mesh.triangles, column)
    height = np.arange(nz) + rng.uniform(0, 1, (nx * ny, nz))
    line, layer = points_wound_around(met, height)
    column = column.reshape(-1, 2)
    points = lattice.world(np.column_stack([column[line], height[line, layer]]))
    unclear = met.open | hole.over(column, lattice)
    doubtful = np.flatnonzero(unclear)
    if not len(doubtful):
        return points
    points = points[~unclear[line]]
    across = np.broadcast_to(column[doubtful, None], (len(doubtful), nz, 2))
    asked = np.concatenate([across, height[doubtful][..., None]], axis=-1)
    asked = lattice.world(asked.reshape(-1, 3))
    return np.concatenate([points, asked[shape.inside(asked)]])


def _scatter_by_blocks(
    shape: QueryMesh, lattice: CubeLattice, rng: np.random.Generator
) -> np.ndarray:
    """Ask the winding number at every point, but only once in blocks the surface stays out of."""
    blocks = np.indices(tuple(-(-lattice.counts // 4))).reshape(3, -1).T * 4
    middles = lattice.world(blocks + 2.0)
    distance = shape.closest(middles)[0]
    mixed = distance < 2 * np.sqrt(3) * lattice.spacing
    # A surface of area A at least d away fills at most A / d² of the 4π seen from a point: beyond
    # this the winding number is below a half, and thin objects leave most of their box beyond it.
    whole = ~mixed & (distance**2 < shape.mesh.areas.sum() / (2 * np.pi))
    whole[whole] = shape.inside(middles[whole])
    offsets = np.indices((4, 4, 4)).reshape(3, -1).T
    found = []
    for chosen, ask in ((whole, False), (mixed, True)):
        inner = (blocks[chosen][:, None] + offsets).reshape(-1, 3).astype(np.float64)
        points = lattice.world(inner + rng.uniform(0, 1, inner.shape))
        found.append(points[shape.inside(points)] if ask else points)
    return np.concatenate(found)


def sample_surface(
    mesh: Mesh, count: int, rng: np.random.Generator
) -> tuple[Float[np.ndarray, "N 3"], Int[np.ndarray, " N"]]:
    """Points spread over the triangles by area, stratified along their order.

    Returns:
        Positions [m] and the triangle of each.

    """
    edge = np.cumsum(mesh.areas)
    where = (np.arange(count) + rng.uniform(0, 1, count)) / count * edge[-1]
    triangle = np.minimum(np.searchsorted(edge, where, side="right"), len(edge) - 1)
    u, v = rng.uniform(0, 1, (2, count))
    root = np.sqrt(u)
    weights = np.stack([1 - root, root * (1 - v), root * v], axis=1)
    return np.einsum("nk,nkd->nd", weights, mesh.corners[triangle]), triangle


def poisson_disk_subset(
    points: Float[np.ndarray, "N 3"], distance: float, taken: Float[np.ndarray, "M 3"] | None = None
) -> Bool[np.ndarray, " N"]:
    """Choose points in the given order so that no two chosen are closer than ``distance``.

    With many points in random order this is dart throwing: blue noise of density about
    0.69 / distance² on a surface.

    Args:
        points: Candidates [m]; earlier ones win.
        distance: [m]
        taken: Points that are chosen already.

    """
    before = np.zeros((0, 3)) if taken is None else taken
    everything = np.concatenate([before, points])
    if not len(points):
        return np.zeros(0, dtype=bool)
    return _throw_darts_in_cells(everything, len(before), distance)[len(before) :]


def _bucket_count(count: int) -> int:
    return 1 << max(4, int(2 * count - 1).bit_length())


@njit(cache=True)
def _bucket_of(i, j, k, size):
    return ((i * 73856093) ^ (j * 19349663) ^ (k * 83492791)) & (size - 1)


@njit(cache=True)
def _throw_darts(points, cells, before, distance, head):
    n = len(points)
    following = np.full(n, -1, np.int64)
    chosen = np.zeros(n, np.bool_)
    for p in range(n):
        free = True
        if p >= before:
            for i in range(-1, 2):
                for j in range(-1, 2):
                    for k in range(-1, 2):
                        q = head[
                            _bucket_of(cells[p, 0] + i, cells[p, 1] + j, cells[p, 2] + k, len(head))
                        ]
                        while q >= 0 and free:
                            d = points[p] - points[q]
                            free = d[0] ** 2 + d[1] ** 2 + d[2] ** 2 >= distance**2
                            q = following[q]
        if free:
            chosen[p] = True
            b = _bucket_of(cells[p, 0], cells[p, 1], cells[p, 2], len(head))
            following[p] = head[b]
            head[b] = p
    return chosen


def _throw_darts_in_cells(points: np.ndarray, before: int, distance: float) -> np.ndarray:
    cells = np.floor((points - points.min(axis=0)) / distance).astype(np.int64)
    head = np.full(_bucket_count(len(points)), -1, np.int64)
    return _throw_darts(np.ascontiguousarray(points), cells, before, distance, head)


def repulsion(
    points: Float[np.ndarray, "N 3"], reach: float, gain: float = 0.2
) -> Float[np.ndarray, "N 3"]:
    """Displacement of every point away from its neighbours.

    Δ_i = gain Σ_j (reach - l_ij) d_ij / l_ij over neighbours nearer than ``reach`` [m].
    """
    low = points.min(axis=0)
    # A far stray point must not make the table of cells large; wider cells are only slower.
    width = max(
        reach, float(np.prod(np.ptp(points, axis=0) + reach) / (64 * len(points) + 1e6)) ** (1 / 3)
    )
    cells = np.floor((points - low) / width).astype(np.int64) + 1
    shape = cells.max(axis=0) + 2
    key = (cells[:, 0] * shape[1] + cells[:, 1]) * shape[2] + cells[:, 2]
    order = np.argsort(key, kind="stable")
    start = np.zeros(int(np.prod(shape)) + 1, np.int64)
    np.cumsum(np.bincount(key, minlength=len(start) - 1), out=start[1:])
    moved = _repulsion_in_cells(
        points[order], key[order], start, (shape[1] * shape[2], shape[2]), reach
    )
    result = np.empty_like(moved)
    result[order] = gain * moved
    return result


@njit(cache=True, fastmath=True)
def _repulsion_in_cells(points, key, start, stride, reach):
    moved = np.zeros_like(points)
    for p in range(len(points)):
        x, y, z = points[p]
        for i in range(-1, 2):
            for j in range(-1, 2):
                row = key[p] + i * stride[0] + j * stride[1]
                # Three neighbouring cells of a row lie one after the other; each pair once.
                for q in range(max(start[row - 1], p + 1), start[row + 2]):
                    dx, dy, dz = x - points[q, 0], y - points[q, 1], z - points[q, 2]
                    squared = dx * dx + dy * dy + dz * dz
                    if 0.0 < squared < reach * reach:
                        length = np.sqrt(squared)
                        f = (reach - length) / length
                        moved[p, 0] += f * dx
                        moved[p, 1] += f * dy
                        moved[p, 2] += f * dz
                        moved[q, 0] -= f * dx
                        moved[q, 1] -= f * dy
                        moved[q, 2] -= f * dz
    return moved

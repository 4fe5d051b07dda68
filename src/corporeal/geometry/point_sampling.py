"""Blue-noise sampling: jittered starts, dart throwing, repulsion.

Inside test of a mesh along parallel columns: exact where the mesh is closed.

A ray that is shot at triangles one after the other passes between two of them, and misses the second of two faces in
one plane, as where a cushion lies on its frame. Here triangles are drawn onto the plane that the columns stand on, as a
raster is, and every edge is decided once: all triangles that share it get the same answer, however numbers round. What
a column enters it leaves, as long as edges are walked as often one way as the other.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numba import njit

from corporeal.geometry import kernels_vertical_lines as kernels
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh, random_rotation

MAX_SLAB_CUBES = 4_000_000
"""Cubes that are looked at together."""
MAX_UNCLEAR_COLUMNS_FRACTION = 0.1
"""Share of the columns up to which those near a hole are asked point by point: all take 0.3 µs a point, and blocks ask
about a tenth of them."""


@dataclass(frozen=True)
class CubeLattice:
    """Cubes in a turned frame."""

    frame: np.ndarray
    """Its axes, as columns."""
    centre: np.ndarray
    """World position of its origin [m]."""
    low: np.ndarray
    """Corner of the first cube, in the frame [m]."""
    counts: np.ndarray
    spacing: float

    def world(self, inner: np.ndarray) -> np.ndarray:
        """World position of points that are given in cubes from the first corner."""
        # A product of so narrow matrices takes BLAS ten times as long.
        turned = np.einsum("...i,ji->...j", self.low + inner * self.spacing, self.frame)
        return turned + self.centre

    def inner(self, points: np.ndarray) -> np.ndarray:
        """Take points of the world [m] into cubes from the first corner."""
        return ((points - self.centre) @ self.frame - self.low) / self.spacing

    def slabs(self) -> "Iterator[CubeLattice]":
        """Cut it along its first axis into lattices of at most SLAB cubes or of four layers."""
        thick = max(4, MAX_SLAB_CUBES // int(self.counts[1] * self.counts[2]) // 4 * 4)
        for first in range(0, self.counts[0], thick):
            low = self.low + np.array([first * self.spacing, 0, 0])
            counts = np.array([min(thick, self.counts[0] - first), *self.counts[1:]])
            yield replace(self, low=low, counts=counts)


@dataclass(frozen=True)
class HoleShadow:
    """Where columns may pass so near open edges that crossings do not settle what is inside.

    A box across the columns, in the lattice's frame; empty where no edge is open.
    """

    low: Float[np.ndarray, " 2"]
    """[m]"""
    high: Float[np.ndarray, " 2"]
    """[m]"""

    def over(self, columns: Float[np.ndarray, "C 2"], lattice: CubeLattice) -> Bool[np.ndarray, " C"]:
        """Whether each column, in cubes, stands in the shadow."""
        place = lattice.low[:2] + columns * lattice.spacing
        return np.logical_and.reduce((place > self.low) & (place < self.high), axis=1)


NO_HOLE_SHADOW = HoleShadow(np.full(2, np.inf), np.full(2, -np.inf))
"""Of a mesh without open edges."""


def hole_shadow_of(shape: QueryMesh, lattice: CubeLattice) -> HoleShadow | None:
    """Find where columns must be asked point by point; None: in too many places.

    A cap from the middle of all open edges to each closes the mesh. Wherever a column crosses mesh and cap as often one
    way as the other, the winding number differs from the count of crossings below by the solid angle of the cap over
    4π. That is below a half, so changes nothing, farther from the cap than the root of its area over 2π.
    """
    rim, excess = shape.open_edges
    if shape.closed or not len(rim):
        return NO_HOLE_SHADOW
    ends = shape.mesh.vertices[rim]
    a, b = np.swapaxes(ends - ends.reshape(-1, 3).mean(axis=0), 0, 1)
    area = 0.5 * float(np.abs(excess) @ np.linalg.norm(np.cross(a, b), axis=1))
    flat = ((ends - lattice.centre) @ lattice.frame)[..., :2].reshape(-1, 2)
    reach = np.sqrt(area / (2 * np.pi)) + lattice.spacing
    hole = HoleShadow(flat.min(axis=0) - reach, flat.max(axis=0) + reach)
    shadow = np.prod(hole.high - hole.low)
    whole = np.prod(lattice.counts[:2]) * lattice.spacing**2
    return hole if shadow <= MAX_UNCLEAR_COLUMNS_FRACTION * whole else None


def cube_lattice_of(shape: QueryMesh, spacing: float, rng: np.random.Generator) -> CubeLattice:
    """Lay cubes of ``spacing`` [m] in a random frame around a shape."""
    used = shape.mesh.vertices[np.unique(shape.mesh.triangles)]
    frame, centre = random_rotation(rng), used.mean(axis=0)
    turned = (used - centre) @ frame
    # A random shift, so that a thin plate is not hit or missed as a whole.
    low = turned.min(axis=0) - rng.uniform(0, 1, 3) * spacing
    counts = np.ceil((turned.max(axis=0) - low) / spacing).astype(int) + 1
    return CubeLattice(frame, centre, low, counts, spacing)


@dataclass(frozen=True)
class ColumnCrossings:
    """Where columns cross a mesh, column by column, from below; H crossings."""

    first: Int[np.ndarray, " C1"]
    """Number of each column's first crossing; one more at the end."""
    height: Float[np.ndarray, " H"]
    """Ascending within a column; in units of the lattice."""
    step: Int[np.ndarray, " H"]
    """1 into the shape, -1 out."""

    @property
    def open(self) -> Bool[np.ndarray, " C"]:
        """Whether a column does not leave the shape as often as it enters it."""
        total = np.concatenate([[0], np.cumsum(self.step)])
        return np.diff(total[self.first]) != 0


def column_crossings(
    vertices: Float[np.ndarray, "V 3"], triangles: Int[np.ndarray, "T 3"], columns: Float[np.ndarray, "nx ny 2"]
) -> ColumnCrossings:
    """Find where columns along the third axis cross a mesh.

    Args:
        vertices: In units of the lattice, from the corner of its first cube.
        triangles: Their vertices.
        columns: Where each column stands: within the cube of its number, [i, i + 1) by [j, j + 1).
    """
    count = np.zeros(columns.shape[:2], np.int64)
    kernels.collect_crossings(vertices, triangles, columns, count, np.zeros((0, 2)))
    first = np.concatenate([[0], np.cumsum(count)])
    met = np.zeros((first[-1], 2))
    kernels.collect_crossings(vertices, triangles, columns, first[:-1].reshape(count.shape).copy(), met)
    kernels.sort_crossings(first, met)
    return ColumnCrossings(first, met[:, 0].copy(), met[:, 1].astype(np.int64))


def points_wound_around(
    met: ColumnCrossings, heights: Float[np.ndarray, "C nz"]
) -> tuple[Int[np.ndarray, " N"], Int[np.ndarray, " N"]]:
    """Find the points that the mesh winds around at all.

    Returns:
        Column and layer of each.
    """
    count = np.zeros(len(heights), np.int64)
    crossed = met.first, met.height, met.step
    kernels.collect_points_in_columns(crossed, heights, count, np.zeros(0, np.int64))
    column = np.repeat(np.arange(len(heights)), count)
    layer = np.zeros(len(column), np.int64)
    kernels.collect_points_in_columns(crossed, heights, np.cumsum(count) - count, layer)
    return column, layer


def scatter_points(shape: QueryMesh, spacing: float, rng: np.random.Generator) -> Float[np.ndarray, "N 3"]:
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

    Where the mesh is wound so that a column does not leave it as often as it enters, or near a hole, its points are
    asked one by one.
    """
    nx, ny, nz = lattice.counts
    column = np.indices((nx, ny)).transpose(1, 2, 0) + rng.uniform(0, 1, (nx, ny, 2))
    met = column_crossings(lattice.inner(shape.mesh.vertices), shape.mesh.triangles, column)
    height = rng.random((nx * ny, nz))
    height += np.arange(nz)
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


def _scatter_by_blocks(shape: QueryMesh, lattice: CubeLattice, rng: np.random.Generator) -> np.ndarray:
    """Ask the winding number at every point, but only once in blocks the surface stays out of."""
    blocks = np.indices(tuple(-(-lattice.counts // 4))).reshape(3, -1).T * 4
    middles = lattice.world(blocks + 2.0)
    distance = shape.closest(middles)[0]
    mixed = distance < 2 * np.sqrt(3) * lattice.spacing
    # A surface of area A at least d away fills at most A / d² of the 4π seen from a point: beyond this the winding
    # number is below a half, and thin objects leave most of their box beyond it.
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
                        q = head[_bucket_of(cells[p, 0] + i, cells[p, 1] + j, cells[p, 2] + k, len(head))]
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


def repulsion(points: Float[np.ndarray, "N 3"], reach: float, gain: float = 0.2) -> Float[np.ndarray, "N 3"]:
    """Displacement of every point away from its neighbours.

    Δ_i = gain Σ_j (reach - l_ij) d_ij / l_ij over neighbours nearer than ``reach`` [m].
    """
    low = points.min(axis=0)
    # A far stray point must not make the table of cells large; wider cells are only slower.
    width = max(reach, float(np.prod(np.ptp(points, axis=0) + reach) / (64 * len(points) + 1e6)) ** (1 / 3))
    cells = np.floor((points - low) / width).astype(np.int64) + 1
    shape = cells.max(axis=0) + 2
    key = (cells[:, 0] * shape[1] + cells[:, 1]) * shape[2] + cells[:, 2]
    order = np.argsort(key, kind="stable")
    start = np.zeros(int(np.prod(shape)) + 1, np.int64)
    np.cumsum(np.bincount(key, minlength=len(start) - 1), out=start[1:])
    moved = _repulsion_in_cells(points[order], key[order], start, (shape[1] * shape[2], shape[2]), reach)
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

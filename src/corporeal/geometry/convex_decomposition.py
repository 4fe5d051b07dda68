"""Convex decomposition of meshes for rigid-body engines.

Cells of a grid that the mesh fills, by the generalised winding number, or passes through, say where
the body is. The box around them is cut by planes: always the part whose convex hull holds most that
the body does not, and where the two new hulls hold least together and the halves are even (as in
Mamou's V-HACD, 2016: volumetric hierarchical approximate convex decomposition).
Then the triangles themselves are cut by the same planes, and each piece is the convex hull of what
lies in its part: they cover the mesh, do not overlap, and leave hollows open.
"""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import ConvexHull

from corporeal.core.errors import BadFileError, UserError
from corporeal.core.store import load, save
from corporeal.geometry.convex_hull import ConvexPiece, convex_hull_of
from corporeal.geometry.mesh import Mesh, orient_outward, weld_mesh
from corporeal.geometry.mesh_queries import QueryMesh

DECOMPOSITION_VERSION = 2
"""Of the way pieces are made: kept ones of another version are made anew."""
GRID_CELLS_COUNT = 80_000
"""Of the grid, about."""
MIN_CELL_SIDE_FRACTION, MAX_CELL_SIDE_FRACTION = 1 / 128, 1 / 32
"""Of the extent: side of a cell."""
MAX_HULL_EXCESS_FRACTION = 0.12
"""Pieces are enough when they hold no more than this share beyond the body's cells."""
MAX_CONVEX_PIECES = 64
"""Pieces of one body."""
CUT_BALANCE_WEIGHT = 0.2
"""Weight of halves that differ in size: slicing a bowl's rim off never opens it."""
EVEN_CUT_PLANES_COUNT, STEEP_CUT_PLANES_COUNT = 5, 4
"""Planes that are tried across each axis: evenly spaced, and where the cross-section changes."""
SHEET_THICKNESS_FRACTION = 4e-3
"""Of the extent: thickness that a sheet is given."""


def decompose_convex(
    vertices: Float[np.ndarray, "V 3"], triangles: Int[np.ndarray, "T 3"], cache: Path | None = None
) -> tuple[ConvexPiece, ...]:
    """Cut a mesh into convex pieces.

    Args:
        vertices: [m]
        triangles: Vertex numbers; holes, flips and many shells are welcome.
        cache: Folder to keep pieces in, by the mesh's hash at unit size; None: keep nothing.

    Raises:
        UserError: The mesh has no surface, or numbers that are none.
    """
    used, number = np.unique(triangles, return_inverse=True)
    points = np.asarray(vertices, dtype=np.float64)[used]
    if not len(points):
        raise UserError("it has no triangles")
    if not np.isfinite(points).all():
        raise UserError("it has vertices that are not finite")
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    extent = float(np.ptp(points, axis=0).max())
    if extent <= 0:
        raise UserError("it has no size: all its vertices are one point")
    unit = np.round((points - middle) / extent, 6)
    arrays = _cached_pieces(unit, number.reshape(-1, 3).astype(np.int64), cache)
    return tuple(ConvexPiece(v * extent + middle, t) for v, t in arrays)


def _cached_pieces(unit: np.ndarray, triangles: np.ndarray, cache: Path | None) -> tuple:
    if cache is None:
        return _cut_convex(unit, triangles)
    name = hashlib.sha256(bytes([DECOMPOSITION_VERSION]) + unit.tobytes() + triangles.tobytes()).hexdigest()
    path = cache / f"{name[:24]}.npz"
    if path.exists():
        try:
            return load(path)
        except BadFileError:
            path.unlink()
    found = _cut_convex(unit, triangles)
    save(path, found)
    return found


def _cut_convex(unit: np.ndarray, triangles: np.ndarray) -> tuple:
    mesh, _ = weld_mesh(unit, triangles)
    if not len(mesh.triangles):
        whole = convex_hull_of(unit, SHEET_THICKNESS_FRACTION)
        return ((whole.vertices, whole.triangles),)
    grid = _CellGrid.of(mesh)
    pieces = [leaf.hull(grid) for leaf in _split_boxes(grid, mesh.corners)]
    return tuple((p.vertices, p.triangles) for p in pieces if p is not None)


@dataclass(frozen=True)
class _CellGrid:
    """Cells that the body fills or its surface passes through."""

    filled: Bool[np.ndarray, "X Y Z"]
    inside: Bool[np.ndarray, "X Y Z"]
    """Those of them whose middle is inside."""
    origin: Float[np.ndarray, "3"]
    side: float

    @classmethod
    def of(cls, mesh: Mesh) -> "_CellGrid":
        low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
        side = float(np.clip(np.prod(np.maximum(high - low, 0.02)) / GRID_CELLS_COUNT, 0, 1) ** (1 / 3))
        side = min(max(side, MIN_CELL_SIDE_FRACTION), MAX_CELL_SIDE_FRACTION)
        counts = np.maximum(np.ceil((high - low) / side - 1e-9), 1).astype(np.int64)
        origin = 0.5 * (low + high - counts * side)
        places = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1)
        centres = origin + (places.reshape(-1, 3) + 0.5) * side
        shape = QueryMesh(orient_outward(mesh))
        inside = shape.inside(centres)
        filled = inside.copy()
        near = np.flatnonzero(~filled & shape.may_be_within(side, centres))
        foot = shape.closest(centres[near])[2]
        filled[near] = np.abs(foot - centres[near]).max(axis=1) <= 0.5 * side + 1e-9
        return cls(filled.reshape(counts), inside.reshape(counts), origin, side)


@dataclass(frozen=True)
class _BoxContent:
    """What of the body lies in one box."""

    filled: Bool[np.ndarray, "x y z"]
    """The box's cells, no empty layer at its ends."""
    low: Int[np.ndarray, "3"]
    """Its first cell in the grid."""
    corners: Float[np.ndarray, "T 3 3"]
    """Triangles in it."""

    @classmethod
    def trimmed(cls, filled: np.ndarray, low: np.ndarray, corners: np.ndarray) -> "_BoxContent":
        ranges = []
        for axis in range(3):
            layers = np.flatnonzero(filled.any(axis=tuple(a for a in range(3) if a != axis)))
            ranges.append((int(layers[0]), int(layers[-1]) + 1))
        box = tuple(slice(a, b) for a, b in ranges)
        return cls(filled[box], low + [a for a, _ in ranges], corners)

    @property
    def excess(self) -> float:
        """Volume that the hull of its cells holds beyond them [cells]."""
        return cells_hull_volume(self.filled) - float(self.filled.sum())

    def best_plane(self) -> tuple[int, int] | None:
        """Axis and layer of the best cut; None: one cell is left."""
        best, least = None, np.inf
        per_cell = CUT_BALANCE_WEIGHT * cells_hull_volume(self.filled) / float(self.filled.sum())
        for axis in range(3):
            turned = np.moveaxis(self.filled, axis, 0)
            for k in _candidate_layers(turned):
                low, high = turned[:k], turned[k:]
                uneven = abs(int(low.sum()) - int(high.sum()))
                cost = cells_hull_volume(low) + cells_hull_volume(high) + per_cell * uneven
                if cost < least:
                    best, least = (axis, k), cost
        return best

    def halves(self, axis: int, k: int, grid: "_CellGrid") -> tuple["_BoxContent", "_BoxContent"]:
        below, above = np.split(self.filled, [k], axis=axis)
        step = np.zeros(3, dtype=np.int64)
        step[axis] = k
        height = grid.origin[axis] + (self.low[axis] + k) * grid.side
        under, over = cut_by_plane(self.corners, axis, float(height))
        return _BoxContent.trimmed(below, self.low, under), _BoxContent.trimmed(above, self.low + step, over)

    def hull(self, grid: "_CellGrid") -> ConvexPiece | None:
        """Enclose its triangles and its middles inside; None: only a line of either."""
        box = tuple(slice(a, a + n) for a, n in zip(self.low, self.filled.shape, strict=True))
        middles = grid.origin + (self.low + np.argwhere(grid.inside[box]) + 0.5) * grid.side
        try:
            return convex_hull_of(np.concatenate([self.corners.reshape(-1, 3), middles]), SHEET_THICKNESS_FRACTION)
        except UserError:
            return None


def _split_boxes(grid: _CellGrid, corners: np.ndarray) -> list[_BoxContent]:
    """Cut the box around the body until its parts are nearly convex."""
    first = _BoxContent.trimmed(grid.filled, np.zeros(3, dtype=np.int64), corners)
    leaves, excesses = [first], [first.excess]
    enough = MAX_HULL_EXCESS_FRACTION * float(grid.filled.sum())
    while sum(excesses) > enough and len(leaves) < MAX_CONVEX_PIECES:
        worst = int(np.argmax(excesses))
        plane = leaves[worst].best_plane()
        if plane is None or excesses[worst] <= 0:
            break
        halves = leaves[worst].halves(*plane, grid)
        leaves[worst : worst + 1] = halves
        excesses[worst : worst + 1] = [half.excess for half in halves]
    return leaves


def _candidate_layers(filled: np.ndarray) -> list[int]:
    """Choose layers of the first axis to try a cut at."""
    count = len(filled)
    even = np.round(np.linspace(0, count, EVEN_CUT_PLANES_COUNT + 2)[1:-1]).astype(np.int64)
    change = np.abs(np.diff(filled.sum(axis=(1, 2)).astype(np.int64)))
    steep = np.argsort(-change, kind="stable")[:STEEP_CUT_PLANES_COUNT] + 1
    chosen = np.unique(np.concatenate([even, steep[change[steep - 1] > 0]]))
    return [int(k) for k in chosen if 0 < k < count]


def cells_hull_volume(filled: Bool[np.ndarray, "x y z"]) -> float:
    """Volume of the convex hull of cells [cells]."""
    x, y, z = filled.shape
    corner = np.zeros((x + 1, y + 1, z + 1), dtype=bool)
    for a in (0, 1):
        for b in (0, 1):
            for c in (0, 1):
                corner[a : a + x, b : b + y, c : c + z] |= filled
    turned = np.moveaxis(corner, int(np.argmax(corner.shape)), 2)
    column = np.argwhere(turned.any(axis=2))
    if not len(column):
        return 0.0
    run = turned[column[:, 0], column[:, 1]]
    first, last = run.argmax(axis=1), run.shape[1] - 1 - run[:, ::-1].argmax(axis=1)
    ends = [np.column_stack([column, end]) for end in (first, last)]
    return float(ConvexHull(np.concatenate(ends).astype(float)).volume)


def cut_by_plane(
    corners: Float[np.ndarray, "T 3 3"], axis: int, height: float
) -> tuple[Float[np.ndarray, "A 3 3"], Float[np.ndarray, "B 3 3"]]:
    """Cut triangles by a plane across an axis: what is below, what is above."""
    above = corners[:, :, axis] > height
    count = above.sum(axis=1)
    below, over = [corners[count == 0]], [corners[count == 3]]
    for lonely, one, two in ((1, over, below), (2, below, over)):
        crossing, side = corners[count == lonely], above[count == lonely]
        # Turned so that the corner alone on its side comes first.
        alone = np.argmax(side if lonely == 1 else ~side, axis=1)
        order = (alone[:, None] + np.arange(3)) % 3
        a, b, c = np.moveaxis(np.take_along_axis(crossing, order[:, :, None], axis=1), 1, 0)
        ab, ac = _edge_plane_points(a, b, axis, height), _edge_plane_points(a, c, axis, height)
        one.append(np.stack([a, ab, ac], axis=1))
        two += [np.stack([ab, b, c], axis=1), np.stack([ab, c, ac], axis=1)]
    return np.concatenate(below), np.concatenate(over)


def _edge_plane_points(a: np.ndarray, b: np.ndarray, axis: int, height: float) -> np.ndarray:
    """Where edges meet the plane."""
    share = (height - a[:, axis]) / (b[:, axis] - a[:, axis])
    point = a + share[:, None] * (b - a)
    point[:, axis] = height
    return point

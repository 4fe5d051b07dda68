"""Graph of superpoints: adjacency, difference of appearance, concavity.

Whether a surface folds inwards or outwards between two patches is read from their normals n and centres c, d = (c_j -
c_i) / |c_j - c_i|: (n_i - n_j) · d is positive at a notch and negative at an edge (Stein et al., "Object partitioning
using local convexity", CVPR 2014).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial import KDTree

from corporeal.multiview.point_cloud_geometry import nearest_neighbours, point_normals
from corporeal.reconstruction.segment.superpoints import superpoints

NORMAL_NEIGHBOURS = 16
"""Points that a normal is found from."""
MEETING_NEIGHBOURS = 12
"""Nearest points of a point: where two patches have such a pair, they meet."""
PATCH_APPEARANCE_SCALE, NORMAL_APPEARANCE_WEIGHT = 0.15, 0.15
"""Difference of appearance that keeps points out of a patch as one patch's width does; what a unit of normal counts as
difference of appearance."""
MIN_POINTS_PER_PATCH = 10
"""To a patch, at least."""


@dataclass(frozen=True)
class SurfacePatches:
    """M patches of N points."""

    of_point: Int[np.ndarray, " N"]
    size: Int[np.ndarray, " M"]
    """Points."""
    centre: Float[np.ndarray, "M 3"]
    """World [m]."""
    appearance: Float[np.ndarray, "M C"]
    """Mean of the points'."""
    normal: Float[np.ndarray, "M 3"]
    """Unit, outward."""


@dataclass(frozen=True)
class PatchBorders:
    """Where patches meet; E pairs."""

    first: Int[np.ndarray, " E"]
    second: Int[np.ndarray, " E"]
    """Larger than ``first``."""
    length: Float[np.ndarray, " E"]
    """Pairs of near points, one on either side."""


def cut_patches(
    position: Float[np.ndarray, "N 3"],
    appearance: Float[np.ndarray, "N C"],
    normal: Float[np.ndarray, "N 3"] | None,
    count: int,
) -> tuple[SurfacePatches, PatchBorders]:
    """Cut points into patches, and say which of them meet.

    Args:
        position: World [m].
        appearance: Short vectors, see ``reduce``.
        normal: Unit, outward; None: found from the points, outward being up where it is highest
            and the same on either side of every fold.
        count: How many patches, about; fewer where there are too few points.
    """
    known = normal is not None
    if normal is None:
        near = nearest_neighbours(position, NORMAL_NEIGHBOURS)
        normal = point_normals(position, near, np.zeros_like(position, np.float64))
    facing = normal if known else _normal_tensors(normal)
    patch = superpoints(
        position,
        np.concatenate([appearance, NORMAL_APPEARANCE_WEIGHT * facing], axis=1),
        max(1, min(count, len(position) // MIN_POINTS_PER_PATCH)),
        PATCH_APPEARANCE_SCALE,
    )
    size = np.bincount(patch)
    centre, mean = _mean(position, patch, size), _mean(appearance, patch, size)
    borders = _borders(position, patch)
    turned = _unit(_mean(normal, patch, size))
    if not known:
        turned = _orient_normals(_leading_direction(_mean(facing, patch, size)), centre, borders)
    return SurfacePatches(patch, size, centre, mean, turned), borders


def border_concavity(found: SurfacePatches, borders: PatchBorders) -> Float[np.ndarray, " E"]:
    """Return how sharply the surface folds inwards: sine-like, from -2 (an edge) to 2 (a slit)."""
    i, j = borders.first, borders.second
    along = _unit(found.centre[j] - found.centre[i])
    return np.sum((found.normal[i] - found.normal[j]) * along, axis=1)


def border_difference(found: SurfacePatches, borders: PatchBorders) -> Float[np.ndarray, " E"]:
    """Return how unlike two patches look: the distance of their mean looks."""
    return np.linalg.norm(found.appearance[borders.first] - found.appearance[borders.second], axis=1)


def join_pieces(found: SurfacePatches, borders: PatchBorders) -> PatchBorders:
    """Add a border between what is in several pieces: from each to the nearest patch of the rest.

    A gap may be a true one, or where no view looked. The new borders are as long as most are.
    """
    first, second = [borders.first], [borders.second]
    while True:
        graph = _sparse_graph(np.concatenate(first), np.concatenate(second), len(found.size))
        pieces, piece = connected_components(graph, directed=False)
        if pieces == 1:
            break
        largest = piece == np.argmax(np.bincount(piece, found.size))
        rest = np.flatnonzero(~largest)
        distance, who = KDTree(found.centre[largest]).query(found.centre[rest])
        other = np.flatnonzero(largest)[who]
        for k in np.unique(piece[rest]):
            own = np.flatnonzero(piece[rest] == k)
            best = own[np.argmin(distance[own])]
            first.append(np.minimum(rest[best], other[best])[None])
            second.append(np.maximum(rest[best], other[best])[None])
    made = np.concatenate(first), np.concatenate(second)
    usual = float(np.median(borders.length)) if len(borders.length) else 1.0
    added = np.full(len(made[0]) - len(borders.first), usual)
    return PatchBorders(*made, np.concatenate([borders.length, added]))


def _borders(position: np.ndarray, patch: np.ndarray) -> PatchBorders:
    near = nearest_neighbours(position, MEETING_NEIGHBOURS + 1)[:, 1:]
    a, b = np.repeat(patch, near.shape[1]), patch[near.ravel()]
    apart = a != b
    low, high = np.minimum(a[apart], b[apart]), np.maximum(a[apart], b[apart])
    count = int(patch.max()) + 1
    pair, length = np.unique(low * count + high, return_counts=True)
    return PatchBorders(pair // count, pair % count, length.astype(np.float64))


def _orient_normals(normal: np.ndarray, centre: np.ndarray, borders: PatchBorders) -> np.ndarray:
    """Turn normals so that those that meet agree, beginning with the most parallel (Hoppe 1992)."""
    i, j = borders.first, borders.second
    agreement = np.sum(normal[i] * normal[j], axis=1)
    count = len(normal)
    tree = minimum_spanning_tree(_sparse_graph(i, j, count, 1 + 1e-9 - np.abs(agreement)))
    made = normal.copy()
    pieces, piece = connected_components(tree, directed=False)
    for k in range(pieces):
        own = np.flatnonzero(piece == k)
        top = own[np.argmax(centre[own, 2])]
        made[top] *= -1 if made[top, 2] < 0 else 1
        order, before = breadth_first_order(tree, top, directed=False)
        for m in order[1:]:
            made[m] *= -1 if made[m] @ made[before[m]] < 0 else 1
    return made


def _normal_tensors(normal: np.ndarray) -> np.ndarray:
    """Return n nᵀ, which does not know a normal's sign, so that |difference| is that of normals."""
    x, y, z = normal.T
    return np.stack([x * x, y * y, z * z, *(np.sqrt(2) * p for p in (x * y, y * z, z * x))], axis=1)


def _leading_direction(tensor: np.ndarray) -> np.ndarray:
    """Return the direction that mean tensors n nᵀ agree on."""
    x, y, z, xy, yz, zx = tensor.T / np.array([[1], [1], [1], *[[np.sqrt(2)]] * 3])
    full = np.stack([x, xy, zx, xy, y, yz, zx, yz, z], axis=1).reshape(-1, 3, 3)
    return np.linalg.eigh(full)[1][:, :, 2]


def _sparse_graph(i: np.ndarray, j: np.ndarray, count: int, weight: np.ndarray | None = None) -> csr_array:
    entries = np.ones(len(i)) if weight is None else weight
    return csr_array((entries, (i, j)), shape=(count, count))


def _mean(rows: np.ndarray, patch: np.ndarray, size: np.ndarray) -> np.ndarray:
    total = [np.bincount(patch, column, len(size)) for column in rows.T]
    return np.stack(total, axis=1) / size[:, None]


def _unit(rows: np.ndarray) -> np.ndarray:
    return rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)

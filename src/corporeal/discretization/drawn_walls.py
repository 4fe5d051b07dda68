"""Walls that a mesh draws with both faces: thickness, and the faces that stand for them."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from corporeal.discretization.mesh_kind import outer_wall_side
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.geometry.remeshing import REMESH_CREASE_ANGLE_DEG, FeaturePatches, PatchProjection, unique_edges

MAX_FACING_COS = -0.7
"""Two faces of a wall look away from one another, at this cosine or less."""
MAX_WALL_MEDIAN_RATIO = 4.0
"""What has its other face farther than so many median thicknesses is an edge of the wall, not a face."""
SAME_FACE_COS = 0.9
"""Least cosine between triangles of one face of a wall, next to one another."""
RIM_REACH_THICKNESSES = 1.1
"""How far a face goes on beyond where the other one is, at an outer corner; in median thicknesses."""
MAX_CONVEX_TURN_DEG = 120.0
"""A face ends where it turns by more."""
MIN_FLAT_COS = 0.7
"""Mean cosine to its shortest axis from which on a wall is a plate, without an outer side [-]."""
MIN_FLAW_COS, MAX_FLAW_TRIANGLES = 0.5, 20
"""Triangles between those of a face belong to it at this cosine to them or more; width of such flaws, at most."""
MIN_FACE_AREA_THICKNESSES2 = 4.0
"""Smaller faces are parts of rims; in median thicknesses squared."""
MIN_NEW_FACE_FRACTION = 0.5
"""Share of a face that lies opposite to no other, from which on it stands for a wall."""


@dataclass(frozen=True)
class WallThickness:
    """How far the other face is behind each triangle."""

    through: Float[np.ndarray, " T"]
    """[m]; inf: nothing."""
    opposite: Int[np.ndarray, " T"]
    """The triangle there; -1: none."""
    facing: Bool[np.ndarray, " T"]
    """Whether the two look away from one another."""
    median: float
    """Of those that do, by area [m]; inf: none does."""


def measure_walls(mesh: Mesh, shape: QueryMesh) -> WallThickness:
    """Measure straight down from the middle of each triangle.

    Args:
        mesh: Its triangles.
        shape: What is met.
    """
    normals = mesh.normals
    start = mesh.corners.mean(axis=1) - 1e-6 * shape.mesh.extent * normals
    through = shape.reach(start, -normals) + 1e-6 * shape.mesh.extent
    opposite = np.where(np.isfinite(through), shape.hit(start, -normals), -1)
    cosine = np.einsum("ij,ij->i", normals, shape.mesh.normals[opposite])
    facing = (opposite >= 0) & (cosine < MAX_FACING_COS)
    if not facing.any():
        return WallThickness(through, opposite, facing, np.inf)
    order = np.argsort(through[facing])
    area = np.cumsum(mesh.areas[facing][order])
    median = float(through[facing][order][np.searchsorted(area, 0.5 * area[-1])])
    return WallThickness(through, opposite, facing, median)


def wall_base_faces(source: FeaturePatches, walls: WallThickness) -> list[Int[np.ndarray, " K"]]:
    """Return one face of each wall as numbers of triangles; edges of walls belong to none.

    Faces end at hollow creases. The largest comes first, and what lies opposite to it stands for no wall of its own: of
    a cup the outside, of a shelf its frame's outside and one face of each board.

    Args:
        source: A closed mesh, normals outward, finer than its walls are wide.
        walls: Measured of its triangles against themselves.
    """
    mesh = source.mesh
    face = walls.facing & (walls.through < MAX_WALL_MEDIAN_RATIO * walls.median)
    edges = _manifold_edges(mesh)
    face = _grown_faces(source, face, RIM_REACH_THICKNESSES * walls.median)
    label = _connected_faces(mesh, face, edges)
    label = _with_enclosed_triangles(mesh, _split_wrapped_faces(mesh, label, walls), edges)
    areas = mesh.areas
    size = np.bincount(label[label >= 0], areas[label >= 0])
    smallest = MIN_FACE_AREA_THICKNESSES2 * walls.median**2
    covered, chosen = np.zeros(len(label), dtype=bool), []
    taken = np.zeros(len(label), dtype=bool)
    for number in np.argsort(-size, kind="stable"):
        own = label == number
        hidden = own & (covered | ((walls.opposite >= 0) & taken[walls.opposite]))
        if areas[own & ~hidden].sum() < max(MIN_NEW_FACE_FRACTION * size[number], smallest):
            continue
        taken |= own
        behind = walls.opposite[own & walls.facing]
        covered[behind[behind >= 0]] = True
        chosen.append(np.flatnonzero(own))
    return chosen


@dataclass(frozen=True)
class _ManifoldEdges:
    """Edges of two triangles: the triangles, the angle by which they turn [deg] (positive: hollow)."""

    one: Int[np.ndarray, " E"]
    other: Int[np.ndarray, " E"]
    turn: Float[np.ndarray, " E"]


def _manifold_edges(mesh: Mesh) -> _ManifoldEdges:
    _, number, count = unique_edges(mesh.triangles)
    order = np.argsort(number.ravel(), kind="stable")
    first = np.concatenate([[0], np.cumsum(count)[:-1]])[count == 2]
    one, other = order[first] // 3, order[first + 1] // 3
    normals = mesh.normals
    cosine = np.einsum("ij,ij->i", normals[one], normals[other]).clip(-1, 1)
    towards = mesh.corners[other].mean(axis=1) - mesh.corners[one].mean(axis=1)
    hollow = np.einsum("ij,ij->i", towards, normals[one] - normals[other]) > 0
    return _ManifoldEdges(one, other, np.degrees(np.arccos(cosine)) * np.where(hollow, 1, -1))


def _grown_faces(source: FeaturePatches, face: Bool[np.ndarray, " T"], reach: float) -> Bool[np.ndarray, " T"]:
    """Add triangles within reach that look the same way: behind them, at an outer corner, is the wall beside."""
    mesh, patch = source.mesh, source.patch
    asked = np.flatnonzero(~face & np.isin(patch, patch[face]))
    base = FeaturePatches(mesh.only(face), patch[face], source.corner)
    centres = mesh.corners[asked].mean(axis=1)
    foot, nearest = PatchProjection(base).onto_patches(centres, patch[asked])
    same = np.einsum("ij,ij->i", base.mesh.normals[nearest], mesh.normals[asked]) > SAME_FACE_COS
    grown = face.copy()
    grown[asked[same & (np.linalg.norm(foot - centres, axis=1) < reach)]] = True
    return grown


def _connected_faces(mesh: Mesh, face: Bool[np.ndarray, " T"], edges: _ManifoldEdges) -> Int[np.ndarray, " T"]:
    """Return the number of each triangle's face; -1: edge of a wall."""
    link = face[edges.one] & face[edges.other] & (edges.turn < REMESH_CREASE_ANGLE_DEG)
    link &= edges.turn > -MAX_CONVEX_TURN_DEG
    graph = coo_matrix((np.ones(int(link.sum())), (edges.one[link], edges.other[link])), shape=(len(face),) * 2)
    label = np.where(face, connected_components(graph, directed=False)[1], -1)
    label[face] = np.unique(label[face], return_inverse=True)[1].reshape(-1)
    return label


def _with_enclosed_triangles(mesh: Mesh, label: Int[np.ndarray, " T"], edges: _ManifoldEdges) -> Int[np.ndarray, " T"]:
    """Add triangles that have two neighbours of one face and do not look away from them: flaws of a scan."""
    normals = mesh.normals
    alike = np.einsum("ij,ij->i", normals[edges.one], normals[edges.other]) > MIN_FLAW_COS
    pairs = np.column_stack([edges.one, edges.other])[alike]
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    for _ in range(MAX_FLAW_TRIANGLES):
        some = pairs[(label[pairs[:, 0]] < 0) & (label[pairs[:, 1]] >= 0)]
        asked, count = np.unique(np.column_stack([some[:, 0], label[some[:, 1]]]), axis=0, return_counts=True)
        if not (count >= 2).any():
            break
        label[asked[count >= 2, 0]] = asked[count >= 2, 1]
    return label


def _split_wrapped_faces(mesh: Mesh, label: Int[np.ndarray, " T"], walls: WallThickness) -> Int[np.ndarray, " T"]:
    """Divide a face that lies opposite to itself: its outer side, and the rest."""
    own = (label >= 0) & (walls.opposite >= 0)
    own[own] = label[own] == label[walls.opposite[own]]
    areas = mesh.areas
    for number in range(label.max(initial=-1) + 1):
        mine = label == number
        if areas[own & mine].sum() < 0.3 * areas[mine].sum():
            continue
        side = _outer_side(mesh.only(mine))
        label[np.flatnonzero(mine)[~side]] = label.max() + 1
    return label


def _outer_side(face: Mesh) -> Bool[np.ndarray, " T"]:
    """Return the outer triangles of a wall, or the upper ones of what is flat."""
    _, _, axes = np.linalg.svd(face.corners.mean(axis=1) - face.corners.mean(axis=(0, 1)), full_matrices=False)
    upward = face.normals @ axes[2]
    if np.average(np.abs(upward), weights=face.areas) > MIN_FLAT_COS:
        return upward > 0
    return outer_wall_side(QueryMesh(face))

"""Enclosing convex hulls of few corners: some engines take no more than 64."""

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull, HalfspaceIntersection

from corporeal.geometry.convex_hull import ConvexPiece

SAME_PLANE_TOLERANCE = 1e-6
"""Of the largest side: planes, and corners, nearer than this are one."""


def simplify_convex(hull: ConvexPiece, most: int) -> ConvexPiece:
    """Enclose a convex body in one of at most so many corners.

    The body stays inside: what is left of it is cut from its upright box by planes of its own
    faces, always the one that the farthest corner is most beyond. So it stands on the same floor
    and against the same walls, and large flat faces stay exactly where they were.

    Args:
        hull: What.
        most: Number of corners, at least 8.

    """
    if len(hull.vertices) <= most:
        return hull
    middle = hull.vertices.mean(axis=0)
    points = hull.vertices - middle
    size = float(np.ptp(points, axis=0).max())
    faces = _distinct_planes(ConvexHull(points).equations, size)
    cut = _box_planes(points)
    corners = _plane_corners(cut, size)
    while True:
        beyond = corners @ faces[:, :3].T + faces[:, 3]
        worst = int(beyond[int(beyond.max(axis=1).argmax())].argmax())
        if beyond.max() < SAME_PLANE_TOLERANCE * size:
            break
        further = np.concatenate([cut, faces[worst : worst + 1]])
        found = _plane_corners(further, size)
        if len(found) > most:
            break
        cut, corners = further, found
    return _piece_of_corners(corners + middle)


def _box_planes(points: Float[np.ndarray, "V 3"]) -> Float[np.ndarray, "6 4"]:
    """Return the planes of the upright box about points: n · x + d ≤ 0 inside."""
    normals = np.concatenate([np.eye(3), -np.eye(3)])
    return np.column_stack([normals, -(points @ normals.T).max(axis=0)])


def _distinct_planes(equations: np.ndarray, size: float) -> np.ndarray:
    """Keep each plane once; triangles of one flat face have the same."""
    step = SAME_PLANE_TOLERANCE * np.array([1.0, 1.0, 1.0, size])
    _, first = np.unique(np.round(equations / step), axis=0, return_index=True)
    return equations[np.sort(first)]


def _plane_corners(planes: np.ndarray, size: float) -> np.ndarray:
    found = HalfspaceIntersection(planes, np.zeros(3)).intersections
    _, first = np.unique(np.round(found / (SAME_PLANE_TOLERANCE * size)), axis=0, return_index=True)
    return found[np.sort(first)]


def _piece_of_corners(corners: np.ndarray) -> ConvexPiece:
    hull = ConvexHull(corners)
    triangles = hull.simplices.copy()
    a, b, c = np.swapaxes(corners[triangles], 0, 1)
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    used, number = np.unique(triangles, return_inverse=True)
    return ConvexPiece(corners[used], number.reshape(-1, 3).astype(np.int64))

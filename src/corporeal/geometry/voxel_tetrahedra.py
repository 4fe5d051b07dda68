"""Tetrahedral mesh of the volume filled by points: grid cells cut into six tetrahedra (Kuhn 1960).

All cells are cut alike, along the diagonal from (0, 0, 0) to (1, 1, 1), so that neighbours share
whole faces.
"""

from itertools import permutations

import numpy as np
from jaxtyping import Float, Int

CELL_CORNERS = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)])


def _kuhn_tetrahedra() -> np.ndarray:
    """Corner numbers of the six tetrahedra of a cell, all of positive volume."""
    found = []
    for order in permutations((1, 2, 4)):
        path = np.cumsum([0, *order])
        a, b, c, d = CELL_CORNERS[path]
        positive = np.dot(np.cross(b - a, c - a), d - a) > 0
        found.append(path if positive else path[[0, 2, 1, 3]])
    return np.array(found)


KUHN_TETRAHEDRA = _kuhn_tetrahedra()


def voxel_tetrahedra(
    points: Float[np.ndarray, "P 3"], side: float
) -> tuple[Float[np.ndarray, "V 3"], Int[np.ndarray, "T 4"]]:
    """Cut the cells that hold points into tetrahedra.

    Args:
        points: [m]
        side: Of a cell [m].

    Returns:
        Vertices [m], and four vertex numbers a tetrahedron: (b - a) × (c - a) · (d - a) > 0.

    """
    low = points.min(axis=0) - 1e-3 * side
    cell = np.unique(np.floor((points - low) / side).astype(np.int64), axis=0)
    corners, number = np.unique(
        (cell[:, None] + CELL_CORNERS).reshape(-1, 3), axis=0, return_inverse=True
    )
    return low + side * corners, number.reshape(-1, 8)[:, KUHN_TETRAHEDRA].reshape(-1, 4)


def tetrahedra_outer_faces(corners: Int[np.ndarray, "T 4"]) -> Int[np.ndarray, "F 3"]:
    """Return the faces that belong to one tetrahedron only, anticlockwise seen from outside."""
    faces = corners[:, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]].reshape(-1, 3)
    _, first, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
    )
    return faces[np.sort(first[count == 1])]

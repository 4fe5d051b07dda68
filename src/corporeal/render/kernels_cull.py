"""Which tiles of a picture could show a surface: loops compiled by numba."""

import numba
import numpy as np

from corporeal.render.kernels_floor import TILE_PX
from corporeal.render.kernels_hits import JIT, LOOP

MIN_DEPTH_RATIO = 1e-3
"""Of its distance: how far a corner must be before the eye to be placed in the picture."""


@numba.njit(**JIT)
def mark_outlined_tiles(vertices, triangles, eye, frame, tangent, size, out):
    """Mark the tiles that a triangle's outline in the picture reaches, or is a pixel away from.

    Args:
        vertices: Of all triangles (V, 3) [m].
        triangles: Their numbers (T, 3).
        eye: Where from [m].
        frame: Right, up and back of the camera, as rows.
        tangent: Of half the vertical field of view.
        size: Width and height of the picture [px].
        out: Marks (rows, columns) of tiles; all of them where a triangle begins behind the eye.

    """
    row, column = np.empty(len(vertices)), np.empty(len(vertices))
    ahead = np.empty(len(vertices), np.bool_)
    _project_vertices(vertices, eye, frame, tangent, size, row, column, ahead)
    _mark_triangle_tiles(triangles, row, column, ahead, size, out)


@numba.njit(**LOOP)
def _project_vertices(vertices, eye, frame, tangent, size, row, column, ahead):
    """Find where each vertex is seen [px], and whether it is before the eye."""
    width, height = size
    for k in range(len(vertices)):
        right = up = depth = square = 0.0
        for a in range(3):
            way = vertices[k, a] - eye[a]
            right += frame[0, a] * way
            up += frame[1, a] * way
            depth -= frame[2, a] * way
            square += way * way
        ahead[k] = depth > MIN_DEPTH_RATIO * np.sqrt(square)
        if ahead[k]:
            row[k] = (1 - up / depth / tangent) * height / 2
            column[k] = (1 + right / depth / tangent * height / width) * width / 2


@numba.njit(**LOOP)
def _mark_triangle_tiles(triangles, row, column, ahead, size, out):
    width, height = size
    for k in range(len(triangles)):
        a, b, c = triangles[k, 0], triangles[k, 1], triangles[k, 2]
        if not (ahead[a] and ahead[b] and ahead[c]):
            for i in range(len(out)):
                for j in range(out.shape[1]):
                    out[i, j] = True
            return
        top = min(min(row[a], row[b]), row[c]) - 1
        bottom = max(max(row[a], row[b]), row[c]) + 1
        left = min(min(column[a], column[b]), column[c]) - 1
        right = max(max(column[a], column[b]), column[c]) + 1
        if bottom < 0 or right < 0 or top >= height or left >= width:
            continue
        for i in range(int(max(top, 0)) // TILE_PX, int(min(bottom, height - 1)) // TILE_PX + 1):
            for j in range(int(max(left, 0)) // TILE_PX, int(min(right, width - 1)) // TILE_PX + 1):
                out[i, j] = True

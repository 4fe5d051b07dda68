"""Pixels whose rays miss a grid, and cells in such pixels. Compiled by numba."""

import numba
import numpy as np

from corporeal.reconstruction.gaussians.kernels_camera import from_camera, project_to_pixel
from corporeal.reconstruction.gaussians.kernels_harmonics import JIT_OPTIONS

RAY_STEP_CELLS = 0.5
"""Between places on a ray that are looked at [cells]."""
PARALLEL_RAY_SLOPE = 1e-12
"""A ray that turns less to an axis stays in one layer of cells."""


@numba.njit(**JIT_OPTIONS)
def mark_unmet_pixels(first, last, grid, cameras, mine, field, out):
    """Fill out (V, H, W), views first to last: an object's pixels whose rays meet nothing.

    grid: low corner's middle (3) and cell (1) [m]; cameras (V, 18): ``DepthRendering.rows``;
    mine (V, H, W): pixels that show the object; field (X, Y, Z): negative where something is.
    A ray that misses the grid meets nothing that the grid could have, and lacks nothing.
    """
    eye, way = np.empty(3), np.empty(3)
    for v in range(first, last):
        c = cameras[v]
        for a in range(3):
            away = c[a] * c[3] + c[4 + a] * c[7] + c[8 + a] * c[11]
            eye[a] = (-away - grid[a]) / grid[3] + 0.5
        for y in range(mine.shape[1]):
            for x in range(mine.shape[2]):
                out[v, y, x] = False
                if mine[v, y, x]:
                    right, down = (x + 0.5 - c[14]) / c[12], (y + 0.5 - c[15]) / c[13]
                    for a in range(3):
                        way[a] = c[a] * right + c[4 + a] * down + c[8 + a]
                    way /= np.sqrt((way * way).sum())
                    out[v, y, x] = _ray_meets_nothing(eye, way, field)


@numba.njit(**JIT_OPTIONS)
def _ray_meets_nothing(eye, way, field):
    """Whether a ray goes through a grid and meets nothing. eye: [cells], way: of length 1."""
    begin, end = 0.0, np.inf
    for a in range(3):
        if abs(way[a]) < PARALLEL_RAY_SLOPE:
            if not 0 <= eye[a] < field.shape[a]:
                return False
            continue
        one, two = -eye[a] / way[a], (field.shape[a] - eye[a]) / way[a]
        begin, end = max(begin, min(one, two)), min(end, max(one, two))
    if begin >= end:
        return False
    t = begin + 0.5 * RAY_STEP_CELLS
    while t < end:
        i, j, k = int(eye[0] + t * way[0]), int(eye[1] + t * way[1]), int(eye[2] + t * way[2])
        i, j = min(max(i, 0), field.shape[0] - 1), min(max(j, 0), field.shape[1] - 1)
        if field[i, j, min(max(k, 0), field.shape[2] - 1)] < 0:
            return False
        t += RAY_STEP_CELLS
    return True


@numba.njit(**JIT_OPTIONS)
def count_lacking_views(first, last, places, cameras, lacks, out):
    """Count for places (N, 3) [m], first to last, views that lack something there, and that look.

    lacks (V, H, W): as ``mark_unmet_pixels`` fills it; out (N, 2).
    """
    for n in range(first, last):
        out[n] = 0
        for v in range(len(cameras)):
            c = cameras[v]
            right, down, ahead = from_camera(c, places[n, 0], places[n, 1], places[n, 2])
            if not ahead > 0:
                continue
            u, w = project_to_pixel(c, right, down, ahead)
            if 0 <= u < c[16] and 0 <= w < c[17]:
                out[n, 0] += lacks[v, int(w), int(u)]
                out[n, 1] += 1

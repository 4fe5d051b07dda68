"""Outlines of objects in pictures and of surfaces, pixel by pixel. Compiled by numba."""

import numba
import numpy as np

from corporeal.reconstruction.gaussians.kernels_harmonics import JIT_OPTIONS
from corporeal.reconstruction.gaussians.kernels_project import from_camera, project_to_pixel

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


@numba.njit(**JIT_OPTIONS)
def _nearest_other_pixel(inside, y, x, reach):
    """Return the row and column of the nearest pixel of the other kind; -1 where none is near."""
    height, width = inside.shape
    own, best, row, column = inside[y, x], reach * reach + 1, -1, -1
    for j in range(max(0, y - reach), min(height, y + reach + 1)):
        for i in range(max(0, x - reach), min(width, x + reach + 1)):
            apart = (j - y) * (j - y) + (i - x) * (i - x)
            if inside[j, i] != own and apart < best:
                best, row, column = apart, j, i
    return row, column


@numba.njit(**JIT_OPTIONS)
def outline_distance(first, last, inside, depths, margin, reach, out):
    """Fill out (V, H, W) with the distance to an object's outline [px], negative inside.

    inside (V, H, W): pixels on the object; depths (V, H, W): of what is seen [m]. nan farther than reach [px], and
    where what is outside is not farther away by margin [m]: there something hides the object, or touches it.
    """
    _, height, width = inside.shape
    for v in range(first, last):
        for y in range(height):
            for x in range(width):
                out[v, y, x] = np.nan
                j, i = _nearest_other_pixel(inside[v], y, x, reach)
                if j < 0:
                    continue
                far = np.sqrt(float((j - y) ** 2 + (i - x) ** 2)) - 0.5
                if inside[v, y, x]:
                    near, behind = depths[v, y, x], depths[v, j, i]
                else:
                    y2, x2 = _nearest_other_pixel(inside[v], j, i, reach)
                    near, behind = depths[v, j, i], depths[v, y2, x2]
                if behind > near + margin:
                    out[v, y, x] = -far if inside[v, y, x] else far


@numba.njit(**JIT_OPTIONS)
def _edge_side(ax, ay, bx, by, px, py):
    return (bx - ax) * (py - ay) - (by - ay) * (px - ax)


@numba.njit(**JIT_OPTIONS)
def _rasterise_mask(seen, triangles, mask):
    """Mark the pixels whose middles any triangle covers; seen (N, 3): u, v, depth."""
    height, width = mask.shape
    for t in range(len(triangles)):
        a, b, c = seen[triangles[t, 0]], seen[triangles[t, 1]], seen[triangles[t, 2]]
        if a[2] <= 0 or b[2] <= 0 or c[2] <= 0:
            continue
        left = max(0, int(np.ceil(min(a[0], b[0], c[0]) - 0.5)))
        right = min(width - 1, int(np.floor(max(a[0], b[0], c[0]) - 0.5)))
        low = max(0, int(np.ceil(min(a[1], b[1], c[1]) - 0.5)))
        high = min(height - 1, int(np.floor(max(a[1], b[1], c[1]) - 0.5)))
        for y in range(low, high + 1):
            for x in range(left, right + 1):
                if mask[y, x]:
                    continue
                u, v = x + 0.5, y + 0.5
                one = _edge_side(a[0], a[1], b[0], b[1], u, v)
                two = _edge_side(b[0], b[1], c[0], c[1], u, v)
                three = _edge_side(c[0], c[1], a[0], a[1], u, v)
                mask[y, x] = (one >= 0) == (two >= 0) == (three >= 0)


@numba.njit(**JIT_OPTIONS)
def rasterise_views(first, last, vertices, triangles, cameras, out):
    """Mark in out (V, H, W), views first to last, the pixels that triangles (T, 3) cover.

    vertices (N, 3) [m]; cameras (V, 18): ``DepthRendering.rows``.
    """
    seen = np.empty((len(vertices), 3))
    for view in range(first, last):
        _project(vertices, cameras[view], seen)
        _rasterise_mask(seen, triangles, out[view])


@numba.njit(**JIT_OPTIONS)
def _project(vertices, c, seen):
    """Fill seen (N, 3) with where a camera sees vertices: u, v [px], and depth [m]."""
    for n in range(len(vertices)):
        right, down, ahead = from_camera(c, vertices[n, 0], vertices[n, 1], vertices[n, 2])
        seen[n, 2] = ahead
        if ahead > 0:
            seen[n, 0], seen[n, 1] = project_to_pixel(c, right, down, ahead)


@numba.njit(**JIT_OPTIONS)
def outline_error(first, last, vertices, triangles, normals, cameras, outlines, rule, out):
    """Fill out (V, N) with how far a surface's outline is inside the pictures' [m] at vertices.

    Negative: outside; nan: the vertex is not on the outline. outlines: as ``outline_distance`` fills them;
    rule: greatest cosine between normal and view on an outline, reach [px], and how near to its outline what is on it
    lies [px].
    """
    _, height, width = outlines.shape
    count, steep, reach, edge = len(vertices), rule[0], int(rule[1]), rule[2]
    seen = np.empty((count, 3))
    for view in range(first, last):
        c = cameras[view]
        _project(vertices, c, seen)
        mask = np.zeros((height, width), np.bool_)
        _rasterise_mask(seen, triangles, mask)
        for n in range(count):
            out[view, n] = np.nan
            u, v, ahead = seen[n]
            if not ahead > 0 or not (0 <= u < c[16] and 0 <= v < c[17]):
                continue
            x, y = int(u), int(v)
            wanted = outlines[view, y, x]
            if np.isnan(wanted):
                continue
            across = (u - c[14]) / c[12], (v - c[15]) / c[13]
            along, length = 0.0, np.sqrt(across[0] ** 2 + across[1] ** 2 + 1)
            for a in range(3):
                ray = c[a] * across[0] + c[4 + a] * across[1] + c[8 + a]
                along += normals[n, a] * ray / length
            if abs(along) > steep:
                continue
            j, i = _nearest_other_pixel(mask, y, x, reach)
            if j < 0:
                continue
            far = np.sqrt(float((j - y) ** 2 + (i - x) ** 2)) - 0.5
            has = -far if mask[y, x] else far
            if abs(has) > edge:
                continue
            out[view, n] = (has - wanted) * ahead / c[12]

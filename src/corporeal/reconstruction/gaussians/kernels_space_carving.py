"""Occlusion by Gaussians, and space carving. Compiled by numba."""

import numba
import numpy as np

from corporeal.reconstruction.gaussians.kernels_blend import (
    MIN_ALPHA,
    RASTER_TILE_PX,
    _alpha,
    _tile_columns,
    _tile_rows,
)
from corporeal.reconstruction.gaussians.kernels_harmonics import JIT_OPTIONS
from corporeal.reconstruction.gaussians.kernels_project import (
    COL_A,
    COL_B,
    COL_C,
    COL_DEPTH,
    COL_EXTENT,
    COL_OPACITY,
    DILATION_PX2,
    from_camera,
    project_to_pixel,
)

f4 = np.float32
SURFACE_TRANSMITTANCE = f4(0.85)
"""Transmittance at which a ray has met a surface. Learned Gaussians lie in a layer, and where half of the light is lost
is already below what is seen."""
MAX_OBJECT_TRANSMITTANCE = f4(0.5)
"""A pixel that lets more light through shows no object."""
MAX_MEETING_SIGMAS = 3.0
"""Nothing of a Gaussian is met farther from its mean, in standard deviations along the view."""
OVERRELAXATION_FACTOR = 1.6
"""Factor of successive overrelaxation."""


@numba.njit(**JIT_OPTIONS)
def depth_slopes(first, last, mean, spread, ellipses, camera, out):
    """Fill out[first:last] (N, 4): how the depth of a Gaussian's densest point changes with pixels.

    In the affine approximation of the projection (u, v, z) is Gaussian, and z given (u, v) has the mean z_0 + Σ_z,uv
    Σ_uv^-1 (u - u_0, v - v_0): two slopes. Then how far from z_0 that may be, and how far before it the Gaussian
    begins: one standard deviation of z given (u, v).

    mean (N, 3) and covariance (N, 3, 3) [m], ellipses as drawn: of others nothing is filled in.
    """
    W = camera.turn
    T, S, half = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for i in range(first, last):
        if not ellipses[i, COL_EXTENT] > 0:
            continue
        x, y, z = camera.shift
        for k in range(3):
            x += W[0, k] * mean[i, k]
            y += W[1, k] * mean[i, k]
            z += W[2, k] * mean[i, k]
        for k in range(3):
            T[0, k] = camera.fx / z * (W[0, k] - x / z * W[2, k])
            T[1, k] = camera.fy / z * (W[1, k] - y / z * W[2, k])
            T[2, k] = W[2, k]
        for r in range(3):
            for k in range(3):
                half[k] = 0.0
                for q in range(3):
                    half[k] += T[r, q] * spread[i, q, k]
            for c in range(3):
                S[r, c] = half[0] * T[c, 0] + half[1] * T[c, 1] + half[2] * T[c, 2]
        flat = S[0, 0] * S[1, 1] - S[0, 1] * S[0, 1]
        whole = S[2, 2] * flat - S[1, 2] * (S[0, 0] * S[1, 2] - S[0, 1] * S[0, 2])
        whole += S[0, 2] * (S[0, 1] * S[1, 2] - S[1, 1] * S[0, 2])
        a, b, c = S[0, 0] + DILATION_PX2, S[0, 1], S[1, 1] + DILATION_PX2
        det = a * c - b * b
        out[i, 0] = (c * S[0, 2] - b * S[1, 2]) / det
        out[i, 1] = (a * S[1, 2] - b * S[0, 2]) / det
        out[i, 2] = MAX_MEETING_SIGMAS * np.sqrt(S[2, 2])
        # The dilation of pictures makes nothing thicker.
        out[i, 3] = np.sqrt(max(whole / max(flat, 1e-30), 0.0))


@numba.njit(**JIT_OPTIONS)
def meet_surfaces(tiles, first, ids, ellipses, slopes, depth, far, met):
    """Find where the ray of each pixel has lost some of its light, half of it, and to whom.

    depth and far (H, W) stay inf and met (H, W) stays -1 where half of the light gets through.

    slopes (N, 4): how the depth of a Gaussian's densest point along a ray changes with the pixel, along u and v [m/px],
    by how much at most, and how far before it the Gaussian begins [m].
    """
    height, width = depth.shape
    across = (width + RASTER_TILE_PX - 1) // RASTER_TILE_PX
    T = np.empty((RASTER_TILE_PX, RASTER_TILE_PX), np.float32)
    for t in tiles:
        y0, x0 = t // across * RASTER_TILE_PX, t % across * RASTER_TILE_PX
        T[:] = 1
        left = min(RASTER_TILE_PX, height - y0) * min(RASTER_TILE_PX, width - x0)
        for k in range(first[t], first[t + 1]):
            if left == 0:
                break
            i = ids[k]
            e, s_ = ellipses[i], slopes[i]
            mx, begin, end = _tile_columns(e, x0, width)
            my, low, high = _tile_rows(e, y0)
            a, b, c = f4(0.5) * e[COL_A], e[COL_B], f4(0.5) * e[COL_C]
            for y in range(low, min(high, height - y0)):
                dy = f4(y) - my
                for x in range(begin, end):
                    before = T[y, x]
                    if before <= MAX_OBJECT_TRANSMITTANCE:
                        continue
                    dx = f4(x) - mx
                    alpha = _alpha(e[COL_OPACITY], c * dy * dy + dx * (b * dy + a * dx))
                    if alpha < MIN_ALPHA:
                        continue
                    T[y, x] = before * (f4(1) - alpha)
                    left -= T[y, x] <= MAX_OBJECT_TRANSMITTANCE
                    if (before > SURFACE_TRANSMITTANCE and T[y, x] <= SURFACE_TRANSMITTANCE) or T[
                        y, x
                    ] <= MAX_OBJECT_TRANSMITTANCE:
                        off = s_[0] * dx + s_[1] * dy
                        off = min(max(off, -s_[2]), s_[2])
                        if before > SURFACE_TRANSMITTANCE:
                            depth[y0 + y, x0 + x] = e[COL_DEPTH] + off - s_[3]
                        if T[y, x] <= MAX_OBJECT_TRANSMITTANCE:
                            far[y0 + y, x0 + x] = e[COL_DEPTH] + off + s_[3]
                            met[y0 + y, x0 + x] = i
        for y in range(min(RASTER_TILE_PX, height - y0)):
            for x in range(min(RASTER_TILE_PX, width - x0)):
                if T[y, x] > MAX_OBJECT_TRANSMITTANCE:
                    depth[y0 + y, x0 + x] = np.inf


@numba.njit(**JIT_OPTIONS)
def carve_grid(first, last, grid, cameras, depths, rule, out):
    """Fill out[first:last] of a grid (X, Y, Z): signed distance to what is seen [m], + outside.

    grid: low corner's middle (3) and cell (1) [m]; cameras (V, 18): ``DepthRendering.rows``;
    depths (V, H, W) [m], where there is nothing minus the pixels to where there is. rule: reach of
    distances [m], share of the views that see a cell which may take it for emptier than the
    others do, and how many must. A cell that too few see is nan.
    """
    views = len(depths)
    _, ny, nz = out.shape
    reach, share, need = rule[0], rule[1], int(rule[2])
    found = np.empty(views, np.float32)
    for i in range(first, last):
        x = grid[0] + i * grid[3]
        for j in range(ny):
            y = grid[1] + j * grid[3]
            for k in range(nz):
                z = grid[2] + k * grid[3]
                n, free = 0, 0
                for v in range(views):
                    c = cameras[v]
                    right, down, ahead = from_camera(c, x, y, z)
                    if not ahead > 0:
                        continue
                    u, w = project_to_pixel(c, right, down, ahead)
                    if not (0 <= u < c[16] and 0 <= w < c[17]):
                        continue
                    depth = depths[v, int(w), int(u)]
                    off = depth - ahead if depth > 0 else -depth * ahead / c[12]
                    if off < -reach:
                        continue
                    found[n] = min(off, reach)
                    n += 1
                    free += off >= reach
                    if free > need and free > share * views:
                        break
                if n < need:
                    out[i, j, k] = np.nan
                    continue
                place = max(need - 1, int(share * n))
                if free > place:
                    out[i, j, k] = reach
                    continue
                out[i, j, k] = _kth_largest(found, n, place)


@numba.njit(**JIT_OPTIONS)
def mark_hidden_cells(first, last, grid, cameras, field, crust, need, out):
    """Fill out[first:last] of a grid (X, Y, Z): whether a free place is hidden by what is not free.

    That is: fewer than ``need`` cameras look at it through no more than ``crust`` such cells.
    field: as ``carve_grid`` fills it, where nan is not free; grid and cameras as there.
    """
    for i in range(first, last):
        for j in range(field.shape[1]):
            for k in range(field.shape[2]):
                out[i, j, k] = False
                if field[i, j, k] > 0:
                    looks = 0
                    for v in range(len(cameras)):
                        looks += _camera_sees_into(cameras[v], grid, field, i, j, k, crust)
                        if looks >= need:
                            break
                    out[i, j, k] = looks < need


@numba.njit(**JIT_OPTIONS)
def _camera_sees_into(c, grid, field, i, j, k, crust):
    """Whether no more than ``crust`` cells that are not free are between a camera and a cell."""
    nx, ny, nz = field.shape
    x, y, z = grid[0] + i * grid[3], grid[1] + j * grid[3], grid[2] + k * grid[3]
    right, down, ahead = from_camera(c, x, y, z)
    if not ahead > 0:
        return False
    u, w = project_to_pixel(c, right, down, ahead)
    if not (0 <= u < c[16] and 0 <= w < c[17]):
        return False
    far = np.sqrt(right * right + down * down + ahead * ahead)
    dx = -(c[0] * right + c[4] * down + c[8] * ahead) / far
    dy = -(c[1] * right + c[5] * down + c[9] * ahead) / far
    dz = -(c[2] * right + c[6] * down + c[10] * ahead) / far
    x, y, z, met = i + 0.5, j + 0.5, k + 0.5, 0
    while met <= crust:
        x, y, z = x + dx, y + dy, z + dz
        if not (0 <= x < nx and 0 <= y < ny and 0 <= z < nz):
            return True
        met += not field[int(x), int(y), int(z)] > 0
    return False


@numba.njit(**JIT_OPTIONS)
def _kth_largest(values, count, place):
    """Return the value with so many larger ones, by quickselect; values are put out of order."""
    low, high = 0, count - 1
    while low < high:
        pivot = values[(low + high) // 2]
        i, j = low, high
        while i <= j:
            while values[i] > pivot:
                i += 1
            while values[j] < pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if place <= j:
            high = j
        elif place >= i:
            low = i
        else:
            break
    return values[place]


@numba.njit(**JIT_OPTIONS)
def relax_unknown_cells(field, unknown, rounds):
    """Make the unknown cells of field (X, Y, Z) the mean of their neighbours that are numbers."""
    shape = np.array(field.shape)
    at = np.empty(3, np.int64)
    for _ in range(rounds):
        for row in range(len(unknown)):
            i, j, k = unknown[row]
            total, n = f4(0), 0
            for side in range(6):
                at[0], at[1], at[2] = i, j, k
                at[side // 2] += 2 * (side % 2) - 1
                if not 0 <= at[side // 2] < shape[side // 2]:
                    continue
                value = field[at[0], at[1], at[2]]
                if not np.isnan(value):
                    total += value
                    n += 1
            if n:
                field[i, j, k] += f4(OVERRELAXATION_FACTOR) * (total / n - field[i, j, k])


@numba.njit(**JIT_OPTIONS)
def paint_points(first, last, points, normals, cameras, depths, pictures, reach, out):
    """Sum what the views see of points first to last: out (N, 4): red, green, blue, weight.

    A view counts by the square of the cosine at which it sees the surface, and only where nothing nearer than reach [m]
    is before the point.
    """
    for i in range(first, last):
        out[i] = 0
        for v in range(len(depths)):
            c = cameras[v]
            right, down, ahead = from_camera(c, points[i, 0], points[i, 1], points[i, 2])
            if not ahead > 0:
                continue
            u, w = project_to_pixel(c, right, down, ahead)
            if not (0 <= u < c[16] and 0 <= w < c[17]):
                continue
            if abs(depths[v, int(w), int(u)] - ahead) > reach:
                continue
            towards = 0.0
            for b in range(3):
                back = c[b] * right + c[4 + b] * down + c[8 + b] * ahead
                towards -= normals[i, b] * back
            if towards <= 0:
                continue
            weight = towards * towards / (right * right + down * down + ahead * ahead)
            out[i, 3] += weight
            for q in range(3):
                out[i, q] += weight * pictures[v, int(w), int(u), q]

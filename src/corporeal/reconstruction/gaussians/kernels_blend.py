"""Tile-based blending of ellipses, with gradients. Loops compiled by numba.

Within a tile of 16 × 16 pixels the outer loop goes over ellipses from front to back and the inner
one along rows of pixels, which the compiler turns into vector instructions. Per pixel, with
α_i = min(o_i exp(-s_i), 0.99) and T_i = Π_{j<i} (1 - α_j):

    colour = Σ T_i α_i c_i + T background

Gradients are found from front to back too, so that no list per pixel is kept: with g = dL/dcolour, G = g · colour and
A_i = Σ_{j≤i} T_j α_j g · c_j,

    dL/dα_i = T_i g · c_i - (G - A_i) / (1 - α_i)
"""

import numba
import numpy as np

from corporeal.reconstruction.gaussians.kernels_harmonics import JIT_OPTIONS
from corporeal.reconstruction.gaussians.kernels_project import (
    COL_A,
    COL_B,
    COL_C,
    COL_DEPTH,
    COL_EXTENT,
    COL_OPACITY,
    COL_RED,
    COL_U,
    COL_V,
    MIN_DRAWN_OPACITY,
)

f4 = np.float32
RASTER_TILE_PX = 16
"""Pixels along a tile: half as many are half as fast."""
MIN_ALPHA = f4(MIN_DRAWN_OPACITY)
MAX_ALPHA = f4(0.99)
"""No α is more, so that 1 - α can be divided by."""
MIN_TRANSMITTANCE = f4(1e-4)
"""Behind less transmittance than this nothing is drawn."""
MAX_EXPONENT = f4(6)
"""exp(-6) is less than 1/255."""
ELLIPSES_PER_FULL_CHECK = 16
"""Ellipses between looks whether the tile is full."""
PICTURE_PLANES = 5
"""Of a picture: red, green, blue, transmittance, Σ w z."""
EXP_C1, EXP_C2, EXP_C3, EXP_C4, EXP_C5 = (f4(c) for c in (0.99999976, 0.49999114, 0.16655975, 0.04109651, 0.00692332))


@numba.njit(inline="always", **JIT_OPTIONS)
def _decay(s):
    """exp(-s) for 0 ≤ s ≤ 6 to 1e-7: a polynomial to the 16th power, without branches or calls."""
    x = s * f4(-1 / 16)
    e = f4(1) + x * (EXP_C1 + x * (EXP_C2 + x * (EXP_C3 + x * (EXP_C4 + x * EXP_C5))))
    e = e * e
    e = e * e
    e = e * e
    return e * e


@numba.njit(**JIT_OPTIONS)
def sort_into_tiles(order, ellipses, across, down):
    """Sort ellipses into tiles, from front to back in each.

    Returns first (tiles + 1), which ellipse each entry is, and for each ellipse where its entries
    stand: places[spans[i, 0] : spans[i, 1]].
    """
    count = np.zeros(across * down + 1, np.int64)
    spans = np.zeros((len(ellipses), 2), np.int64)
    box = np.empty((len(order), 4), np.int64)
    for k in range(len(order)):
        e = ellipses[order[k]]
        box[k, 0] = max(0, int(np.floor((e[COL_U] - e[COL_EXTENT]) / RASTER_TILE_PX)))
        box[k, 1] = min(across, int(np.floor((e[COL_U] + e[COL_EXTENT]) / RASTER_TILE_PX)) + 1)
        box[k, 2] = max(0, int(np.floor((e[COL_V] - e[COL_EXTENT + 1]) / RASTER_TILE_PX)))
        box[k, 3] = min(down, int(np.floor((e[COL_V] + e[COL_EXTENT + 1]) / RASTER_TILE_PX)) + 1)
        for y in range(box[k, 2], box[k, 3]):
            for x in range(box[k, 0], box[k, 1]):
                count[y * across + x + 1] += 1
    first = np.cumsum(count)
    free = first[:-1].copy()
    ids = np.empty(first[-1], np.int32)
    places = np.empty(first[-1], np.int32)
    n = 0
    for k in range(len(order)):
        spans[order[k], 0] = n
        for y in range(box[k, 2], box[k, 3]):
            for x in range(box[k, 0], box[k, 1]):
                t = y * across + x
                ids[free[t]] = order[k]
                places[n] = free[t]
                free[t] += 1
                n += 1
        spans[order[k], 1] = n
    return first, ids, places, spans


@numba.njit(inline="always", **JIT_OPTIONS)
def _tile_is_full(T):
    most = f4(0)
    for y in range(RASTER_TILE_PX):
        for x in range(RASTER_TILE_PX):
            most = T[y, x] if T[y, x] > most else most
    return most <= MIN_TRANSMITTANCE


@numba.njit(inline="always", **JIT_OPTIONS)
def _tile_rows(e, y0):
    """Middle row within the tile, and the rows that the ellipse reaches."""
    my = e[COL_V] - f4(y0) - f4(0.5)
    low = max(0, int(np.ceil(my - e[COL_EXTENT + 1])))
    return my, low, min(RASTER_TILE_PX, int(np.floor(my + e[COL_EXTENT + 1])) + 1)


@numba.njit(inline="always", **JIT_OPTIONS)
def _tile_columns(e, x0, width):
    """Middle column within the tile, and the columns that the ellipse reaches in the picture."""
    mx = e[COL_U] - f4(x0) - f4(0.5)
    low = max(0, int(np.ceil(mx - e[COL_EXTENT])))
    return mx, low, min(RASTER_TILE_PX, width - x0, int(np.floor(mx + e[COL_EXTENT])) + 1)


@numba.njit(inline="always", **JIT_OPTIONS)
def _alpha(o, s):
    """α = min(o exp(-s), 0.99), for s ≥ 0."""
    alpha = o * _decay(s if s < MAX_EXPONENT else MAX_EXPONENT)
    return alpha if alpha < MAX_ALPHA else MAX_ALPHA


@numba.njit(**JIT_OPTIONS)
def blend(tiles, first, ids, ellipses, background, picture):
    """Fill in the picture (5, H, W) in these tiles."""
    _, height, width = picture.shape
    across = (width + RASTER_TILE_PX - 1) // RASTER_TILE_PX
    column = np.arange(RASTER_TILE_PX).astype(np.float32)
    planes = np.empty((PICTURE_PLANES, RASTER_TILE_PX, RASTER_TILE_PX), np.float32)
    for t in tiles:
        y0, x0 = t // across * RASTER_TILE_PX, t % across * RASTER_TILE_PX
        planes[:] = 0
        planes[3] = 1
        T = planes[3]
        for k in range(first[t], first[t + 1]):
            e = ellipses[ids[k]]
            mx = e[COL_U] - f4(x0) - f4(0.5)
            my, low, high = _tile_rows(e, y0)
            a, b, c, o = f4(0.5) * e[COL_A], e[COL_B], f4(0.5) * e[COL_C], e[COL_OPACITY]
            red, green, blue, z = e[COL_RED], e[COL_RED + 1], e[COL_RED + 2], e[COL_DEPTH]
            for y in range(low, high):
                dy = f4(y) - my
                q0, q1 = c * dy * dy, b * dy
                r_, g_, b_, T_, z_ = planes[0, y], planes[1, y], planes[2, y], T[y], planes[4, y]
                for x in range(RASTER_TILE_PX):
                    dx = column[x] - mx
                    s = q0 + dx * (q1 + a * dx)
                    s = s if s < MAX_EXPONENT else MAX_EXPONENT
                    alpha = o * _decay(s)
                    alpha = alpha if alpha < MAX_ALPHA else MAX_ALPHA
                    before = T_[x]
                    alpha = alpha if alpha >= MIN_ALPHA and before > MIN_TRANSMITTANCE else f4(0)
                    w = before * alpha
                    T_[x] = before - w
                    r_[x] += w * red
                    g_[x] += w * green
                    b_[x] += w * blue
                    z_[x] += w * z
            if k % ELLIPSES_PER_FULL_CHECK == ELLIPSES_PER_FULL_CHECK - 1 and _tile_is_full(T):
                break
        for y in range(min(RASTER_TILE_PX, height - y0)):
            for x in range(min(RASTER_TILE_PX, width - x0)):
                for q in range(3):
                    picture[q, y0 + y, x0 + x] = planes[q, y, x] + T[y, x] * background[q]
                picture[3, y0 + y, x0 + x] = T[y, x]
                picture[4, y0 + y, x0 + x] = planes[4, y, x]


@numba.njit(**JIT_OPTIONS)
def blend_back(tiles, first, ids, ellipses, picture, slope, entries):
    """Fill in dL/d(ellipse) of each entry, from slope = dL/d(red, green, blue, transmittance)."""
    _, height, width = picture.shape
    across = (width + RASTER_TILE_PX - 1) // RASTER_TILE_PX
    column = np.arange(RASTER_TILE_PX).astype(np.float32)
    g = np.empty((4, RASTER_TILE_PX, RASTER_TILE_PX), np.float32)
    T = np.empty((RASTER_TILE_PX, RASTER_TILE_PX), np.float32)
    done = np.empty((RASTER_TILE_PX, RASTER_TILE_PX), np.float32)
    goal = np.empty((RASTER_TILE_PX, RASTER_TILE_PX), np.float32)
    for t in tiles:
        y0, x0 = t // across * RASTER_TILE_PX, t % across * RASTER_TILE_PX
        g[:] = 0
        goal[:] = 0
        done[:] = 0
        T[:] = 1
        for y in range(min(RASTER_TILE_PX, height - y0)):
            for x in range(min(RASTER_TILE_PX, width - x0)):
                for q in range(4):
                    g[q, y, x] = slope[q, y0 + y, x0 + x]
                    goal[y, x] += g[q, y, x] * picture[q, y0 + y, x0 + x]
        entries[first[t] : first[t + 1]] = 0
        for k in range(first[t], first[t + 1]):
            e = ellipses[ids[k]]
            mx = e[COL_U] - f4(x0) - f4(0.5)
            my, low, high = _tile_rows(e, y0)
            a, b, c, o = f4(0.5) * e[COL_A], e[COL_B], f4(0.5) * e[COL_C], e[COL_OPACITY]
            red, green, blue = e[COL_RED], e[COL_RED + 1], e[COL_RED + 2]
            s_r = s_g = s_b = s_o = s_x = s_y = s_xx = s_xy = s_yy = f4(0)
            for y in range(low, high):
                dy = f4(y) - my
                q0, q1 = c * dy * dy, b * dy
                v0 = v1 = v2 = f4(0)
                r_, g_, b_, T_, d_, G_ = g[0, y], g[1, y], g[2, y], T[y], done[y], goal[y]
                for x in range(RASTER_TILE_PX):
                    dx = column[x] - mx
                    s = q0 + dx * (q1 + a * dx)
                    s = s if s < MAX_EXPONENT else MAX_EXPONENT
                    decay = _decay(s)
                    raw = o * decay
                    alpha = raw if raw < MAX_ALPHA else MAX_ALPHA
                    before = T_[x]
                    on = alpha >= MIN_ALPHA and before > MIN_TRANSMITTANCE
                    alpha = alpha if on else f4(0)
                    w = before * alpha
                    T_[x] = before - w
                    along = red * r_[x] + green * g_[x] + blue * b_[x]
                    now = d_[x] + w * along
                    d_[x] = now
                    s_r += w * r_[x]
                    s_g += w * g_[x]
                    s_b += w * b_[x]
                    da = before * along - (G_[x] - now) / (f4(1) - alpha)
                    da = da * decay if on and raw < MAX_ALPHA else f4(0)
                    v0 += da
                    v1 += da * dx
                    v2 += da * dx * dx
                s_o += v0
                s_x += v1
                s_xx += v2
                s_y += v0 * dy
                s_xy += v1 * dy
                s_yy += v0 * dy * dy
            out = entries[k]
            out[0] = o * (e[COL_A] * s_x + e[COL_B] * s_y)
            out[1] = o * (e[COL_B] * s_x + e[COL_C] * s_y)
            out[2], out[3], out[4] = f4(-0.5) * o * s_xx, -o * s_xy, f4(-0.5) * o * s_yy
            out[5], out[6], out[7], out[8] = s_o, s_r, s_g, s_b
            if k % ELLIPSES_PER_FULL_CHECK == ELLIPSES_PER_FULL_CHECK - 1 and _tile_is_full(T):
                break


@numba.njit(**JIT_OPTIONS)
def sum_cell_weights(tiles, first, ids, ellipses, size, cell, out):
    """Sum the weights T α of each entry over the cells of its tile, (E, cells, cells).

    size: height and width of the picture [px]; cell: pixels along a cell, a divisor of 16.
    """
    height, width = size
    across = (width + RASTER_TILE_PX - 1) // RASTER_TILE_PX
    T = np.empty((RASTER_TILE_PX, RASTER_TILE_PX), np.float32)
    for t in tiles:
        y0, x0 = t // across * RASTER_TILE_PX, t % across * RASTER_TILE_PX
        T[:] = 1
        out[first[t] : first[t + 1]] = 0
        left = min(RASTER_TILE_PX, height - y0) * min(RASTER_TILE_PX, width - x0)
        for k in range(first[t], first[t + 1]):
            if left == 0:
                break
            e = ellipses[ids[k]]
            mx, begin, end = _tile_columns(e, x0, width)
            my, low, high = _tile_rows(e, y0)
            a, b, c = f4(0.5) * e[COL_A], e[COL_B], f4(0.5) * e[COL_C]
            for y in range(low, min(high, height - y0)):
                dy = f4(y) - my
                for x in range(begin, end):
                    before = T[y, x]
                    if before <= MIN_TRANSMITTANCE:
                        continue
                    dx = f4(x) - mx
                    alpha = _alpha(e[COL_OPACITY], c * dy * dy + dx * (b * dy + a * dx))
                    if alpha >= MIN_ALPHA:
                        out[k, y // cell, x // cell] += before * alpha
                        T[y, x] = before * (f4(1) - alpha)
                        left -= T[y, x] <= MIN_TRANSMITTANCE

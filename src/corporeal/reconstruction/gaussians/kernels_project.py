"""Projection of Gaussians to ellipses, with gradients. Loops compiled by numba.

EWA projection (Zwicker et al. 2001) as in Kerbl et al. 2023: Σ' = J W Σ W^T J^T plus a dilation; opacity is multiplied
by sqrt(det Σ' / det(Σ' + dilation)), so that what is dilated does not grow denser (Yu et al. 2024, Mip-Splatting).
Numbers are double within, single between kernels.

Projection of points to cameras. Compiled by numba.

A camera is a row: camera from world (3 × 4), fx, fy, cx, cy, and whatever comes after.
"""

from typing import NamedTuple

import numba
import numpy as np

from corporeal.reconstruction.gaussians.gaussian_parameters import (
    PARAM_COLOUR,
    PARAM_MEAN,
    PARAM_OPACITY,
    PARAM_ROTATION,
    PARAM_SCALE,
)
from corporeal.reconstruction.gaussians.kernels_harmonics import JIT_OPTIONS, harmonics, harmonics_gradient


@numba.njit(**JIT_OPTIONS)
def from_camera(c, x, y, z):
    """Return where a point is from the camera: to the right, down, ahead [m]."""
    right = c[3] + c[0] * x + c[1] * y + c[2] * z
    down = c[7] + c[4] * x + c[5] * y + c[6] * z
    return right, down, c[11] + c[8] * x + c[9] * y + c[10] * z


@numba.njit(**JIT_OPTIONS)
def project_to_pixel(c, right, down, ahead):
    """Return u and v [px] of what is ahead."""
    return c[12] * right / ahead + c[14], c[13] * down / ahead + c[15]


@numba.njit(**JIT_OPTIONS)
def sample_colour(picture, u, v, out):
    """Fill out (3,) with the colour at u, v [px from the middle of the first pixel]; in it."""
    column, row = int(u), int(v)
    a, b = np.float32(u - column), np.float32(v - row)
    for q in range(3):
        above = (1 - a) * picture[row, column, q] + a * picture[row, column + 1, q]
        below = (1 - a) * picture[row + 1, column, q] + a * picture[row + 1, column + 1, q]
        out[q] = (1 - b) * above + b * below


COL_U, COL_V, COL_A, COL_B, COL_C, COL_OPACITY, COL_RED, COL_DEPTH, COL_EXTENT = (0, 1, 2, 3, 4, 5, 6, 9, 10)
"""Columns of an ellipse: middle (2) [px], inverse covariance (3) [1/px²], opacity, colour (3), depth [m], half extents
(2) [px], negative where it is not in the picture."""
ELLIPSE_COLUMNS = 12
GRADIENT_COLUMNS = 9
"""Of an ellipse: middle, inverse covariance, opacity, colour."""
DILATION_PX2 = 0.3
"""Added to variances [px²]: about a pixel's own extent."""
MIN_DILATED_OPACITY_SQ = 2.5e-5
"""Least share of the opacity, squared, that dilation leaves."""
MIN_DRAWN_OPACITY = 1 / 255
"""Less opaque is not drawn."""
MAX_ELLIPSE_PX = 1e6
"""Wider ones are not drawn [px]."""


class PinholeCamera(NamedTuple):
    """A camera in numbers that kernels read."""

    turn: np.ndarray
    """(3, 3) camera from world"""
    shift: np.ndarray
    """(3,) [m]"""
    eye: np.ndarray
    """(3,) [m]"""
    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int
    near: float
    """What is nearer is not drawn [m]"""


@numba.njit(**JIT_OPTIONS)
def _rotation(theta, i, R):
    """Rotation of the quaternion, which need not be of unit length; returns one over its length."""
    w, x = np.float64(theta[i, PARAM_ROTATION]), np.float64(theta[i, PARAM_ROTATION + 1])
    y, z = np.float64(theta[i, PARAM_ROTATION + 2]), np.float64(theta[i, PARAM_ROTATION + 3])
    n = 1 / np.sqrt(w * w + x * x + y * y + z * z + 1e-30)
    w, x, y, z = w * n, x * n, y * n, z * n
    R[0, 0], R[0, 1], R[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
    R[1, 0], R[1, 1], R[1, 2] = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
    R[2, 0], R[2, 1], R[2, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
    return n


@numba.njit(**JIT_OPTIONS)
def _limit_slope(ratio, centre, focal, size):
    """Keep a slope within the picture and a little more, where J is a fair approximation."""
    low, high = -(centre + 0.15 * size) / focal, (size - centre + 0.15 * size) / focal
    return min(max(ratio, low), high), low < ratio < high


@numba.njit(**JIT_OPTIONS)
def _flatten_gaussian(theta, i, camera, p, T, R, P, scale):
    """Fill T = J W, R, the scales and P = T R diag(scale); returns one over |q|, slope inside."""
    W = camera.turn
    sx, in_x = _limit_slope(p[0] / p[2], camera.cx, camera.fx, camera.width)
    sy, in_y = _limit_slope(p[1] / p[2], camera.cy, camera.fy, camera.height)
    for a in range(3):
        T[0, a] = camera.fx / p[2] * (W[0, a] - sx * W[2, a])
        T[1, a] = camera.fy / p[2] * (W[1, a] - sy * W[2, a])
        scale[a] = np.exp(np.float64(theta[i, PARAM_SCALE + a]))
    n = _rotation(theta, i, R)
    for r in range(2):
        for a in range(3):
            P[r, a] = (T[r, 0] * R[0, a] + T[r, 1] * R[1, a] + T[r, 2] * R[2, a]) * scale[a]
    return n, sx, sy, in_x, in_y


@numba.njit(**JIT_OPTIONS)
def _mean_in_camera(theta, i, camera, p):
    """Camera coordinates of the mean."""
    W = camera.turn
    for a in range(3):
        p[a] = camera.shift[a]
        for b in range(3):
            p[a] += W[a, b] * theta[i, PARAM_MEAN + b]


@numba.njit(**JIT_OPTIONS)
def _view_direction(theta, i, camera, d):
    """Unit direction from the eye to the mean; returns its length."""
    for a in range(3):
        d[a] = theta[i, PARAM_MEAN + a] - camera.eye[a]
    length = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    for a in range(3):
        d[a] /= length
    return length


@numba.njit(**JIT_OPTIONS)
def project(theta, first, last, camera, ellipses):
    """Fill in the ellipses of Gaussians first to last."""
    coefficients = (theta.shape[1] - PARAM_COLOUR) // 3
    T, R, P = np.empty((2, 3)), np.empty((3, 3)), np.empty((2, 3))
    p, scale, d, Y = np.empty(3), np.empty(3), np.empty(3), np.empty(16)
    for i in range(first, last):
        e = ellipses[i]
        e[COL_EXTENT] = e[COL_EXTENT + 1] = -1
        _mean_in_camera(theta, i, camera, p)
        if not p[2] >= camera.near:
            continue
        _flatten_gaussian(theta, i, camera, p, T, R, P, scale)
        a0 = P[0, 0] * P[0, 0] + P[0, 1] * P[0, 1] + P[0, 2] * P[0, 2]
        b = P[0, 0] * P[1, 0] + P[0, 1] * P[1, 1] + P[0, 2] * P[1, 2]
        c0 = P[1, 0] * P[1, 0] + P[1, 1] * P[1, 1] + P[1, 2] * P[1, 2]
        a, c = a0 + DILATION_PX2, c0 + DILATION_PX2
        det = a * c - b * b
        kept = max((a0 * c0 - b * b) / det, MIN_DILATED_OPACITY_SQ)
        o = np.sqrt(kept) / (1 + np.exp(-np.float64(theta[i, PARAM_OPACITY])))
        if not o > MIN_DRAWN_OPACITY:
            continue
        u, v = camera.fx * p[0] / p[2] + camera.cx, camera.fy * p[1] / p[2] + camera.cy
        reach = 2 * np.log(o / MIN_DRAWN_OPACITY)
        ex, ey = np.sqrt(reach * a), np.sqrt(reach * c)
        if not (-ex <= u <= camera.width + ex and -ey <= v <= camera.height + ey):
            continue
        if not (ex < MAX_ELLIPSE_PX and ey < MAX_ELLIPSE_PX):
            continue
        e[COL_U], e[COL_V], e[COL_A], e[COL_B], e[COL_C] = u, v, c / det, -b / det, a / det
        e[COL_OPACITY], e[COL_DEPTH], e[COL_EXTENT], e[COL_EXTENT + 1] = o, p[2], ex, ey
        _view_direction(theta, i, camera, d)
        harmonics(d[0], d[1], d[2], coefficients, Y)
        for q in range(3):
            s = 0.5
            for k in range(coefficients):
                s += Y[k] * theta[i, PARAM_COLOUR + 3 * k + q]
            e[COL_RED + q] = max(s, 0.0)


@numba.njit(**JIT_OPTIONS)
def project_back(theta, first, last, camera, ellipses, entries, places, spans, gradient):
    """Fill in dL/dθ of Gaussians first to last.

    entries: dL/d(ellipse) of each Gaussian in each tile; places[spans[i, 0] : spans[i, 1]] says which of them are
    Gaussian i's.
    """
    coefficients = (theta.shape[1] - PARAM_COLOUR) // 3
    T, R, P = np.empty((2, 3)), np.empty((3, 3)), np.empty((2, 3))
    p, scale, d, Y, S = np.empty(3), np.empty(3), np.empty(3), np.empty(16), np.empty((16, 3))
    g, gR, gT = np.empty(GRADIENT_COLUMNS), np.empty((3, 3)), np.empty((2, 3))
    gp, gd, gP = np.empty(3), np.empty(3), np.empty((2, 3))
    W = camera.turn
    for i in range(first, last):
        out = gradient[i]
        out[:] = 0
        if spans[i, 0] == spans[i, 1]:
            continue
        g[:] = 0
        for s in range(spans[i, 0], spans[i, 1]):
            for k in range(GRADIENT_COLUMNS):
                g[k] += entries[places[s], k]
        # The ellipse's covariance: from its inverse, and from the opacity that dilation leaves.
        _mean_in_camera(theta, i, camera, p)
        n, sx, sy, in_x, in_y = _flatten_gaussian(theta, i, camera, p, T, R, P, scale)
        a0 = P[0, 0] * P[0, 0] + P[0, 1] * P[0, 1] + P[0, 2] * P[0, 2]
        b = P[0, 0] * P[1, 0] + P[0, 1] * P[1, 1] + P[0, 2] * P[1, 2]
        c0 = P[1, 0] * P[1, 0] + P[1, 1] * P[1, 1] + P[1, 2] * P[1, 2]
        a, c = a0 + DILATION_PX2, c0 + DILATION_PX2
        det, det0 = a * c - b * b, a0 * c0 - b * b
        iA, iB, iC = c / det, -b / det, a / det
        gA, gB, gC = g[2], 0.5 * g[3], g[4]
        m00, m01 = iA * gA + iB * gB, iA * gB + iB * gC
        m10, m11 = iB * gA + iC * gB, iB * gB + iC * gC
        h00 = -(m00 * iA + m01 * iB)
        h01 = -(m00 * iB + m01 * iC)
        h11 = -(m10 * iB + m11 * iC)
        opaque = 1 / (1 + np.exp(-np.float64(theta[i, PARAM_OPACITY])))
        kept = det0 / det
        comp = np.sqrt(max(kept, MIN_DILATED_OPACITY_SQ))
        out[PARAM_OPACITY] = g[5] * comp * opaque * (1 - opaque)
        if kept > MIN_DILATED_OPACITY_SQ:
            half = 0.5 * g[5] * opaque * comp
            h00 += half * (c0 / det0 - c / det)
            h11 += half * (a0 / det0 - a / det)
            h01 += half * (b / det - b / det0)
        # Through P = T R diag(scale) to the scales, R and T.
        gT[:] = 0
        for j in range(3):
            gP[0, j] = 2 * (h00 * P[0, j] + h01 * P[1, j])
            gP[1, j] = 2 * (h01 * P[0, j] + h11 * P[1, j])
            along = 0.0
            for k in range(3):
                t = gP[0, j] * T[0, k] + gP[1, j] * T[1, k]
                along += t * R[k, j]
                gR[k, j] = t * scale[j]
                gT[0, k] += gP[0, j] * R[k, j] * scale[j]
                gT[1, k] += gP[1, j] * R[k, j] * scale[j]
            out[PARAM_SCALE + j] = along * scale[j]
        _quaternion_gradient(theta, i, n, gR, out)
        # Through T = J W and the middle to the mean.
        z = p[2]
        gsx = gsy = gz = 0.0
        for k in range(3):
            gsx -= gT[0, k] * camera.fx / z * W[2, k]
            gsy -= gT[1, k] * camera.fy / z * W[2, k]
            gz -= (gT[0, k] * T[0, k] + gT[1, k] * T[1, k]) / z
        gp[0], gp[1] = g[0] * camera.fx / z, g[1] * camera.fy / z
        gp[2] = gz - (gp[0] * p[0] + gp[1] * p[1]) / z
        if in_x:
            gp[0] += gsx / z
            gp[2] -= gsx * sx / z
        if in_y:
            gp[1] += gsy / z
            gp[2] -= gsy * sy / z
        # Colour: to its coefficients, and to the mean through the direction it is seen along.
        length = _view_direction(theta, i, camera, d)
        harmonics(d[0], d[1], d[2], coefficients, Y)
        harmonics_gradient(d[0], d[1], d[2], coefficients, S)
        gd[:] = 0
        for q in range(3):
            if not ellipses[i, COL_RED + q] > 0:
                continue
            for k in range(coefficients):
                out[PARAM_COLOUR + 3 * k + q] = g[6 + q] * Y[k]
                for x in range(3):
                    gd[x] += g[6 + q] * theta[i, PARAM_COLOUR + 3 * k + q] * S[k, x]
        radial = gd[0] * d[0] + gd[1] * d[1] + gd[2] * d[2]
        for x in range(3):
            out[PARAM_MEAN + x] = W[0, x] * gp[0] + W[1, x] * gp[1] + W[2, x] * gp[2]
            out[PARAM_MEAN + x] += (gd[x] - radial * d[x]) / length


@numba.njit(**JIT_OPTIONS)
def _quaternion_gradient(theta, i, n, g, out):
    """From dL/dR to the quaternion that is brought to unit length by the factor n."""
    w, x = theta[i, PARAM_ROTATION] * n, theta[i, PARAM_ROTATION + 1] * n
    y, z = theta[i, PARAM_ROTATION + 2] * n, theta[i, PARAM_ROTATION + 3] * n
    gw = -z * g[0, 1] + y * g[0, 2] + z * g[1, 0] - x * g[1, 2] - y * g[2, 0] + x * g[2, 1]
    gx = y * (g[0, 1] + g[1, 0]) + z * (g[0, 2] + g[2, 0]) + w * (g[2, 1] - g[1, 2])
    gx -= 2 * x * (g[1, 1] + g[2, 2])
    gy = x * (g[0, 1] + g[1, 0]) + z * (g[1, 2] + g[2, 1]) + w * (g[0, 2] - g[2, 0])
    gy -= 2 * y * (g[0, 0] + g[2, 2])
    gz = x * (g[0, 2] + g[2, 0]) + y * (g[1, 2] + g[2, 1]) + w * (g[1, 0] - g[0, 1])
    gz -= 2 * z * (g[0, 0] + g[1, 1])
    along = gw * w + gx * x + gy * y + gz * z
    out[PARAM_ROTATION] = 2 * n * (gw - along * w)
    out[PARAM_ROTATION + 1] = 2 * n * (gx - along * x)
    out[PARAM_ROTATION + 2] = 2 * n * (gy - along * y)
    out[PARAM_ROTATION + 3] = 2 * n * (gz - along * z)

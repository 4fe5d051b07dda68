"""Projection of points to cameras. Compiled by numba.

A camera is a row: camera from world (3 × 4), fx, fy, cx, cy, and whatever comes after.
"""

import numba
import numpy as np

from corporeal.reconstruction.gaussians.kernels_harmonics import JIT_OPTIONS


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

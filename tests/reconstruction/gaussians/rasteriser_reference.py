"""Reference rasteriser: every Gaussian at every pixel, double precision.

It says what ``raster`` must draw. It works on complex numbers too, so that derivatives come exact
to rounding from a complex step: dL/dx = Im L(x + i h) / h, h = 1e-30. Decisions look at real parts.
"""

import numpy as np
from jaxtyping import Float, Inexact

from corporeal.geometry.spherical_harmonics import SH_DEGREE_OF_COUNT, sh_basis
from corporeal.reconstruction.gaussians.gaussian_parameters import (
    PARAM_COLOUR,
    PARAM_MEAN,
    PARAM_OPACITY,
    PARAM_ROTATION,
    PARAM_SCALE,
)
from corporeal.reconstruction.gaussians.kernels_blend import MAX_ALPHA, MIN_ALPHA, MIN_TRANSMITTANCE
from corporeal.reconstruction.gaussians.kernels_project import (
    DILATION_PX2,
    MIN_DILATED_OPACITY_SQ,
    MIN_DRAWN_OPACITY,
    PinholeCamera,
)

InexactMatrix = Inexact[np.ndarray, "N D"]


def render_reference(
    theta: InexactMatrix, camera: PinholeCamera, background: Float[np.ndarray, "3"]
) -> Inexact[np.ndarray, "5 H W"]:
    """Return red, green, blue (before the background), transmittance, depth times coverage."""
    u, v = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    T = np.ones(u.shape, theta.dtype)
    picture = np.zeros((5, *u.shape), theta.dtype)
    seen = theta[:, PARAM_MEAN:PARAM_ROTATION] @ camera.turn.T + camera.shift
    for i in np.argsort(np.real(seen[:, 2]), kind="stable"):
        p = seen[i]
        if not p[2].real >= camera.near:
            continue
        covariance = picture_covariance(theta[i], p, camera)
        dilated = covariance + DILATION_PX2 * np.eye(2)
        kept = _determinant(covariance) / _determinant(dilated)
        kept = kept if kept.real > MIN_DILATED_OPACITY_SQ else MIN_DILATED_OPACITY_SQ
        o = np.sqrt(kept) / (1 + np.exp(-theta[i, PARAM_OPACITY]))
        if not o.real > MIN_DRAWN_OPACITY:
            continue
        dx = u - (camera.fx * p[0] / p[2] + camera.cx)
        dy = v - (camera.fy * p[1] / p[2] + camera.cy)
        a, b, c = dilated[1, 1], -dilated[0, 1], dilated[0, 0]
        alpha = o * np.exp(-(a * dx**2 + 2 * b * dx * dy + c * dy**2) / 2 / _determinant(dilated))
        alpha = np.where(np.real(alpha) < MAX_ALPHA, alpha, MAX_ALPHA)
        alpha = np.where((np.real(alpha) >= MIN_ALPHA) & (np.real(T) > MIN_TRANSMITTANCE), alpha, 0)
        picture[:3] += T * alpha * gaussian_colour(theta[i], camera)[:, None, None]
        picture[4] += T * alpha * p[2]
        T = T * (1 - alpha)
    picture[:3] += T * background[:, None, None]
    picture[3] = T
    return picture


def picture_covariance(
    row: Inexact[np.ndarray, " D"], p: Inexact[np.ndarray, "3"], camera: PinholeCamera
) -> Inexact[np.ndarray, "2 2"]:
    """Return the covariance in the picture [px²], J W Σ W^T J^T."""
    x = _limited_slope(p[0] / p[2], camera.cx, camera.fx, camera.width)
    y = _limited_slope(p[1] / p[2], camera.cy, camera.fy, camera.height)
    J = np.array([[camera.fx, 0, -camera.fx * x], [0, camera.fy, -camera.fy * y]]) / p[2]
    q = row[PARAM_ROTATION:PARAM_SCALE]
    w, x, y, z = q / np.sqrt((q * q).sum())
    R = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    P = J @ camera.turn @ R @ np.diag(np.exp(row[PARAM_SCALE:PARAM_OPACITY]))
    return P @ P.T


def gaussian_colour(row: Inexact[np.ndarray, " D"], camera: PinholeCamera) -> Inexact[np.ndarray, "3"]:
    """Return what is seen of one Gaussian, at least black."""
    towards = row[PARAM_MEAN:PARAM_ROTATION] - camera.eye
    direction = towards / np.sqrt((towards * towards).sum())
    sh = row[PARAM_COLOUR:].reshape(-1, 3)
    rgb = 0.5 + sh_basis(direction[None], SH_DEGREE_OF_COUNT[len(sh)])[0] @ sh
    return np.where(rgb.real > 0, rgb, 0)


def _limited_slope(slope: complex, centre: float, focal: float, size: int) -> complex:
    low, high = -(centre + 0.15 * size) / focal, (1.15 * size - centre) / focal
    return slope if low < slope.real < high else min(max(slope.real, low), high)


def _determinant(m: Inexact[np.ndarray, "2 2"]) -> complex:
    return m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0]

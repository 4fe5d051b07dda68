"""Real spherical harmonics of 3D Gaussian splatting, and their rotation.

Band l has 2l + 1 functions; they follow each other by band and within it by order -l … l. Signs include the
Condon–Shortley phase: Y_1 = 0.4886 (-y, z, -x).

The polynomials are those of Sloan, "Stupid Spherical Harmonics Tricks" (2008), appendix A2, up to degree 3.
"""

import numpy as np
from jaxtyping import Float

SH_DC_COEFFICIENT = 0.28209479177387814
"""Y_0: 1 / (2 sqrt π)."""
SH_DEGREE_OF_COUNT = {1: 0, 4: 1, 9: 2, 16: 3}
"""Degree for each number of coefficients K = (degree + 1)²."""
GOLDEN_ANGLE_RAD = np.pi * (3 - np.sqrt(5))


def sh_basis(directions: Float[np.ndarray, "N 3"], degree: int) -> Float[np.ndarray, "N K"]:
    """Return Y_k at unit directions, up to a degree of 0 to 3."""
    x, y, z = np.moveaxis(np.asarray(directions), -1, 0)
    bands = [[np.full(x.shape, SH_DC_COEFFICIENT, x.dtype)]]
    if degree > 0:
        bands.append([a * b for a, b in zip((-1, 1, -1), (y, z, x), strict=True)])
        bands[1] = [0.4886025119029199 * b for b in bands[1]]
    if degree > 1:
        bands.append(_second_degree(x, y, z))
    if degree > 2:
        bands.append(_third_degree(x, y, z))
    return np.stack([y_k for band in bands for y_k in band], axis=-1)


def rotate_sh(sh: Float[np.ndarray, "N K 3"], rotation: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "N K 3"]:
    """Return the coefficients of the same colours after the object they belong to was rotated.

    The new function is f'(d) = f(R^T d). Each band turns within itself: its matrix is found from more directions than
    it has functions, which is exact to rounding.
    """
    degree = SH_DEGREE_OF_COUNT[sh.shape[1]]
    points = _fibonacci_directions(32)
    here, there = sh_basis(points, degree), sh_basis(points @ rotation, degree)
    new = np.array(sh)
    for band in range(1, degree + 1):
        of = slice(band * band, (band + 1) ** 2)
        matrix = np.linalg.pinv(here[:, of]) @ there[:, of]
        channels = sh[:, of].swapaxes(1, 2).reshape(-1, 2 * band + 1)
        after = channels @ matrix.T.astype(sh.dtype)
        new[:, of] = after.reshape(len(sh), 3, 2 * band + 1).swapaxes(1, 2)
    return new


def _second_degree(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> list[np.ndarray]:
    a, b, c = 1.0925484305920792, 0.31539156525252005, 0.5462742152960396
    return [a * x * y, -a * y * z, b * (2 * z * z - x * x - y * y), -a * x * z, c * (x * x - y * y)]


def _third_degree(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> list[np.ndarray]:
    a, b, c = 0.5900435899266435, 2.890611442640554, 0.4570457994644658
    d, e = 0.3731763325901154, 1.445305721320277
    xx, yy, zz = x * x, y * y, z * z
    return [
        -a * y * (3 * xx - yy),
        b * x * y * z,
        -c * y * (4 * zz - xx - yy),
        d * z * (2 * zz - 3 * xx - 3 * yy),
        -c * x * (4 * zz - xx - yy),
        e * z * (xx - yy),
        -a * x * (xx - 3 * yy),
    ]


def _fibonacci_directions(count: int) -> np.ndarray:
    """Return unit vectors, spread evenly (Fibonacci lattice)."""
    z = 1 - (2 * np.arange(count) + 1) / count
    turn = GOLDEN_ANGLE_RAD * np.arange(count)
    flat = np.sqrt(1 - z * z)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=-1)

"""Kinematics of stacks of deformation gradients F.

Letters: F = R S = U Σ Vᵀ, J = det F, b = F Fᵀ, ε = ln Σ.
"""

import numpy as np
from jaxtyping import Float

Matrices = Float[np.ndarray, "P 3 3"]
Vectors = Float[np.ndarray, "P 3"]
Scalars = Float[np.ndarray, " P"]

MIN_STRETCH_RATIO2 = 1e-4
"""Square of the ratio of two stretches below which the closed form loses too many digits."""


def signed_svd(F: Matrices) -> tuple[Matrices, Vectors, Matrices]:
    """F = U Σ Vᵀ with rotations U and V; the smallest stretch carries the sign of det F.

    Returns:
        U, the stretches Σ in descending order, and V (not its transpose).
    """
    U, stretch, Vt = np.linalg.svd(F)
    mirror_u, mirror_v = np.sign(determinant(U)), np.sign(determinant(Vt))
    U[:, :, 2] *= mirror_u[:, None]
    Vt[:, 2, :] *= mirror_v[:, None]
    stretch[:, 2] *= mirror_u * mirror_v
    return U, stretch, transpose(Vt)


def polar(F: Matrices) -> tuple[Matrices, Matrices]:
    """F = R S with a rotation R (never a reflection) and a symmetric S."""
    U, stretch, V = signed_svd(F)
    return U @ transpose(V), (V * stretch[:, None, :]) @ transpose(V)


def stretches(F: Matrices) -> Vectors:
    """Return Σ as ``signed_svd`` does, without U and V and in a tenth of the time.

    In closed form from E = FᵀF - 1 (Smith 1961), formed from F - 1 so that small strains stay exact; what is pressed
    nearly flat is decomposed. Two that are nearly equal come 1e-5 apart, but their sums and products, and so energies,
    are exact.
    """
    # Each component in a row of its own: sums of three numbers a matrix take three times as long.
    H = np.ascontiguousarray(np.moveaxis(F, 0, -1)) - np.eye(3)[:, :, None]
    xx, yy, zz = (2.0 * H[i, i] + _product(H, i, i) for i in range(3))
    xy, xz, yz = (H[i, j] + H[j, i] + _product(H, i, j) for i, j in ((0, 1), (0, 2), (1, 2)))
    mean = (xx + yy + zz) / 3.0
    a, b, c = xx - mean, yy - mean, zz - mean
    spread = np.sqrt((a * a + b * b + c * c + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0)
    cubic = a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz)
    angle = np.arccos(np.clip(0.5 * cubic / np.maximum(spread**3, 1e-300), -1.0, 1.0)) / 3.0
    largest = mean + 2.0 * spread * np.cos(angle)
    least = mean + 2.0 * spread * np.cos(angle + 2.0 * np.pi / 3.0)
    squares = 1.0 + np.stack([largest, 3.0 * mean - largest - least, least], axis=1)
    out = np.sqrt(np.maximum(squares, 0.0))
    out[:, 2] *= np.sign(determinant(F))
    flat = ~(squares[:, 2] > MIN_STRETCH_RATIO2 * squares[:, 0])
    out[flat] = signed_svd(F[flat])[1]
    return out


def _product(H: Float[np.ndarray, "3 3 P"], i: int, j: int) -> Scalars:
    """Component ij of HᵀH."""
    return H[0, i] * H[0, j] + H[1, i] * H[1, j] + H[2, i] * H[2, j]


def from_stretches(U: Matrices, stretch: Vectors, V: Matrices) -> Matrices:
    """U Σ Vᵀ."""
    return (U * stretch[:, None, :]) @ transpose(V)


def log_strain(stretch: Vectors) -> Vectors:
    """ε = ln Σ; not a number where material is inside out."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.log(stretch)


def determinant(F: Matrices) -> Scalars:
    """Triple product of the rows; with ``np.cross`` it takes two and a half times as long."""
    (a, b, c), (d, e, f), (g, h, i) = np.moveaxis(F, 0, -1)
    return a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g)


def log_j(F: Matrices) -> Scalars:
    """Return ln J; not a number where material is inside out."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.log(determinant(F))


def transpose(A: Matrices) -> Matrices:
    """Transpose every matrix of a stack."""
    return np.swapaxes(A, -1, -2)


def inverse_transpose(F: Matrices) -> Matrices:
    """F⁻ᵀ."""
    return transpose(np.linalg.inv(F))


def per_particle(scalar: Scalars) -> Float[np.ndarray, "P 1 1"]:
    """Shape one number per particle so that it multiplies matrices."""
    return scalar[:, None, None]


def isotropic_tensors(scalar: Scalars) -> Matrices:
    """Return s 1."""
    return per_particle(scalar) * np.eye(3)

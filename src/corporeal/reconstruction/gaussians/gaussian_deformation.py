"""Gaussians deformed with the material, for rendering."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from corporeal.core.types import Gaussians
from corporeal.geometry.spherical_harmonics import SH_DEGREE_OF_COUNT, sh_basis

PROBE_DIRECTIONS = np.random.default_rng(0).normal(size=(12, 3))
"""Directions that tell how a band turns: more than it has functions, in general position."""


def deform_gaussians(gaussians: Gaussians, F: Float[np.ndarray, "N 3 3"], x: Float[np.ndarray, "N 3"]) -> Gaussians:
    """Return Gaussians carried along by deformation gradients F [-] to new means x [m].

    Σ' = F Σ F^T (Xie et al. 2024, PhysGaussian); colours turn by the rotation R of the polar decomposition F = R U. F
    may be singular or inverted: R is the rotation nearest to it.
    """
    kind = gaussians.mean.dtype
    axes = Rotation.from_quat(gaussians.rotation, scalar_first=True).as_matrix()
    turned, scale, _ = np.linalg.svd(F @ (axes * gaussians.scale[:, None, :]))
    return replace(
        gaussians,
        mean=np.asarray(x, kind),
        rotation=_quaternions(_flip_last_axis(turned, np.linalg.det(turned))).astype(kind),
        scale=scale.astype(kind),
        sh=rotate_harmonics(gaussians.sh, nearest_rotations(F)).astype(kind),
    )


def nearest_rotations(F: Float[np.ndarray, "N 3 3"]) -> Float[np.ndarray, "N 3 3"]:
    """Return the rotation nearest to each matrix, det R = 1 (Kabsch 1976)."""
    left, _, right = np.linalg.svd(F)
    return _flip_last_axis(left, np.linalg.det(left) * np.linalg.det(right)) @ right


def rotate_harmonics(sh: Float[np.ndarray, "N K 3"], turn: Float[np.ndarray, "N 3 3"]) -> Float[np.ndarray, "N K 3"]:
    """Return the coefficients after every Gaussian turned by a rotation of its own.

    As ``geometry.harmonics.turned``, which has one rotation for all: f'(d) = f(R^T d).
    """
    degree = SH_DEGREE_OF_COUNT[sh.shape[1]]
    probes = PROBE_DIRECTIONS / np.linalg.norm(PROBE_DIRECTIONS, axis=1, keepdims=True)
    here, there = sh_basis(probes, degree), sh_basis(probes @ turn, degree)
    new = sh.astype(np.float64)
    for band in range(1, degree + 1):
        of = slice(band * band, (band + 1) ** 2)
        new[:, of] = np.linalg.pinv(here[:, of]) @ (there[..., of] @ new[:, of])
    return new


def _flip_last_axis(matrices: np.ndarray, sign: np.ndarray) -> np.ndarray:
    """Turn the last axis about where a sign is negative."""
    matrices = matrices.copy()
    matrices[sign < 0, :, -1] *= -1
    return matrices


def _quaternions(matrices: np.ndarray) -> np.ndarray:
    return Rotation.from_matrix(matrices).as_quat(scalar_first=True)

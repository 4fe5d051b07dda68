"""Gaussians that move with matter: what the film of a deformed scene is drawn from."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from corporeal.core.types import Gaussians
from corporeal.geometry.harmonics import DEGREES, basis

PROBES = np.random.default_rng(0).normal(size=(12, 3))
"""Directions that tell how a band turns: more than it has functions, in general position."""


def deformed(
    gaussians: Gaussians, F: Float[np.ndarray, "N 3 3"], x: Float[np.ndarray, "N 3"]
) -> Gaussians:
    """Return Gaussians carried along by deformation gradients F [-] to new means x [m].

    Σ' = F Σ F^T (Xie et al. 2024, PhysGaussian); colours turn by the rotation R of the polar
    decomposition F = R U. F may be singular or inverted: R is the rotation nearest to it.
    """
    kind = gaussians.mean.dtype
    axes = Rotation.from_quat(gaussians.rotation, scalar_first=True).as_matrix()
    turned, scale, _ = np.linalg.svd(F @ (axes * gaussians.scale[:, None, :]))
    return replace(
        gaussians,
        mean=np.asarray(x, kind),
        rotation=_quaternions(_mirrored(turned, np.linalg.det(turned))).astype(kind),
        scale=scale.astype(kind),
        sh=carried(gaussians.sh, polar(F)).astype(kind),
    )


def polar(F: Float[np.ndarray, "N 3 3"]) -> Float[np.ndarray, "N 3 3"]:
    """Return the rotation nearest to each matrix, det R = 1 (Kabsch 1976)."""
    left, _, right = np.linalg.svd(F)
    return _mirrored(left, np.linalg.det(left) * np.linalg.det(right)) @ right


def carried(
    sh: Float[np.ndarray, "N K 3"], turn: Float[np.ndarray, "N 3 3"]
) -> Float[np.ndarray, "N K 3"]:
    """Return the coefficients after every Gaussian turned by a rotation of its own.

    As ``geometry.harmonics.turned``, which has one rotation for all: f'(d) = f(R^T d).
    """
    degree = DEGREES[sh.shape[1]]
    probes = PROBES / np.linalg.norm(PROBES, axis=1, keepdims=True)
    here, there = basis(probes, degree), basis(probes @ turn, degree)
    new = sh.astype(np.float64)
    for band in range(1, degree + 1):
        of = slice(band * band, (band + 1) ** 2)
        new[:, of] = np.linalg.pinv(here[:, of]) @ (there[..., of] @ new[:, of])
    return new


def _mirrored(matrices: np.ndarray, sign: np.ndarray) -> np.ndarray:
    """Turn the last axis about where a sign is negative."""
    matrices = matrices.copy()
    matrices[sign < 0, :, -1] *= -1
    return matrices


def _quaternions(matrices: np.ndarray) -> np.ndarray:
    return Rotation.from_matrix(matrices).as_quat(scalar_first=True)

"""Return maps of Hencky's elasticity, shared by all plastic laws.

A map takes the trial strains ε = ln Σ of a step that was taken elastically and gives back the
nearest admissible ones.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from corporeal.mpm.laws.constitutive_law import ReturnMapResult, YieldParameters
from corporeal.mpm.laws.hencky import principal_tau
from corporeal.mpm.laws.kinematics import (
    Matrices,
    Scalars,
    Vectors,
    from_stretches,
    log_strain,
    signed_svd,
)


class PrincipalReturn(NamedTuple):
    """What a return map gives back."""

    strain: Vectors
    """Admissible principal logarithmic strains."""
    slip: Vectors
    """Plastic part of the step: what the trial strains had too much, less its free expansion."""
    plastic_strain: Scalars
    """Increment of the equivalent plastic strain √(2/3) ‖Δε‖ [-]."""
    volume: Scalars
    """Volume correction v_c: logarithmic expansion that carried no stress [-]."""


def apply_return_map(
    F: Matrices, numbers: YieldParameters, back: Callable[[Vectors], PrincipalReturn]
) -> ReturnMapResult:
    """Apply a return map of principal strains to deformation gradients.

    Args:
        F: Trial elastic deformation gradients.
        numbers: Of the material.
        back: The map.

    """
    U, stretch, V = signed_svd(F)
    strain = log_strain(stretch)
    new = back(strain)
    moved = np.any(new.strain != strain, axis=1)
    rebuilt = from_stretches(U, np.exp(new.strain), V)
    loss = np.sum(principal_tau(new.strain, numbers.mu, numbers.lam) * new.slip, axis=1)
    return ReturnMapResult(
        np.where(moved[:, None, None], rebuilt, F), new.plastic_strain, new.volume, loss
    )


def deviator(strain: Vectors) -> tuple[Vectors, Scalars]:
    """ε̂ = ε - tr ε/3, and its size."""
    part = strain - np.mean(strain, axis=1, keepdims=True)
    return part, np.linalg.norm(part, axis=1)


def scaled_deviator(part: Vectors, slip: Scalars, size: Scalars) -> Vectors:
    """δγ ε̂/‖ε̂‖; 0 where there is no direction."""
    return part * (slip / np.where(size > 0.0, size, 1.0))[:, None]

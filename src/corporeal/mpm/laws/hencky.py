"""Hencky's elasticity: quadratic in the logarithmic strain ε = ln Σ.

"StVK" in the graphics literature, where it carries plasticity; but Saint-Venant's and Kirchhoff's law is quadratic in
Green's strain.

Return maps of Hencky's elasticity, shared by all plastic laws.

A map takes the trial strains ε = ln Σ of a step that was taken elastically and gives back the nearest admissible ones.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from corporeal.mpm.laws.constitutive_law import (
    LOGARITHMIC_VOLUMETRIC,
    ConstitutiveLaw,
    ReturnMapResult,
    YieldParameters,
)
from corporeal.mpm.laws.kinematics import Matrices, Scalars, Vectors, from_stretches, log_strain, signed_svd, stretches


def principal_tau(strain: Vectors, mu: Scalars, lam: Scalars) -> Vectors:
    """Return the principal Kirchhoff stresses 2μ ε + λ tr ε [Pa] of principal logarithmic strains."""
    return 2.0 * mu[:, None] * strain + (lam * np.sum(strain, axis=1))[:, None]


def stretched_tau(stretch: Vectors, mu: Scalars, lam: Scalars) -> Vectors:
    """Return the same of principal stretches."""
    return principal_tau(log_strain(stretch), mu, lam)


def psi(F: Matrices, mu: Scalars, lam: Scalars) -> Scalars:
    """Ψ = μ ‖ε‖² + λ/2 (tr ε)²."""
    strain = log_strain(stretches(F))
    return mu * np.sum(strain**2, axis=1) + 0.5 * lam * np.sum(strain, axis=1) ** 2


def tau(F: Matrices, mu: Scalars, lam: Scalars) -> Matrices:
    """τ = U (2μ ε + λ tr ε 1) Uᵀ."""
    U, stretch, _ = signed_svd(F)
    return from_stretches(U, principal_tau(log_strain(stretch), mu, lam), U)


def pk1(F: Matrices, mu: Scalars, lam: Scalars) -> Matrices:
    """P = U (2μ Σ⁻¹ ε + λ tr ε Σ⁻¹) Vᵀ."""
    U, stretch, V = signed_svd(F)
    return from_stretches(U, principal_tau(log_strain(stretch), mu, lam) / stretch, V)


def wave_modulus(F: Matrices, mu: Scalars, lam: Scalars) -> Scalars:
    """λ + 2μ at any strain: τ is linear in ε."""
    return lam + 2.0 * mu


LAW = ConstitutiveLaw(
    name="Hencky",
    source="Hencky 1928, Über die Form des Elastizitätsgesetzes bei ideal elastischen Stoffen",
    psi=psi,
    tau=tau,
    principal_tau=stretched_tau,
    pk1=pk1,
    wave_modulus=wave_modulus,
    volumetric=LOGARITHMIC_VOLUMETRIC,
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
    return ReturnMapResult(np.where(moved[:, None, None], rebuilt, F), new.plastic_strain, new.volume, loss)


def deviator(strain: Vectors) -> tuple[Vectors, Scalars]:
    """ε̂ = ε - tr ε/3, and its size."""
    part = strain - np.mean(strain, axis=1, keepdims=True)
    return part, np.linalg.norm(part, axis=1)


def scaled_deviator(part: Vectors, slip: Scalars, size: Scalars) -> Vectors:
    """δγ ε̂/‖ε̂‖; 0 where there is no direction."""
    return part * (slip / np.where(size > 0.0, size, 1.0))[:, None]

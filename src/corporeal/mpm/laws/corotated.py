"""Fixed corotated elasticity: Ψ = μ ‖S - 1‖² + λ/2 (J - 1)², finite also where J < 0."""

import numpy as np

from corporeal.mpm.laws.constitutive_law import QUADRATIC_VOLUMETRIC, ConstitutiveLaw
from corporeal.mpm.laws.kinematics import (
    Matrices,
    Scalars,
    Vectors,
    determinant,
    inverse_transpose,
    isotropic_tensors,
    per_particle,
    polar,
    stretches,
    transpose,
)


def psi(F: Matrices, mu: Scalars, lam: Scalars) -> Scalars:
    """Ψ = μ Σ (σ_i - 1)² + λ/2 (J - 1)²."""
    stretch = stretches(F)
    J = determinant(F)
    return mu * np.sum((stretch - 1.0) ** 2, axis=1) + 0.5 * lam * (J - 1.0) ** 2


def tau(F: Matrices, mu: Scalars, lam: Scalars) -> Matrices:
    """τ = 2μ (F - R) Fᵀ + λ J (J - 1) 1."""
    J = determinant(F)
    return 2.0 * per_particle(mu) * (F - polar(F)[0]) @ transpose(F) + isotropic_tensors(lam * J * (J - 1.0))


def principal_tau(stretch: Vectors, mu: Scalars, lam: Scalars) -> Vectors:
    """τ_i = 2μ (σ_i - 1) σ_i + λ J (J - 1)."""
    J = np.prod(stretch, axis=1)
    return 2.0 * mu[:, None] * (stretch - 1.0) * stretch + (lam * J * (J - 1.0))[:, None]


def pk1(F: Matrices, mu: Scalars, lam: Scalars) -> Matrices:
    """P = 2μ (F - R) + λ J (J - 1) F⁻ᵀ."""
    J = determinant(F)
    return 2.0 * per_particle(mu) * (F - polar(F)[0]) + per_particle(lam * J * (J - 1.0)) * inverse_transpose(F)


def wave_modulus(F: Matrices, mu: Scalars, lam: Scalars) -> Scalars:
    """2μ σ (2σ - 1) + λ J (2J - 1) of the largest stretch σ, and of J ≥ 1."""
    most, J = stretches(F)[:, 0], np.maximum(determinant(F), 1.0)
    return 2.0 * mu * most * (2.0 * most - 1.0) + lam * J * (2.0 * J - 1.0)


LAW = ConstitutiveLaw(
    name="fixed corotated",
    source="Stomakhin, Howes, Schroeder and Teran 2012, Energetically consistent invertible elasticity",
    psi=psi,
    tau=tau,
    principal_tau=principal_tau,
    pk1=pk1,
    wave_modulus=wave_modulus,
    volumetric=QUADRATIC_VOLUMETRIC,
)

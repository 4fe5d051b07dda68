"""Compressible Neo-Hookean elasticity: Ψ = μ/2 (‖F‖² - 3 - 2 ln J) + λ/2 (ln J)²."""

import numpy as np

from corporeal.mpm.laws.constitutive_law import LOGARITHMIC_VOLUMETRIC, ConstitutiveLaw
from corporeal.mpm.laws.kinematics import (
    Matrices,
    Scalars,
    Vectors,
    inverse_transpose,
    isotropic_tensors,
    log_j,
    log_strain,
    per_particle,
    stretches,
    transpose,
)


def psi(F: Matrices, mu: Scalars, lam: Scalars) -> Scalars:
    """Ψ = μ/2 (‖F‖² - 3 - 2 ln J) + λ/2 (ln J)²; not a number where material is inside out."""
    swelling = log_j(F)
    square = np.sum(F * F, axis=(1, 2))
    return 0.5 * mu * (square - 3.0 - 2.0 * swelling) + 0.5 * lam * swelling**2


def tau(F: Matrices, mu: Scalars, lam: Scalars) -> Matrices:
    """τ = μ (F Fᵀ - 1) + λ ln J 1."""
    return per_particle(mu) * (F @ transpose(F)) + isotropic_tensors(lam * log_j(F) - mu)


def principal_tau(stretch: Vectors, mu: Scalars, lam: Scalars) -> Vectors:
    """τ_i = μ (σ_i² - 1) + λ ln J."""
    swelling = np.sum(log_strain(stretch), axis=1)
    return mu[:, None] * (stretch**2 - 1.0) + (lam * swelling)[:, None]


def pk1(F: Matrices, mu: Scalars, lam: Scalars) -> Matrices:
    """P = μ (F - F⁻ᵀ) + λ ln J F⁻ᵀ."""
    inverse = inverse_transpose(F)
    return per_particle(mu) * (F - inverse) + per_particle(lam * log_j(F)) * inverse


def wave_modulus(F: Matrices, mu: Scalars, lam: Scalars) -> Scalars:
    """2μ σ² + λ of the largest stretch σ, which is taken as 1 at least."""
    return lam + 2.0 * mu * np.maximum(stretches(F)[:, 0], 1.0) ** 2


LAW = ConstitutiveLaw(
    name="Neo-Hookean",
    source="Bonet and Wood 2008, Nonlinear Continuum Mechanics for Finite Element Analysis, ch. 6",
    psi=psi,
    tau=tau,
    principal_tau=principal_tau,
    pk1=pk1,
    wave_modulus=wave_modulus,
    volumetric=LOGARITHMIC_VOLUMETRIC,
)

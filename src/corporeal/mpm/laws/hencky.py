"""Hencky's elasticity: quadratic in the logarithmic strain ε = ln Σ.

"StVK" in the graphics literature, where it carries plasticity; but Saint-Venant's and Kirchhoff's
law is quadratic in Green's strain.
"""

import numpy as np

from corporeal.mpm.laws.constitutive_law import ConstitutiveLaw
from corporeal.mpm.laws.kinematics import (
    Matrices,
    Scalars,
    Vectors,
    from_stretches,
    log_strain,
    signed_svd,
    stretches,
)
from corporeal.mpm.laws.volumetric_energy import LOGARITHMIC_VOLUMETRIC


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

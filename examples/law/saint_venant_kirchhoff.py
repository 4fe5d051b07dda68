"""Saint-Venant's and Kirchhoff's elasticity: quadratic in Green's strain E = (FᵀF - 1)/2."""

import numpy as np

from corporeal.mpm.laws.constitutive_law import ConstitutiveLaw
from corporeal.mpm.laws.kinematics import Matrices, Scalars, isotropic_tensors, per_particle, stretches, transpose


def psi(F: Matrices, mu: Scalars, lam: Scalars) -> Scalars:
    """Ψ = μ ‖E‖² + λ/2 (tr E)²."""
    E = _green(F)
    trace = np.trace(E, axis1=1, axis2=2)
    return mu * np.sum(E * E, axis=(1, 2)) + 0.5 * lam * trace**2


def pk1(F: Matrices, mu: Scalars, lam: Scalars) -> Matrices:
    """P = F (2μ E + λ tr E 1)."""
    E = _green(F)
    return F @ (2.0 * per_particle(mu) * E + isotropic_tensors(lam * np.trace(E, axis1=1, axis2=2)))


def tau(F: Matrices, mu: Scalars, lam: Scalars) -> Matrices:
    """τ = P Fᵀ."""
    return pk1(F, mu, lam) @ transpose(F)


def wave_modulus(F: Matrices, mu: Scalars, lam: Scalars) -> Scalars:
    """S (2μ (2s - 1) + λ (s + max(tr b - 3, 0))) with the largest s = σ², taken as 1 at least."""
    square = stretches(F) ** 2
    most, swollen = np.maximum(square[:, 0], 1.0), np.maximum(np.sum(square, axis=1) - 3.0, 0.0)
    return most * (2.0 * mu * (2.0 * most - 1.0) + lam * (most + swollen))


def _green(F: Matrices) -> Matrices:
    H = F - np.eye(3)
    return 0.5 * (H + transpose(H) + transpose(H) @ H)


LAW = ConstitutiveLaw(
    name="Saint-Venant–Kirchhoff",
    source="Bonet and Wood 2008, Nonlinear Continuum Mechanics for Finite Element Analysis, ch. 6",
    psi=psi,
    tau=tau,
    pk1=pk1,
    wave_modulus=wave_modulus,
)

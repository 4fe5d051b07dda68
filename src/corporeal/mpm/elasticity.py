"""Elastic laws: energies and stresses of fixed corotated, Neo-Hookean and Hencky solids.

All functions take stacks of deformation gradients F. ``psi_`` is the stored energy per rest
volume Ψ [J/m³], ``pk1_`` the first Piola–Kirchhoff stress P = ∂Ψ/∂F [Pa], ``tau_`` the Kirchhoff
stress τ = P Fᵀ [Pa]. Letters: F = R S = U Σ Vᵀ, J = det F, ε = ln Σ, μ and λ Lamé's constants.
"""

import numpy as np
from jaxtyping import Float, Int

from corporeal.types import Law

Matrices = Float[np.ndarray, "P 3 3"]
Vectors = Float[np.ndarray, "P 3"]
Scalars = Float[np.ndarray, " P"]
Number = Float[np.ndarray, " P"] | float

FLAT = 1e-4
"""Square of the ratio of two stretches below which the closed form loses too many digits."""


def lame(young: Number, poisson: Number) -> tuple[Number, Number]:
    """Lamé's constants (μ, λ) [Pa].

    μ = E / 2(1 + ν),  λ = E ν / ((1 + ν)(1 - 2ν))
    """
    return (
        young / (2.0 * (1.0 + poisson)),
        young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)),
    )


# ---------------------------------------------------------------- decompositions


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

    In closed form from E = FᵀF - 1 (Smith 1961), formed from F - 1 so that small strains stay
    exact; what is pressed nearly flat is decomposed. Two that are nearly equal come 1e-5 apart, but
    their sums and products, and so energies, are exact.
    """
    H = F - np.eye(3)
    xx, yy, zz = (2.0 * H[:, i, i] + np.sum(H[:, :, i] ** 2, axis=1) for i in range(3))
    xy, xz, yz = (
        H[:, i, j] + H[:, j, i] + np.sum(H[:, :, i] * H[:, :, j], axis=1)
        for i, j in ((0, 1), (0, 2), (1, 2))
    )
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
    flat = ~(squares[:, 2] > FLAT * squares[:, 0])
    out[flat] = signed_svd(F[flat])[1]
    return out


def determinant(F: Matrices) -> Scalars:
    """Triple product of the rows; a tenth of the time of a factorisation."""
    return np.sum(F[:, 0] * np.cross(F[:, 1], F[:, 2]), axis=1)


def transpose(A: Matrices) -> Matrices:
    """Transpose every matrix of a stack."""
    return np.swapaxes(A, -1, -2)


def from_stretches(U: Matrices, stretch: Vectors, V: Matrices) -> Matrices:
    """U Σ Vᵀ."""
    return (U * stretch[:, None, :]) @ transpose(V)


# ---------------------------------------------------------------- fixed corotated


def psi_corotated(F: Matrices, mu: Scalars, lam: Scalars) -> Scalars:
    """Ψ = μ Σ (σ_i - 1)² + λ/2 (J - 1)²  (Stomakhin et al. 2012)."""
    stretch = stretches(F)
    J = determinant(F)
    return mu * np.sum((stretch - 1.0) ** 2, axis=1) + 0.5 * lam * (J - 1.0) ** 2


def tau_corotated(F: Matrices, mu: Scalars, lam: Scalars) -> Matrices:
    """τ = 2μ (F - R) Fᵀ + λ J (J - 1) 1."""
    J = determinant(F)
    return 2.0 * _per(mu) * (F - polar(F)[0]) @ transpose(F) + _isotropic(lam * J * (J - 1.0))


def pk1_corotated(F: Matrices, mu: Scalars, lam: Scalars) -> Matrices:
    """P = 2μ (F - R) + λ J (J - 1) F⁻ᵀ."""
    J = determinant(F)
    return 2.0 * _per(mu) * (F - polar(F)[0]) + _per(lam * J * (J - 1.0)) * _inverse_transpose(F)


# ---------------------------------------------------------------- Neo-Hookean


def psi_neo_hookean(F: Matrices, mu: Scalars, lam: Scalars) -> Scalars:
    """Ψ = μ/2 (‖F‖² - 3 - 2 ln J) + λ/2 (ln J)²; not a number where matter is inside out."""
    log_j = _log_j(F)
    return 0.5 * mu * (np.sum(F * F, axis=(1, 2)) - 3.0 - 2.0 * log_j) + 0.5 * lam * log_j**2


def tau_neo_hookean(F: Matrices, mu: Scalars, lam: Scalars) -> Matrices:
    """τ = μ (F Fᵀ - 1) + λ ln J 1."""
    return _per(mu) * (F @ transpose(F)) + _isotropic(lam * _log_j(F) - mu)


def pk1_neo_hookean(F: Matrices, mu: Scalars, lam: Scalars) -> Matrices:
    """P = μ (F - F⁻ᵀ) + λ ln J F⁻ᵀ."""
    inverse = _inverse_transpose(F)
    return _per(mu) * (F - inverse) + _per(lam * _log_j(F)) * inverse


# ---------------------------------------------------------------- Hencky


def log_strain(stretch: Vectors) -> Vectors:
    """ε = ln Σ; not a number where matter is inside out."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.log(stretch)


def psi_log_strain(strain: Vectors, mu: Scalars, lam: Scalars) -> Scalars:
    """Ψ = μ ‖ε‖² + λ/2 (tr ε)² of principal logarithmic strains."""
    return mu * np.sum(strain**2, axis=1) + 0.5 * lam * np.sum(strain, axis=1) ** 2


def psi_hencky(F: Matrices, mu: Scalars, lam: Scalars) -> Scalars:
    """Ψ = μ ‖ε‖² + λ/2 (tr ε)²  ("StVK" in the graphics literature, but on logarithmic strain)."""
    return psi_log_strain(log_strain(stretches(F)), mu, lam)


def tau_hencky(F: Matrices, mu: Scalars, lam: Scalars) -> Matrices:
    """τ = U (2μ ε + λ tr ε 1) Uᵀ."""
    U, stretch, _ = signed_svd(F)
    return from_stretches(U, principal_tau(log_strain(stretch), mu, lam), U)


def pk1_hencky(F: Matrices, mu: Scalars, lam: Scalars) -> Matrices:
    """P = U (2μ Σ⁻¹ ε + λ tr ε Σ⁻¹) Vᵀ."""
    U, stretch, V = signed_svd(F)
    return from_stretches(U, principal_tau(log_strain(stretch), mu, lam) / stretch, V)


# ---------------------------------------------------------------- all laws

PSI = {
    Law.COROTATED: psi_corotated,
    Law.NEO_HOOKEAN: psi_neo_hookean,
    Law.HENCKY: psi_hencky,
    Law.DRUCKER_PRAGER: psi_hencky,
    Law.VON_MISES: psi_hencky,
}
TAU = {
    Law.COROTATED: tau_corotated,
    Law.NEO_HOOKEAN: tau_neo_hookean,
    Law.HENCKY: tau_hencky,
    Law.DRUCKER_PRAGER: tau_hencky,
    Law.VON_MISES: tau_hencky,
}
PK1 = {
    Law.COROTATED: pk1_corotated,
    Law.NEO_HOOKEAN: pk1_neo_hookean,
    Law.HENCKY: pk1_hencky,
    Law.DRUCKER_PRAGER: pk1_hencky,
    Law.VON_MISES: pk1_hencky,
}


RELIEVED = (Law.COROTATED, Law.NEO_HOOKEAN, Law.HENCKY)


def psi(law: Int[np.ndarray, " P"], F: Matrices, mu: Scalars, lam: Scalars) -> Scalars:
    """Give the stored energy per rest volume Ψ [J/m³] of particles with different laws."""
    out = np.empty(len(F))
    for rule, chosen in _by_law(law):
        out[chosen] = PSI[rule](F[chosen], mu[chosen], lam[chosen])
    return out


def tau(law: Int[np.ndarray, " P"], F: Matrices, mu: Scalars, lam: Scalars) -> Matrices:
    """Give the Kirchhoff stress τ [Pa] of particles with different laws."""
    out = np.empty_like(F)
    for rule, chosen in _by_law(law):
        out[chosen] = TAU[rule](F[chosen], mu[chosen], lam[chosen])
    return out


def is_stiff_in_bulk(law: np.ndarray, mu: np.ndarray, lam: np.ndarray) -> np.ndarray:
    """Whether matter is elastic and its ν above 0.4: splines lock unless pressure is a mean."""
    return np.isin(law, [rule.value for rule in RELIEVED]) & (lam > 4.0 * mu)


def tau_relief(law: Int[np.ndarray, " P"], F: Matrices, lam: Scalars, relief: Scalars) -> Matrices:
    """Give what a swelling of J + ``relief`` instead of J adds to the Kirchhoff stress [Pa].

    Only the pressure sees it: λ J (J - 1) of fixed corotated, λ ln J of the others.
    """
    J = determinant(F)
    mean = np.maximum(J + relief, 1e-3)
    corotated = lam * (mean * (mean - 1.0) - J * (J - 1.0))
    with np.errstate(invalid="ignore", divide="ignore"):
        other = lam * np.log(mean / J)
    return _isotropic(np.where(law == Law.COROTATED.value, corotated, other))


def psi_pressed(law: Int[np.ndarray, " P"], F: Matrices, mu: Scalars, stress: Matrices) -> Scalars:
    """Give the stored energy per rest volume [J/m³] where the pressure is a mean (decision 7).

    Ψ = Ψ(F; λ = 0) + p θ/2, p = tr(τ - τ(F; λ = 0))/3, with θ = ln J, or 1 - 1/J of fixed
    corotated: ``psi`` itself where p is one's own. A mean whose weights are masses is
    self-adjoint, so the forces that p makes are the slope of Σ V p θ/2. Strain that only the own
    J shows, and that no force resists, stores nothing.

    Args:
        law: ``types.Law`` values.
        F: Deformation gradients.
        mu: μ [Pa].
        stress: Elastic Kirchhoff stress τ that acts, whose pressure is not one's own [Pa].

    """
    none = np.zeros(len(F))
    more = stress - tau(law, F, mu, none)
    pressure = np.trace(more, axis1=1, axis2=2) / 3.0
    swollen = np.where(law == Law.COROTATED.value, 1.0 - 1.0 / determinant(F), _log_j(F))
    return psi(law, F, mu, none) + 0.5 * pressure * swollen


def _by_law(law: Int[np.ndarray, " P"]) -> list[tuple[Law, np.ndarray]]:
    return [(Law(value), np.flatnonzero(law == value)) for value in np.unique(law).tolist()]


def principal_tau(strain: Vectors, mu: Scalars, lam: Scalars) -> Vectors:
    """Give the principal Kirchhoff stresses 2μ ε + λ tr ε [Pa] of principal logarithmic strains."""
    return 2.0 * mu[:, None] * strain + (lam * np.sum(strain, axis=1))[:, None]


def _log_j(F: Matrices) -> Scalars:
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.log(determinant(F))


def _per(scalar: Scalars) -> Float[np.ndarray, "P 1 1"]:
    return scalar[:, None, None]


def _isotropic(scalar: Scalars) -> Matrices:
    return _per(scalar) * np.eye(3)


def _inverse_transpose(F: Matrices) -> Matrices:
    return transpose(np.linalg.inv(F))

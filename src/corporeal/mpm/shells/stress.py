"""Plane-stress constitutive models of shells: membrane stress from C = FᵀF, and moments from curvature.

All three elasticities have principal Kirchhoff stresses τ_i = g(λ_i) - g(λ_3), where the stretch λ_3 across the wall is
the one without stress: neo-Hookean g = μ λ², corotated g = 2μ λ (λ - 1), Hencky g = 2μ ln λ (``laws`` has the solids).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.core.types import Law
from corporeal.mpm import laws
from corporeal.mpm.constants import (
    MIN_SQUARED_STRETCH,
    NEO_HOOKEAN_ITERATIONS,
    RETURN_MAP_ITERATIONS,
    TINY_DOUBLE,
)
from corporeal.mpm.laws.constitutive_law import lame_parameters

Sym = Float[np.ndarray, "T 3"]
"""Components 11, 22, 12 of a symmetric tensor in the triangle's frame."""
Stretches = Float[np.ndarray, "T 2"]
Scalars = Float[np.ndarray, " T"]
StressAndEnergy = tuple[Stretches, Scalars]
"""Principal Kirchhoff stresses [Pa] and energy per rest volume [J/m³]."""


@dataclass(frozen=True)
class ShellMaterial:
    """Material of T triangles."""

    law: Int[np.ndarray, " T"]
    """``types.Law`` values; what yields is elastic as Hencky's law is."""
    thickness: Float[np.ndarray, " T"]
    """[m]"""
    young_pa: Float[np.ndarray, " T"]
    """E that acts in bending [Pa]."""
    membrane_young_pa: Float[np.ndarray, " T"]
    """E that acts in the plane [Pa]: lower where the step budget does not allow the measured one."""
    poisson: Float[np.ndarray, " T"]
    yield_stress: Float[np.ndarray, " T"]
    """[Pa]; infinite: it does not yield."""
    hardening: Float[np.ndarray, " T"]
    """H [Pa]"""
    branch_strength: Float[np.ndarray, "T 2"]
    """Stiffness of either Maxwell branch over the elastic one [-]; 0: it has none."""
    branch_time: Float[np.ndarray, "T 2"]
    """Relaxation times [s]."""

    @property
    def bending_stiffness(self) -> Float[np.ndarray, " T"]:
        """D = E t³/(12 (1 - ν²)) [N m]."""
        return self.young_pa * self.thickness**3 / (12.0 * (1.0 - self.poisson**2))

    @property
    def membrane_stiffness(self) -> Float[np.ndarray, " T"]:
        """E/(1 - ν²) [Pa]."""
        return self.membrane_young_pa / (1.0 - self.poisson**2)


@dataclass(frozen=True)
class MembraneResponse:
    """Answer of T triangles to their strain."""

    stress: Sym
    """Second Piola–Kirchhoff stress [Pa]."""
    energy: Float[np.ndarray, " T"]
    """Per rest volume [J/m³]."""


@dataclass(frozen=True)
class _Principal:
    """Squared principal stretches c₁ ≥ c₂, their mean and half difference, and its direction (cos, sin of twice it)."""

    c: Float[np.ndarray, "T 2"]
    cosine: Float[np.ndarray, " T"]
    sine: Float[np.ndarray, " T"]

    @classmethod
    def of(cls, C: Sym) -> "_Principal":
        mean, half = 0.5 * (C[:, 0] + C[:, 1]), 0.5 * (C[:, 0] - C[:, 1])
        radius = np.hypot(half, C[:, 2])
        safe = np.maximum(radius, TINY_DOUBLE)
        c = np.stack([mean + radius, np.maximum(mean - radius, MIN_SQUARED_STRETCH)], axis=1)
        return cls(c, half / safe, C[:, 2] / safe)

    def tensor(self, values: Float[np.ndarray, "T 2"]) -> Sym:
        """Tensor with the given principal values."""
        mean, half = 0.5 * (values[:, 0] + values[:, 1]), 0.5 * (values[:, 0] - values[:, 1])
        return np.stack([mean + half * self.cosine, mean - half * self.cosine, half * self.sine], axis=1)


def membrane_response(material: ShellMaterial, C: Sym) -> MembraneResponse:
    """Second Piola–Kirchhoff stress and energy at C = FᵀF, without yield."""
    principal = _Principal.of(C)
    tau, energy = _principal_tau(material, np.sqrt(principal.c))
    return MembraneResponse(principal.tensor(tau / principal.c), energy)


def _principal_tau(material: ShellMaterial, stretch: Stretches) -> StressAndEnergy:
    mu, lam = map(np.asarray, lame_parameters(material.membrane_young_pa, material.poisson))
    tau, energy = np.zeros_like(stretch), np.zeros(len(stretch))
    for k, answer in (
        (material.law == Law.NEO_HOOKEAN.value, _neo_hookean),
        (material.law == Law.COROTATED.value, _corotated),
        (~np.isin(material.law, [Law.NEO_HOOKEAN.value, Law.COROTATED.value]), _hencky),
    ):
        if k.any():
            tau[k], energy[k] = answer(stretch[k], mu[k], lam[k])
    return tau, energy


def _neo_hookean(stretch: Stretches, mu: Scalars, lam: Scalars) -> StressAndEnergy:
    """μ (λ_3² - 1) + λ ln J = 0, by Newton's method for ln λ_3."""
    log_area = np.log(stretch).sum(axis=1)
    y = -lam / (lam + 2.0 * mu) * log_area
    for _ in range(NEO_HOOKEAN_ITERATIONS):
        square = np.exp(2.0 * y)
        y = y - (mu * (square - 1.0) + lam * (log_area + y)) / (2.0 * mu * square + lam)
    across, swelling = np.exp(2.0 * y), log_area + y
    energy = 0.5 * mu * ((stretch**2).sum(axis=1) + across - 3.0 - 2.0 * swelling) + 0.5 * lam * swelling**2
    return mu[:, None] * (stretch**2 - across[:, None]), energy


def _corotated(stretch: Stretches, mu: Scalars, lam: Scalars) -> StressAndEnergy:
    """2μ (λ_3 - 1) λ_3 + λ J (J - 1) = 0 is linear in λ_3 once divided by it."""
    area = np.prod(stretch, axis=1)
    across = (2.0 * mu + lam * area) / (2.0 * mu + lam * area**2)
    g = 2.0 * mu[:, None] * stretch * (stretch - 1.0)
    energy = mu * (((stretch - 1.0) ** 2).sum(axis=1) + (across - 1.0) ** 2) + 0.5 * lam * (area * across - 1.0) ** 2
    return g - (2.0 * mu * across * (across - 1.0))[:, None], energy


def _hencky(stretch: Stretches, mu: Scalars, lam: Scalars) -> StressAndEnergy:
    """2μ ln λ_3 + λ ln J = 0."""
    strain = np.log(stretch)
    across = -lam / (lam + 2.0 * mu) * strain.sum(axis=1)
    swelling = strain.sum(axis=1) + across
    energy = mu * ((strain**2).sum(axis=1) + across**2) + 0.5 * lam * swelling**2
    return 2.0 * mu[:, None] * (strain - across[:, None]), energy


@dataclass(frozen=True)
class MembraneFlow:
    """What became of trial strains that were checked against the yield stress."""

    rest_factor: Float[np.ndarray, "T 2 2"]
    """By which B is multiplied from the right [-]."""
    plastic_strain: Float[np.ndarray, " T"]
    """Increment of the equivalent plastic strain [-]."""
    loss: Float[np.ndarray, " T"]
    """Plastic work per rest volume, with the stress after the return [J/m³]."""


def membrane_flow(material: ShellMaterial, C: Sym, plastic: Float[np.ndarray, " T"]) -> MembraneFlow:
    """Return trial strains to the von Mises yield surface in plane stress (Simo and Hughes 1998, box 3.4).

    In sum and difference of the principal stresses the return is a scalar equation for the multiplier γ:
    p = p_tr/(1 + γ E/(3(1-ν))), q = q_tr/(1 + 2μγ), φ = ½ √(p² + 3q²) = σ_y + H (α + ⅔ γ φ).

    Args:
        material: Of the triangles.
        C: Trial FᵀF.
        plastic: Equivalent plastic strain α so far [-].
    """
    E, nu, count = material.membrane_young_pa, material.poisson, len(C)
    principal = _Principal.of(C)
    strain = 0.5 * np.log(principal.c)
    a, b = E / (3.0 * (1.0 - nu)), E / (1.0 + nu)
    p0, q0 = 3.0 * a * strain.sum(axis=1), b * (strain[:, 0] - strain[:, 1])
    gamma, yields = np.zeros(count), _is_plastic(material)
    start = material.yield_stress + material.hardening * plastic
    yields &= 0.5 * np.sqrt(p0**2 + 3.0 * q0**2) > start
    k = np.flatnonzero(yields)
    for _ in range(RETURN_MAP_ITERATIONS if len(k) else 0):
        g = gamma[k]
        u, w = 1.0 + a[k] * g, 1.0 + b[k] * g
        p2, q2 = (p0[k] / u) ** 2, 3.0 * (q0[k] / w) ** 2
        phi = 0.5 * np.sqrt(p2 + q2)
        slope = -0.25 * (p2 * a[k] / u + q2 * b[k] / w) / phi
        H = 2.0 / 3.0 * material.hardening[k]
        over = phi - start[k] - H * g * phi
        gamma[k] = np.maximum(g - over / (slope - H * (phi + g * slope)), 0.0)
    p, q = p0 / (1.0 + a * gamma), q0 / (1.0 + b * gamma)
    step = np.stack([gamma * (p / 6.0 + q / 2.0), gamma * (p / 6.0 - q / 2.0)], axis=1)
    tau = 0.5 * np.stack([p + q, p - q], axis=1)
    factor = principal.tensor(np.exp(-step))
    return MembraneFlow(
        rest_factor=factor[:, [0, 2, 2, 1]].reshape(-1, 2, 2),
        plastic_strain=gamma * np.sqrt(p**2 + 3.0 * q**2) / 3.0,
        loss=np.sum(tau * step, axis=1),
    )


def _is_plastic(material: ShellMaterial) -> Bool[np.ndarray, " T"]:
    return np.isin(material.law, laws.PLASTIC_LAWS) & np.isfinite(material.yield_stress)


def plane_stress(poisson: Float[np.ndarray, " T"], strain: Sym) -> Sym:
    """(1 - ν) ε + ν tr ε 1: over E/(1 - ν²) the stress, over D the moments, of small strains or curvatures."""
    trace = poisson * (strain[:, 0] + strain[:, 1])
    keep = 1.0 - poisson
    return np.stack([keep * strain[:, 0] + trace, keep * strain[:, 1] + trace, keep * strain[:, 2]], axis=1)


def contract(a: Sym, b: Sym) -> Float[np.ndarray, " T"]:
    """Double contraction a : b of symmetric tensors."""
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + 2.0 * a[:, 2] * b[:, 2]


def moment_return(material: ShellMaterial, moment: Sym) -> Float[np.ndarray, " T"]:
    """Factor by which a moment is brought back to that of the plastic hinge, σ_y t²/4 [-]."""
    equivalent = np.sqrt(moment[:, 0] ** 2 - moment[:, 0] * moment[:, 1] + moment[:, 1] ** 2 + 3.0 * moment[:, 2] ** 2)
    limit = np.where(_is_plastic(material), 0.25 * material.yield_stress * material.thickness**2, np.inf)
    return np.where(equivalent > limit, limit / np.maximum(equivalent, TINY_DOUBLE), 1.0)

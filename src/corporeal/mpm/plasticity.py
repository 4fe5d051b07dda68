"""Plastic return maps on principal logarithmic strains ε = ln Σ (Hencky elasticity).

A map takes the trial strains of a step that was taken elastically and gives back the nearest
admissible ones. ε̂ is the deviatoric part of ε, K = λ + 2μ/3 the bulk modulus.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from corporeal.mpm.elasticity import (
    Matrices,
    Number,
    Scalars,
    Vectors,
    from_stretches,
    log_strain,
    principal_tau,
    signed_svd,
)

SMALLEST_ANGLE = 1e-4
"""Friction angle [rad] below which a cone is taken for a cylinder; its apex is at infinity."""


class Returned(NamedTuple):
    """What a return map gives back."""

    strain: Vectors
    """Admissible principal logarithmic strains."""
    slip: Vectors
    """Plastic part of the step: what the trial strains had too much, less its free expansion."""
    plastic_strain: Scalars
    """Increment of the equivalent plastic strain √(2/3) ‖Δε‖ [-]."""
    volume: Scalars
    """Volume correction v_c: logarithmic expansion that carried no stress [-]."""


def cone_slope(friction_angle: Number) -> Number:
    """α = (√2/3) sin φ: Mohr–Coulomb's strength in plane strain, flowing without dilation.

    There √J₂ = p sin φ (Davis 1968), and ‖s‖ = √(2 J₂) ≤ 3 α p. Through triaxial compression
    instead, as in Klar et al. 2016, a slope of φ = 30° would be as strong as one of 44°, and sand
    pushed aside, in extension, stronger still (decision 6).
    """
    return np.sqrt(2.0) / 3.0 * np.sin(friction_angle)


def return_von_mises(
    strain: Vectors, mu: Scalars, yield_stress: Scalars, hardening: Scalars, plastic: Scalars
) -> Returned:
    """Radial return to von Mises' cylinder with linear isotropic hardening.

    δγ = (‖ε̂‖ - √(2/3) (σ_y + H ε_p) / 2μ) / (1 + H / 3μ);  ε ← ε - δγ ε̂/‖ε̂‖ where δγ > 0

    The √(2/3) makes a bar yield at σ_y in uniaxial tension (Simo and Hughes 1998, box 3.1);
    without it, as in some graphics codes, it yields at 1.225 σ_y.

    Args:
        strain: Trial strains ε.
        mu: Shear modulus μ [Pa].
        yield_stress: Initial uniaxial yield stress σ_y [Pa].
        hardening: H [Pa].
        plastic: Equivalent plastic strain ε_p so far.

    """
    deviator, size = _deviator(strain)
    radius = np.sqrt(2.0 / 3.0) * (yield_stress + hardening * plastic) / (2.0 * mu)
    slip = np.maximum(size - radius, 0.0) / (1.0 + hardening / (3.0 * mu))
    returned = strain - _scaled(deviator, slip, size)
    equivalent = np.sqrt(2.0 / 3.0) * slip
    return Returned(returned, strain - returned, equivalent, np.zeros(len(strain)))


def return_drucker_prager(
    strain: Vectors,
    mu: Scalars,
    lam: Scalars,
    friction_angle: Scalars,
    cohesion: Scalars,
    volume: Scalars,
) -> Returned:
    """Return to the Drucker–Prager cone ‖s‖ ≤ 3α (p₀ - p), without dilation.

    ε is first corrected by the expansion that carried no stress, ε ← ε + v_c/3, or sand that was
    loose for a moment would gain volume for ever (Tampubolon et al. 2017). Beyond the apex,
    tr ε > p₀/K with p₀ = c cot φ, the strain is the apex's. Else, with tr' = tr ε - p₀/K,

    δγ = ‖ε̂‖ + α (3λ + 2μ)/(2μ) tr';  ε ← ε - δγ ε̂/‖ε̂‖ where δγ > 0

    Args:
        strain: Trial strains ε.
        mu: μ [Pa].
        lam: λ [Pa].
        friction_angle: φ [rad].
        cohesion: c [Pa].
        volume: Volume correction v_c so far.

    """
    angle = np.maximum(friction_angle, SMALLEST_ANGLE)
    bulk = lam + 2.0 * mu / 3.0
    strain = strain + volume[:, None] / 3.0
    trace = np.sum(strain, axis=1)
    apex = cohesion / np.tan(angle) / bulk
    deviator, size = _deviator(strain)
    slip = size + cone_slope(angle) * (3.0 * lam + 2.0 * mu) / (2.0 * mu) * (trace - apex)
    on_cone = strain - _scaled(deviator, np.clip(slip, 0.0, size), size)
    returned = np.where((trace > apex)[:, None], apex[:, None] / 3.0, on_cone)
    # Beyond the apex what was open before is no new slip: only the change is.
    opened = np.where(trace > apex, volume, 0.0)[:, None] / 3.0
    excess = strain - returned - opened
    equivalent = np.sqrt(2.0 / 3.0) * np.linalg.norm(excess, axis=1)
    return Returned(returned, excess, equivalent, trace - np.sum(returned, axis=1))


class Flow(NamedTuple):
    """What became of deformation gradients whose trial was checked against a yield surface."""

    F: Matrices
    """Elastic part that is left."""
    plastic_strain: Scalars
    """Increment of the equivalent plastic strain [-]."""
    volume: Scalars
    """New volume correction [-]."""
    loss: Scalars
    """Plastic work per rest volume τ : Δε_p [J/m³], with the stress after the return.

    This is what the grid really pays. The elastic energy given up would also count the overshoot of
    the trial, for which no force did work: several times too much where a step passes the yield
    strain.
    """


def flow_von_mises(
    F: Matrices, elastic: tuple[Scalars, Scalars], metal: tuple[Scalars, Scalars], plastic: Scalars
) -> Flow:
    """Apply ``return_von_mises`` to deformation gradients.

    Args:
        F: Trial elastic deformation gradients.
        elastic: μ and λ [Pa].
        metal: σ_y and H [Pa].
        plastic: Equivalent plastic strain so far.

    """
    mu, lam = elastic
    U, stretch, V = signed_svd(F)
    trial = log_strain(stretch)
    new = return_von_mises(trial, mu, metal[0], metal[1], plastic)
    return _flown(F, (U, trial, V), new, (mu, lam))


def flow_drucker_prager(
    F: Matrices, elastic: tuple[Scalars, Scalars], soil: tuple[Scalars, Scalars], volume: Scalars
) -> Flow:
    """Apply ``return_drucker_prager`` to deformation gradients.

    Args:
        F: Trial elastic deformation gradients.
        elastic: μ and λ [Pa].
        soil: φ [rad] and c [Pa].
        volume: Volume correction so far.

    """
    mu, lam = elastic
    U, stretch, V = signed_svd(F)
    trial = log_strain(stretch)
    new = return_drucker_prager(trial, mu, lam, soil[0], soil[1], volume)
    return _flown(F, (U, trial, V), new, (mu, lam))


def _flown(
    F: Matrices,
    trial: tuple[Matrices, Vectors, Matrices],
    new: Returned,
    elastic: tuple[Scalars, Scalars],
) -> Flow:
    U, strain, V = trial
    moved = np.any(new.strain != strain, axis=1)
    rebuilt = from_stretches(U, np.exp(new.strain), V)
    loss = np.sum(principal_tau(new.strain, *elastic) * new.slip, axis=1)
    return Flow(np.where(moved[:, None, None], rebuilt, F), new.plastic_strain, new.volume, loss)


def _deviator(strain: Vectors) -> tuple[Vectors, Scalars]:
    deviator = strain - np.mean(strain, axis=1, keepdims=True)
    return deviator, np.linalg.norm(deviator, axis=1)


def _scaled(deviator: Vectors, slip: Scalars, size: Scalars) -> Float[np.ndarray, "P 3"]:
    return deviator * (slip / np.where(size > 0.0, size, 1.0))[:, None]

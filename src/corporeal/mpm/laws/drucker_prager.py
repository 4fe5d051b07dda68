"""Sand, soil and snow: Hencky's elasticity in Drucker's and Prager's cone, without dilation."""

import numpy as np

from corporeal.mpm.laws import hencky
from corporeal.mpm.laws.constitutive_law import ConstitutiveLaw, Number, ReturnMapResult, YieldParameters
from corporeal.mpm.laws.hencky import PrincipalReturn, apply_return_map, deviator, scaled_deviator
from corporeal.mpm.laws.kinematics import Matrices, Scalars, Vectors

MIN_FRICTION_ANGLE_RAD = 1e-4
"""Friction angle [rad] below which a cone is taken for a cylinder; its apex is at infinity."""


def cone_slope(friction_angle: Number) -> Number:
    """α = (√2/3) sin φ: Mohr–Coulomb's strength in plane strain, flowing without dilation.

    There √J₂ = p sin φ (Davis 1968), and ‖s‖ = √(2 J₂) ≤ 3 α p. Through triaxial compression instead, as in Klar et al.
    2016, a slope of φ = 30° would be as strong as one of 44°, and sand pushed aside, in extension, stronger still
    (decision laws-sand).
    """
    return np.sqrt(2.0) / 3.0 * np.sin(np.maximum(friction_angle, MIN_FRICTION_ANGLE_RAD))


def apex_strain(friction_angle: Number, cohesion: Number, mu: Number, lam: Number) -> Number:
    """Return tr ε = p₀/K at the apex, with p₀ = c cot φ and the bulk modulus K = λ + 2μ/3 [-]."""
    bulk = np.maximum(lam + 2.0 * mu / 3.0, 1e-30)
    return cohesion / np.tan(np.maximum(friction_angle, MIN_FRICTION_ANGLE_RAD)) / bulk


def return_drucker_prager(
    strain: Vectors, mu: Scalars, lam: Scalars, cone: Scalars, apex: Scalars, volume: Scalars
) -> PrincipalReturn:
    """Return to the Drucker–Prager cone ‖s‖ ≤ 3α (p₀ - p), without dilation.

    ε is first corrected by the expansion that carried no stress, ε ← ε + v_c/3, or sand that was
    loose for a moment would gain volume for ever (Tampubolon et al. 2017). Beyond the apex,
    tr ε > p₀/K, the strain is the apex's. Else, with tr' = tr ε - p₀/K,

    δγ = ‖ε̂‖ + α (3λ + 2μ)/(2μ) tr';  ε ← ε - δγ ε̂/‖ε̂‖ where δγ > 0

    Args:
        strain: Trial strains ε.
        mu: μ [Pa].
        lam: λ [Pa].
        cone: α, of ``cone_slope``.
        apex: p₀/K, of ``apex_strain``.
        volume: Volume correction v_c so far.
    """
    strain = strain + volume[:, None] / 3.0
    trace = np.sum(strain, axis=1)
    part, size = deviator(strain)
    slip = size + cone * (3.0 * lam + 2.0 * mu) / (2.0 * mu) * (trace - apex)
    on_cone = strain - scaled_deviator(part, np.clip(slip, 0.0, size), size)
    returned = np.where((trace > apex)[:, None], apex[:, None] / 3.0, on_cone)
    # Beyond the apex what was open before is no new slip: only the change is.
    opened = np.where(trace > apex, volume, 0.0)[:, None] / 3.0
    excess = strain - returned - opened
    equivalent = np.sqrt(2.0 / 3.0) * np.linalg.norm(excess, axis=1)
    return PrincipalReturn(returned, excess, equivalent, trace - np.sum(returned, axis=1))


def flow(F: Matrices, numbers: YieldParameters, plastic: Scalars, volume: Scalars) -> ReturnMapResult:
    """Apply ``return_drucker_prager`` to trial deformation gradients; grains do not harden."""
    n = numbers
    return apply_return_map(F, n, lambda trial: return_drucker_prager(trial, n.mu, n.lam, n.cone, n.apex, volume))


LAW = ConstitutiveLaw(
    name="Drucker–Prager",
    source="Drucker and Prager 1952; Klar et al. 2016, Drucker-Prager elastoplasticity for sand "
    "animation; the slope after Davis 1968",
    psi=hencky.psi,
    tau=hencky.tau,
    principal_tau=hencky.stretched_tau,
    pk1=hencky.pk1,
    wave_modulus=hencky.wave_modulus,
    flow=flow,
    granular=True,
    needs=("friction_angle", "cohesion"),
)

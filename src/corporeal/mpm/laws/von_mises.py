"""Metals and plasticine: Hencky's elasticity in von Mises' cylinder, with linear hardening."""

import numpy as np

from corporeal.mpm.laws import hencky
from corporeal.mpm.laws.constitutive_law import ConstitutiveLaw, ReturnMapResult, YieldParameters
from corporeal.mpm.laws.hencky import PrincipalReturn, apply_return_map, deviator, scaled_deviator
from corporeal.mpm.laws.kinematics import Matrices, Scalars, Vectors


def return_von_mises(
    strain: Vectors, mu: Scalars, yield_stress: Scalars, hardening: Scalars, plastic: Scalars
) -> PrincipalReturn:
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
    part, size = deviator(strain)
    radius = np.sqrt(2.0 / 3.0) * (yield_stress + hardening * plastic) / (2.0 * mu)
    slip = np.maximum(size - radius, 0.0) / (1.0 + hardening / (3.0 * mu))
    returned = strain - scaled_deviator(part, slip, size)
    equivalent = np.sqrt(2.0 / 3.0) * slip
    return PrincipalReturn(returned, strain - returned, equivalent, np.zeros(len(strain)))


def flow(F: Matrices, numbers: YieldParameters, plastic: Scalars, volume: Scalars) -> ReturnMapResult:
    """Apply ``return_von_mises`` to trial deformation gradients; no volume opens."""
    n = numbers
    return apply_return_map(F, n, lambda trial: return_von_mises(trial, n.mu, n.yield_stress, n.hardening, plastic))


LAW = ConstitutiveLaw(
    name="von Mises",
    source="Simo and Hughes 1998, Computational Inelasticity, box 3.1",
    psi=hencky.psi,
    tau=hencky.tau,
    principal_tau=hencky.stretched_tau,
    pk1=hencky.pk1,
    wave_modulus=hencky.wave_modulus,
    flow=flow,
    needs=("yield_stress",),
    reads=("hardening",),
)

"""Liquids and pastes: pressure of their volume, and a Maxwell branch without a spring beside it.

Herschel and Bulkley's law τ = τ_y + K_c γ̇ⁿ; with n = 1 Bingham's, and without a yield stress Newton's of viscosity
K_c. Elastic is what a step adds: the shear modulus μ and the bulk modulus are numbers of the method
(``physics.liquid_stiffness``), and a stress fades as fast as the law says, however long the step.
"""

import numpy as np

from corporeal.mpm.laws import hencky
from corporeal.mpm.laws.constitutive_law import ConstitutiveLaw, ReturnMapResult, YieldParameters
from corporeal.mpm.laws.hencky import PrincipalReturn, apply_return_map, deviator, scaled_deviator
from corporeal.mpm.laws.kinematics import Matrices, Scalars, Vectors

SLIP_NEWTON_ITERATIONS = 12
"""Newton's steps for the slip of a step where n is not 1: monotone, from a side of the root."""
MIN_SHEAR_STRAIN = 1e-30
"""Slips below it are none [-]."""


def shear_slip(excess: Scalars, mu: Scalars, drag: Scalars, index: Scalars) -> Scalars:
    """Shear Δ of a step [-]: μ Δ + (K_c/dtⁿ) Δⁿ = excess, which is √2 μ ‖ε̂‖ - τ_y [Pa].

    The left side is concave in Δ for n < 1: Newton's steps from below stay below and rise.
    """
    q = np.maximum(excess, 0.0)
    plain = q / (mu + drag)
    bent = np.flatnonzero((index != 1.0) & (q > 0.0) & (drag > 0.0))
    if len(bent) == 0:
        return plain
    q, mu, drag, n = q[bent], mu[bent], drag[bent], index[bent]
    slip = np.maximum(np.minimum(q / (2.0 * mu), (q / (2.0 * drag)) ** (1.0 / n)), MIN_SHEAR_STRAIN)
    for _ in range(SLIP_NEWTON_ITERATIONS):
        power = drag * slip**n
        slip = slip - (mu * slip + power - q) / (mu + n * power / slip)
        slip = np.maximum(slip, MIN_SHEAR_STRAIN)
    plain[bent] = slip
    return plain


def return_fluid(strain: Vectors, numbers: YieldParameters) -> PrincipalReturn:
    """Let principal trial strains relax to what the law bears at their rate; volume is kept."""
    part, size = deviator(strain)
    excess = np.sqrt(2.0) * numbers.mu * size - numbers.yield_stress / np.sqrt(3.0)
    slip = shear_slip(excess, numbers.mu, numbers.drag, numbers.flow_index) / np.sqrt(2.0)
    returned = strain - scaled_deviator(part, slip, size)
    equivalent = np.sqrt(2.0 / 3.0) * slip
    return PrincipalReturn(returned, strain - returned, equivalent, np.zeros(len(strain)))


def flow(F: Matrices, numbers: YieldParameters, plastic: Scalars, volume: Scalars) -> ReturnMapResult:
    """Apply ``return_fluid`` to trial deformation gradients; no volume opens."""
    return apply_return_map(F, numbers, lambda trial: return_fluid(trial, numbers))


LAW = ConstitutiveLaw(
    name="Herschel–Bulkley",
    source="Herschel and Bulkley 1926; Bingham 1922 (n = 1), Newton (and no yield stress)",
    psi=hencky.psi,
    tau=hencky.tau,
    principal_tau=hencky.stretched_tau,
    pk1=hencky.pk1,
    wave_modulus=hencky.wave_modulus,
    flow=flow,
    liquid=True,
    needs_one_of=("viscosity", "consistency"),
    reads=("yield_shear", "flow_index"),
)

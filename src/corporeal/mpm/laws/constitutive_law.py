"""Interface of constitutive laws.

``psi`` is the stored energy per rest volume Ψ [J/m³], ``pk1`` the first Piola–Kirchhoff stress
P = ∂Ψ/∂F [Pa], ``tau`` the Kirchhoff stress τ = P Fᵀ [Pa]; all take stacks of deformation gradients
F, and μ and λ [Pa] of each.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from corporeal.mpm.laws.kinematics import Matrices, Scalars, Vectors


@dataclass(frozen=True)
class VolumetricEnergy:
    """One energy of volume, as functions of J alone, over λ."""

    psi: Callable[[Scalars], Scalars]
    """e²/2 [-]."""
    pressure: Callable[[Scalars], Scalars]
    """Its slope in ln J: the Kirchhoff pressure [-]."""
    modulus: Callable[[Scalars], Scalars]
    """Bound on the slope of that in ln J, for J and all smaller volumes [-]."""


def _log(J: Scalars) -> Scalars:
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.log(J)


def _stretched(J: Scalars) -> Scalars:
    most = np.maximum(J, 1.0)
    return most * (2.0 * most - 1.0)


QUADRATIC_VOLUMETRIC = VolumetricEnergy(
    psi=lambda J: 0.5 * (J - 1.0) ** 2, pressure=lambda J: J * (J - 1.0), modulus=_stretched
)
"""e = J - 1."""
LOGARITHMIC_VOLUMETRIC = VolumetricEnergy(psi=lambda J: 0.5 * _log(J) ** 2, pressure=_log, modulus=np.ones_like)
"""e = ln J."""


Number = Float[np.ndarray, " P"] | float


def lame_parameters(young_pa: Number, poisson: Number) -> tuple[Number, Number]:
    """Lamé's constants (μ, λ) [Pa].

    μ = E / 2(1 + ν),  λ = E ν / ((1 + ν)(1 - 2ν))
    """
    return (young_pa / (2.0 * (1.0 + poisson)), young_pa * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)))


@dataclass(frozen=True)
class YieldParameters:
    """What a return map reads of the material of P particles: columns of ``mpm.substance``."""

    mu: Scalars
    """[Pa]"""
    lam: Scalars
    """[Pa]"""
    yield_stress: Scalars
    """σ_y [Pa]"""
    hardening: Scalars
    """H [Pa]"""
    cone: Scalars
    """Slope α of the cone [-]."""
    apex: Scalars
    """tr ε at the cone's apex, p₀/K [-]."""
    drag: Scalars
    """K_c/dtⁿ [Pa]: by a shear Δ in this step a liquid's stress exceeds its yield stress by
    K_c (Δ/dt)ⁿ."""
    flow_index: Scalars
    """n [-]"""

    def of(self, chosen: np.ndarray) -> "YieldParameters":
        """Return the numbers of some of the particles."""
        return YieldParameters(*(getattr(self, f.name)[chosen] for f in fields(self)))


class ReturnMapResult(NamedTuple):
    """What became of deformation gradients whose trial was checked against a yield surface."""

    F: Matrices
    """Elastic part that is left."""
    plastic_strain: Scalars
    """Increment of the equivalent plastic strain √(2/3) ‖Δε‖ [-]."""
    volume: Scalars
    """New volume correction v_c: logarithmic expansion that carried no stress [-]."""
    loss: Scalars
    """Plastic work per rest volume τ : Δε_p [J/m³], with the stress after the return.

    This is what the grid really pays. The elastic energy given up would also count the overshoot of the trial, for
    which no force did work: several times too much where a step passes the yield strain.
    """


@dataclass(frozen=True)
class ConstitutiveLaw:
    """One law, whole. Its number is in ``types.Law``, its twin in C++ in ``formulas/laws.h``."""

    name: str
    """As figures and reports write it."""
    source: str
    """Who published it: author, year, where in it."""
    psi: Callable[[Matrices, Scalars, Scalars], Scalars]
    tau: Callable[[Matrices, Scalars, Scalars], Matrices]
    pk1: Callable[[Matrices, Scalars, Scalars], Matrices]
    wave_modulus: Callable[[Matrices, Scalars, Scalars], Scalars]
    """Bound on ρ₀ c² [Pa]: no ∂τᵢᵢ/∂ln σᵢ along a principal axis exceeds it."""
    volumetric: VolumetricEnergy | None = None
    """Its energy of volume; None: its pressure never comes from a mean, and it may lock."""
    principal_tau: Callable[[Vectors, Scalars, Scalars], Vectors] | None = None
    """τ along the principal axes from the stretches Σ, which is less work; None: as ``tau``."""
    flow: Callable[[Matrices, YieldParameters, Scalars, Scalars], ReturnMapResult] | None = None
    """Return map of trial F: numbers, equivalent plastic strain and volume correction so far.

    None: it is elastic. Who flows is elastic as Hencky's law is.
    """
    granular: bool = False
    """Whether it is of grains, which bear no tension beyond their cohesion and do not ring."""
    liquid: bool = False
    """Whether it takes any shape: it remembers its volume alone, and no wave of shear."""
    needs: tuple[str, ...] = ()
    """Fields of ``types.Material`` that it cannot do without, besides E, ν and ρ."""
    needs_one_of: tuple[str, ...] = ()
    """Fields of which it needs any."""
    reads: tuple[str, ...] = ()
    """Fields that it takes as 0 where the library has none."""

    @property
    def fields(self) -> tuple[str, ...]:
        """Fields of ``types.Material`` that it reads, besides E, ν and ρ."""
        return (*self.needs, *self.needs_one_of, *self.reads)

    @property
    def flows(self) -> bool:
        """Whether it has a return map: its particles remember more than F."""
        return self.flow is not None

    @property
    def ductile(self) -> bool:
        """Whether it yields and keeps its volume, so that a wall of it folds along hinges."""
        return self.flows and not self.loose

    @property
    def loose(self) -> bool:
        """Whether neighbours part: its shape is where its particles are, not what F says."""
        return self.granular or self.liquid

    @property
    def full_name(self) -> str:
        """Elasticity and, where it flows, plasticity."""
        if self.liquid:
            return self.name
        return f"Hencky + {self.name}" if self.flows else self.name

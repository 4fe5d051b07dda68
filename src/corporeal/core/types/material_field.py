"""Materials, structures and masses of a scene."""

from dataclasses import dataclass, field
from enum import Enum
from typing import Literal

import numpy as np
from jaxtyping import Float

from corporeal.core.types.description import MassEvidence, PartDescription, Provenance


class Law(Enum):
    """How a material answers to strain: each is defined in the file of its name in ``mpm/laws``."""

    COROTATED = 0
    NEO_HOOKEAN = 1
    HENCKY = 2
    DRUCKER_PRAGER = 3
    """Hencky elasticity with the Drucker–Prager cone: sand, soil, snow."""
    VON_MISES = 4
    """Hencky elasticity with the von Mises cylinder: metals, plasticine."""
    FLUID = 5
    """Pressure of its volume, and a shear stress that its rate makes: liquids and pastes."""


@dataclass(frozen=True)
class Material:
    """A grounded material: numbers that were looked up, never invented. All SI."""

    name: str
    law: Law
    young_pa: float
    """Young's modulus as measured [Pa]; what is simulated is ``Discretization.simulated_young_pa``."""
    poisson: float
    """Poisson's ratio [-]."""
    density: float
    """Mass density [kg/m³]."""
    yield_stress: float | None = None
    """Von Mises yield stress [Pa]; None where the law does not yield."""
    strength: float | None = None
    """Of what breaks before it yields: in bending or in tension, of a whole bar [Pa]."""
    friction_angle: float | None = None
    """Internal friction angle of a granular material [rad]."""
    cohesion: float | None = None
    """Of a granular material [Pa]."""
    hardening: float = 0.0
    """Linear isotropic hardening modulus of a metal [Pa]."""
    friction: float = 0.5
    """This surface's own sliding friction, combined where no pair is measured [-]."""
    restitution: float = 0.5
    """Normal restitution where rigid meets rigid [-]."""
    loss: float = 0.0
    """Loss factor at an impact: tan δ of the bulk at an impact's frequencies and strains [-]."""
    shell_thickness: float | None = None
    """How thin such objects are usually made [m]; None: solid as a rule."""
    viscosity: float | None = None
    """η of a liquid whose stress is proportional to its shear rate [Pa s]."""
    consistency: float | None = None
    """K_c of any other liquid or paste [Pa sⁿ]: its stress beyond yielding, at a rate of 1/s."""
    flow_index: float = 1.0
    """n of that: the stress grows with the rate to this power [-]."""
    yield_shear: float = 0.0
    """Shear stress below which a paste does not flow [Pa]."""
    strength_local: float | None = None
    """Tension that a brittle material bears over a square millimetre [Pa]; None: not brittle, or not measured."""
    grounds: dict[str, Provenance] = field(default_factory=dict)
    """Field name → why, for every measured number above."""

    @property
    def thickness_of_flow(self) -> float:
        """K_c of a liquid, whose viscosity it is where n is 1 [Pa sⁿ]; 0 of what is none."""
        return self.consistency or self.viscosity or 0.0


@dataclass(frozen=True)
class Structure:
    """How one part is built."""

    kind: Literal["solid", "shell", "filled"]
    thickness: float | None = None
    """Of the wall of a shell, or of what is filled [m]."""
    reason: str = ""
    contents: Material | None = None
    """What is behind the wall of what is filled; None: air."""
    fill: float = 0.0
    """Share of the cavity inside the wall that the contents take up, in [0, 1]."""
    loose: bool = False
    """Whether the contents lie at the bottom, as liquids and grains do; else they are all over."""
    inflated: bool = False
    """Whether wall and contents, sealed air, are one soft solid: of mass over volume all through.
    """
    gauge_pressure: float | None = None
    """Pressure of air sealed behind an elastic wall that bears more than the air does, above that around it [Pa]; None:
    there is none, or the air bears more."""
    rebound: float | None = None
    """Restitution that rules ask of an inflated ball of its name [-]; None: none is known."""
    solidity: float = 1.0
    """Share of a solid's shape that is material, the rest being air between its pieces; 1: all."""
    holds: str = ""
    """What moves by itself behind the wall of a shell, as an object of its own; "": nothing."""
    sealed: bool = False
    """Whether air is sealed behind a wall that resists a dent more than the air does."""


@dataclass(frozen=True)
class PartComponent:
    """One of several objects that share a part's mesh."""

    words: PartDescription
    material: Material
    structure: Structure


@dataclass(frozen=True)
class WeighedHypothesis:
    """One way the parts of an object may be, with what it then weighs."""

    words: str
    """Materials and builds of all parts that are in doubt."""
    probability: float
    """After the evidence, in [0, 1]."""
    prior: float
    """Before it, in [0, 1]."""
    mass: float
    """Median of its draws [kg]."""


@dataclass(frozen=True)
class AnsweredMass:
    """What one of several answers says that an object weighs."""

    mass: float
    """Median over its own ways and ranges, without outside evidence [kg]."""
    judged: float | None
    """What it was judged to weigh outright [kg]; None: not asked, or no usable answer."""
    low: float
    """5 % [kg]."""
    high: float
    """95 % [kg]."""
    words: str
    """Its likeliest way, as in ``WeighedHypothesis``."""
    probability: float
    """How likely it takes that way to be, in [0, 1]."""


@dataclass(frozen=True)
class MassPosterior:
    """What one object may weigh, over all ways it may be, and over all ranges."""

    object: str
    mass: float
    """Median [kg]: it minimises the expected error of the logarithm."""
    low: float
    """5 % [kg]."""
    high: float
    """95 % [kg]."""
    mass_without: float
    """Median without outside evidence [kg]."""
    low_without: float
    """[kg]"""
    high_without: float
    """[kg]"""
    hypotheses: tuple[WeighedHypothesis, ...] = ()
    """Likeliest first."""
    evidence: MassEvidence | None = None
    warning: str = ""
    """Where outside evidence contradicts all that was drawn: what would reconcile them."""
    answers: tuple[AnsweredMass, ...] = ()
    """Of each of several answers; empty: one was given."""


@dataclass(frozen=True)
class MaterialField:
    """What every part is made of; K parts in the catalogue's order."""

    materials: tuple[Material, ...]
    """One per part."""
    structures: tuple[Structure, ...]
    """One per part."""
    words: tuple[PartDescription, ...]
    """The answer each material was chosen from, one per part."""
    friction: Float[np.ndarray, "K1 K1"]
    """Sliding friction between parts [-], K1 = K + 1; the last row and column are the floor and the walls."""
    restitution: Float[np.ndarray, "K1 K1"]
    """Newton's coefficient between rigid parts [-]; last row and column as above."""
    pieces: tuple[tuple[PartComponent, ...], ...] = ()
    """Per part, of what it consists where its mesh does not tell; empty: nowhere more than one."""
    mixtures: tuple[MassPosterior, ...] = ()
    """Per object that a model described, what it may weigh; empty: no model was asked."""
    notes: tuple[str, ...] = ()
    """What a reader of the report should know of numbers from elsewhere, in sentences."""
    floor: Material | None = None
    """What the floor and the walls are made of; None: not known."""

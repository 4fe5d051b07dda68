"""Brittle fracture under impact: peak force from the energy, and tensile stress under it.

An impact's energy goes into a dent where the two touch (Hertz) and into bending the wall:
E = F²/2k + ⅖ F^(5/3)/k_h^(2/3). Under the force a wall is in tension as under a load on a small
circle, and a lump splits between two points. A square millimetre is stressed, not a whole bar: what
counts is the local strength, two to five times that of a bar.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, log, pi, sqrt
from typing import Literal

import numpy as np
from scipy.optimize import brentq

TUBE_COMPLIANCE = 0.149
"""P R³/(2 l D) by which an open ring gives between two opposite loads P, 2 l its length (Timoshenko, Theory of Plates
and Shells: inextensional deformation of a cylindrical shell) [-]."""
RING_MOMENT = 0.318
"""M/(P R) under such a load: 1/π (Timoshenko, Strength of Materials) [-]."""
PLATE_COMPLIANCE = 0.0148
"""w D/(P b²) of a simply supported plate of sides 1.3 : 1 under a load in its middle (Timoshenko, Theory of Plates and
Shells, table 23) [-]."""
LUMP_TENSION_FACTOR = 0.9
"""Tension over F/D² in a lump that is pressed between two points (Hiramatsu and Oka 1966) [-]."""
LUMP_STRENGTH_RATIO = 1.0 / 3.0
"""Of the local strength: a lump is stressed all through, as a bar is [-]."""
MIN_FORCE_N, MAX_FORCE_N = 1e-9, 1e12
"""Forces between which peak forces are looked for [N]."""

BrittleForm = Literal["closed", "tube", "plate", "lump"]
"""Of a wall that goes all around, an open vessel or bottle, a flat sheet, and what has no wall."""
BreakageWord = Literal["holds", "may break", "would break"]
CERTAIN_BREAK_ENERGY_RATIO = 10.0
"""Ratio to the energy that breaks half of such parts, from which breakage is certain [-]."""


@dataclass(frozen=True)
class ElasticSolid:
    """Elastic constants of an isotropic solid."""

    young_pa: float
    """E [Pa]."""
    poisson: float
    """ν [-]"""

    @property
    def compliance(self) -> float:
        """(1 - ν²)/E [1/Pa]."""
        return (1.0 - self.poisson**2) / self.young_pa


@dataclass(frozen=True)
class BrittlePart:
    """The part that is struck."""

    form: BrittleForm
    solid: ElasticSolid
    strength: float
    """Local tensile strength [Pa]."""
    radius: float
    """Of curvature where it is struck [m]; of a plate, of what strikes it."""
    thickness: float = 0.0
    """Of its wall or sheet [m]; 0 of a lump."""
    length: float = 0.0
    """Of a tube, or the shorter side of a plate [m]; of a lump its thickness."""
    other_radius: float = inf
    """Of curvature of what strikes it [m], if that is not flat."""

    @property
    def rigidity(self) -> float:
        """D = E t³/12 (1 - ν²) [N m]."""
        return self.thickness**3 / (12.0 * self.solid.compliance)

    @property
    def shell_stiffness(self) -> float:
        """Of a closed round wall under a point load, 4 E t²/(R √(3 (1 - ν²))) [N/m] (Reissner)."""
        poisson = self.solid.poisson
        plain = 4.0 * self.solid.young_pa * self.thickness**2
        return plain / (self.radius * sqrt(3.0 * (1.0 - poisson**2)))

    @property
    def stiffness(self) -> float:
        """Of the wall under a point load [N/m]."""
        if self.form == "closed":
            return self.shell_stiffness
        if self.form == "tube":
            return self.length * self.rigidity / (TUBE_COMPLIANCE * self.radius**3)
        if self.form == "plate":
            return self.rigidity / (PLATE_COMPLIANCE * self.length**2)
        return inf

    def hertz(self, other: ElasticSolid) -> float:
        """k_h = 4/3 E* √R [N/m^(3/2)]."""
        return 4.0 / 3.0 * sqrt(self.touch) / (self.solid.compliance + other.compliance)

    @property
    def touch(self) -> float:
        """Radius of both surfaces together, 1/R = 1/R_a + 1/R_c [m]."""
        return 1.0 / (1.0 / self.radius + 1.0 / self.other_radius)

    def energy(self, force: float, other: ElasticSolid) -> float:
        """Of the impact that makes a peak force [J]."""
        dent = 0.4 * force ** (5.0 / 3.0) / self.hertz(other) ** (2.0 / 3.0)
        return 0.5 * force**2 / self.stiffness + dent

    def force(self, energy: float, other: ElasticSolid) -> float:
        """Peak force of an impact [N]."""
        return _root(lambda f: self.energy(f, other) - energy)

    def tension(self, force: float, other: ElasticSolid) -> float:
        """Largest tension under a force [Pa].

        3 F/(2 π t²) ((1 + ν) ln(L/r) + .6) with Westergaard's radius r of the loaded circle, or larger where the wall
        is pressed flat; a tube adds what bends it oval.
        """
        if self.form == "lump":
            return LUMP_TENSION_FACTOR * force / self.length**2
        t, R = self.thickness, self.radius
        touch = (0.75 * force * self.touch * (self.solid.compliance + other.compliance)) ** (1.0 / 3.0)
        r = sqrt(1.6 * touch**2 + t**2) - 0.675 * t if touch < 1.72 * t else touch
        reach = 2.0 * self.length / pi if self.form == "plate" else sqrt(R * t)
        if self.form != "plate":
            r = max(r, sqrt(R * force / self.shell_stiffness))
        local = (1.0 + self.solid.poisson) * log(max(1.0, reach / r)) + 0.6
        oval = 6.0 * RING_MOMENT * R / self.length if self.form == "tube" else 0.0
        return force / t**2 * (1.5 / pi * local + oval)

    def breaking_energy(self, other: ElasticSolid) -> float:
        """E₅₀ [J]: of an impact under which the tension is the strength."""
        bears = self.strength * (LUMP_STRENGTH_RATIO if self.form == "lump" else 1.0)
        return self.energy(_root(lambda f: self.tension(f, other) - bears), other)


def _root(missing: Callable[[float], float]) -> float:
    """Force [N] at which what is missing changes its sign."""
    return float(np.asarray(brentq(missing, MIN_FORCE_N, MAX_FORCE_N)).item())


def breakage_word(ratio: float) -> BreakageWord:
    """Return the word for the outcome of an impact of so many times E₅₀."""
    if ratio < 1.0:
        return "holds"
    return "may break" if ratio <= CERTAIN_BREAK_ENERGY_RATIO else "would break"

"""Restitution of layered sheets under flat crush.

Corrugated board is stiff in its plane and weak across its flutes, which fold at a pressure that hardly changes until
they lie flat (flat crush). An impact that presses harder than that is work against this pressure, on the volume that is
crushed, and lost; what is stored meanwhile in the ball and in the sheet comes back.
"""

import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from math import log, pi, sqrt

from scipy.optimize import brentq

from corporeal.core.deserialize import from_plain
from corporeal.core.types import Material
from corporeal.materials.contact_pairs import RestitutionLaw, compliance_share
from corporeal.materials.loss_restitution import restitution_of_loss
from corporeal.materials.restitution_speed import material_at_speed, plane_strain_compliance

PACKED_STRAIN_FACTOR = 1.4
"""A cellular solid is packed at a strain of 1 - 1.4 of its relative density (Gibson and Ashby, Cellular Solids, 1997,
§4.3; recalled)."""
MAX_CONTACT_RADIUS_RATIO = 1.0
"""Radius of a contact over the ball's, at most [-]."""


@dataclass(frozen=True)
class LayeredMaterial:
    """How a material of layers answers across them."""

    of: str
    """Its name."""
    young_across_pa: float
    crush_pa: float
    """Pressure at which its layers fold."""
    solid_kg_m3: float
    """Density of what its layers are made of."""
    source: str
    """Key of ``materials.sources``."""


@dataclass(frozen=True)
class _LayeredTable:
    layered: tuple[LayeredMaterial, ...]


@cache
def layered_materials() -> dict[str, LayeredMaterial]:
    """Every material that is weak across its layers, by its name."""
    text = files("corporeal.materials").joinpath("pairs.toml").read_text(encoding="utf-8")
    return {one.of: one for one in from_plain(_LayeredTable, tomllib.loads(text)).layered}


@dataclass(frozen=True)
class ImpactingBall:
    """What strikes a sheet."""

    material: Material
    mass: float
    """[kg]"""
    radius: float
    """[m]"""


@dataclass(frozen=True)
class LayeredSheet:
    """A sheet that is struck across its layers, and cannot go away."""

    material: Material
    thickness: float
    """[m]"""

    @property
    def layers(self) -> LayeredMaterial:
        """How it answers across them."""
        return layered_materials()[self.material.name]

    @property
    def depth(self) -> float:
        """How deep it can be crushed [m]."""
        packed = PACKED_STRAIN_FACTOR * self.material.density / self.layers.solid_kg_m3
        return self.thickness * max(0.0, 1.0 - packed)


@dataclass(frozen=True)
class _CrushContact:
    """A ball that crushes a sheet: uniform pressure p on a disc of radius a = x R."""

    pressure: float
    """p [Pa]"""
    both: float
    """1/E*, the compliance of ball and sheet [1/Pa]."""
    ball: float
    """The ball's part of it [1/Pa]."""
    radius: float
    """R [m]"""

    def stored(self, x: float) -> float:
        """Energy in strain [J]: ½ F u with u = 16 p a/(3π E*) (Johnson, 1985, §3.4)."""
        return 8.0 / 3.0 * self.pressure**2 * self.both * (x * self.radius) ** 3

    def taken(self, x: float) -> float:
        """Work of the pressure [J]: on what is stored, and on the cap that is crushed.

        The cap, π a⁴/4R, is less by what flattens the ball: 4 a³ p/3 E*.
        """
        a = x * self.radius
        crushed = 0.25 * pi * a**4 / self.radius - 4.0 / 3.0 * self.pressure * self.both * a**3
        return self.stored(x) + self.pressure * max(crushed, 0.0)

    def depth(self, x: float) -> float:
        """How deep the sheet is crushed in the middle [m].

        The ball's centre is pressed in by 2 p a/E* and its rim by 4 p a/(π E*).
        """
        a = x * self.radius
        return 0.5 * a**2 / self.radius - (2.0 - 4.0 / pi) * self.pressure * self.ball * a


def material_across_layers(sheet: Material) -> Material:
    """Return a sheet's material as it is across its layers, as long as they do not fold."""
    young_pa = layered_materials()[sheet.name].young_across_pa
    return replace(sheet, young_pa=young_pa, restitution=restitution_of_loss(sheet.loss), poisson=0.0)


def crush_restitution(ball: ImpactingBall, sheet: LayeredSheet, speed: float, packed: float) -> float:
    """Restitution of a ball on a sheet that lies on something hard [-].

    Where the sheet is not thick enough to take all of an impact, the rest of it rebounds from what is packed.

    Args:
        ball: What strikes.
        sheet: What is struck.
        speed: Of the impact [m/s].
        packed: Restitution of the ball and the packed sheet [-].
    """
    made, struck = material_across_layers(sheet.material), material_at_speed(ball.material, speed)
    of_sheet = compliance_share(made, struck)
    back = of_sheet * made.restitution**2 + (1.0 - of_sheet) * struck.restitution**2
    energy = 0.5 * ball.mass * speed**2
    if energy <= 0.0:
        return sqrt(back)
    of_ball = plane_strain_compliance(struck)
    both = of_ball / (1.0 - of_sheet)
    contact = _CrushContact(sheet.layers.crush_pa, both, of_ball, ball.radius)
    widest = _solve_increasing(contact.depth, sheet.depth)
    x = min(_solve_increasing(contact.taken, energy), widest)
    # A ball that sinks in deeper than to its middle crushes no wider hole.
    deeper = max(0.0, sheet.depth - contact.depth(x)) if x == MAX_CONTACT_RADIUS_RATIO else 0.0
    taken = contact.taken(x) + contact.pressure * pi * ball.radius**2 * deeper
    rest = max(energy - taken, 0.0)
    returned = back * min(contact.stored(x), energy) + packed**2 * rest
    return sqrt(min(back, returned / energy))


def crush_restitution_law(ball: ImpactingBall, sheet: LayeredSheet, speed: float, packed: float) -> RestitutionLaw:
    """Return how the restitution of a ball on a sheet changes about the speed of an impact.

    The power of the speed is that between this speed and a quarter of it.

    Args:
        ball: What strikes.
        sheet: What is struck.
        speed: Of the impact [m/s].
        packed: As in ``crush_restitution``.
    """
    whole, slower, now = (crush_restitution(ball, sheet, v, packed) for v in (0.0, 0.25 * speed, speed))
    power = max(0.0, log(slower / now) / log(4.0)) if min(slower, now) > 0.0 else 0.0
    return RestitutionLaw(now, speed, 0.0, power, 0.0, max(now, whole))


def _solve_increasing(grows: Callable[[float], float], value: float) -> float:
    """Return the x, ``MAX_CONTACT_RADIUS_RATIO`` at most, at which a function that grows has a value."""
    if grows(MAX_CONTACT_RADIUS_RATIO) <= value:
        return MAX_CONTACT_RADIUS_RATIO
    return float(brentq(lambda x: grows(x) - value, 0.0, MAX_CONTACT_RADIUS_RATIO))  # pyright: ignore[reportArgumentType]

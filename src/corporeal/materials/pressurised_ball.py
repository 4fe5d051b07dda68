"""Air sealed behind a wall: inflated balls as soft solids.

A limp skin that is pressed flat by x bears F = p A, with the area A = π (2 R x - x²) of the flat and the pressure p of
the air behind it. Hertz's force on a solid ball, 4/3 E* √R x^(3/2), is the same at x = R/5, a firm bounce, for E = 9 p
(ν = 0.2); its contact time is then within 15 % of the limp ball's from a light bounce to a kick. On a grid the skin
itself would be ten times too thick: it would stretch, or dent by itself as stiffly as the air does.

Where the skin dents less easily than the air behind it is pressed (Reissner's k = 4 E t²/(R √(3 (1
- ν²))) against 2π R p) but is elastic, a racquetball, both are springs side by side, and air bears the more of an
impact the harder it is: ``equivalent_solid``. What flows when it is dented, a table tennis ball, and what leaks, a
rubber duck, stays a wall.
"""

from dataclasses import dataclass, replace
from math import pi, sqrt

from scipy.optimize import brentq

from corporeal.core.types import Law, Material, MeasuredRange, Provenance
from corporeal.materials.loss_restitution import loss_of_restitution, restitution_of_loss
from corporeal.materials.restitution_speed import is_stated_by_person
from corporeal.mpm.constants import AIR_DENSITY

ATMOSPHERIC_PRESSURE_PA = 101_325.0
"""[Pa]"""
REFERENCE_SQUEEZE_RATIO = 0.2
"""Depth over radius at which air and solid press alike [-]."""
MODULUS_PRESSURE_RATIO = 9.0
"""E/p [-]"""
MAX_SQUEEZE_RATIO = 0.9
"""Deepest dent over the radius that is reckoned with [-]."""
SEALED_AIR_POISSON_RATIO = 0.2
SOLID_BALL_STIFFNESS_RATIO = 0.8
"""Force over depth of a solid ball, over E R [-]: Hertz's 4/3 √SQUEEZE/(1 - ν²) of rubber."""
HEAT_RATIO = 1.4
"""γ of air [-]."""
INFLATED_BALL_RESTITUTION = 0.8
"""Of inflated balls on a hard floor [-]: the middle of what rules ask, with the drag of air taken off: footballs
.82–.92, basketballs .75–.83, korfballs .72–.80, tennis balls .75–.79."""
RULED_RESTITUTION_TOLERANCE = 0.04
"""How far from the middle of their range rules let a ball rebound [-]."""
ESTIMATE_SOURCE = "engineering-estimate"


def lost_volume_fraction(squeeze: float) -> float:
    """Share of its volume that a ball loses when it is pressed flat by x: V = π x² (R - x/3) [-].

    Args:
        squeeze: x/R [-].
    """
    return 0.75 * squeeze**2 * (1.0 - squeeze / 3.0)


def pressed_gauge_pressure(gauge: float, squeeze: float = REFERENCE_SQUEEZE_RATIO) -> float:
    """Gauge pressure [Pa] behind the skin of a ball that is pressed flat.

    The cap is lost adiabatically: p V^γ. Air at no gauge pressure resists too.

    Args:
        gauge: Before [Pa].
        squeeze: Depth over radius [-].
    """
    return (ATMOSPHERIC_PRESSURE_PA + gauge) * (
        1.0 - lost_volume_fraction(squeeze)
    ) ** -HEAT_RATIO - ATMOSPHERIC_PRESSURE_PA


def wall_stiffness(skin: Material, thickness: float, radius: float) -> float:
    """Force over depth where a spherical wall is dented, k = 4 E t²/(R √(3 (1 - ν²))) [N/m].

    Reissner, Stresses and small displacements of shallow spherical shells, J. Math. Phys. 25 (1946). A thick wall is
    dented where it is touched, too: never more than ``SOLID_BALL_STIFFNESS_RATIO`` E R.
    """
    thin = 4.0 * skin.young_pa * thickness**2 / (radius * sqrt(3.0 * (1.0 - skin.poisson**2)))
    return thin / (1.0 + thin / (SOLID_BALL_STIFFNESS_RATIO * skin.young_pa * radius))


def is_carried_by_air(gauge: float, skin: Material, thickness: float, radius: float) -> bool:
    """Return whether a ball is carried by its air rather than by its skin when it is dented.

    Args:
        gauge: Of the air [Pa].
        skin: Material of the wall.
        thickness: Of the wall [m].
        radius: Of the ball [m].
    """
    return 2.0 * pi * radius * pressed_gauge_pressure(gauge) > wall_stiffness(skin, thickness, radius)


@dataclass(frozen=True)
class InflatedBall:
    """A ball with an elastic wall and air sealed in it."""

    gauge_pressure: float
    """Pressure above that of the air around it [Pa]."""
    skin: Material
    thickness: float
    """Of the wall [m]."""
    radius: float
    """[m]"""

    @property
    def spring(self) -> float:
        """Of the wall [N/m]."""
        return wall_stiffness(self.skin, self.thickness, self.radius)

    def wall_energy(self, squeeze: float) -> float:
        """Return what the wall stores at a depth over the radius [J]."""
        return 0.5 * self.spring * (squeeze * self.radius) ** 2

    def air_energy(self, squeeze: float) -> float:
        """Return the work on the air inside less that of the air outside [J]."""
        volume, lost = 4.0 / 3.0 * pi * self.radius**3, lost_volume_fraction(squeeze)
        inside = (ATMOSPHERIC_PRESSURE_PA + self.gauge_pressure) * ((1.0 - lost) ** (1.0 - HEAT_RATIO) - 1.0)
        return volume * (inside / (HEAT_RATIO - 1.0) - ATMOSPHERIC_PRESSURE_PA * lost)

    def squeeze(self, energy: float) -> float:
        """Depth over radius at which an impact of so much energy [J] is stored."""

        def excess(squeeze: float) -> float:
            return self.wall_energy(squeeze) + self.air_energy(squeeze) - energy

        if excess(MAX_SQUEEZE_RATIO) <= 0.0:
            return MAX_SQUEEZE_RATIO
        return float(brentq(excess, 0.0, MAX_SQUEEZE_RATIO))  # pyright: ignore[reportArgumentType]


@dataclass(frozen=True)
class EquivalentSolid:
    """The soft solid that a sealed ball is in one impact."""

    young_pa: float
    """[Pa]"""
    loss: float
    """[-]"""


def equivalent_solid(ball: InflatedBall, energy: float) -> EquivalentSolid:
    """Young's modulus and loss factor of the solid that resists an impact as wall and air do.

    Hertz's force 4/3 E* √R x^(3/2) is that of wall and air, k x + p A, at the depth at which both have stored the
    impact (of a light one: at ``REFERENCE_SQUEEZE_RATIO``). Air loses nothing; the wall loses of what it stores.

    Args:
        ball: What is struck.
        energy: Of the impact [J].
    """
    depth = max(ball.squeeze(energy), REFERENCE_SQUEEZE_RATIO)
    flat = pi * ball.radius**2 * (2.0 * depth - depth**2)
    force = ball.spring * depth * ball.radius + pressed_gauge_pressure(ball.gauge_pressure, depth) * flat
    plane = force / (4.0 / 3.0 * ball.radius**2 * depth**1.5)
    wall, air = ball.wall_energy(depth), ball.air_energy(depth)
    return EquivalentSolid(plane * (1.0 - SEALED_AIR_POISSON_RATIO**2), ball.skin.loss * wall / (wall + air))


def inflated_ball_material(ball: InflatedBall) -> Material:
    """Return the soft solid that a sealed ball with an elastic wall is, struck lightly.

    How hard an impact changes it says ``equivalent_solid``.
    """
    light, skin = equivalent_solid(ball, 0.0), ball.skin
    density = AIR_DENSITY * (1.0 + ball.gauge_pressure / ATMOSPHERIC_PRESSURE_PA)
    bounces = restitution_of_loss(light.loss)
    why = f"wall of {skin.name} and air at {ball.gauge_pressure / 1e3:.3g} kPa act in parallel"
    values = {
        "young_pa": _ground(0.5 * light.young_pa, light.young_pa, 1.5 * light.young_pa, why),
        "poisson": _ground(0.1, SEALED_AIR_POISSON_RATIO, 0.3, "as of a ball full of air"),
        "density": _ground(density, density, density, "air at this pressure"),
        "restitution": _ground(0.0, bounces, 1.0, "the wall's share of the loss"),
        "loss": _ground(0.0, light.loss, max(skin.loss, light.loss), "of the wall, air loses nothing"),
    }
    return _material(f"air at {ball.gauge_pressure / 1e3:.3g} kPa behind {skin.name}", values)


def sealed_air_material(gauge: float) -> Material:
    """Return what air sealed in a ball is simulated as: a soft solid, as heavy as the air.

    Args:
        gauge: Pressure above that of the air around it [Pa].
    """
    young_pa = MODULUS_PRESSURE_RATIO * pressed_gauge_pressure(gauge)
    density = AIR_DENSITY * (1.0 + gauge / ATMOSPHERIC_PRESSURE_PA)
    why = f"a limp ball at {gauge / 1e3:.3g} kPa presses as a solid of nine times the pressure does"
    values = {
        "young_pa": _ground(0.85 * young_pa, young_pa, 1.15 * young_pa, why),
        "poisson": _ground(0.1, SEALED_AIR_POISSON_RATIO, 0.3, "air lets itself be pressed together"),
        "density": _ground(density, density, density, "air at this pressure"),
        "restitution": _ground(0.73, INFLATED_BALL_RESTITUTION, 0.88, "what rules of sports ask of inflated balls"),
        "loss": _ground(
            loss_of_restitution(0.88),
            loss_of_restitution(INFLATED_BALL_RESTITUTION),
            loss_of_restitution(0.73),
            "from the restitution",
        ),
    }
    return _material(f"air at {gauge / 1e3:.3g} kPa", values)


def sealed_wall_material(skin: Material) -> Material:
    """Let a sealed wall that is struck too lightly to be seen to flex rebound as its bulk does.

    A material's restitution is that of solid bodies whose point of contact yields. A closed wall is dented over a wide
    place instead, and gives back what its loss factor leaves. One that a person stated stays.
    """
    if is_stated_by_person(skin, "restitution"):
        return skin
    loss = skin.grounds["loss"].range if "loss" in skin.grounds else None
    most, least = (loss.low, loss.high) if loss is not None else (skin.loss, skin.loss)
    bounces = restitution_of_loss(skin.loss)
    why = "a closed wall loses what its loss factor says; no point of contact yields"
    ground = _ground(restitution_of_loss(least), bounces, restitution_of_loss(most), why)
    return replace(skin, restitution=bounces, grounds=skin.grounds | {"restitution": ground})


def solid_with_ruled_restitution(material: Material, rebound: float | None) -> Material:
    """Let a solid ball that is struck as a rigid body rebound as its rules ask, if there are any.

    Its loss factor stays: what is hard does not lose its rebound in its bulk. A restitution that a person stated stays,
    too.

    Args:
        material: What it is made of.
        rebound: Restitution on a hard floor [-]; None: no rule is known.
    """
    if rebound is None or is_stated_by_person(material, "restitution"):
        return material
    ground = _ground(
        rebound - RULED_RESTITUTION_TOLERANCE,
        rebound,
        rebound + RULED_RESTITUTION_TOLERANCE,
        "what the rules of its sport ask for",
    )
    grounds = material.grounds | {"restitution": ground}
    return replace(material, restitution=rebound, grounds=grounds)


def air_with_ruled_restitution(inner: Material, rebound: float | None) -> Material:
    """Let a ball rebound as its rules ask, where there are any.

    How it is made is not known then: a futsal ball has something in its bladder that takes energy.

    Args:
        inner: What wall and air are simulated as.
        rebound: Restitution on a hard floor [-]; None: no rule is known.
    """
    if rebound is None:
        return inner
    lossy = loss_of_restitution(rebound)
    grounds = {
        "restitution": _ground(
            rebound - RULED_RESTITUTION_TOLERANCE,
            rebound,
            rebound + RULED_RESTITUTION_TOLERANCE,
            "what the rules of its sport ask for",
        ),
        "loss": _ground(
            loss_of_restitution(rebound + RULED_RESTITUTION_TOLERANCE),
            lossy,
            loss_of_restitution(rebound - RULED_RESTITUTION_TOLERANCE),
            "from the restitution",
        ),
    }
    grounds = inner.grounds | grounds
    return replace(inner, restitution=rebound, loss=lossy, grounds=grounds)


def _ground(low: float, usual: float, high: float, reason: str) -> Provenance:
    return Provenance(usual, MeasuredRange(low, usual, high, ESTIMATE_SOURCE), "typical", reason)


def _material(name: str, grounds: dict[str, Provenance]) -> Material:
    """Give a material these values."""
    numbers = {key: ground.value for key, ground in grounds.items()}
    return Material(name=name, law=Law.NEO_HOOKEAN, grounds=grounds, **numbers)

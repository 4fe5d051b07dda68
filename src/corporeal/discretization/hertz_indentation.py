"""Depth of indentation of a ball that strikes a rigid plane."""

from math import pi, sqrt


def hertz_dent_of_ball(young_pa: float, poisson: float, density: float, speed: float) -> float:
    """Greatest dent of a ball that strikes a rigid plane, over its radius [-], at most 1.

    δ/R = (5π ρ v²/4 E*)^(2/5), E* = E/(1 - ν²): all of ½ m v² is stored by Hertz's force
    (Johnson, Contact Mechanics, 1985, §11.4). So E/5.7 doubles it.
    """
    plane = young_pa / (1.0 - poisson**2)
    return min(1.0, (1.25 * pi * density * speed**2 / plane) ** 0.4)


HERTZ_CONTACT_TIME_COEFFICIENT = 2.94
"""How long a ball touches what it dents, over the greatest dent by its speed (Hertz) [-]."""


def hertz_contact_time(mass: float, radius: float, speed: float, plane: float, most: float) -> float:
    """How long a ball touches a layer that it dents [s]: 2.94 δ/v; arguments: ``hertz_dent_of_layer``."""
    return HERTZ_CONTACT_TIME_COEFFICIENT * hertz_dent_of_layer(mass, radius, speed, plane, most) / speed


def hertz_dent_of_layer(mass: float, radius: float, speed: float, plane: float, most: float) -> float:
    """How much nearer a ball draws to a layer that it strikes [m].

    δ = (15 m v²/(16 E* √R))^(2/5) of a half-space (Johnson, Contact Mechanics, 1985, §11.4), and no more than the layer
    is thick.

    Args:
        mass: Of the ball [kg].
        radius: Of the ball [m].
        speed: [m/s]
        plane: E* of both [Pa].
        most: Thickness of the layer [m].
    """
    return min((15.0 * mass * speed**2 / (16.0 * plane * sqrt(radius))) ** 0.4, most)


HARDNESS_YIELD_RATIO = 2.8
"""Pressure under what is pressed into a metal, over its yield stress [-] (Tabor 1951)."""


def yield_mark_of_ball(strength: float, density: float, speed: float) -> float:
    """Depth to which a ball that yields is flattened by a rigid plane, over its radius [-].

    All of ½ m v² is work against the pressure 2.8 Y on the volume π R δ² that is pushed aside:
    δ/R = v √(2ρ/(3 · 2.8 Y)), at most 1.

    Args:
        strength: Yield stress Y [Pa].
        density: [kg/m³]
        speed: [m/s]
    """
    return min(1.0, speed * sqrt(2.0 * density / (3.0 * HARDNESS_YIELD_RATIO * strength)))


def dent_of_hollow_ball(
    young_pa: float, poisson: float, density: float, thickness: float, radius: float, speed: float
) -> float:
    """Greatest dent of a hollow ball that strikes a rigid plane, over its radius [-], at most 1.

    ½ m v² = ½ k δ² with m = 4π R² ρ t and Reissner's k = 4 E t²/(R √(3(1 - ν²))) (1946):
    δ/R = v √(π ρ R √(3(1 - ν²))/(E t)).
    """
    bend = sqrt(3.0 * (1.0 - poisson**2))
    return min(1.0, speed * sqrt(pi * density * radius * bend / (young_pa * thickness)))

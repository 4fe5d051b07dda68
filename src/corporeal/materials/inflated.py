"""Air sealed behind a wall: inflated balls as soft solids.

A limp skin that is pressed flat by x bears F = p A, with the area A = π (2 R x - x²) of the flat
and the pressure p of the air behind it. Hertz's force on a solid ball, 4/3 E* √R x^(3/2), is the
same at x = R/5, a firm bounce, for E = 9 p (ν = 0.2); its contact time is then within 15 % of the
limp ball's from a light bounce to a kick. On a grid the skin itself would be ten times too thick:
it would stretch, or dent by itself as stiffly as the air does.

Where the skin dents less easily than the air behind it is pressed (Reissner's k = 4 E t²/(R √(3 (1
- ν²))) against 2π R p), it stays a wall: a rubber duck, a table tennis ball.
"""

from math import pi, sqrt

from corporeal.materials.rebound import loss_of
from corporeal.mpm.constants import AIR_DENSITY
from corporeal.types import Ground, Law, Material, Range

ATMOSPHERE = 101_325.0
"""[Pa]"""
SQUEEZE = 0.2
"""Depth over radius at which air and solid press alike [-]."""
MODULUS_OVER_PRESSURE = 9.0
"""E/p [-]"""
POISSON = 0.2
HEAT_RATIO = 1.4
"""γ of air [-]."""
RESTITUTION = 0.8
"""Of inflated balls on a hard floor [-]: the middle of what rules ask of footballs (.79–.88) and
basketballs (.82–.87) and of tennis balls (.73–.76)."""
SOURCE = "engineering-estimate"


def pressed(gauge: float) -> float:
    """Gauge pressure [Pa] behind the skin of a ball pressed flat by ``SQUEEZE`` of its radius.

    The cap V = π x² (R - x/3) is lost, adiabatically: p V^γ. Air at no gauge pressure resists too.
    """
    lost = 0.75 * SQUEEZE**2 * (1.0 - SQUEEZE / 3.0)
    return (ATMOSPHERE + gauge) * (1.0 - lost) ** -HEAT_RATIO - ATMOSPHERE


def air_bears(gauge: float, skin: Material, thickness: float, radius: float) -> bool:
    """Tell whether a ball is carried by its air rather than by its skin when it is dented.

    Args:
        gauge: Of the air [Pa].
        skin: Material of the wall.
        thickness: Of the wall [m].
        radius: Of the ball [m].

    """
    wall = 4.0 * skin.young * thickness**2 / (radius * sqrt(3.0 * (1.0 - skin.poisson**2)))
    return 2.0 * pi * radius * pressed(gauge) > wall


def sealed_air(gauge: float) -> Material:
    """Return what air sealed in a ball is simulated as: a soft solid, as heavy as the air.

    Args:
        gauge: Pressure above that of the air around it [Pa].

    """
    young = MODULUS_OVER_PRESSURE * pressed(gauge)
    density = AIR_DENSITY * (1.0 + gauge / ATMOSPHERE)
    why = f"a limp ball at {gauge / 1e3:.3g} kPa presses as a solid of nine times the pressure does"
    values = {
        "young": (0.85 * young, young, 1.15 * young, why),
        "poisson": (0.1, POISSON, 0.3, "air lets itself be pressed together"),
        "density": (density, density, density, "air at this pressure"),
        "restitution": (0.73, RESTITUTION, 0.88, "what rules of sports ask of inflated balls"),
        "loss": (loss_of(0.88), loss_of(RESTITUTION), loss_of(0.73), "from the restitution"),
    }
    grounds = {
        name: Ground(usual, Range(low, usual, high, SOURCE), "typical", reason)
        for name, (low, usual, high, reason) in values.items()
    }
    numbers = {name: ground.value for name, ground in grounds.items()}
    return Material(
        name=f"air at {gauge / 1e3:.3g} kPa", law=Law.NEO_HOOKEAN, grounds=grounds, **numbers
    )

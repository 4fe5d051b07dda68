"""How restitution falls with the speed of an impact.

Two laws, by what takes the energy. A wound, foamed or rubber ball loses more of a harder impact, in proportion to its
speed: e(v) = e_r - s (v - v_r), with the speed v_r at which its restitution was rated. A metal yields where it is
struck: e ∝ v^(-1/4) (Johnson, Contact Mechanics, 1985, §11.5).
"""

import tomllib
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from math import pi, sqrt

from corporeal.core.deserialize import from_plain
from corporeal.core.types import Law, Material
from corporeal.materials.loss_restitution import loss_of_restitution, restitution_of_loss

NOMINAL_IMPACT_SPEED_M_S = 1.0
"""Speed at which restitution of pairs is stated where no other is given [m/s]."""
MIN_CARRIED_RESTITUTION, MAX_CARRIED_RESTITUTION = 0.12, 0.99
"""What a restitution that was carried to another speed may be [-]."""


@dataclass(frozen=True)
class RatedRestitution:
    """At which speed the restitution of a material was rated, and how it changes with it."""

    of: str
    """Name of the material."""
    speed_m_s: float
    slope_s_m: float
    """How much less it is for every m/s more."""
    source: str
    """Key of ``materials.sources``."""


@dataclass(frozen=True)
class _RatedTable:
    rated: tuple[RatedRestitution, ...]


@cache
def rated_restitutions() -> dict[str, RatedRestitution]:
    """Every material whose restitution is known to fall with speed, by its name."""
    text = files("corporeal.materials").joinpath("pairs.toml").read_text(encoding="utf-8")
    return {rating.of: rating for rating in from_plain(_RatedTable, tomllib.loads(text)).rated}


def material_at_speed(material: Material, speed: float) -> Material:
    """Return a material as it rebounds from an impact at this speed; what a person stated stays.

    Its loss factor changes so that its rebound does by as much.

    Args:
        material: With its values at the speed at which it was rated.
        speed: Of the impact [m/s].
    """
    rating = rated_restitutions().get(material.name)
    if rating is None:
        return material
    gained = rating.slope_s_m * (rating.speed_m_s - speed)
    changed = {}
    if not is_stated_by_person(material, "restitution"):
        changed["restitution"] = _bound_restitution(material.restitution + gained)
    if not is_stated_by_person(material, "loss"):
        changed["loss"] = loss_of_restitution(_bound_restitution(restitution_of_loss(material.loss) + gained))
    return replace(material, **changed)


def plane_strain_compliance(material: Material) -> float:
    """(1 - ν²)/E, what a material adds to 1/E* of a contact [1/Pa] (Johnson, 1985, §4.2)."""
    return (1.0 - material.poisson**2) / material.young_pa


def yield_restitution(a: Material, b: Material, speed: float) -> float:
    """Restitution of two bodies of which at least one yields where it is struck [-], at most 1.

    e = 3.8 (Y/E*)^(1/2) (½ m v²/Y R³)^(-1/8) of a ball (Johnson, Contact Mechanics, 1985, eq. 11.43; recalled), with
    the yield stress Y of the weaker and ½ m v²/Y R³ = 2/3 π ρ v²/Y.

    Args:
        a: One material.
        b: The other; the denser is taken for the ball's.
        speed: Of the impact [m/s].
    """
    weak = [m.yield_stress for m in (a, b) if m.law is Law.VON_MISES and m.yield_stress]
    if not weak or speed <= 0.0:
        return 1.0
    strength = min(weak)
    plane = 1.0 / sum(plane_strain_compliance(m) for m in (a, b))
    impact_number = 2.0 / 3.0 * pi * max(a.density, b.density) * speed**2 / strength
    return min(1.0, 3.8 * sqrt(strength / plane) * impact_number**-0.125)


def is_stated_by_person(material: Material, field: str) -> bool:
    """Return whether a person stated this number of a material."""
    ground = material.grounds.get(field)
    return ground is not None and ground.chosen_by == "annotation"


def _bound_restitution(restitution: float) -> float:
    return min(max(restitution, MIN_CARRIED_RESTITUTION), MAX_CARRIED_RESTITUTION)

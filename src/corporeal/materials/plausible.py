"""Can a number be true? Measured against what the default library says of objects alike."""

from collections.abc import Mapping
from dataclasses import dataclass

from corporeal.core.types import Law
from corporeal.materials.entry import Entry, plain
from corporeal.materials.quantities import QUANTITIES, UNITS, si
from corporeal.materials.shipped import shipped

WIDER = 3.0
"""How far a new material may lie beyond all that are like it, as a factor."""
COMPARED = ("young", "density", "yield_stress", "hardening", "shell_thickness")
"""What spans decades and carries a unit, so that a slip of the unit shows."""
YIELD_STRAIN = (5e-5, 0.3)
"""Yield stress over Young's modulus: from annealed pure metals to modelling clay."""


@dataclass(frozen=True)
class Doubt:
    """What is implausible about numbers."""

    what: str
    advice: str


def doubt(
    key: str, span: tuple[float, float], name: str, group: str, law: Law | None
) -> Doubt | None:
    """Say what is implausible about a range and what to do, or None.

    Args:
        key: Its key in the file, unit included.
        span: Low and high in that unit.
        name: The material's name in the file.
        group: The material's group, "" for none.
        law: The material's law, where it has a known one.

    """
    field, factor = si(key)
    quantity = QUANTITIES[field]
    low, high = (value * factor for value in span)
    bounds, whose = _expected(field, name, group, law)
    if bounds[0] <= low and high <= bounds[1]:
        return None
    what = (
        f"{low:.3g} to {high:.3g} {quantity.unit} is outside of what {whose} has: "
        f"{bounds[0]:.3g} to {bounds[1]:.3g} {quantity.unit}."
    )
    other = _other_unit(key, span, bounds)
    if other:
        return Doubt(what, f"In {other} it would fit: check the unit.")
    return Doubt(what, "Check the number; if it is true, add unusual = true to the range.")


def strain_doubt(values: Mapping[str, float]) -> Doubt | None:
    """Say that ``yield_stress`` and ``young`` [Pa] do not go together, or None."""
    if "yield_stress" not in values or not values.get("young"):
        return None
    strain = values["yield_stress"] / values["young"]
    if YIELD_STRAIN[0] <= strain <= YIELD_STRAIN[1]:
        return None
    what = f"yields at a strain of {strain:.2g}; solids yield between 5e-05 and 0.3."
    return Doubt(what, "Check the units of yield stress and modulus.")


def namesake(name: str) -> Entry | None:
    """Return the entry of the default library that goes by this name."""
    for entry in shipped("default").values():
        if plain(name) in map(plain, (entry.name, *entry.aliases)):
            return entry
    return None


def _expected(
    field: str, name: str, group: str, law: Law | None
) -> tuple[tuple[float, float], str]:
    """Return what may be true of ``field``, and of whom that was learnt."""
    quantity = QUANTITIES[field]
    world = (quantity.low, quantity.high)
    if field not in COMPARED:
        return world, "anything in this world"
    alike, whose = _alike(field, name, group, law)
    if not alike:
        return world, "anything in this world"
    ranges = [entry.ranges[field] for entry in alike]
    low, high = min(r.low for r in ranges), max(r.high for r in ranges)
    return (max(low / WIDER, world[0]), min(high * WIDER, world[1])), whose


def _alike(field: str, name: str, group: str, law: Law | None) -> tuple[list[Entry], str]:
    """Return the namesake in the default library; else those of its group and law."""
    own = namesake(name)
    if own and field in own.ranges:
        return [own], f"our {own.name}"
    alike = [e for e in shipped("default").values() if group and (e.group, e.law) == (group, law)]
    return [e for e in alike if field in e.ranges], f"any {group}"


def _other_unit(key: str, span: tuple[float, float], bounds: tuple[float, float]) -> str | None:
    """Return the unit in which the same figures would be plausible."""
    field, _ = si(key)
    for suffix, (unit, factor) in UNITS.items():
        fits = bounds[0] <= span[0] * factor and span[1] * factor <= bounds[1]
        if unit == QUANTITIES[field].unit and fits:
            return suffix
    return None

"""Can a number be true? Measured against what the default library says of objects alike."""

from collections.abc import Mapping
from dataclasses import dataclass

from corporeal.core.types import Law
from corporeal.materials.library_entry import MaterialEntry, comparable_name, shipped_library
from corporeal.materials.quantities import QUANTITIES, SI_OF_KEY_UNIT, parse_quantity_key

PLAUSIBLE_RANGE_FACTOR = 3.0
"""How far a new material may lie beyond all that are like it, as a factor."""
COMPARED_FIELDS = ("young_pa", "density", "yield_stress", "hardening", "shell_thickness")
"""What spans decades and carries a unit, so that a slip of the unit shows."""
YIELD_STRAIN_RANGE = (5e-5, 0.3)
"""Yield stress over Young's modulus: from annealed pure metals to modelling clay."""


@dataclass(frozen=True)
class ValueDoubt:
    """What is implausible about numbers."""

    what: str
    advice: str


def range_doubt(key: str, span: tuple[float, float], name: str, group: str, law: Law | None) -> ValueDoubt | None:
    """Describe what is implausible about a range and what to do, or None.

    Args:
        key: Its key in the file, unit included.
        span: Low and high in that unit.
        name: The material's name in the file.
        group: The material's group, "" for none.
        law: The material's law, where it has a known one.
    """
    field, factor = parse_quantity_key(key)
    quantity = QUANTITIES[field]
    low, high = (value * factor for value in span)
    bounds, whose = _expected_bounds(field, name, group, law)
    if bounds[0] <= low and high <= bounds[1]:
        return None
    what = (
        f"{low:.3g} to {high:.3g} {quantity.unit} is outside of what {whose} has: "
        f"{bounds[0]:.3g} to {bounds[1]:.3g} {quantity.unit}."
    )
    other = _other_unit(key, span, bounds)
    if other:
        return ValueDoubt(what, f"In {other} it would fit: check the unit.")
    return ValueDoubt(what, "Check the number; if it is true, add unusual = true to the range.")


def yield_strain_doubt(values: Mapping[str, float]) -> ValueDoubt | None:
    """State that ``yield_stress`` and ``young_pa`` [Pa] do not go together, or None."""
    if "yield_stress" not in values or not values.get("young_pa"):
        return None
    strain = values["yield_stress"] / values["young_pa"]
    if YIELD_STRAIN_RANGE[0] <= strain <= YIELD_STRAIN_RANGE[1]:
        return None
    what = f"yields at a strain of {strain:.2g}; solids yield between 5e-05 and 0.3."
    return ValueDoubt(what, "Check the units of yield stress and modulus.")


def default_namesake(name: str) -> MaterialEntry | None:
    """Return the entry of the default library that goes by this name."""
    for entry in shipped_library("default").values():
        if comparable_name(name) in map(comparable_name, (entry.name, *entry.aliases)):
            return entry
    return None


def _expected_bounds(field: str, name: str, group: str, law: Law | None) -> tuple[tuple[float, float], str]:
    """Return what may be true of ``field``, and of whom that was learnt."""
    quantity = QUANTITIES[field]
    world = (quantity.low, quantity.high)
    if field not in COMPARED_FIELDS:
        return world, "anything in this world"
    alike, whose = _similar_materials(field, name, group, law)
    if not alike:
        return world, "anything in this world"
    ranges = [entry.ranges[field] for entry in alike]
    low, high = min(r.low for r in ranges), max(r.high for r in ranges)
    return (max(low / PLAUSIBLE_RANGE_FACTOR, world[0]), min(high * PLAUSIBLE_RANGE_FACTOR, world[1])), whose


def _similar_materials(field: str, name: str, group: str, law: Law | None) -> tuple[list[MaterialEntry], str]:
    """Return the namesake in the default library; else those of its group and law."""
    own = default_namesake(name)
    if own and field in own.ranges:
        return [own], f"our {own.name}"
    alike = [e for e in shipped_library("default").values() if group and (e.group, e.law) == (group, law)]
    return [e for e in alike if field in e.ranges], f"any {group}"


def _other_unit(key: str, span: tuple[float, float], bounds: tuple[float, float]) -> str | None:
    """Return the unit in which the same figures would be plausible."""
    field, _ = parse_quantity_key(key)
    for suffix, (unit, factor) in SI_OF_KEY_UNIT.items():
        fits = bounds[0] <= span[0] * factor and span[1] * factor <= bounds[1]
        if unit == QUANTITIES[field].unit and fits:
            return suffix
    return None

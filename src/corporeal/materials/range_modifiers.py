"""How an object's use or treatment narrows its material's range, in words and bands."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from corporeal.core.types import MeasuredRange
from corporeal.materials.quantities import QUANTITIES, parse_quantity_key


@dataclass(frozen=True)
class RangeModifier:
    """One way in which objects of a material are used or made."""

    words: str
    bands: Mapping[str, tuple[float, float]]
    """Field of ``Material`` → low and high [SI]."""


def range_modifiers(material: str) -> tuple[RangeModifier, ...]:
    """Return what is known of a material's uses; nothing for most."""
    return _table().get(material, ())


def range_modifier_problems(ranges: Mapping[str, Mapping[str, MeasuredRange]]) -> list[str]:
    """Return what is wrong with the table, one sentence each.

    Args:
        ranges: Material → field → measured range, of the library that the table belongs to.

    """
    found = []
    for material, known in _table().items():
        if material not in ranges:
            found.append(f"treatments: there is no material {material!r}")
            continue
        for treatment in known:
            for field, (low, high) in treatment.bands.items():
                whole = ranges[material].get(field)
                if whole is None or not is_within_range(low, high, whole):
                    found.append(
                        f"{material}: {treatment.words!r} puts {field} at {low:g} to {high:g} "
                        f"{QUANTITIES[field].unit}, outside the measured range"
                    )
    return found


def is_within_range(low: float, high: float, whole: MeasuredRange) -> bool:
    """Return whether a band lies within a measured range."""
    slack = 1e-9 * abs(whole.high)
    return whole.low - slack <= low < high <= whole.high + slack


@cache
def _table() -> dict[str, tuple[RangeModifier, ...]]:
    text = files("corporeal.materials").joinpath("range_modifiers.toml").read_text(encoding="utf-8")
    return {
        material: tuple(_read_modifier(words, row) for words, row in known.items())
        for material, known in tomllib.loads(text).items()
    }


def _read_modifier(words: str, row: Mapping[str, list[float]]) -> RangeModifier:
    bands = {}
    for key, (low, high) in row.items():
        field, factor = parse_quantity_key(key)
        bands[field] = (low * factor, high * factor)
    return RangeModifier(words, bands)

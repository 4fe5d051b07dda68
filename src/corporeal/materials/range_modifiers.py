"""How an object's use or treatment narrows its material's range, in words and bands."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from corporeal.core.types import MeasuredRange
from corporeal.materials.quantities import parse_quantity_key


@dataclass(frozen=True)
class RangeModifier:
    """One way in which objects of a material are used or made."""

    words: str
    bands: Mapping[str, tuple[float, float]]
    """Field of ``Material`` → low and high [SI]."""


def range_modifiers(material: str) -> tuple[RangeModifier, ...]:
    """Return what is known of a material's uses; nothing for most."""
    return range_modifier_table().get(material, ())


def is_within_range(low: float, high: float, whole: MeasuredRange) -> bool:
    """Return whether a band lies within a measured range."""
    slack = 1e-9 * abs(whole.high)
    return whole.low - slack <= low < high <= whole.high + slack


@cache
def range_modifier_table() -> dict[str, tuple[RangeModifier, ...]]:
    """Read all materials with what is known of their uses."""
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

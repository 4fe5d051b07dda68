"""How an object's use or treatment narrows its material's range, in words and bands."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from corporeal.core.types import Range
from corporeal.materials.quantities import QUANTITIES, si


@dataclass(frozen=True)
class Treatment:
    """One way in which objects of a material are used or made."""

    words: str
    bands: Mapping[str, tuple[float, float]]
    """Field of ``Material`` → low and high [SI]."""


def treatments(material: str) -> tuple[Treatment, ...]:
    """Return what is known of a material's uses; nothing for most."""
    return _table().get(material, ())


def treatment_problems(ranges: Mapping[str, Mapping[str, Range]]) -> list[str]:
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
                if whole is None or not inside(low, high, whole):
                    found.append(
                        f"{material}: {treatment.words!r} puts {field} at {low:g} to {high:g} "
                        f"{QUANTITIES[field].unit}, outside the measured range"
                    )
    return found


def inside(low: float, high: float, whole: Range) -> bool:
    """Tell whether a band lies within a measured range."""
    slack = 1e-9 * abs(whole.high)
    return whole.low - slack <= low < high <= whole.high + slack


@cache
def _table() -> dict[str, tuple[Treatment, ...]]:
    text = files("corporeal.materials").joinpath("treatments.toml").read_text(encoding="utf-8")
    return {
        material: tuple(_treatment(words, row) for words, row in known.items())
        for material, known in tomllib.loads(text).items()
    }


def _treatment(words: str, row: Mapping[str, list[float]]) -> Treatment:
    bands = {}
    for key, (low, high) in row.items():
        field, factor = si(key)
        bands[field] = (low * factor, high * factor)
    return Treatment(words, bands)

"""Candidates for questions to a model: materials, contents, ranges and uses."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import degrees

from corporeal.core.types import MeasuredRange
from corporeal.materials.library import content_materials, library, part_materials
from corporeal.materials.quantities import QUANTITIES
from corporeal.materials.range_modifiers import is_within_range, range_modifiers

LOG_SCALE_MIN_RATIO = 10.0
"""A range whose ends differ by more than this factor is divided on a logarithmic scale."""


def is_logarithmic(r: MeasuredRange) -> bool:
    """Return whether places in a range are counted in factors, not in differences."""
    return r.low > 0 and r.high / r.low > LOG_SCALE_MIN_RATIO


def value_at_fraction(r: MeasuredRange, fraction: float) -> float:
    """Return the value at a place in a range, 0 its low end and 1 its high end.

    x = a + f (b - a), or on a logarithmic scale x = a (b/a)^f.
    """
    if is_logarithmic(r):
        value = r.low * (r.high / r.low) ** fraction
    else:
        value = r.low + fraction * (r.high - r.low)
    return min(max(value, r.low), r.high)  # rounding must not leave the range


def fraction_of(r: MeasuredRange, value: float) -> float:
    """Return the place of a value in a range: the inverse of ``value_at_fraction``; 0.5 in a single value."""
    if r.high <= r.low:
        return 0.5
    if is_logarithmic(r):
        return math.log(value / r.low) / math.log(r.high / r.low)
    return (value - r.low) / (r.high - r.low)


PRESSURE_UNITS_PA = ((1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa"), (1.0, "Pa"))


@dataclass(frozen=True)
class QuantityChoice:
    """One quantity whose place in a measured range is to be chosen."""

    field: str
    """Of ``Material``."""
    range: MeasuredRange
    """[SI]"""
    unit: str
    """In which a person reads it, "" for none."""
    factor: float
    """SI = unit × factor."""
    uses: tuple[tuple[str, float, float], ...] = ()
    """Use or treatment, low and high [unit]."""

    @property
    def bounds(self) -> tuple[float, float]:
        """Low and high [unit]."""
        return self.range.low / self.factor, self.range.high / self.factor

    @property
    def words(self) -> str:
        """The range as a person is shown it, with where the usual value lies."""
        low, high = self.bounds
        usual = self.range.typical / self.factor
        scale = ", logarithmic scale" if is_logarithmic(self.range) else ""
        where = f"place {fraction_of(self.range, self.range.typical):.2f}"
        unit = f" {self.unit}" if self.unit else ""
        lines = [f"{QUANTITIES[self.field].words}: {low:.6g} to {high:.6g}{unit}{scale}; usually {usual:.6g} ({where})"]
        lines += [f"  - {use}: {a:.6g} to {b:.6g}{unit}" for use, a, b in self.uses]
        return "\n".join(lines)


def quantity_choice(material: str, field: str, measured: MeasuredRange) -> QuantityChoice:
    """Offer one quantity of a material, with the uses that lie inside what was measured.

    The uses are the default library's: another library's range may leave some of them out.
    """
    factor, unit = _unit(field, measured.typical)
    uses = tuple(
        (t.words, t.bands[field][0] / factor, t.bands[field][1] / factor)
        for t in range_modifiers(material)
        if field in t.bands and is_within_range(*t.bands[field], measured)
    )
    return QuantityChoice(field, measured, unit, factor, uses)


def _unit(field: str, value: float) -> tuple[float, str]:
    unit = QUANTITIES[field].unit
    if unit == "Pa":
        return next(((f, u) for f, u in PRESSURE_UNITS_PA if value >= f), (1.0, "Pa"))
    return {"rad": (1 / degrees(1.0), "°"), "m": (1e-3, "mm"), "-": (1.0, "")}.get(unit, (1.0, unit))


def part_materials_text(library_name: str) -> str:
    """Every material of a library that a part may be made of, by group."""
    return _by_group(part_materials(library_name), library_name)


def content_materials_text(library_name: str) -> str:
    """Everything in a library that something may be filled with, by group."""
    return _by_group(content_materials(library_name), library_name)


def _by_group(names: Sequence[str], library_name: str) -> str:
    entries: Mapping = library(library_name)
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(entries[name].group or "others", []).append(name)
    lines = (f"- {group}: {', '.join(found)}" for group, found in groups.items())
    return "\n".join(lines) or "- (none)"

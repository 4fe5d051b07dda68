"""What somebody is offered to choose from, in words: materials, contents, ranges and uses."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import degrees

from corporeal.core.types import Range
from corporeal.materials.library import contents, library, substances
from corporeal.materials.quantities import QUANTITIES
from corporeal.materials.scale import fraction_of, logarithmic
from corporeal.materials.treatments import inside, treatments

UNITS = ((1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa"), (1.0, "Pa"))


@dataclass(frozen=True)
class Choice:
    """One quantity whose place in a measured range is to be chosen."""

    field: str
    """Of ``Material``."""
    range: Range
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
        scale = ", logarithmic scale" if logarithmic(self.range) else ""
        where = f"place {fraction_of(self.range, self.range.typical):.2f}"
        unit = f" {self.unit}" if self.unit else ""
        lines = [
            f"{QUANTITIES[self.field].words}: {low:.6g} to {high:.6g}{unit}{scale}; usually "
            f"{usual:.6g} ({where})"
        ]
        lines += [f"  - {use}: {a:.6g} to {b:.6g}{unit}" for use, a, b in self.uses]
        return "\n".join(lines)


def choice(material: str, field: str, measured: Range) -> Choice:
    """Offer one quantity of a material, with the uses that lie inside what was measured.

    The uses are the default library's: another library's range may leave some of them out.
    """
    factor, unit = _unit(field, measured.typical)
    uses = tuple(
        (t.words, t.bands[field][0] / factor, t.bands[field][1] / factor)
        for t in treatments(material)
        if field in t.bands and inside(*t.bands[field], measured)
    )
    return Choice(field, measured, unit, factor, uses)


def _unit(field: str, value: float) -> tuple[float, str]:
    unit = QUANTITIES[field].unit
    if unit == "Pa":
        return next(((f, u) for f, u in UNITS if value >= f), (1.0, "Pa"))
    return {"rad": (1 / degrees(1.0), "°"), "m": (1e-3, "mm"), "-": (1.0, "")}.get(
        unit, (1.0, unit)
    )


def substances_offered(library_name: str) -> str:
    """Every material of a library that a part may be made of, by group."""
    return _by_group(substances(library_name), library_name)


def contents_offered(library_name: str) -> str:
    """Everything in a library that something may be filled with, by group."""
    return _by_group(contents(library_name), library_name)


def _by_group(names: Sequence[str], library_name: str) -> str:
    entries: Mapping = library(library_name)
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(entries[name].group or "others", []).append(name)
    lines = (f"- {group}: {', '.join(found)}" for group, found in groups.items())
    return "\n".join(lines) or "- (none)"

"""One material of a library: constitutive law, and a measured range for every property."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files

from corporeal.core.errors import OutOfRangeError, UserError
from corporeal.core.types import Law, Material, MeasuredRange, Provenance
from corporeal.materials.quantities import QUANTITIES, parse_quantity_key

POISSON_LIMIT = 0.5
"""λ = E ν / ((1 + ν)(1 - 2 ν)) has no finite value here."""
DESCRIPTION_KEYS = {"law": str, "group": str, "family": str, "published": str, "note": str}
DESCRIPTION_KEYS |= {"aliases": list, "id": int}
"""Keys of a material in a file that are no numbers, with their types."""


@dataclass(frozen=True)
class MaterialEntry:
    """One material: its law and, for every number, the measured range. All SI."""

    name: str
    law: Law
    ranges: Mapping[str, MeasuredRange]
    """Field name of ``types.Material`` → measured range."""
    group: str = ""
    """Metal, mineral, granular, fibrous, polymer, elastomer, foam, food, liquid, bulk (what lies in containers)."""
    family: str = ""
    """The material whose measured friction it shares."""
    published: str = ""
    """The nearest name of the 22-material vocabulary, where its own is not one."""
    aliases: tuple[str, ...] = ()
    note: str = ""
    notes: Mapping[str, str] = field(default_factory=dict)
    """Field name → what is to be known of one of its numbers."""
    number: int = field(default=0, compare=False)
    """Its number in the published vocabulary; 0: not in it."""

    @property
    def kin(self) -> tuple[str, ...]:
        """Names under which a measured pair may list it, most particular first."""
        return tuple(n for n in (self.name, self.family, self.group) if n)

    def typical(self, reason: str = "the usual value in the measured range") -> dict[str, Provenance]:
        """Ground every number at its typical value."""
        return {
            name: Provenance(r.typical, r, "typical", reason if r.low < r.high else "a single value")
            for name, r in self.ranges.items()
        }

    def pick(self, grounds: Mapping[str, Provenance]) -> Material:
        """Make the material from chosen values.

        Raises:
            OutOfRangeError: A value lies outside the measured range.
            UserError: The library has no such number, or nothing can be computed with it.
        """
        for name, ground in grounds.items():
            quantity, allowed = QUANTITIES[name], self.ranges.get(name)
            if allowed is None:
                raise UserError(
                    f"{self.name} has no {quantity.words.lower()} in the library, so none can be "
                    f"chosen. It has: {', '.join(self.ranges)}."
                )
            # A scene's file may name a range of its own, with its source.
            span = ground.range
            if ground.value not in span:
                what = f"{quantity.words} of {self.name}"
                raise OutOfRangeError(what, ground.value, span.low, span.high, quantity.unit)
        values = {name: ground.value for name, ground in grounds.items()}
        if values.get("poisson", 0.0) >= POISSON_LIMIT:
            raise UserError(
                f"A Poisson's ratio of {values['poisson']:g} for {self.name} lies in the published "
                "range, but leaves no finite Lamé constant. Choose a smaller one, or use --library "
                "default."
            )
        return Material(name=self.name, law=self.law, grounds=dict(grounds), **values)


def read_entries(tables: Mapping[str, dict]) -> dict[str, MaterialEntry]:
    """Read the tables of a sound library."""
    return {name: _read_entry(name, row) for name, row in tables.items()}


def comparable_name(name: str) -> str:
    """Write a name as it is compared: case, hyphens, underscores and spaces don't matter."""
    return " ".join(name.lower().replace("-", " ").replace("_", " ").split())


def _read_entry(name: str, row: dict) -> MaterialEntry:
    ranges, notes = {}, {}
    for key, cell in row.items():
        if key not in DESCRIPTION_KEYS:
            quantity, factor = parse_quantity_key(key)
            low, typical, high = (cell[k] * factor for k in ("low", "typical", "high"))
            ranges[quantity] = MeasuredRange(low, typical, high, cell["source"])
            notes |= {quantity: cell["note"]} if "note" in cell else {}
    return MaterialEntry(
        name=name,
        law=Law[row["law"].upper()],
        ranges=ranges,
        group=row.get("group", ""),
        family=row.get("family", ""),
        published=row.get("published", ""),
        aliases=tuple(row.get("aliases", ())),
        note=row.get("note", ""),
        notes=notes,
        number=row.get("id", 0),
    )


SHIPPED_LIBRARY_FILES = {"default": "library.toml", "reference": "reference.toml"}


@cache
def shipped_library(name: str) -> dict[str, MaterialEntry]:
    """Return every entry of "default" or "reference"."""
    return read_entries(tomllib.loads(data_file_text(SHIPPED_LIBRARY_FILES[name])))


@cache
def source_table() -> dict[str, dict[str, str]]:
    """Every source: how to cite it, and whether it was read or recalled."""
    return tomllib.loads(data_file_text("sources.toml"))


def citation(key: str) -> str:
    """Resolve a source key ("a", or "a+b" for two) to what a reader can look up.

    A source that a user's library explains itself is already written out, and stays as it is.
    """
    known, keys = source_table(), key.split("+")
    return " / ".join(known[k]["cite"] for k in keys) if set(keys) <= set(known) else key


def is_estimate(key: str) -> bool:
    """Return whether a source, or one of two, is an estimate, not a measurement."""
    return any(source_table().get(k, {}).get("check") == "ours" for k in key.split("+"))


def cited_sources() -> dict[str, str]:
    """Every source key that a value of the shipped libraries carries, with what it stands for."""
    ranges = [r for name in SHIPPED_LIBRARY_FILES for e in shipped_library(name).values() for r in e.ranges.values()]
    return {key: citation(key) for key in sorted({r.source for r in ranges} | set(source_table()))}


def data_file_text(name: str) -> str:
    """Return a data file of this package."""
    return files("corporeal.materials").joinpath(name).read_text(encoding="utf-8")

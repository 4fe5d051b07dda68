"""Read the library's tables; find a material by any of its names."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from pathlib import Path

from corporeal.errors import BadFileError, OutOfRangeError, UnknownChoiceError, UserError
from corporeal.materials.quantities import QUANTITIES, si
from corporeal.types import Ground, Law, Material, Range

MENU = {"default": "library.toml", "reference": "reference.toml"}
ABOUT = {"law", "group", "family", "published", "aliases", "note", "id"}

HELD = ("liquid", "bulk", "granular", "foam", "food")
"""Groups of what is found inside things."""


@dataclass(frozen=True)
class Entry:
    """One material: its law and, for every number, the measured range. All SI."""

    name: str
    law: Law
    ranges: Mapping[str, Range]
    """Field name of ``types.Material`` → measured range."""
    group: str = ""
    """Metal, mineral, granular, fibrous, polymer, elastomer, foam, food, liquid, bulk (what lies in
    containers)."""
    family: str = ""
    """The material whose measured friction it shares."""
    published: str = ""
    """The nearest name of the 22-material vocabulary, where its own is not one."""
    aliases: tuple[str, ...] = ()
    note: str = ""
    number: int = field(default=0, compare=False)
    """Its number in the published vocabulary; 0: not in it."""

    @property
    def kin(self) -> tuple[str, ...]:
        """Names under which a measured pair may list it, most particular first."""
        return tuple(n for n in (self.name, self.family, self.group) if n)

    def typical(self, reason: str = "the usual value in the measured range") -> dict[str, Ground]:
        """Ground every number at its typical value."""
        return {
            name: Ground(r.typical, r, "typical", reason if r.low < r.high else "a single value")
            for name, r in self.ranges.items()
        }

    def pick(self, grounds: Mapping[str, Ground]) -> Material:
        """Make the material from chosen values.

        Raises:
            OutOfRangeError: A value lies outside the measured range.

        """
        for name, ground in grounds.items():
            quantity, allowed = QUANTITIES[name], self.ranges.get(name)
            if allowed is None:
                raise UserError(
                    f"{self.name} has no {quantity.words.lower()} in the library, so none can be "
                    f"chosen. It has: {', '.join(self.ranges)}."
                )
            if ground.value not in allowed:
                what = f"{quantity.words} of {self.name}"
                raise OutOfRangeError(what, ground.value, allowed.low, allowed.high, quantity.unit)
        values = {name: ground.value for name, ground in grounds.items()}
        return Material(name=self.name, law=self.law, grounds=dict(grounds), **values)


def library(name: str = "default") -> dict[str, Entry]:
    """Return every entry of a library: "default", "reference", or the path of a TOML file."""
    if name in MENU:
        return _shipped(name)
    if name.endswith(".toml"):
        return read(Path(name))
    raise UnknownChoiceError("material library", name, [*MENU, "a .toml file"])


def counterpart(entry: Entry, library_name: str) -> Entry:
    """Return what stands for ``entry`` in another library: its own name, or the published one."""
    entries = library(library_name)
    for name in (entry.name, entry.published):
        if name in entries:
            return entries[name]
    raise UserError(
        f"Library {library_name!r} has nothing for {entry.name!r}. Use --library default."
    )


def find(name: str, library_name: str = "default") -> Entry:
    """Return the entry called ``name``; spaces, hyphens, case and aliases don't matter.

    Raises:
        UnknownChoiceError: No material has that name or alias.

    """
    entries = library(library_name)
    wanted = _plain(name)
    for entry in entries.values():
        if wanted in map(_plain, (entry.name, *entry.aliases)):
            return entry
    raise UnknownChoiceError("material", name, list(entries))


def contents(library_name: str = "default") -> list[str]:
    """Names of what a thing may be filled with: liquids, loose matter and soft stuffing."""
    return [e.name for e in library(library_name).values() if e.group in HELD]


def citation(key: str) -> str:
    """Resolve a source key ("a", or "a+b" for two) to what a reader can look up."""
    known = source_table()
    return " / ".join(known[k]["cite"] if k in known else k for k in key.split("+"))


def sources() -> dict[str, str]:
    """Every source key that a value of the shipped libraries carries, with what it stands for."""
    ranges = [r for name in MENU for e in library(name).values() for r in e.ranges.values()]
    return {key: citation(key) for key in sorted({r.source for r in ranges} | set(source_table()))}


@cache
def source_table() -> dict[str, dict[str, str]]:
    """Every source: how to cite it, and whether it was read or recalled."""
    return tomllib.loads(_text("sources.toml"))


def read(path: Path) -> dict[str, Entry]:
    """Read a library of the user's own."""
    try:
        return _entries(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise BadFileError(path, f"cannot be read ({error}).") from error
    except (tomllib.TOMLDecodeError, KeyError, TypeError, ValueError, UserError) as error:
        raise BadFileError(path, f"is not a material library ({error}).") from error


@cache
def _shipped(name: str) -> dict[str, Entry]:
    return _entries(_text(MENU[name]))


def _text(name: str) -> str:
    return files("corporeal.materials").joinpath(name).read_text(encoding="utf-8")


def _entries(text: str) -> dict[str, Entry]:
    return {name: _entry(name, row) for name, row in tomllib.loads(text).items()}


def _entry(name: str, row: dict) -> Entry:
    ranges = {}
    for key, cell in row.items():
        if key not in ABOUT:
            quantity, factor = si(key)
            low, typical, high = (cell[k] * factor for k in ("low", "typical", "high"))
            ranges[quantity] = Range(low, typical, high, cell["source"])
    return Entry(
        name=name,
        law=Law[row["law"].upper()],
        ranges=ranges,
        group=row.get("group", ""),
        family=row.get("family", ""),
        published=row.get("published", ""),
        aliases=tuple(row.get("aliases", ())),
        note=row.get("note", ""),
        number=row.get("id", 0),
    )


def _plain(name: str) -> str:
    return " ".join(name.lower().replace("-", " ").replace("_", " ").split())

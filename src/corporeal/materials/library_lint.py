"""Validation of material libraries: errors with lines and advice.

Works on the text of the file, so that all errors are found at once, with lines.
"""

import difflib
import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import isfinite
from typing import Any

from corporeal.core.errors import UserError
from corporeal.core.types import Law
from corporeal.materials.library_entry import DESCRIPTION_KEYS, POISSON_LIMIT
from corporeal.materials.loss_restitution import restitution_range_of_loss
from corporeal.materials.quantities import QUANTITIES, SI_OF_KEY_UNIT, example_keys, parse_quantity_key
from corporeal.materials.value_plausibility import default_namesake, range_doubt, yield_strain_doubt
from corporeal.mpm.laws import CONSTITUTIVE_LAWS

REQUIRED_FIELDS = ("young_pa", "poisson", "density")
LAWS_OF_FIELD = {
    field: {law for law in Law if field in CONSTITUTIVE_LAWS[law].fields}
    for asked in CONSTITUTIVE_LAWS.values()
    for field in asked.fields
}
"""Fields that only these laws read."""
MATERIAL_GROUPS = ("metal", "mineral", "granular", "soft", "fibrous", "polymer", "elastomer", "foam")
MATERIAL_GROUPS += ("food", "liquid", "bulk")
LOSS_CHECKED_GROUPS = ("soft", "fibrous", "polymer", "elastomer", "foam", "food")
"""Groups whose impacts are lost in the bulk: loss and restitution tell of the same."""
RESERVED_KEYS = ("extends", "sources")
"""Keys at the top of a user's library that are no materials."""
RANGE_KEYS = ("low", "typical", "high", "source", "unusual", "note")
TABLE_HEADER_PATTERN = re.compile(r"^\s*\[\s*([^\]]+?)\s*\]")
KEY_PATTERN = re.compile(r"""^\s*["']?([\w-]+)["']?\s*=""")


@dataclass(frozen=True)
class LibraryProblem:
    """One mistake in a library."""

    line: int
    """In the file, from 1; 0: not in one line."""
    table: str
    key: str
    what: str
    advice: str

    def __str__(self) -> str:
        where = f"line {self.line}, " if self.line else ""
        table = f"[{self.table}] " if self.table else ""
        key = f"{self.key}: " if self.key else ""
        return f"{where}{table}{key}{self.what} {self.advice}".strip()


def lint_library(text: str, sources: Mapping[str, Any], bases: tuple[str, ...]) -> list[LibraryProblem]:
    """Return every mistake in the text of a library; empty when there is none.

    Args:
        text: The TOML file.
        sources: Source keys that are known without the file saying so.
        bases: Names that ``extends`` may have.
    """
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        return [LibraryProblem(0, "", "", f"This is not TOML: {error}.", "Fix the syntax first.")]
    found = _ProblemFinder(_line_of_key(text))
    _check_top(found, tables, bases)
    own = tables.get("sources", {})
    known = set(sources) | (set(own) if isinstance(own, dict) else set())
    rows = {name: row for name, row in tables.items() if name not in RESERVED_KEYS}
    for name, row in rows.items():
        if isinstance(row, dict):
            _check_material(found, name, row, known)
        else:
            found.tell(name, "", "is not a table.", f"Write a material as [{name}] with its keys.")
    _check_names(found, {n: r for n, r in rows.items() if isinstance(r, dict)})
    return sorted(found.problems, key=lambda p: p.line)


@dataclass(frozen=True)
class _NumberPlace:
    """Place of a number in the file."""

    table: str
    key: str


@dataclass(frozen=True)
class _RangeCell:
    """A number's key, and the entries of its range."""

    key: str
    entries: dict

    @property
    def unusual(self) -> bool:
        """Whether the file says that it is true all the same."""
        return bool(self.entries.get("unusual"))


@dataclass(frozen=True)
class _MaterialRow:
    """One material of the file."""

    name: str
    group: str
    law: Law | None


class _ProblemFinder:
    """Collects problems and knows in which line each key is."""

    def __init__(self, lines: dict[tuple[str, str], int]) -> None:
        self.lines = lines
        self.problems: list[LibraryProblem] = []

    def tell(self, table: str, key: str, what: str, advice: str) -> None:
        line = self.lines.get((table, key)) or self.lines.get((table, ""), 0)
        self.problems.append(LibraryProblem(line, table, key, what, advice))


def _line_of_key(text: str) -> dict[tuple[str, str], int]:
    table, lines = "", {}
    for number, line in enumerate(text.splitlines(), 1):
        if head := TABLE_HEADER_PATTERN.match(line):
            table = head[1].strip("\"'")
            lines.setdefault((table, ""), number)
        elif key := KEY_PATTERN.match(line):
            lines.setdefault((table, key[1]), number)
    return lines


def _check_top(found: _ProblemFinder, tables: dict, bases: tuple[str, ...]) -> None:
    base = tables.get("extends")
    if base is not None and base not in bases:
        found.tell("", "extends", f"{base!r} is not a library.", f"Write one of: {_list(bases)}.")
    own = tables.get("sources", {})
    if not isinstance(own, dict):
        found.tell("", "sources", "must be a table.", "Write [sources.mine] with cite = '...'.")
        return
    for name, row in own.items():
        if not (isinstance(row, dict) and isinstance(row.get("cite"), str) and row["cite"]):
            what = "has no citation."
            found.tell(f"sources.{name}", "", what, "Give it cite = 'author, title, table'.")
    if not set(tables) - set(RESERVED_KEYS):
        found.tell("", "", "There is no material in the file.", "Write one as [name].")


def _check_names(found: _ProblemFinder, rows: dict[str, dict]) -> None:
    owner: dict[str, str] = {}
    for name, row in rows.items():
        aliases = row.get("aliases", [])
        for word in (name, *(aliases if isinstance(aliases, list) else ())):
            first = owner.setdefault(str(word).lower(), name)
            if first != name:
                what = f"{word!r} also names {first}."
                found.tell(name, "aliases", what, "Use it for one of the two only.")


def _check_material(found: _ProblemFinder, name: str, row: dict, known: set[str]) -> None:
    law = _law(found, name, row)
    _check_words(found, name, row)
    fields: dict[str, _RangeCell] = {}
    for key, cell in row.items():
        if key in DESCRIPTION_KEYS:
            continue
        field = _field(found, name, key)
        if field is None:
            continue
        if field in fields:
            what = f"says {QUANTITIES[field].words.lower()} a second time."
            found.tell(name, key, what, f"Keep {fields[field].key} or {key}.")
        elif _check_cell(found, _NumberPlace(name, key), cell, known):
            fields[field] = _RangeCell(key, cell)
    _check_needs(found, name, law, {f for f in map(_field_of_key, row) if f})
    _check_sizes(found, _MaterialRow(name, row.get("group", ""), law), fields)


def _law(found: _ProblemFinder, name: str, row: dict) -> Law | None:
    laws = [law.name.lower() for law in Law]
    if "law" not in row:
        found.tell(name, "", "has no law.", f"Add law = one of: {_list(laws)}.")
    elif row["law"] not in laws:
        found.tell(name, "law", f"{row['law']!r} is not a constitutive law.", f"Write one of: {_list(laws)}.")
    else:
        return Law[row["law"].upper()]
    return None


def _check_words(found: _ProblemFinder, name: str, row: dict) -> None:
    for key, kind in DESCRIPTION_KEYS.items():
        if key in row and not isinstance(row[key], kind):
            found.tell(name, key, f"is {row[key]!r}.", f"It must be of type {kind.__name__}.")
    group = row.get("group", "")
    if group == "" and default_namesake(name) is None:
        what = "has no group, so its values cannot be compared with those of similar materials."
        found.tell(name, "", what, f"Add group = one of: {_list(MATERIAL_GROUPS)}.")
    elif isinstance(group, str) and group and group not in MATERIAL_GROUPS:
        found.tell(name, "group", f"{group!r} is not a group.", f"Write one of: {_list(MATERIAL_GROUPS)}.")


def _field(found: _ProblemFinder, name: str, key: str) -> str | None:
    try:
        return parse_quantity_key(key)[0]
    except UserError:
        keys = [*_valid_keys(), *DESCRIPTION_KEYS]
        close = difflib.get_close_matches(key, keys, n=1, cutoff=0.75)
        advice = f"Did you mean {close[0]}?" if close else f"Keys: {_list(example_keys())}."
        found.tell(name, key, "Unknown key; the unit is in the key.", advice)
        return None


def _field_of_key(key: str) -> str | None:
    try:
        return parse_quantity_key(key)[0]
    except UserError:
        return None


def _valid_keys() -> Iterator[str]:
    """Every key that a number may have, all units."""
    for field, quantity in QUANTITIES.items():
        units = [name for name, (unit, _) in SI_OF_KEY_UNIT.items() if unit == quantity.unit]
        yield from (f"{field}_{unit}" for unit in units) if units else (field,)


def _check_needs(found: _ProblemFinder, name: str, law: Law | None, fields: set[str]) -> None:
    needs = REQUIRED_FIELDS if law is None else (*REQUIRED_FIELDS, *CONSTITUTIVE_LAWS[law].needs)
    spelt = {parse_quantity_key(key)[0]: key for key in example_keys()}
    for field in needs:
        if field not in fields:
            because = f" ({law.name.lower()} reads it)" if law and field not in REQUIRED_FIELDS else ""
            what = f"has no {QUANTITIES[field].words.lower()}{because}."
            found.tell(name, "", what, f"Add {spelt[field]}.")
    some = () if law is None else CONSTITUTIVE_LAWS[law].needs_one_of
    if some and not fields & set(some):
        words = " or ".join(QUANTITIES[field].words.lower() for field in some)
        found.tell(name, "", f"has no {words}.", f"Add {' or '.join(spelt[f] for f in some)}.")
    for field, laws in LAWS_OF_FIELD.items():
        if law and field in fields and law not in laws:
            right = _list(sorted(one.name.lower() for one in laws))
            what = f"{law.name.lower()} never reads {QUANTITIES[field].words.lower()}."
            found.tell(name, "", what, f"Remove it, or use law = {right}.")


def _check_cell(found: _ProblemFinder, at: _NumberPlace, cell: Any, known: set[str]) -> bool:
    """Return what is wrong with the form of a cell; return whether its numbers can be read."""
    form = "Write { low = 1, typical = 2, high = 3, source = 'key' }."
    if not isinstance(cell, dict):
        found.tell(at.table, at.key, f"is {cell!r}, not a range.", form)
        return False
    for key in set(cell) - set(RANGE_KEYS):
        found.tell(at.table, at.key, f"has an unknown entry {key!r}.", f"A range has: {_list(RANGE_KEYS)}.")
    _check_source(found, at, cell.get("source"), known)
    if "note" in cell and not (isinstance(cell["note"], str) and cell["note"].strip()):
        found.tell(at.table, at.key, f"has the note {cell['note']!r}.", "Write it in words.")
    missing = [k for k in RANGE_KEYS[:3] if not _is_number(cell.get(k))]
    if missing:
        found.tell(at.table, at.key, f"{missing[0]!r} is missing or not a number.", form)
    return not missing


def _check_source(found: _ProblemFinder, at: _NumberPlace, source: Any, known: set[str]) -> None:
    if not isinstance(source, str) or not source.strip():
        advice = "Cite its source: source = 'key', and [sources.key] with cite = '...'."
        found.tell(at.table, at.key, "has no source.", advice)
        return
    for key in source.split("+"):
        if key not in known:
            advice = f"Add [sources.{key}] with cite = '...', or use an existing key."
            found.tell(at.table, at.key, f"cites {key!r}, which is not defined.", advice)


def _check_sizes(found: _ProblemFinder, row: _MaterialRow, fields: dict[str, _RangeCell]) -> None:
    for field, cell in fields.items():
        low, typical, high = (cell.entries[k] for k in RANGE_KEYS[:3])
        if not low <= typical <= high:
            advice = "Swap low and high." if low > typical > high else "Put them in order."
            what = f"is out of order: {low:g}, {typical:g}, {high:g}."
            found.tell(row.name, cell.key, what, advice)
        elif field == "poisson" and high >= POISSON_LIMIT:
            what = f"reaches {high:g}: 0.5 is incompressible."
            found.tell(row.name, cell.key, what, "For nearly incompressible materials use 0.49 to 0.499.")
        elif not cell.unusual:
            doubted = range_doubt(cell.key, (low, high), row.name, row.group, row.law)
            if doubted:
                found.tell(row.name, cell.key, doubted.what, doubted.advice)
    _check_rebound(found, row, fields)
    doubted = yield_strain_doubt({f: c.entries["typical"] * parse_quantity_key(c.key)[1] for f, c in fields.items()})
    if doubted and not any(p.table == row.name for p in found.problems):
        strength, stiffness = fields["yield_stress"], fields["young_pa"]
        if not (strength.unusual or stiffness.unusual):
            found.tell(row.name, strength.key, doubted.what, doubted.advice)


def _check_rebound(found: _ProblemFinder, row: _MaterialRow, fields: dict[str, _RangeCell]) -> None:
    """Hold the loss factor of what is soft against its restitution, unless a note parts them."""
    if row.group not in LOSS_CHECKED_GROUPS or not {"loss", "restitution"} <= set(fields):
        return
    if any(p.table == row.name and p.key in ("loss", "restitution") for p in found.problems):
        return  # what is wrong in itself comes first
    restitution, loss = fields["restitution"].entries, fields["loss"].entries
    low, high = restitution_range_of_loss(loss["low"], loss["high"])
    if restitution.get("note") or (low <= restitution["high"] and restitution["low"] <= high):
        return
    what = (
        f"{restitution['low']:g} to {restitution['high']:g} contradicts the loss factor: with "
        f"{loss['low']:g} to {loss['high']:g} a ball keeps {low:.2f} to {high:.2f} of its speed."
    )
    advice = "Correct one of the two, or explain with note = '...' what else dissipates the energy."
    found.tell(row.name, "restitution", what, advice)


def _is_number(x: Any) -> bool:
    return isinstance(x, int | float) and not isinstance(x, bool) and isfinite(x)


def _list(words: Any) -> str:
    return ", ".join(map(str, words))

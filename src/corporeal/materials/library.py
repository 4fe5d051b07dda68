"""Lookup of materials in the default library or a user's.

A user's file replaces the default library; one that starts with ``extends = "default"`` is merged into it. Merging is
by material: a table of the file replaces its namesake whole.
"""

import re
import tomllib
from functools import lru_cache
from pathlib import Path

from corporeal.core.errors import MAX_SUGGESTED_CHOICES, BadFileError, UnknownChoiceError, UserError
from corporeal.materials.library_entry import (
    SHIPPED_LIBRARY_FILES,
    MaterialEntry,
    comparable_name,
    read_entries,
    shipped_library,
    source_table,
)
from corporeal.materials.library_lint import RESERVED_KEYS, LibraryProblem, lint_library

CONTENT_GROUPS = ("liquid", "bulk", "granular", "foam", "food")
"""Groups of what is found inside objects."""
CONTENT_ONLY_GROUPS = ("liquid", "bulk")
"""Groups of what is nothing without a container."""
LIBRARY_PATH_ADVICE = "Give the path of a TOML file."


def library(name: str = "default") -> dict[str, MaterialEntry]:
    """Return every entry of a library: "default", "reference", or the path of a TOML file.

    Raises:
        UserError: There is no such library, or the file has a mistake.
    """
    if name in SHIPPED_LIBRARY_FILES:
        return shipped_library(name)
    if name.endswith(".toml"):
        return read_library(Path(name))
    raise UnknownChoiceError("material library", name, [*SHIPPED_LIBRARY_FILES, "a .toml file"])


def part_materials(library_name: str = "default") -> list[str]:
    """Names of materials of parts: all but liquids and granular materials."""
    return [e.name for e in library(library_name).values() if e.group not in CONTENT_ONLY_GROUPS]


def content_materials(library_name: str = "default") -> list[str]:
    """Names of what an object may be filled with: liquids, granular material and soft stuffing."""
    return [e.name for e in library(library_name).values() if e.group in CONTENT_GROUPS]


def find_material(name: str, library_name: str = "default") -> MaterialEntry:
    """Return the entry called ``name``; spaces, hyphens, case and aliases don't matter.

    Raises:
        UnknownChoiceError: No material has that name or alias.
    """
    known, wanted = library(library_name), comparable_name(name)
    named = [e for e in known.values() if wanted == comparable_name(e.name)]
    also = [e for e in known.values() if wanted in map(comparable_name, e.aliases)]
    if named or also:
        return (named or also)[-1]
    raise UnknownChoiceError("material", name, list(known), _similar_entries(wanted, known))


def _similar_entries(wanted: str, known: dict[str, MaterialEntry]) -> list[str]:
    """Return the entries that have a word in their name or in an alias, as a person reads them."""
    found = [e.name for e in known.values() if wanted in _words(e.name)]
    for entry in known.values():
        also = [alias for alias in entry.aliases if wanted in _words(alias)]
        found += [f"{alias!r} ({entry.name})" for alias in also if entry.name not in found]
    return found[:MAX_SUGGESTED_CHOICES]


def _words(name: str) -> list[str]:
    return [comparable_name(word) for word in re.split(r"[\s_-]+", name)]


def find_material_or_default(name: str, library_name: str) -> MaterialEntry:
    """Return the entry called ``name``; what a smaller library leaves out is the default one's.

    Raises:
        UnknownChoiceError: Neither has that name or alias.
    """
    try:
        return find_material(name, library_name)
    except UnknownChoiceError:
        return find_material(name)


def library_counterpart(entry: MaterialEntry, library_name: str) -> MaterialEntry:
    """Return the counterpart of ``entry`` in another library: its own name, or the published one.

    Raises:
        UserError: The library has neither.
    """
    known = library(library_name)
    for name in (entry.name, entry.published):
        if name in known:
            return known[name]
    raise UserError(
        f"Library {library_name!r} has nothing for {entry.name!r}. Add it there, or start the "
        'file with: extends = "default".'
    )


def read_library(path: Path) -> dict[str, MaterialEntry]:
    """Read a library of the user's own.

    Raises:
        BadFileError: The file cannot be read, or has a mistake; the first one is reported.
    """
    try:
        stat = path.stat()
    except OSError as error:
        raise BadFileError(path, f"cannot be read ({error}).", LIBRARY_PATH_ADVICE) from error
    return _read(path.resolve(), path, stat.st_mtime_ns, stat.st_size)


def check_library(path: Path) -> list[LibraryProblem]:
    """Return every mistake in a user's library; empty when it is sound.

    Raises:
        BadFileError: The file cannot be read.
    """
    return lint_library(_text(path), source_table(), tuple(SHIPPED_LIBRARY_FILES))


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise BadFileError(path, f"cannot be read ({error}).", LIBRARY_PATH_ADVICE) from error


@lru_cache(maxsize=8)
def _read(where: Path, path: Path, changed: int, size: int) -> dict[str, MaterialEntry]:
    problems = check_library(path)
    if problems:
        more = f"All {len(problems)} errors: corporeal materials check {path}."
        raise BadFileError(path, str(problems[0]), more if len(problems) > 1 else "")
    tables = tomllib.loads(_text(path))
    base = tables.get("extends")
    own = {key: row["cite"] for key, row in tables.get("sources", {}).items()}
    rows = {n: _cited(row, own) for n, row in tables.items() if n not in RESERVED_KEYS}
    return {**(shipped_library(base) if base else {}), **read_entries(rows)}


def _cited(row: dict, own: dict[str, str]) -> dict:
    """Write out the sources that the file explains itself."""
    cells = {}
    for key, cell in row.items():
        if isinstance(cell, dict) and set(cell["source"].split("+")) & set(own):
            shipped = source_table()
            cites = [own[k] if k in own else shipped[k]["cite"] for k in cell["source"].split("+")]
            cell = cell | {"source": " / ".join(cites)}
        cells[key] = cell
    return row | cells

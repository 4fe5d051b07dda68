"""Look materials up: in what is shipped, or in a library of the user's own.

A user's file replaces the default library; one that starts with ``extends = "default"`` is merged
into it. Merging is by material: a table of the file replaces its namesake whole.
"""

import re
import tomllib
from functools import lru_cache
from pathlib import Path

from corporeal.core.errors import NEAR, BadFileError, UnknownChoiceError, UserError
from corporeal.materials.entry import Entry, entries, plain
from corporeal.materials.lint import RESERVED, Problem, inspect
from corporeal.materials.shipped import SHIPPED, shipped, source_table

HELD = ("liquid", "bulk", "granular", "foam", "food")
"""Groups of what is found inside objects."""
ONLY_HELD = ("liquid", "bulk")
"""Groups of what is nothing without a container."""
A_FILE = "Give the path of a TOML file."


def library(name: str = "default") -> dict[str, Entry]:
    """Return every entry of a library: "default", "reference", or the path of a TOML file.

    Raises:
        UserError: There is no such library, or the file has a mistake.

    """
    if name in SHIPPED:
        return shipped(name)
    if name.endswith(".toml"):
        return read(Path(name))
    raise UnknownChoiceError("material library", name, [*SHIPPED, "a .toml file"])


def substances(library_name: str = "default") -> list[str]:
    """Names of what a part itself may be made of: all but liquids and loose goods."""
    return [e.name for e in library(library_name).values() if e.group not in ONLY_HELD]


def contents(library_name: str = "default") -> list[str]:
    """Names of what an object may be filled with: liquids, loose matter and soft stuffing."""
    return [e.name for e in library(library_name).values() if e.group in HELD]


def find(name: str, library_name: str = "default") -> Entry:
    """Return the entry called ``name``; spaces, hyphens, case and aliases don't matter.

    Raises:
        UnknownChoiceError: No material has that name or alias.

    """
    known, wanted = library(library_name), plain(name)
    named = [e for e in known.values() if wanted == plain(e.name)]
    also = [e for e in known.values() if wanted in map(plain, e.aliases)]
    if named or also:
        return (named or also)[-1]
    raise UnknownChoiceError("material", name, list(known), _near(wanted, known))


def _near(wanted: str, known: dict[str, Entry]) -> list[str]:
    """Return the entries that have a word in their name or in an alias, as a person reads them."""
    found = [e.name for e in known.values() if wanted in _words(e.name)]
    for entry in known.values():
        also = [alias for alias in entry.aliases if wanted in _words(alias)]
        found += [f"{alias!r} ({entry.name})" for alias in also if entry.name not in found]
    return found[:NEAR]


def _words(name: str) -> list[str]:
    return [plain(word) for word in re.split(r"[\s_-]+", name)]


def named(name: str, library_name: str) -> Entry:
    """Return the entry called ``name``; what a smaller library leaves out is the default one's.

    Raises:
        UnknownChoiceError: Neither has that name or alias.

    """
    try:
        return find(name, library_name)
    except UnknownChoiceError:
        return find(name)


def counterpart(entry: Entry, library_name: str) -> Entry:
    """Return what stands for ``entry`` in another library: its own name, or the published one.

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


def read(path: Path) -> dict[str, Entry]:
    """Read a library of the user's own.

    Raises:
        BadFileError: The file cannot be read, or has a mistake; the first one is reported.

    """
    try:
        stat = path.stat()
    except OSError as error:
        raise BadFileError(path, f"cannot be read ({error}).", A_FILE) from error
    return _read(path.resolve(), path, stat.st_mtime_ns, stat.st_size)


def check(path: Path) -> list[Problem]:
    """Return every mistake in a user's library; empty when it is sound.

    Raises:
        BadFileError: The file cannot be read.

    """
    return inspect(_text(path), source_table(), tuple(SHIPPED))


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise BadFileError(path, f"cannot be read ({error}).", A_FILE) from error


@lru_cache(maxsize=8)
def _read(where: Path, path: Path, changed: int, size: int) -> dict[str, Entry]:
    problems = check(path)
    if problems:
        more = f"All {len(problems)} mistakes: corporeal materials check {path}."
        raise BadFileError(path, str(problems[0]), more if len(problems) > 1 else "")
    tables = tomllib.loads(_text(path))
    base = tables.get("extends")
    own = {key: row["cite"] for key, row in tables.get("sources", {}).items()}
    rows = {n: _cited(row, own) for n, row in tables.items() if n not in RESERVED}
    return {**(shipped(base) if base else {}), **entries(rows)}


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

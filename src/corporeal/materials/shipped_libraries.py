"""What comes with the package: two libraries, and the sources of their numbers."""

import tomllib
from functools import cache
from importlib.resources import files

from corporeal.materials.library_entry import MaterialEntry, read_entries

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
    ranges = [
        r
        for name in SHIPPED_LIBRARY_FILES
        for e in shipped_library(name).values()
        for r in e.ranges.values()
    ]
    return {key: citation(key) for key in sorted({r.source for r in ranges} | set(source_table()))}


def data_file_text(name: str) -> str:
    """Return a data file of this package."""
    return files("corporeal.materials").joinpath(name).read_text(encoding="utf-8")

"""Markers that declare which settings name files, by the type of the field, and which are options.

A field of type ``Path`` or ``Path | None`` names a file or folder that is read. A field of type ``str`` names one only
if its annotation carries ``ReadsPath``; a path that is written carries ``WritesPath``. All other values are never
looked up on the disk.
"""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin, get_type_hints


@dataclass(frozen=True)
class ReadsPath:
    """Marks a string that may name a file or folder which is read."""

    prefixes: tuple[str, ...] = ()
    """Words before a colon and a path: "replay" in "replay:FOLDER"."""
    names: tuple[str, ...] | None = None
    """Values that are names; any other value without a prefix is a path. None: none is a path."""

    def path_in(self, value: str) -> Path | None:
        """Return the path that a value names; None: it names none."""
        prefix, colon, rest = value.partition(":")
        if colon and prefix in self.prefixes:
            return Path(rest)
        if self.names is None or value in self.names:
            return None
        return Path(value)


@dataclass(frozen=True)
class WritesPath:
    """Marks a path that is written and not read."""


@dataclass(frozen=True)
class NoOption:
    """Marks a dataclass within settings that is set in Python only: no verb offers it."""


def paths_read(config: Any) -> list[Path]:
    """Return the files and folders that the settings in a dataclass name to be read.

    Args:
        config: An instance of a dataclass; dataclasses within it are not searched.
    """
    hints = get_type_hints(type(config), include_extras=True)
    found = [_path_read(hints[f.name], getattr(config, f.name)) for f in fields(config)]
    return [path.expanduser() for path in found if path is not None]


def _path_read(hint: Any, value: Any) -> Path | None:
    hint, *markers = get_args(hint) if get_origin(hint) is Annotated else (hint,)
    if not value or any(isinstance(marker, WritesPath) for marker in markers):
        return None
    if Path in (hint, *get_args(hint)):
        return Path(value)
    specs = [marker for marker in markers if isinstance(marker, ReadsPath)]
    return specs[0].path_in(value) if specs else None

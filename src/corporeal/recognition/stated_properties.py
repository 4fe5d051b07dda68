"""Properties of parts stated in files: substance, wall, pressure, structure, values."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from math import isfinite
from typing import Any

from corporeal.core.types import STATED_MATTER_KEY, SUBSTANCE_KEY, MeasuredRange, PartDescription, Provenance, Surface

SEALABLE_STRUCTURES = ("shell", "hollow")
"""Structures that air can be sealed in."""
MAX_INFLATION_PA = 1e6
"""No ball or tyre is inflated to more [Pa]."""
MAX_WALL_THICKNESS_M = 10.0
"""No wall of an object is thicker [m]."""


def stated_substance(surfaces: Iterable[Surface]) -> str | None:
    """Return what the nodes state outright in their extras, or None."""
    stated = {str(s.extras[SUBSTANCE_KEY]) for s in surfaces if s.extras.get(SUBSTANCE_KEY)}
    return stated.pop() if len(stated) == 1 else None


def stated_thickness(surfaces: Iterable[Surface]) -> float | None:
    """Return the wall thickness [m] that the nodes state; 0: stated solid; None: unknown."""
    stated = {_length(s.extras.get("shell_thickness_m")) for s in surfaces}
    return stated.pop() if len(stated) == 1 else None


def stated_inflation(surfaces: Iterable[Surface]) -> float | None:
    """Return the gauge pressure [Pa] of the air that the nodes say is sealed in; None: none is."""
    stated = {_pressure(s.extras.get("inflation_kPa")) for s in surfaces}
    return stated.pop() if len(stated) == 1 else None


def _pressure(value: object) -> float | None:
    """Return a foreign file's number where it can be a gauge pressure in kPa, in Pa."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return 1e3 * float(value) if isfinite(value) and 0 <= 1e3 * value <= MAX_INFLATION_PA else None


def stated_values(surfaces: Iterable[Surface]) -> dict[str, Provenance]:
    """Return the numbers that a file states of a part's material, with their sources.

    Field of ``Material`` → value; where the file names no range it is the value alone. What cannot be such a number is
    left out, and where surfaces of a part differ, the first counts.
    """
    for surface in surfaces:
        rows = _mapping(_mapping(surface.extras.get(STATED_MATTER_KEY)).get("values"))
        found = {str(name): _stated_ground(_mapping(row)) for name, row in rows.items()}
        if found:
            return {name: ground for name, ground in found.items() if ground}
    return {}


def _mapping(value: object) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}


def _stated_ground(row: Mapping[str, Any]) -> Provenance | None:
    value, source = row.get("value"), str(row.get("source", ""))[:500]
    interval = row.get("range") or (value, value)
    numbers = [value, *interval] if isinstance(interval, list | tuple) else []
    good = all(isinstance(x, int | float) and not isinstance(x, bool) for x in numbers)
    if len(numbers) != 3 or not good or not all(map(isfinite, numbers)):
        return None
    value, low, high = (float(x) for x in numbers)
    if not low <= value <= high:
        return None
    reason = str(row.get("reason") or source)[:500]
    sure = row.get("margin", 1.0)
    margin = float(sure) if isinstance(sure, int | float) and 0 <= sure <= 1 else 1.0
    by = str(row.get("chosen_by", "annotation"))
    return Provenance(value, MeasuredRange(low, value, high, source), by, reason, margin)


def apply_stated_structure(words: PartDescription, surfaces: Iterable[Surface]) -> PartDescription:
    """Take over how a part is built, as a file that this package wrote states it."""
    stated = next((s.extras[STATED_MATTER_KEY] for s in surfaces if STATED_MATTER_KEY in s.extras), None)
    row = _mapping(_mapping(stated).get("words"))
    structure, contents = row.get("structure"), row.get("contents")
    if structure not in ("solid", "shell", "filled"):
        return words
    fill = row.get("fill")
    return replace(
        words,
        structure=structure,
        thickness=_length(row.get("thickness")) or None,
        wall_usual=False,
        contents=contents if isinstance(contents, str) else None,
        fill=float(fill) if isinstance(fill, int | float) and 0 < fill <= 1 else None,
    )


def _length(value: object) -> float | None:
    """Return a foreign file's number where it can be a length [m]."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if isfinite(value) and 0 <= value < MAX_WALL_THICKNESS_M else None


def apply_stated_wall(words: PartDescription, thickness: float | None) -> PartDescription:
    """Let the wall's thickness [m] that the file states decide; 0: stated solid."""
    if thickness is None:
        return words
    if thickness == 0:
        words = replace(words, structure="solid", thickness=None, contents=None, fill=None)
        return replace(words, wall_usual=False)
    filled = words.structure == "filled"
    built = "filled" if filled else "shell"
    return replace(words, structure=built, thickness=thickness, wall_usual=False)


def apply_inflation(words: PartDescription, stated: float | None, usual: float | None) -> PartDescription:
    """Put air behind the wall of what is a shell.

    Args:
        words: Of one part.
        stated: Stated gauge pressure [Pa]; None: none is stated.
        usual: That such objects have [Pa]; None: they are not sealed.
    """
    if words.structure not in SEALABLE_STRUCTURES:
        return words
    return replace(words, inflation=usual if stated is None else stated)

"""Typical bulk density of everyday objects, for plausibility checks."""

import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal

from corporeal.core.types import Note, NoteKind
from corporeal.recognition.typical_extents import (
    index_compounds,
    normalised_words,
    rank_class_match,
    singular_words,
    with_article,
)

BULK_DENSITY_MARGIN_RATIO = 2.0
"""How far beyond the table an object may be before it is reported, as a factor."""
MAX_LARGE_OBJECT_KG_M3, LARGE_OBJECT_SIDE_M = 2000.0, 0.5
"""What no object exceeds [kg/m³ of its box] whose longest side is that long [m], if its class is not in the table:
stone and metal fill a part of theirs.
"""
MAX_THICK_OBJECT_KG_M3, THICK_OBJECT_SIDE_M = 3500.0, 0.15
"""What none exceeds that is so thick [m], its middle side: more than stone is metal through and through. What is
thinner may be a bar or a plate."""


BulkMeasure = Literal["box", "large", "face"]
"""Mass is held against the volume of the smallest box around an object, or against that box's largest side where it
goes with that: of what is flat, whose depth is a stand's, and of what is inflated. "large" is the box of objects from
some length on, where small ones are denser.
"""
BULK_MEASURES: tuple[BulkMeasure, ...] = ("box", "large", "face")
PER_BOX_VOLUME_TEXT, PER_FACE_AREA_TEXT = ("kg per cubic metre of its box", "kg per square metre of its largest side")
UNIT_OF_BULK_MEASURE = {"box": PER_BOX_VOLUME_TEXT, "large": PER_BOX_VOLUME_TEXT, "face": PER_FACE_AREA_TEXT}


@dataclass(frozen=True)
class TypicalBulkDensity:
    """How heavy one class of objects is for its size."""

    words: str
    low: float
    """[kg/m³], or [kg/m²] of a face."""
    high: float
    measure: BulkMeasure = "box"
    longer: float = 0.0
    """For objects whose longest side is longer than this [m]."""


def typical_bulk_density(class_name: str, longest: float) -> TypicalBulkDensity | None:
    """Return the entry of the name's last known noun, the one with the most words that fit.

    Args:
        class_name: Class of the object.
        longest: Its longest side [m].
    """
    named = normalised_words(class_name, _compounds())
    known = [e for e in _table() if set(singular_words(e.words)) <= set(named)]
    found = [e for e in known if longest >= e.longer]
    return max(found, key=lambda e: (*rank_class_match(e.words, named), e.longer), default=None)


def mass_warning(name: str, class_name: str, mass: float, sides: tuple[float, float, float]) -> str | None:
    """Return a sentence for the user where an object is implausibly heavy or light.

    Args:
        name: Of the object, for the sentence.
        class_name: What it is.
        mass: [kg]
        sides: Of the smallest box around it [m].
    """
    across, deep = sorted(sides)[1:]
    room, face = sides[0] * sides[1] * sides[2], across * deep
    if room <= 0.0:
        return None  # a sheet has no box
    known, bulk = typical_bulk_density(class_name, deep), mass / room
    if known is None:
        heavy = (deep >= LARGE_OBJECT_SIDE_M and bulk > MAX_LARGE_OBJECT_KG_M3) or (
            across >= THICK_OBJECT_SIDE_M and bulk > MAX_THICK_OBJECT_KG_M3
        )
        found = _mass_text(name, mass, bulk, "box")
        note = Note(f"{found}, more than nearly all objects. {MASS_ADVICE}", NoteKind.ASSUMED)
        return note if heavy else None
    found = mass / face if known.measure == "face" else bulk
    if known.low / BULK_DENSITY_MARGIN_RATIO <= found <= known.high * BULK_DENSITY_MARGIN_RATIO:
        return None
    large = f"longer than {known.longer:g} m " if known.longer else ""
    usual = with_article(known.words, f"{large}has", f"{large}have")
    usual = f"{usual} {known.low:g} to {known.high:g}"
    return Note(f"{_mass_text(name, mass, found, known.measure)}, and {usual}. {MASS_ADVICE}", NoteKind.ASSUMED)


MASS_ADVICE = "Check its size (--extent), its material and whether it is hollow."


def _mass_text(name: str, mass: float, found: float, measure: BulkMeasure) -> str:
    weight = f"{mass / 1000:.3g} t" if mass >= 1000 else f"{mass:.3g} kg"
    return f"{name} weighs {weight}: {found:.3g} {UNIT_OF_BULK_MEASURE[measure]}"


@cache
def _table() -> tuple[TypicalBulkDensity, ...]:
    rows = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    named = [(words, row) for row in rows.pop("alike") for words in row["words"]]
    return tuple(e for words, row in (*rows.items(), *named) for e in _entries(words, row))


def _entries(words: str, row: Any) -> list[TypicalBulkDensity]:
    """Read a row: low and high of the box, or these by measure, and from which length on."""
    by_measure: dict[str, Any] = {"box": row} if isinstance(row, list) else row
    found = []
    for measure in BULK_MEASURES:
        if measure in by_measure:
            low, high = by_measure[measure]
            longer = float(by_measure.get(f"{measure}_from", 0.0))
            found.append(TypicalBulkDensity(words, float(low), float(high), measure, longer))
    return found


@cache
def _compounds() -> dict[str, tuple[str, ...]]:
    return index_compounds(e.words for e in _table())

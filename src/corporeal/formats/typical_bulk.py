"""How heavy everyday objects are for the room that they take, to notice what cannot be."""

import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from corporeal.formats.typical_extents import joined, nouns

MARGIN = 2.0
"""How far beyond the table an object may be before it is reported, as a factor."""
HEAVIEST = 2000.0
"""What no large thing of a class that is not in the table exceeds [kg/m³ of its box]: stone and
metal fill a part of theirs."""
LARGE = 0.5
"""Longest side from which a thing counts as large [m]: a smaller one may be a block of metal."""


@dataclass(frozen=True)
class TypicalBulk:
    """Mass over the volume of the box around it, of one class of objects [kg/m³]."""

    words: str
    low: float
    high: float


def typical_bulk(class_name: str) -> TypicalBulk | None:
    """Return the entry of the name's last known noun, the one with the most words that fit."""
    named = nouns(class_name, _compounds())
    found = [e for e in _table() if set(e.words.split()) <= set(named)]
    return max(found, key=lambda e: _fit(e, named), default=None)


def doubt_mass(
    name: str, class_name: str, mass: float, sides: tuple[float, float, float]
) -> str | None:
    """Return a sentence for the user where an object is implausibly heavy or light.

    Args:
        name: Of the object, for the sentence.
        class_name: What it is.
        mass: [kg]
        sides: Of the smallest box around it [m].

    """
    room = sides[0] * sides[1] * sides[2]
    if room <= 0.0:
        return None  # a sheet has no box
    known, bulk = typical_bulk(class_name), mass / room
    if known is None:
        heavy = max(sides) >= LARGE and bulk > HEAVIEST
        return f"{_weighs(name, mass, bulk)}, more than nearly all things. {ADVICE}" * heavy or None
    if known.low / MARGIN <= bulk <= known.high * MARGIN:
        return None
    article = "an" if known.words[0] in "aeiou" else "a"
    usual = f"{article} {known.words} has {known.low:g} to {known.high:g}"
    return f"{_weighs(name, mass, bulk)}, and {usual}. {ADVICE}"


ADVICE = "Check how large it is (--extent), what it is made of and whether it is hollow."


def _weighs(name: str, mass: float, bulk: float) -> str:
    weight = f"{mass / 1000:.3g} t" if mass >= 1000 else f"{mass:.3g} kg"
    return f"{name} weighs {weight}: {bulk:.3g} kg per cubic metre of its box"


@cache
def _table() -> tuple[TypicalBulk, ...]:
    text = Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
    rows = tomllib.loads(text).items()
    return tuple(TypicalBulk(words, float(low), float(high)) for words, (low, high) in rows)


@cache
def _compounds() -> dict[str, tuple[str, ...]]:
    return joined(e.words for e in _table())


def _fit(entry: TypicalBulk, named: list[str]) -> tuple[int, int]:
    own = entry.words.split()
    return max(named.index(w) for w in own), len(own)

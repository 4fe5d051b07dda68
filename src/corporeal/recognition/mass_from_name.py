"""Masses stated in names: "dumbbell_5kg", "10lb bowling ball"."""

import re
import tomllib
from functools import cache
from pathlib import Path

from corporeal.core.types import Note, NoteKind
from corporeal.recognition.readable_names import everyday_words

MASS_AGREEMENT_RATIO = 1.5
"""Factor between a mass that a name states and the one that comes out which needs no telling: three standard deviations
of what follows from a printed weight (12 %)."""
NETWORK_GENERATIONS = ("2g", "3g", "4g", "5g", "6g")
"""Of mobile networks."""


def mass_from_name(*names: str) -> float | None:
    """Return the mass [kg] that an object's names state; None: none, or several different ones."""
    found = {mass for name in names for mass in _of_name(name)}
    return found.pop() if len(found) == 1 else None


def _of_name(name: str) -> list[float]:
    if _has_table_word(everyday_words(name), "capacity"):
        return []
    return [mass for match in _pattern().finditer(name) if (mass := _mass_of_match(name, match))]


def _mass_of_match(name: str, match: re.Match[str]) -> float | None:
    before = re.sub(r"[^a-z]+", " ", name[: match.start()].lower()).split()
    behind = re.sub(r"[^a-z/]+", " ", name[match.end() :].lower()).split()
    limited = " ".join(before[-2:]).endswith(tuple(_table()["limit"]))
    if limited or (behind and behind[0].startswith(("/", *_table()["behind"]))):
        return None
    if match[0].lower() in NETWORK_GENERATIONS:
        return None
    number = match["number"]
    thousands = re.fullmatch(r"\d{1,3},\d{3}", number)
    value = float(number.replace(",", "" if thousands else "."))
    return int(match["times"] or 1) * value * _units()[match["unit"].lower()] or None


def _has_table_word(name: str, table: str) -> bool:
    """Return whether words of a table stand in a name, whole."""
    return any(re.search(rf"\b{w}s?\b", name) for w in _table()[table])


@cache
def _pattern() -> re.Pattern[str]:
    units = "|".join(sorted(_units(), key=len, reverse=True))
    times = r"(?:(?<!\d)(?P<times>\d{1,2})\s*[x×]\s*)?"
    number = r"(?<![\d.,])(?P<number>\d+(?:[.,]\d+)?)"
    return re.compile(rf"{times}{number}[\s_-]*(?P<unit>{units})(?![A-Za-z])", re.IGNORECASE)


def _units() -> dict[str, float]:
    return _table()["units"]


@cache
def _table() -> dict:
    return tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))


def mass_from_name_warning(name: str, mass: float, *names: str) -> str | None:
    """Return a sentence for the user where an object does not weigh what its names state.

    Args:
        name: Of the object, for the sentence.
        mass: That came out [kg].
        names: All that it is called.
    """
    said = mass_from_name(*names)
    if said is None or mass <= 0.0 or 1 / MASS_AGREEMENT_RATIO <= mass / said <= MASS_AGREEMENT_RATIO:
        return None
    return Note(
        f"{name}: its name says {said:.3g} kg, and it weighs {mass:.3g} kg. Check its size "
        "(--extent), its material and whether it is hollow or filled (--annotations); or the "
        "name means something else.",
        NoteKind.ASSUMED,
    )

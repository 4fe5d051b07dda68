"""How large everyday things are, to notice a file that is not in metres."""

import re
import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

MARGIN = 1.5
"""How far beyond the table a thing may be before anybody is told."""
SMALLEST, LARGEST = 0.005, 20.0
"""Extents that would be remarkable for anything in a scene [m]."""


@dataclass(frozen=True)
class TypicalExtent:
    """Largest extent of one class of things [m]."""

    words: str
    low: float
    usual: float
    high: float


def typical_extent(class_name: str) -> TypicalExtent | None:
    """Return the entry for a name's last known word, the one with the most words that fit.

    "soda can" for "soda can crushed", "cup" for "tea set cup": English puts the noun last.
    """
    words = [_singular(w) for w in re.findall(r"[a-zà-ÿ]+", class_name.lower())]
    found = [e for e in _table() if set(e.words.split()) <= set(words)]
    return max(found, key=lambda e: _fit(e, words), default=None)


def doubt(name: str, class_name: str, extent: float) -> str | None:
    """Return a sentence for the user where a thing is implausibly large or small [m]."""
    known = typical_extent(class_name)
    low, high = (known.low / MARGIN, known.high * MARGIN) if known else (SMALLEST, LARGEST)
    if low <= extent <= high and not _normalised(extent, known):
        return None
    size = f"{name} is {_length(extent)} large"
    if known is None:
        return f"{size}: is the file in metres? Give its real size with --extent {name}=METRES."
    article = "an" if known.words[0] in "aeiou" else "a"
    usual = f"{article} {known.words} is usually about {_length(known.usual)}"
    return f"{size}, but {usual}. Set its size with --extent {name}={known.usual:g}."


def _normalised(extent: float, known: TypicalExtent | None) -> bool:
    """Tell whether a program seems to have fitted the model into a box of 1 or 2 units."""
    exact = min(abs(extent - 1), abs(extent - 2)) < 1e-5
    return exact and known is not None and not known.usual / MARGIN < extent < known.usual * MARGIN


@cache
def _table() -> tuple[TypicalExtent, ...]:
    text = Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
    return tuple(TypicalExtent(words, *sizes) for words, sizes in tomllib.loads(text).items())


def _fit(entry: TypicalExtent, words: list[str]) -> tuple[int, int]:
    own = entry.words.split()
    return max(words.index(w) for w in own), len(own)


def _singular(word: str) -> str:
    keep = word.endswith("ss") or word in (
        "scissors",
        "pliers",
        "dice",
        "cactus",
        "ficus",
        "fitness",
    )
    return word[:-1] if word.endswith("s") and not keep and len(word) > 3 else word


def _length(metres: float) -> str:
    return f"{metres:.3g} m" if metres >= 1 else f"{100 * metres:.3g} cm"

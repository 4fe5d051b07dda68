"""Typical extents of everyday objects, for plausibility checks of units."""

import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from corporeal.core.types import Note, NoteKind
from corporeal.recognition.compound_words import (
    KnownWords,
    correct_doubled_letters,
    index_without_doubled_letters,
    normalise_compounds,
    remove_unknown_accents,
)
from corporeal.recognition.head_noun import move_head_noun_last, names_several_objects, strip_whole_from_part_name
from corporeal.recognition.translation import substance_words, translate_words

TYPICAL_EXTENT_MARGIN_RATIO = 1.5
"""How far beyond the table an object may be before it is reported."""
MIN_PLAUSIBLE_EXTENT_M, MAX_PLAUSIBLE_EXTENT_M = 0.005, 20.0
"""Extents that would be remarkable for anything in a scene [m]."""
CLASSES_ALSO_SUBSTANCES = ("marble", "brick", "stone", "rock", "sand", "snow", "mud", "foam", "paper", "glass")
"""Classes that may be meant as matter where another is named, the least likely last."""


@dataclass(frozen=True)
class TypicalExtent:
    """Largest extent of one class of objects [m]."""

    words: str
    low: float
    usual: float
    high: float
    part: bool = False
    """Usually found as a part of something else, such as clothing."""


def typical_extent(class_name: str) -> TypicalExtent | None:
    """Return the entry for a name's last known word, the one with the most words that fit.

    "soda can" for "soda can crushed", "cup" for "tea set cup": English puts the noun last.
    """
    words = class_name_words(class_name)
    if names_several_objects(plain_words(class_name)):
        return None
    found = [e for e in _table() if set(singular_words(e.words)) <= set(words)]
    return max(found, key=lambda e: _rank_entry(e, words), default=None)


def class_name_words(class_name: str) -> list[str]:
    """Return a name's words as ``normalised_words`` has them, with the compounds of this table."""
    return normalised_words(class_name, _compounds())


def sized_classes() -> tuple[str, ...]:
    """Return what is called every class that has a usual size."""
    return tuple(e.words for e in _table())


def normalised_words(class_name: str, compounds: Mapping[str, tuple[str, ...]]) -> list[str]:
    """Return a name's words, in English and the singular; a known compound counts as its words.

    Args:
        class_name: Class of an object: "golfball", "Kühlschrank".
        compounds: A known compound → the words that it is made of.
    """
    known = _vocabulary()
    said = [remove_unknown_accents(w, known.words) for w in translate_words(plain_words(class_name))]
    tokens = normalise_compounds([_singular(correct_doubled_letters(w, known)) for w in said], known)
    phrases = frozenset((*known.joined.values(), *compounds.values()))
    ordered = strip_whole_from_part_name(move_head_noun_last(tokens, known, phrases), phrases)
    return [part for word in ordered for part in compounds.get(word, (word,))]


def plain_words(class_name: str) -> list[str]:
    """Return a name's runs of letters in lower case."""
    return re.findall(r"[^\W\d_]+", class_name.lower())


PLURAL_ONLY_NOUNS = frozenset(
    "scissors pliers tongs tweezers handcuffs binoculars goggles sunglasses spectacles eyeglasses "
    "jeans pants trousers tights".split()
)
"""Plural words that name one object."""


def with_article(words: str, has: str, have: str) -> str:
    """Return a class with its article and verb: "an axe is", "scissors are"."""
    if words.split()[-1] in PLURAL_ONLY_NOUNS:
        return f"{words} {have}"
    return f"{'an' if words[0] in 'aeiou' else 'a'} {words} {has}"


@cache
def singular_words(phrase: str) -> tuple[str, ...]:
    """Return the words of a class as they stand among ``normalised_words``."""
    return tuple(_singular(w) for w in phrase.split())


def index_compounds(phrases: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Return phrases of several words, by how they look when they are written as one."""
    compounds = (singular_words(phrase) for phrase in phrases)
    return {"".join(words): words for words in compounds if len(words) > 1}


def extent_warning(name: str, class_name: str, extent: float) -> str | None:
    """Return a sentence for the user where an object is implausibly large or small [m]."""
    known = typical_extent(class_name)
    low, high = (
        (known.low / TYPICAL_EXTENT_MARGIN_RATIO, known.high * TYPICAL_EXTENT_MARGIN_RATIO)
        if known
        else (MIN_PLAUSIBLE_EXTENT_M, MAX_PLAUSIBLE_EXTENT_M)
    )
    if low <= extent <= high and not _is_normalised(extent, known):
        return None
    size = f"{name} is {length_text(extent)} large"
    if known is None:
        return Note(
            f"{size}: is the file in metres? Give its real size with --extent {name}=METRES.", NoteKind.ASSUMED, name
        )
    usual = f"{with_article(known.words, 'is', 'are')} usually about {length_text(known.usual)}"
    return Note(f"{size}, but {usual}. Set its size with --extent {name}={known.usual:g}.", NoteKind.ASSUMED, name)


def _is_normalised(extent: float, known: TypicalExtent | None) -> bool:
    """Return whether the model seems normalised to a box of 1 or 2 units."""
    exact = min(abs(extent - 1), abs(extent - 2)) < 1e-5
    return (
        exact
        and known is not None
        and not known.usual / TYPICAL_EXTENT_MARGIN_RATIO < extent < known.usual * TYPICAL_EXTENT_MARGIN_RATIO
    )


@cache
def _table() -> tuple[TypicalExtent, ...]:
    rows = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
    alike = [
        _typical(words, row["size"], row.get("part", False)) for row in rows.pop("alike") for words in row["words"]
    ]
    return (*(_typical(words, sizes) for words, sizes in rows.items()), *alike)


def _typical(words: str, sizes: list[int | float], part: bool = False) -> TypicalExtent:
    low, usual, high = sizes
    return TypicalExtent(words, float(low), float(usual), float(high), part)


@cache
def _compounds() -> dict[str, tuple[str, ...]]:
    return index_compounds(e.words for e in _table())


@cache
def _vocabulary() -> KnownWords:
    """Return the words of the table and for substances, for compounds and slips."""
    things = {singular_words(name)[0] for name in sized_classes() if " " not in name}
    known = things | {w for name in sized_classes() for w in singular_words(name)} | substance_words()
    return KnownWords(
        known, substance_words(), things, _compounds(), index_without_doubled_letters([*known, *_compounds()])
    )


def _rank_entry(entry: TypicalExtent, words: list[str]) -> tuple[int, int, int]:
    return rank_class_match(entry.words, words)


def rank_class_match(phrase: str, words: list[str]) -> tuple[int, int, int]:
    """Rank how well a class fits a name that has all its words, best last.

    Classes that may be materials as well ("table glass", "lego brick") come later; then the last in the name, and the
    one of most words.
    """
    own = singular_words(phrase)
    matter = CLASSES_ALSO_SUBSTANCES.index(own[0]) + 1 if len(own) == 1 and own[0] in CLASSES_ALSO_SUBSTANCES else 0
    return -matter, max(words.index(w) for w in own), len(own)


def _singular(word: str) -> str:
    keep = word.endswith(("ss", "us", "is")) or word in ("scissors", "pliers", "dice")
    return word[:-1] if word.endswith("s") and not keep and len(word) > 3 else word


def length_text(metres: float) -> str:
    """Return a length in words [m]."""
    return f"{metres:.3g} m" if metres >= 1 else f"{100 * metres:.3g} cm"

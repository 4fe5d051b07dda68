"""Splitting and joining of compound words in names."""

import re
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass

from corporeal.recognition.parts_by_name import strip_accents

MIN_COMPOUND_PART_LETTERS = 3
"""Letters of the shortest word that a compound is taken apart into."""
MIN_FIRST_NOUN_LETTERS = 4
"""The same of the first word where both are things: "car" and "pet" make no carpet."""
MIN_CORRECTED_LETTERS = 5
"""Letters of the shortest word whose spelling is mended."""
NEVER_CORRECTED_WORDS = frozenset(("canon",))
"""Right words that a doubled letter would make another of."""
SINGULAR_OF_PLURAL_ENDING = (
    ("ie", "y"), ("ve", "f"), ("ve", "fe"), ("se", "s"), ("xe", "x"), ("ze", "z"), ("che", "ch"),
    ("she", "sh"), ("oe", "o"),
)  # fmt: skip
"""How plurals without their s end, and what stands for it in the singular: "cherrie", "knive"."""
PLURALS_WITH_OTHER_MEANING = frozenset(("glasses", "ashes"))
"""Plurals that mean something else, but in a phrase: glasses are no glass, wine glasses are."""


@dataclass(frozen=True)
class KnownWords:
    """Words that are known, in the singular."""

    words: Container[str]
    """All of them."""
    first: Container[str]
    """Substances: the first word of a compound such as "steelbucket"."""
    last: Container[str]
    """Things: its last word."""
    joined: Mapping[str, tuple[str, ...]]
    """Phrases by how they look when they are written as one word."""
    squeezed: Mapping[str, str]
    """Words and joined phrases by how they look without doubled letters; what two have is not in it."""


def without_doubled_letters(word: str) -> str:
    """Return a word without doubled letters, where most slips are: "dumbbell" as "dumbel"."""
    return re.sub(r"(.)\1+", r"\1", word)


def index_without_doubled_letters(words: Sequence[str]) -> dict[str, str]:
    """Return words by how they look without doubled letters; what two share says nothing."""
    found: dict[str, str] = {}
    for word in dict.fromkeys(words):
        if len(word) >= MIN_CORRECTED_LETTERS:
            found[without_doubled_letters(word)] = "" if without_doubled_letters(word) in found else word
    return {short: word for short, word in found.items() if word}


def normalise_compounds(words: Sequence[str], known: KnownWords) -> list[str]:
    """Return a name's words as a vocabulary has them.

    ``["dumbbel"]`` gives ``["dumbbell"]``, ``["wineglas"]`` ``["wine", "glass"]``, ``["surf", "board"]``
    ``["surfboard"]``, ``["treestump"]`` ``["tree", "stump"]``.
    """
    right = [correct_doubled_letters(word, known) for word in words]
    return [part for word in _join_compounds(right, known) for part in _split_compound(word, known)]


def singularise_words(words: Sequence[str], known: KnownWords, without_s: Callable[[str], str]) -> list[str]:
    """Return words in the singular: ``["wine", "glasses"]`` gives ``["wine", "glass"]``.

    What a plural in -ies, -ves or -es is of has to be known; of any other the s is cut.

    Args:
        words: Of a name.
        known: The words that there are.
        without_s: Cuts the s of a plural.
    """
    found: list[str] = []
    for word in words:
        found.append(_singular(word, found[-1] if found else "", known, without_s))
    return found


def _singular(word: str, before: str, known: KnownWords, without_s: Callable[[str], str]) -> str:
    shorter = without_s(word)
    ways = [shorter.removesuffix(a) + b for a, b in SINGULAR_OF_PLURAL_ENDING if shorter.endswith(a)]
    if word in PLURALS_WITH_OTHER_MEANING:
        return next((way for way in ways if before + way in known.joined), shorter)
    if shorter == word:  # it may end as a singular does: taxis as tennis
        ways = [] if word in known.words else [word.removesuffix("s")]
    elif shorter in known.words or shorter in known.joined:
        return shorter
    return next((way for way in ways if way in known.words or way in known.joined), shorter)


def remove_unknown_accents(word: str, known: Container[str]) -> str:
    """Return a word without its accents where only this is known: "métal"."""
    bare = strip_accents(word)
    return bare if bare in known else word


def correct_doubled_letters(word: str, known: KnownWords) -> str:
    """Mend a doubled letter that was left out or is one too many."""
    if (
        len(word) < MIN_CORRECTED_LETTERS
        or word in known.words
        or word in known.joined
        or word in NEVER_CORRECTED_WORDS
    ):
        return word
    return known.squeezed.get(without_doubled_letters(word), word)


def _join_compounds(words: Sequence[str], known: KnownWords) -> list[str]:
    """Join neighbours that are one known word, unless the phrase is known as two."""
    found: list[str] = []
    for word in words:
        one = found[-1] + word if found else ""
        if one and one in known.words and one not in known.joined:
            found[-1] = one
        else:
            found.append(word)
    return found


def _split_compound(word: str, known: KnownWords) -> tuple[str, ...]:
    """Take a compound apart: "golfball" is a golf ball, a "steelbucket" a bucket of steel."""
    if word in known.words or len(word) < 2 * MIN_COMPOUND_PART_LETTERS:
        return (word,)
    if word in known.joined:
        return known.joined[word]
    cuts = [(word[:k], word[k:]) for k in range(MIN_COMPOUND_PART_LETTERS, len(word) - MIN_COMPOUND_PART_LETTERS + 1)]
    of_matter = ((a, b) for a, b in cuts if a in known.first and b in known.last)
    of_things = ((a, b) for a, b in cuts if len(a) >= MIN_FIRST_NOUN_LETTERS and a in known.words and b in known.last)
    return next(of_matter, None) or next(of_things, (word,))

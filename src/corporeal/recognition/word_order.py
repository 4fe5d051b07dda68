"""Which word of a name is the thing: read as English has it, whatever order the file has."""

import tomllib
from collections.abc import Collection, Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path

from corporeal.recognition.spelling import Vocabulary

Phrases = Collection[tuple[str, ...]]
"""Names of things in several words."""


def thing_last(words: Sequence[str], known: Vocabulary, phrases: Phrases) -> list[str]:
    """Return a name's words with what it is of before it, and without what is beside it.

    ``can of coke`` gives ``coke can``, ``barrel oil rusty`` ``oil barrel rusty``, ``bottle with
    cork`` ``bottle``, ``barrel game asset`` ``barrel``.

    Args:
        words: In English, in the singular.
        known: Words for substances and things.
        phrases: Names of things that are more than one word.

    """
    bare = _without(words, (*_phrases("wrapping"), *_phrases("measures")), phrases)
    return _swapped(_turned(bare, known, phrases), phrases)


def of_part(words: Sequence[str], phrases: Phrases) -> tuple[str, ...]:
    """Return the words of a part's name without the thing that it is of.

    ``lid jar metal`` and ``jar lid metal`` give ``lid metal``; ``door handle`` is a word of its own
    where the vocabulary has it.
    """
    found = tuple(words)
    for k, word in enumerate(found):
        for whole in _parts().get(word, ()):
            n = len(whole)
            if found[k + 1 : k + 1 + n] == whole and not _within(found, k, phrases):
                return of_part((*found[: k + 1], *found[k + 1 + n :]), phrases)
            if k >= n and found[k - n : k] == whole and not _within(found, k, phrases):
                return of_part((*found[: k - n], *found[k:]), phrases)
    return found


def is_several(words: Sequence[str]) -> bool:
    """Tell whether a name is that of several things: "pile of bricks"."""
    several = {phrase[0] for phrase in _phrases("several")}
    return any(a in several and b in ("of", "de", "von") for a, b in pairwise(words))


def _turned(words: list[str], known: Vocabulary, phrases: Phrases) -> list[str]:
    """Put what stands behind a preposition before the thing, or leave it out.

    What only describes stays in front: a full bottle of wine is a full wine bottle.
    """
    for k in range(1, len(words) - 1):
        before, behind = words[:k], words[k + 1 :]
        several = (before[-1],) in _phrases("several")
        if _within(words, k, phrases) or not (several or any(w in known.words for w in before)):
            continue
        if (words[k],) in _phrases("of") or _is_of_matter(words[k], behind, known):
            own = before[:-1] if several else before
            n = next((n for n, w in enumerate(own) if w in known.words), 0)
            return _turned([*own[:n], *behind, *own[n:]], known, phrases)
        if (words[k],) in (*_phrases("beside"), *_phrases("made")) and _is_thing(
            before, known, phrases
        ):
            return before
    return words


def _is_thing(words: Sequence[str], known: Vocabulary, phrases: Phrases) -> bool:
    """Tell whether words name a thing: a clip-on lamp is no clip."""
    named = any(word in known.last for word in words)
    return named or any(_within(words, k, phrases) for k in range(len(words)))


def _is_of_matter(word: str, behind: Sequence[str], known: Vocabulary) -> bool:
    """Tell whether a preposition is followed by what something is made of, and by no thing."""
    return (word,) in _phrases("made") and behind[0] in known.first and len(behind) == 1


def _swapped(words: list[str], phrases: Phrases) -> list[str]:
    """Put two words right that are a phrase the other way round: "barrel oil", "tire car"."""
    found = list(words)
    for k in range(len(found) - 1):
        a, b = found[k], found[k + 1]
        free = not any(_within(found, j, phrases) for j in (k, k + 1))
        if free and (b, a) in phrases:
            found[k], found[k + 1] = b, a
    return found


def _within(words: Sequence[str], k: int, phrases: Phrases) -> bool:
    """Tell whether a word is one of a phrase where it stands."""
    pairs = [tuple(words[j : j + n]) for n in (2, 3) for j in range(max(0, k - n + 1), k + 1)]
    return any(len(pair) > 1 and pair in phrases for pair in pairs)


def _without(words: Sequence[str], phrases: Phrases, kept: Phrases) -> list[str]:
    """Leave phrases out of a name, unless nothing is left then."""
    found, k = [], 0
    while k < len(words):
        n = next((n for n in (2, 1) if tuple(words[k : k + n]) in phrases), 0)
        if n and not _within(words, k, kept):
            k += n
            continue
        found.append(words[k])
        k += 1
    return found or list(words)


def part_words() -> frozenset[str]:
    """Return the words for parts of things."""
    return frozenset(_parts())


@cache
def _phrases(table: str) -> tuple[tuple[str, ...], ...]:
    return tuple(tuple(phrase.split()) for phrase in _table()[table])


@cache
def _parts() -> dict[str, tuple[tuple[str, ...], ...]]:
    rows = _table()["parts"].items()
    return {part: tuple(tuple(w.split()) for w in wholes) for part, wholes in rows}


@cache
def _table() -> dict:
    return tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))

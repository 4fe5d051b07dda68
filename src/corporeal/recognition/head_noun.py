"""Head nouns of names, by English word order."""

import tomllib
from collections.abc import Collection, Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path

from corporeal.recognition.compound_words import KnownWords

PhraseSet = Collection[tuple[str, ...]]
"""Names of objects in several words."""


def move_head_noun_last(words: Sequence[str], known: KnownWords, phrases: PhraseSet) -> list[str]:
    """Return a name's words with what it is of before it, and without what is beside it.

    ``can of coke`` gives ``coke can``, ``barrel oil rusty`` ``oil barrel rusty``, ``bottle with cork`` ``bottle``,
    ``barrel game asset`` ``barrel``.
    """
    bare = _remove_phrases(words, (*_phrases("wrapping"), *_phrases("measures")), phrases)
    return _swap_reversed_phrases(_move_complement_first(bare, known, phrases), phrases)


def strip_whole_from_part_name(words: Sequence[str], phrases: PhraseSet) -> tuple[str, ...]:
    """Return the words of a part's name without the object that it is of.

    ``lid jar metal`` and ``jar lid metal`` give ``lid metal``; ``door handle`` is a word of its own where the
    vocabulary has it.
    """
    found = tuple(words)
    for k, word in enumerate(found):
        for whole in _wholes_of_part().get(word, ()):
            n = len(whole)
            if found[k + 1 : k + 1 + n] == whole and not _is_in_phrase(found, k, phrases):
                return strip_whole_from_part_name((*found[: k + 1], *found[k + 1 + n :]), phrases)
            if k >= n and found[k - n : k] == whole and not _is_in_phrase(found, k, phrases):
                return strip_whole_from_part_name((*found[: k - n], *found[k:]), phrases)
    return found


def names_several_objects(words: Sequence[str]) -> bool:
    """Return whether a name is that of several objects: "pile of bricks"."""
    several = {phrase[0] for phrase in _phrases("several")}
    return any(a in several and b in ("of", "de", "von") for a, b in pairwise(words))


def _move_complement_first(words: list[str], known: KnownWords, phrases: PhraseSet) -> list[str]:
    """Put what follows a preposition before the object, or leave it out.

    What only describes stays in front: a full bottle of wine is a full wine bottle.
    """
    for k in range(1, len(words) - 1):
        before, behind = words[:k], words[k + 1 :]
        several = (before[-1],) in _phrases("several")
        if _is_in_phrase(words, k, phrases) or not (several or any(w in known.words for w in before)):
            continue
        if (words[k],) in _phrases("of") or _is_followed_by_substance(words[k], behind, known):
            own = before[:-1] if several else before
            n = next((n for n, w in enumerate(own) if w in known.words), 0)
            return _move_complement_first([*own[:n], *behind, *own[n:]], known, phrases)
        if (words[k],) in (*_phrases("beside"), *_phrases("made")) and _names_object(before, known, phrases):
            return before
    return words


def _names_object(words: Sequence[str], known: KnownWords, phrases: PhraseSet) -> bool:
    """Return whether words name an object: a clip-on lamp is no clip."""
    named = any(word in known.last for word in words)
    return named or any(_is_in_phrase(words, k, phrases) for k in range(len(words)))


def _is_followed_by_substance(word: str, behind: Sequence[str], known: KnownWords) -> bool:
    """Return whether a preposition is followed by a substance, and by no object."""
    return (word,) in _phrases("made") and behind[0] in known.first and len(behind) == 1


def _swap_reversed_phrases(words: list[str], phrases: PhraseSet) -> list[str]:
    """Put two words right that are a phrase the other way round: "barrel oil", "tire car"."""
    found = list(words)
    for k in range(len(found) - 1):
        a, b = found[k], found[k + 1]
        free = not any(_is_in_phrase(found, j, phrases) for j in (k, k + 1))
        if free and (b, a) in phrases:
            found[k], found[k + 1] = b, a
    return found


def _is_in_phrase(words: Sequence[str], k: int, phrases: PhraseSet) -> bool:
    """Return whether a word is part of a phrase."""
    pairs = [tuple(words[j : j + n]) for n in (2, 3) for j in range(max(0, k - n + 1), k + 1)]
    return any(len(pair) > 1 and pair in phrases for pair in pairs)


def _remove_phrases(words: Sequence[str], phrases: PhraseSet, kept: PhraseSet) -> list[str]:
    """Leave phrases out of a name, unless nothing is left then."""
    found, k = [], 0
    while k < len(words):
        n = next((n for n in (2, 1) if tuple(words[k : k + n]) in phrases), 0)
        if n and not _is_in_phrase(words, k, kept):
            k += n
            continue
        found.append(words[k])
        k += 1
    return found or list(words)


def part_nouns() -> frozenset[str]:
    """Return the words for parts of objects."""
    return frozenset(_wholes_of_part())


@cache
def _phrases(table: str) -> tuple[tuple[str, ...], ...]:
    return tuple(tuple(phrase.split()) for phrase in _table()[table])


@cache
def _wholes_of_part() -> dict[str, tuple[tuple[str, ...], ...]]:
    rows = _table()["parts"].items()
    return {part: tuple(tuple(w.split()) for w in wholes) for part, wholes in rows}


@cache
def _table() -> dict:
    return tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))

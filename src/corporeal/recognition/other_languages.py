"""Names in other languages, as far as they name everyday things and what these are made of."""

import tomllib
import unicodedata
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

from corporeal.recognition.identity import plain

OF = frozenset("de del di du des da do della dello en au aux".split())
"""What stands between a thing and what belongs to it: "caja de carton" is a box of cardboard,
"pot au lait" a milk pot."""
STATES = frozenset("empty full old small large red blue green white black".split())
"""What stands behind a thing and what belongs to it, and is of the thing: "botella de vino vacía"
is an empty bottle."""
UMLAUTS = str.maketrans({"ä": "ae", "ö": "oe", "ü": "ue", "ß": "ss"})
GAPLESS = ("CJK ", "HIRAGANA ", "KATAKANA ")
"""Letters of languages that are written without gaps."""
PLURALS = ("s", "es", "n", "en", "x")
"""How plurals end that only add to a word: Muscheln, llaves, gâteaux; -es, -en to a consonant."""
VOWELS = frozenset("aeiou")
SHORTEST = 3
"""Letters before the last word of a compound."""


def in_english(words: Sequence[str]) -> list[str]:
    """Return the words of a name with those of other languages in English, the thing last.

    ``["seau", "de", "plage"]`` gives ``["plage", "bucket"]``, ``["holzstuhl"]`` ``["wood",
    "chair"]``; what is not known stays as it is.

    Args:
        words: Of a name, in lower case.

    """
    words = _unhyphened(words)
    found = [_translated(plain(word)) for word in words]
    known = [part for k, word in enumerate(words) for part in found[k] or (word,)]
    where = next(
        (k for k, word in enumerate(words) if plain(word) in OF and k and found[k - 1]), None
    )
    if where is None:
        return known
    before = [part for k in range(where) for part in found[k] or (words[k],)]
    behind = in_english(words[where + 1 :])
    last = next((k for k in range(len(behind), 1, -1) if behind[k - 1] not in STATES), 1)
    return behind[:last] + before + behind[last:]


def _unhyphened(words: Sequence[str]) -> list[str]:
    """Join neighbours that are one word of the table: "lave vaisselle", "cerf volant"."""
    found: list[str] = []
    for word in words:
        whole = found and min(len(found[-1]), len(word)) > SHORTEST
        if whole and plain(found[-1] + word) in _words():
            found[-1] += word
        else:
            found.append(word)
    return found


@cache
def _translated(word: str) -> tuple[str, ...]:
    """Return what a word, or a compound that ends with it, is in English; (): not known."""
    for ending in ("", *PLURALS):
        stem = word.removesuffix(ending) if word.endswith(ending) else ""
        if stem in _words() and not (len(ending) > 1 and stem[-1] in VOWELS):
            return _words()[stem]
    if not word.isascii():
        return _pieced(word)
    for cut in range(SHORTEST, len(word) - SHORTEST):
        last = _ends().get(word[cut:])
        if last:
            first = word[:cut]
            return (*(_words().get(first) or (first,)), *last)
    return ()


def _pieced(word: str) -> tuple[str, ...]:
    """Return the English of known words that stand together without a gap; (): the last is unknown.

    Chinese and Japanese are written so, the thing last: 木箱 is a box of wood, 木の箱 too. What is
    not known before it is left out there, and nowhere else.
    """
    gapless = all(unicodedata.name(c, "").startswith(GAPLESS) for c in word)
    found: list[str] = []
    known = 0
    while word:
        known = next((k for k in range(len(word), 0, -1) if word[:k] in _words()), 0)
        if not known and not gapless:
            return ()
        found += _words()[word[:known]] if known else ()
        word = word[known or 1 :]
    return tuple(found) if known else ()


@cache
def substances() -> frozenset[str]:
    """Return the English words for substances that other languages are put into, one word each."""
    text = Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
    tables = [table for name, table in tomllib.loads(text).items() if name == "substances"]
    return frozenset(w for table in tables for w in table if " " not in w)


@cache
def _words() -> dict[str, tuple[str, ...]]:
    """Return every word that stands by itself → its English words."""
    return {s: english for word, english in _rows() if word[0] != "-" for s in _spelt(word)}


@cache
def _ends() -> dict[str, tuple[str, ...]]:
    """Return every word that ends compounds → its English words."""
    ends = [(word, english) for word, english in _rows() if word[0] == "-" or word[-1] == "*"]
    return {s: english for word, english in ends for s in _spelt(word)}


def _spelt(word: str) -> set[str]:
    """Return the ways in which a word of the table is written without accents."""
    bare = word.strip("-*")
    return {plain(bare), plain(bare.translate(UMLAUTS))}


def _rows() -> Iterator[tuple[str, tuple[str, ...]]]:
    text = Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
    for table in tomllib.loads(text).values():
        for english, words in table.items():
            for word in words:
                yield word, tuple(english.split())

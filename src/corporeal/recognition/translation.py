"""Translation of names of everyday objects and materials to English."""

import tomllib
import unicodedata
from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path

from corporeal.recognition.parts_by_name import strip_accents

OF_PREPOSITIONS = frozenset("de del di du des da do della dello en au aux".split())
"""Words between an object and what belongs to it: "caja de carton" is a box of cardboard, "pot au lait" a milk
pot.
"""
TRAILING_ADJECTIVES = frozenset("empty full old small large red blue green white black".split())
"""Words after an object and what belongs to it that describe the object: "botella de vino vacía" is an empty bottle.
"""
UMLAUT_TRANSCRIPTION = str.maketrans({"ä": "ae", "ö": "oe", "ü": "ue", "ß": "ss"})
UNSPACED_SCRIPTS = ("CJK ", "HIRAGANA ", "KATAKANA ")
"""Letters of languages that are written without gaps."""
PLURAL_ENDINGS = ("s", "es", "n", "en", "x")
"""How plurals end that only add to a word: Muscheln, llaves, gâteaux; -es, -en to a consonant."""
VOWELS = frozenset("aeiou")
MIN_COMPOUND_LETTERS = 3
"""Letters before the last word of a compound."""


def translate_words(words: Sequence[str]) -> list[str]:
    """Return the words of a name with those of other languages in English, the object last.

    ``["seau", "de", "plage"]`` gives ``["plage", "bucket"]``, ``["holzstuhl"]`` ``["wood", "chair"]``; what is not
    known stays as it is.
    """
    words = _join_hyphenated(words)
    found = [_translate_word(strip_accents(word)) for word in words]
    known = [part for k, word in enumerate(words) for part in found[k] or (word,)]
    where = next(
        (k for k, word in enumerate(words) if strip_accents(word) in OF_PREPOSITIONS and k and found[k - 1]), None
    )
    if where is None:
        return known
    before = [part for k in range(where) for part in found[k] or (words[k],)]
    behind = translate_words(words[where + 1 :])
    last = next((k for k in range(len(behind), 1, -1) if behind[k - 1] not in TRAILING_ADJECTIVES), 1)
    return behind[:last] + before + behind[last:]


def _join_hyphenated(words: Sequence[str]) -> list[str]:
    """Join neighbours that are one word of the table: "lave vaisselle", "cerf volant"."""
    found: list[str] = []
    for word in words:
        whole = found and min(len(found[-1]), len(word)) > MIN_COMPOUND_LETTERS
        if whole and strip_accents(found[-1] + word) in _word_translations():
            found[-1] += word
        else:
            found.append(word)
    return found


@cache
def _translate_word(word: str) -> tuple[str, ...]:
    """Return what a word, or a compound that ends with it, is in English; (): not known."""
    for ending in ("", *PLURAL_ENDINGS):
        stem = word.removesuffix(ending) if word.endswith(ending) else ""
        if stem in _word_translations() and not (len(ending) > 1 and stem[-1] in VOWELS):
            return _word_translations()[stem]
    if not word.isascii():
        return _translate_unspaced(word)
    for cut in range(MIN_COMPOUND_LETTERS, len(word) - MIN_COMPOUND_LETTERS):
        last = _ending_translations().get(word[cut:])
        if last:
            first = word[:cut]
            return (*(_word_translations().get(first) or (first,)), *last)
    return ()


def _translate_unspaced(word: str) -> tuple[str, ...]:
    """Return the English of known words that stand together without a gap; (): the last is unknown.

    Chinese and Japanese are written so, the object last: 木箱 is a box of wood, 木の箱 too. What is
    not known before it is left out there, and nowhere else.
    """
    gapless = all(unicodedata.name(c, "").startswith(UNSPACED_SCRIPTS) for c in word)
    found: list[str] = []
    known = 0
    while word:
        known = next((k for k in range(len(word), 0, -1) if word[:k] in _word_translations()), 0)
        if not known and not gapless:
            return ()
        found += _word_translations()[word[:known]] if known else ()
        word = word[known or 1 :]
    return tuple(found) if known else ()


@cache
def substance_words() -> frozenset[str]:
    """Return the English words for substances that other languages are put into, one word each."""
    text = Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
    tables = [table for name, table in tomllib.loads(text).items() if name == "substances"]
    return frozenset(w for table in tables for w in table if " " not in w)


@cache
def _word_translations() -> dict[str, tuple[str, ...]]:
    """Return every single word → its English words."""
    return {s: english for word, english in _dictionary_rows() if word[0] != "-" for s in _unaccented_spellings(word)}


@cache
def _ending_translations() -> dict[str, tuple[str, ...]]:
    """Return every word that ends compounds → its English words."""
    ends = [(word, english) for word, english in _dictionary_rows() if word[0] == "-" or word[-1] == "*"]
    return {s: english for word, english in ends for s in _unaccented_spellings(word)}


def _unaccented_spellings(word: str) -> set[str]:
    """Return the ways in which a word of the table is written without accents."""
    bare = word.strip("-*")
    return {strip_accents(bare), strip_accents(bare.translate(UMLAUT_TRANSCRIPTION))}


def _dictionary_rows() -> Iterator[tuple[str, tuple[str, ...]]]:
    text = Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
    for table in tomllib.loads(text).values():
        for english, words in table.items():
            for word in words:
                yield word, tuple(english.split())

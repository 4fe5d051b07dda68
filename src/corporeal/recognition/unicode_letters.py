"""Letters of every alphabet, for tokenizing names."""

import unicodedata
from itertools import groupby


def compose_accents(name: str) -> str:
    """Return a name with each accented letter as one character, however a file system wrote it."""
    return unicodedata.normalize("NFC", name)


def is_letter(character: str) -> bool:
    """Return whether a character is a letter, or a mark that belongs to one (a vowel sign)."""
    return unicodedata.category(character)[0] in "LM"


def is_ideograph(character: str) -> bool:
    """Return whether a character is a word by itself, as in Chinese and Japanese."""
    return unicodedata.name(character, "").startswith("CJK ")


def letter_runs(name: str) -> list[str]:
    """Return the unbroken runs of letters in a name: ``"013_Größe.x"`` gives Größe and x."""
    return ["".join(run) for letter, run in groupby(compose_accents(name), is_letter) if letter]


def has_meaning(word: str) -> bool:
    """Return whether a word has two letters or more, or is an ideograph."""
    return len(word) > 1 or (word != "" and is_ideograph(word))

"""Portable identifiers of names."""

import re
import unicodedata
from collections.abc import Iterable

from corporeal.recognition.readable_names import unique_names


def identifiers(titles: Iterable[str], taken: Iterable[str] = ()) -> list[str]:
    """Return ASCII identifiers, each once: letters, digits and underscores, no digit in front.

    Accents are dropped; letters of other alphabets become underscores, and a name of nothing else
    becomes ``thing``.

    Args:
        titles: As people call objects.
        taken: Identifiers that stand for something else.

    """
    taken = list(taken)
    return unique_names([*taken, *map(_identifier, titles)])[len(taken) :]


def _identifier(title: str) -> str:
    plain = unicodedata.normalize("NFKD", title).encode("ascii", "ignore").decode()
    word = re.sub(r"[^A-Za-z0-9]+", "_", plain).strip("_")[:60]
    if not re.search(r"[A-Za-z]", word):
        return f"thing_{word}" if word else "thing"
    return word if word[0].isalpha() else f"thing_{word}"

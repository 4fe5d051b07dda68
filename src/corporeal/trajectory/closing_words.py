"""What a finished run says last, by weight: what may be wrong, what was assumed, what was left out.

Sentences are written where something is noticed; here they are only put in order, for the report
and for the terminal. A sentence tells by its own words which it is: what was left out says so, and
what was assumed names the option, or the file, that changes it.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from corporeal.findings import RunAudit


@dataclass(frozen=True)
class Kind:
    """One kind of sentence."""

    word: str
    """Before each of them in a log."""
    head: str
    """Above them in the report."""
    several: str
    """More than one of them."""


DOUBT = Kind("warning", "What may be wrong", "warnings")
ASSUMED = Kind("hint", "What was assumed, and what changes it", "hints")
LEFT_OUT = Kind("left out", "What was left out", "left out")
KINDS = (DOUBT, ASSUMED, LEFT_OUT)
"""The gravest first."""

OMITS = re.compile(r"\bleft out\b")
GRAVE = re.compile(
    r"\b(wrong|invalid|unknown|contradict|Check them|made up(?! of)|not (physical|to be trusted))\b"
)
"""What a sentence says that doubts the result itself."""
OFFERS = re.compile(r"(?<!\w)--(?!detail\b|force\b)[a-z]|\bscene\.toml\b|0-reconstruct/")
"""What a sentence says that tells how to have it otherwise. A finer --detail is what errors of the
simulation ask for, and --force is no other way."""


def closing_words(audit: RunAudit) -> dict[Kind, tuple[str, ...]]:
    """Return what a run says last, each sentence once, kinds and sentences by weight."""
    told = [*((_kind(w), w) for w in audit.warnings), *_hints(audit.hints)]
    return {kind: _by_weight(s for k, s in told if k == kind) for kind in KINDS}


def parted(sentences: str) -> tuple[str, str]:
    """Part what is the matter, the first sentence, from what follows: why, and what to do."""
    first, *rest = re.split(r"(?<=[a-z0-9)%°][.:]) (?=[A-Z])", sentences, maxsplit=1)
    return first, " ".join(rest)


def _hints(hints: Iterable[str]) -> Iterator[tuple[Kind, str]]:
    for hint in hints:
        yield (LEFT_OUT if OMITS.search(hint) else ASSUMED), hint


def _kind(warning: str) -> Kind:
    if OMITS.search(warning):
        return LEFT_OUT
    return ASSUMED if OFFERS.search(warning) and not GRAVE.search(warning) else DOUBT


def _by_weight(sentences: Iterable[str]) -> tuple[str, ...]:
    return tuple(sorted(dict.fromkeys(sentences), key=lambda s: GRAVE.search(s) is None))

"""What a finished run says last, by weight: what may be wrong, what was assumed, what was left out.

Sentences get their kind where something is noticed (``types.notes``); here they are only put in
order, for the report and for the terminal.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from corporeal.core.findings import RunAudit
from corporeal.core.types import Note, NoteKind


@dataclass(frozen=True)
class Section:
    """Sentences that are listed together."""

    word: str
    """Before each of them in a log."""
    head: str
    """Above them in the report."""
    several: str
    """More than one of them."""
    kinds: tuple[NoteKind, ...]
    """Which they are, the gravest first."""


DOUBT = Section("warning", "What may be wrong", "warnings", (NoteKind.GRAVE, NoteKind.DOUBT))
ASSUMED = Section("hint", "What was assumed, and what changes it", "hints", (NoteKind.ASSUMED,))
LEFT_OUT = Section("left out", "What was left out", "left out", (NoteKind.LEFT_OUT,))
SECTIONS = (DOUBT, ASSUMED, LEFT_OUT)
"""The gravest first."""


def closing_words(audit: RunAudit) -> dict[Section, tuple[str, ...]]:
    """Return what a run says last, each sentence once, sections and sentences by weight."""
    told = (*audit.notes, *(Note(hint, NoteKind.ASSUMED) for hint in audit.hints))
    return {s: tuple(dict.fromkeys(_of(s, told))) for s in SECTIONS}


def parted(sentences: str) -> tuple[str, str]:
    """Part what is the matter, the first sentence, from what follows: why, and what to do."""
    first, *rest = re.split(r"(?<=[a-z0-9)%°][.:]) (?=[A-Z])", sentences, maxsplit=1)
    return first, " ".join(rest)


def _of(section: Section, told: tuple[Note, ...]) -> Iterator[str]:
    for kind in section.kinds:
        yield from (str(note) for note in told if note.kind is kind)

"""Summary of a run's notes by severity: possible errors, assumptions, omissions.

Notes get their kind where they are made (``types.notes``); here they are ordered for the report and the terminal.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from corporeal.core.audit_data import RunAudit
from corporeal.core.types import Note, NoteKind


@dataclass(frozen=True)
class SummarySection:
    """Sentences that are listed together."""

    word: str
    """Before each of them in a log."""
    head: str
    """Above them in the report."""
    several: str
    """More than one of them."""
    kinds: tuple[NoteKind, ...]
    """Which they are, the gravest first."""


FINDINGS_SECTION = SummarySection("grave", "What contradicts the measured values", "grave findings", ())
WARNINGS_SECTION = SummarySection("warning", "What may be wrong", "warnings", (NoteKind.GRAVE, NoteKind.DOUBT))
ASSUMPTIONS_SECTION = SummarySection("hint", "What was assumed, and what changes it", "hints", (NoteKind.ASSUMED,))
LEFT_OUT_SECTION = SummarySection("left out", "What was left out", "left out", (NoteKind.LEFT_OUT,))
SECTIONS = (FINDINGS_SECTION, WARNINGS_SECTION, ASSUMPTIONS_SECTION, LEFT_OUT_SECTION)
"""The gravest first."""


def summary_sections(audit: RunAudit) -> dict[SummarySection, tuple[str, ...]]:
    """Return the sections of the summary, each sentence once, by severity."""
    grave = tuple(f.sentence for f in audit.findings if f.severity == "grave")
    rest = (note for note in audit.notes if note not in grave)
    every = (*rest, *(Note(hint, NoteKind.ASSUMED) for hint in audit.hints))
    return {s: grave if s is FINDINGS_SECTION else tuple(dict.fromkeys(_of(s, every))) for s in SECTIONS}


def split_advice(sentences: str) -> tuple[str, str]:
    """Split a message into its first sentence and the rest: reason and advice."""
    first, *rest = re.split(r"(?<=[a-z0-9)%°][.:]) (?=[A-Z])", sentences, maxsplit=1)
    return first, " ".join(rest)


def _of(section: SummarySection, every: tuple[Note, ...]) -> Iterator[str]:
    for kind in section.kinds:
        yield from (str(note) for note in every if note.kind is kind)

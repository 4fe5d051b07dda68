"""Notes on results: sentences with a kind, set where they are made.

A note is a string: what only prints sentences knows nothing of kinds. A plain string counts as a doubt, which errs to
the safe side; so do sentences that were kept before there were kinds.
"""

from collections.abc import Iterable, Sequence
from enum import Enum
from itertools import zip_longest


class NoteKind(Enum):
    """What a sentence tells a reader of the report; the gravest first."""

    GRAVE = "the result, or a shape in it, may be wrong as a whole"
    DOUBT = "something may be wrong"
    ASSUMED = "something was assumed, and an option or a file changes it"
    LEFT_OUT = "something of the input is not used"


class Note(str):
    """A sentence, or some, of one kind.

    What is made of it by formatting is a plain string; ``with_text`` keeps the kind.
    """

    kind: NoteKind
    size_of: str
    """Name of the object whose size it doubts; empty: it is about something else."""

    def __new__(cls, text: str, kind: NoteKind = NoteKind.DOUBT, size_of: str = "") -> "Note":
        """Return the text as a note of that kind."""
        note = super().__new__(cls, text)
        note.kind, note.size_of = kind, size_of
        return note

    def __getnewargs__(self) -> tuple[str, NoteKind, str]:  # type: ignore[override]
        """Return what a copy in another process is made of."""
        return str(self), self.kind, self.size_of


def note_kind(sentence: str) -> NoteKind:
    """Return the kind of a sentence; a plain string is a doubt."""
    return sentence.kind if isinstance(sentence, Note) else NoteKind.DOUBT


def with_text(sentence: str, text: str) -> Note:
    """Return another text of the same kind, about the same."""
    return Note(text, note_kind(sentence), sentence.size_of if isinstance(sentence, Note) else "")


def note_kinds(sentences: Iterable[str]) -> tuple[NoteKind, ...]:
    """Return the kind of each sentence, for a JSON file beside the plain sentences."""
    return tuple(map(note_kind, sentences))


def notes_with_kinds(sentences: Sequence[str], kinds: Sequence[NoteKind]) -> tuple[Note, ...]:
    """Return the notes whose kinds ``note_kinds`` listed; sentences of files without kinds are doubts."""
    pairs = zip_longest(sentences, kinds[: len(sentences)], fillvalue=NoteKind.DOUBT)
    return tuple(Note(str(text), NoteKind(kind)) for text, kind in pairs)

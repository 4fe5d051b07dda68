"""How large real objects are: asked of a model in words, or read in a table, never computed.

Each class is a question of its own, so that its answer is recorded, replayed and paid for once,
whatever else stands in a scene.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Literal

from corporeal.core.types import NOTHING_ASKED, Note, NoteKind, Usage
from corporeal.recognition.typical_extents import MARGIN, typical_extent
from corporeal.vlm import Vlm, connect
from corporeal.vlm.by_hand import all_answered, is_more
from corporeal.vlm.interview import Interview, Subject
from corporeal.vlm.together import together
from corporeal.vlm.words import length, usage

NEUTRAL = 0.3
"""Stands in for the size of what nobody knows [m]: between a mug and a chair."""
TABLE = "the table of typical extents"
AT_ONCE = 4
"""Questions that are asked at the same time."""

SizedBy = Literal["file", "model", "recording", "table", "nobody"]
ANSWERED = {"model": "a model", "recording": "a recorded answer"}


@dataclass(frozen=True)
class UsualSize:
    """How large one class of objects usually is along its longest side."""

    class_name: str
    low: float
    """The smallest that one commonly meets [m]."""
    usual: float
    """[m]"""
    high: float
    """The largest that one commonly meets [m]."""
    said_by: SizedBy
    who: str
    """The model, whoever gave the recorded answer, or the table."""
    reason: str


@dataclass(frozen=True)
class Sizes:
    """What was found out about the sizes of some classes."""

    usual: Mapping[str, UsualSize]
    """Class → its usual size; a class that nobody knows is not in it."""
    transcript: tuple[dict, ...] = ()
    """Every question put to a model with its answer, as data."""
    usage: Usage = NOTHING_ASKED
    """What the questions took."""
    warnings: tuple[str, ...] = ()
    """What a reader of the report should know about the answers, in sentences."""


@dataclass(frozen=True)
class RealExtent:
    """How large one real object is, and by whose estimate."""

    extent: float
    """Largest extent [m]."""
    said_by: SizedBy
    by: str
    """Whose estimate it is, in a clause: "a model (openai:gpt-5.4)"."""
    reason: str
    """Why, in one sentence."""
    warnings: tuple[str, ...] = ()
    """What speaks against it, in sentences."""


def usual_sizes(classes: Iterable[str], vlm: str = "metadata", record: Path | None = None) -> Sizes:
    """Find out how large objects of each class usually are: a model first, then the table.

    Args:
        classes: What objects are, in words; doubles are asked about once.
        vlm: Whom to ask, as a person types it; "metadata": nobody.
        record: Folder where every answer is kept for "replay:FOLDER".

    Raises:
        UserError: Nobody can be asked, a recording is missing, or questions wait for a person's
            answers.

    """
    named = list(dict.fromkeys(classes))
    model = connect(vlm, record)
    interviews = [] if model is None else [_interview(model, name) for name in named]
    answers = together(
        [partial(_asked, interview) for interview in interviews], AT_ONCE, fatal=is_more
    )
    answered = [a for a in all_answered(answers, vlm) if isinstance(a, UsualSize)]
    known = {name: size for name in named if (size := _tabled(name))}
    rows = tuple(row for interview in interviews for row in interview.transcript)
    warnings = [w for interview in interviews for w in interview.warnings]
    warnings += [w for size in answered if (w := _against(size, known.get(size.class_name)))]
    asked = {size.class_name: size for size in answered}
    return Sizes(known | asked, rows, usage(rows), tuple(warnings))


def real_extent(
    name: str, class_name: str, extent: float, metric: bool, sizes: Sizes
) -> RealExtent:
    """Say how large the real object is of which a file holds a model.

    A file in metres counts; the usual size of its class can only cast doubt on it. Otherwise the
    usual size of its class counts, and where nobody knows that, a neutral stand-in.

    Args:
        name: Of the asset, for the sentences.
        class_name: What it is, in words.
        extent: Largest extent in the file [its own unit].
        metric: Whether that unit is the metre.
        sizes: What is known of its class, among others.

    """
    known = sizes.usual.get(class_name)
    if metric:
        doubt = _beyond(name, extent, known)
        warnings = (doubt,) if doubt else ()
        return RealExtent(extent, "file", "its file", "The file is in metres.", warnings)
    if known is not None:
        return RealExtent(known.usual, known.said_by, _whose(known), known.reason)
    warning = Note(
        f"Nobody knows how large {name} ({class_name}) is: its file is not in metres, and its "
        f"class is not in {TABLE}. It is taken as {length(NEUTRAL)}. Name a model with --vlm.",
        NoteKind.ASSUMED,
    )
    return RealExtent(NEUTRAL, "nobody", "nobody", "A neutral stand-in.", (warning,))


# ---------------------------------------------------------------- a model's answers


def _interview(model: Vlm, class_name: str) -> Interview:
    prompt = files("corporeal.vlm").joinpath("sizes.md").read_text(encoding="utf-8")
    subject = Subject(class_name, class_name, class_name, "")
    return Interview(model, model, {"sizes": prompt}, subject)


def _asked(interview: Interview) -> UsualSize | None:
    reply = interview.size()
    if reply is None:
        return None
    found = reply.answer
    return UsualSize(
        class_name=interview.subject.class_name,
        low=found.smallest,
        usual=found.usual,
        high=found.largest,
        said_by=reply.by,
        who=reply.model,
        reason=found.reason,
    )


# ---------------------------------------------------------------- the table, and doubts


def _tabled(class_name: str) -> UsualSize | None:
    found = typical_extent(class_name)
    if found is None:
        return None
    reason = f"{length(found.usual)} is usual for such objects: {found.words}."
    return UsualSize(class_name, found.low, found.usual, found.high, "table", TABLE, reason)


def _whose(size: UsualSize) -> str:
    """Name the source of a size: a table is its own name."""
    return TABLE if size.said_by == "table" else f"{ANSWERED[size.said_by]} ({size.who})"


def _against(answered: UsualSize, known: UsualSize | None) -> str:
    """Say where a model's size is beyond the table's; "" where it is not."""
    if known is None or known.low / MARGIN <= answered.usual <= known.high * MARGIN:
        return ""
    return (
        f"According to {_whose(answered)}, {length(answered.usual)} is usual for objects like "
        f"this: {answered.class_name}; {TABLE} knows {length(known.low)} to {length(known.high)}. "
        "The former was believed."
    )


def _beyond(name: str, extent: float, known: UsualSize | None) -> str:
    """Say where a file's own size is beyond its class's; "" where it is not."""
    if known is None or known.low / MARGIN <= extent <= known.high * MARGIN:
        return ""
    return (
        f"{name} is {length(extent)} large in its file, which is in metres; {_whose(known)} knows "
        f"such objects ({known.class_name}) from {length(known.low)} to {length(known.high)}. The "
        "file was believed."
    )

"""Real sizes of objects: from a model, or from a table.

Each class is a separate question, so that its answer can be reused in other scenes.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Literal

from corporeal.core.types import NO_USAGE, ModelUsage, Note, NoteKind
from corporeal.recognition.typical_extents import TYPICAL_EXTENT_MARGIN_RATIO, typical_extent
from corporeal.vlm import VlmClient, connect_vlm
from corporeal.vlm.human_client import is_not_pending, refuse_pending
from corporeal.vlm.interpret_answers import extent_text, sum_usage
from corporeal.vlm.interview import Interview, InterviewSubject
from corporeal.vlm.prompt_files import read_prompt
from corporeal.vlm.thread_map import thread_map

UNKNOWN_EXTENT_M = 0.3
"""Assumed size of unknown objects [m]: between a mug and a chair."""
EXTENT_TABLE_SOURCE = "the table of typical extents"
MAX_PARALLEL_SIZE_QUESTIONS = 4
"""Questions that are asked at the same time."""

SizeSource = Literal["file", "model", "recording", "table", "default"]
ANSWER_SOURCE_TEXT = {"model": "a model", "recording": "a recorded answer"}


@dataclass(frozen=True)
class ClassSize:
    """How large one class of objects usually is along its longest side."""

    class_name: str
    low: float
    """The smallest that one commonly meets [m]."""
    usual: float
    """[m]"""
    high: float
    """The largest that one commonly meets [m]."""
    said_by: SizeSource
    who: str
    """The model, whoever gave the recorded answer, or the table."""
    reason: str


@dataclass(frozen=True)
class ClassSizes:
    """Sizes of some classes, with the questions asked."""

    usual: Mapping[str, ClassSize]
    """Class → its usual size; unknown classes are absent."""
    transcript: tuple[dict, ...] = ()
    """Every question put to a model with its answer, as data."""
    usage: ModelUsage = NO_USAGE
    """Cost of the questions."""
    warnings: tuple[str, ...] = ()
    """Warnings about the answers."""


@dataclass(frozen=True)
class RealExtent:
    """Real size of one object, with its source."""

    extent: float
    """Largest extent [m]."""
    said_by: SizeSource
    by: str
    """Source in a clause: "a model (openai:gpt-5.4)"."""
    reason: str
    """Why, in one sentence."""
    warnings: tuple[str, ...] = ()
    """Contradictions, in sentences."""


def find_class_sizes(classes: Iterable[str], vlm: str = "metadata", record: Path | None = None) -> ClassSizes:
    """Find the usual sizes of classes: from a model first, then the table.

    Args:
        classes: What objects are, in words; doubles are asked about once.
        vlm: The model, as in --vlm; "metadata": none.
        record: Folder where every answer is kept for "replay:FOLDER".

    Raises:
        UserError: The model is unavailable, a recording is missing, or questions wait for a
            person's
            answers.
    """
    named = list(dict.fromkeys(classes))
    model = connect_vlm(vlm, record)
    interviews = [] if model is None else [_interview(model, name) for name in named]
    answers = thread_map(
        [partial(_size_from_model, interview) for interview in interviews],
        MAX_PARALLEL_SIZE_QUESTIONS,
        fatal=is_not_pending,
    )
    answered = [a for a in refuse_pending(answers, vlm) if isinstance(a, ClassSize)]
    known = {name: size for name in named if (size := _size_from_table(name))}
    rows = tuple(row for interview in interviews for row in interview.transcript)
    warnings = [w for interview in interviews for w in interview.warnings]
    warnings += [w for size in answered if (w := _table_disagreement_text(size, known.get(size.class_name)))]
    asked = {size.class_name: size for size in answered}
    return ClassSizes(known | asked, rows, sum_usage(rows), tuple(warnings))


def estimate_real_extent(name: str, class_name: str, extent: float, metric: bool, sizes: ClassSizes) -> RealExtent:
    """Return the real size of the object in a file.

    A file in metres counts; the usual size of its class can only cast doubt on it. Otherwise the usual size of its
    class, or a default.

    Args:
        name: Of the asset, for the sentences.
        class_name: What it is, in words.
        extent: Largest extent in the file [its own unit].
        metric: Whether that unit is the metre.
        sizes: What is known of its class, among others.
    """
    known = sizes.usual.get(class_name)
    if metric:
        doubt = _class_disagreement_text(name, extent, known)
        warnings = (doubt,) if doubt else ()
        return RealExtent(extent, "file", "its file", "The file is in metres.", warnings)
    if known is not None:
        return RealExtent(known.usual, known.said_by, _size_source_text(known), known.reason)
    warning = Note(
        f"The size of {name} ({class_name}) is unknown: its file is not in metres, and its "
        f"class is not in {EXTENT_TABLE_SOURCE}. It is taken as {extent_text(UNKNOWN_EXTENT_M)}. "
        "Name a model with --vlm.",
        NoteKind.ASSUMED,
    )
    return RealExtent(UNKNOWN_EXTENT_M, "default", "default", "A default size.", (warning,))


def _interview(model: VlmClient, class_name: str) -> Interview:
    prompt = read_prompt(files("corporeal.vlm").joinpath("prompts", "sizes.md"))
    subject = InterviewSubject(class_name, class_name, class_name, "")
    return Interview(model, model, {"sizes": prompt}, subject)


def _size_from_model(interview: Interview) -> ClassSize | None:
    reply = interview.size()
    if reply is None:
        return None
    found = reply.answer
    return ClassSize(
        class_name=interview.subject.class_name,
        low=found.smallest,
        usual=found.usual,
        high=found.largest,
        said_by=reply.by,
        who=reply.model,
        reason=found.reason,
    )


def _size_from_table(class_name: str) -> ClassSize | None:
    found = typical_extent(class_name)
    if found is None:
        return None
    reason = f"{extent_text(found.usual)} is usual for such objects: {found.words}."
    return ClassSize(class_name, found.low, found.usual, found.high, "table", EXTENT_TABLE_SOURCE, reason)


def _size_source_text(size: ClassSize) -> str:
    """Name the source of a size: a table is its own name."""
    return EXTENT_TABLE_SOURCE if size.said_by == "table" else f"{ANSWER_SOURCE_TEXT[size.said_by]} ({size.who})"


def _table_disagreement_text(answered: ClassSize, known: ClassSize | None) -> str:
    """Describe where a model's size is outside the table's range; "" if it is not."""
    if (
        known is None
        or known.low / TYPICAL_EXTENT_MARGIN_RATIO <= answered.usual <= known.high * TYPICAL_EXTENT_MARGIN_RATIO
    ):
        return ""
    return (
        f"According to {_size_source_text(answered)}, {extent_text(answered.usual)} is usual for "
        "objects like "
        f"this: {answered.class_name}; {EXTENT_TABLE_SOURCE} knows {extent_text(known.low)} to "
        f"{extent_text(known.high)}. "
        "The former was used."
    )


def _class_disagreement_text(name: str, extent: float, known: ClassSize | None) -> str:
    """Describe where a file's size is outside its class's range; "" if it is not."""
    if known is None or known.low / TYPICAL_EXTENT_MARGIN_RATIO <= extent <= known.high * TYPICAL_EXTENT_MARGIN_RATIO:
        return ""
    return (
        f"{name} is {extent_text(extent)} large in its file, which is in metres; "
        f"{_size_source_text(known)} knows "
        f"such objects ({known.class_name}) from {extent_text(known.low)} to "
        f"{extent_text(known.high)}. The "
        "file was used."
    )

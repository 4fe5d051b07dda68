"""Names of the objects in a photographed scene, matched to segmented regions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path

import numpy as np

from corporeal.core.errors import UserError
from corporeal.core.types import NO_USAGE, ModelUsage, Note, NoteKind
from corporeal.discretization.object_scaling import parse_extent
from corporeal.multiview.metric_scale import (
    MetricScale,
    ObjectExtent,
    choose_metric_scale,
    implausible_scene_extent,
    scale_from_file,
)
from corporeal.recognition.readable_names import everyday_words, safe_name, unique_names
from corporeal.recognition.typical_extents import class_name_words, length_text, typical_extent, with_article
from corporeal.vlm import VlmClient, connect_vlm
from corporeal.vlm.interpret_answers import sum_usage
from corporeal.vlm.interview import Interview, InterviewSubject
from corporeal.vlm.prompt_files import read_prompt
from corporeal.vlm.real_sizes import ANSWER_SOURCE_TEXT, EXTENT_TABLE_SOURCE

COMMAND_LINE_SOURCE = "the command line"
"""Source of names on the command line, for the report."""


UNKNOWN_CLASS = "object"
"""Name of unknown objects."""
PHOTOGRAPHY_WORDS = frozenset(
    "camera card computer drone image laptop phone photo photograph picture snapshot tablet video webcam".split()
)
"""Words for photographs and their devices, which name folders, not objects."""


@dataclass(frozen=True)
class SeenObject:
    """An object that pictures of a scene show."""

    class_name: str
    look: str = ""
    """Description that distinguishes it from the others."""
    extent: float | None = None
    """Largest extent of the real object [m]; None: unknown."""
    sized_by: str = ""
    """Its source, in words for the report."""


@dataclass(frozen=True)
class QuestionLog:
    """Questions to a model on one scene, with warnings."""

    transcript: tuple[dict, ...] = ()
    usage: ModelUsage = NO_USAGE
    warnings: tuple[str, ...] = ()


class PhotoInterview:
    """Interview on pictures of one scene."""

    def __init__(self, scene: str, vlm: str, record: Path | None = None) -> None:
        """Connect to the model; ``looks`` is False without one.

        Args:
            scene: Its name.
            vlm: The model, as in --vlm; "metadata": none.
            record: Folder where every answer is kept for "replay:FOLDER".

        Raises:
            UserError: The model is unavailable.
        """
        self.scene = scene
        self.model = connect_vlm(vlm, record)
        self.interviews: list[Interview] = []

    def objects(self, pictures: Sequence[np.ndarray]) -> list[SeenObject]:
        """Ask which objects there are; empty: no answer.

        Args:
            pictures: Of the scene, H x W x 3, uint8, sRGB.
        """
        if self.model is None:
            return []
        reply = self._interview(self.model, "things", pictures, len(pictures)).things()
        seen = reply.answer.things if reply else []
        who = "" if reply is None else f"{ANSWER_SOURCE_TEXT[reply.by]} ({reply.model})"
        return [SeenObject(t.class_name, t.look, t.metres, who) for t in seen]

    def regions(
        self, pictures: Sequence[np.ndarray], colours: Sequence[str], objects: Sequence[SeenObject]
    ) -> list[int | None] | None:
        """Ask which object each painted region is.

        Returns:
            Per region the place of its object, or None where it is none of them; None: no answer.
        """
        if self.model is None:
            return None
        interview = self._interview(self.model, "regions", pictures, len(pictures) // 2)
        reply = interview.regions(colours, [f"{t.class_name}: {t.look}" for t in objects])
        if reply is None:
            return None
        object_of = {r.colour: r.thing for r in reply.answer.regions}
        return [None if (n := object_of[colour]) is None else n - 1 for colour in colours]

    def asked(self) -> QuestionLog:
        """Return all that was asked so far."""
        rows = tuple(row for interview in self.interviews for row in interview.transcript)
        warnings = tuple(w for interview in self.interviews for w in interview.warnings)
        return QuestionLog(rows, sum_usage(rows), warnings)

    def _interview(self, model: VlmClient, task: str, pictures: Sequence[np.ndarray], count: int) -> Interview:
        prompt = read_prompt(files("corporeal.vlm").joinpath("prompts", f"{task}.md"))
        views = f"{count} of its photographs"
        subject = InterviewSubject(
            scene=self.scene,
            name=self.scene,
            class_name="",
            sides="",
            views=views,
            count=count,
            pictures=pictures if model.looks else (),
        )
        self.interviews.append(Interview(model, model, {task: prompt}, subject))
        return self.interviews[-1]


def object_of_usual_size(class_name: str) -> SeenObject:
    """Return a named object with the usual size of its class."""
    known = typical_extent(class_name)
    return SeenObject(class_name, extent=known.usual, sized_by=EXTENT_TABLE_SOURCE) if known else SeenObject(class_name)


def telling_words(source: str) -> str:
    """Return the words of a folder's name, or a video's, that can name an object in the pictures.

    Words for photographs and devices are excluded.
    """
    return " ".join(w for w in everyday_words(source).split() if not PHOTOGRAPHY_WORDS & set(class_name_words(w)))


def object_from_name(source: str) -> SeenObject | None:
    """Return the object named by a folder or a video, with its usual size.

    None: it says nothing that has a usual size.
    """
    known = typical_extent(telling_words(source))
    if known is None or known.part:
        return None
    return SeenObject(known.words, extent=known.usual, sized_by=EXTENT_TABLE_SOURCE)


def named_object_note(source: str, seen: SeenObject, name: str) -> str:
    """Note that the object was named after the pictures' folder, with advice."""
    size, more = "", ""
    if seen.extent is not None:
        usually = with_article(seen.class_name, "usually is", "usually are")
        size = f", and made as large as {usually}, {length_text(seen.extent)}"
        more = f", and how large with --extent {name}=METRES"
    return Note(
        f"The object was not named: from the name {source!r} it was called "
        f"{seen.class_name}{size}. Name it with --object-names{more}.",
        NoteKind.ASSUMED,
    )


def class_extent_note(objects: Sequence[SeenObject], names: Sequence[str]) -> str:
    """Note that a size was assumed, with advice."""
    sized = [(o, name) for o, name in zip(objects, names, strict=True) if o.extent is not None]
    usually = (with_article(one.class_name, "usually is", "usually are") for one, _ in sized)
    large = (f"{u}, {length_text(one.extent or 0)}" for u, (one, _) in zip(usually, sized, strict=True))
    them = "it is" if len(objects) == 1 else "they are"
    return Note(
        f"How large {them} was not stated: assumed as large as {'; '.join(dict.fromkeys(large))}. "
        f"State a size with --extent {sized[0][1]}=METRES.",
        NoteKind.ASSUMED,
    )


def object_names(objects: Sequence[SeenObject]) -> list[str]:
    """Return what objects are called."""
    return unique_names([safe_name(one.class_name) or UNKNOWN_CLASS for one in objects])


def check_stated_extents(stated: Sequence[str], objects: Sequence[SeenObject], source: str = "") -> None:
    """Raise UserError where a size is stated of an unknown object.

    Args:
        stated: Sizes that a person gave for some, such as "duck=0.1" [m].
        objects: Known objects; others are objects.
        source: What the pictures are called, by which a lone object may be called.
    """
    by_name = None if objects else object_from_name(source)
    known = object_names(objects or [obj for obj in [by_name] if obj])
    for text in stated:
        name, _ = parse_extent(text, (known or [UNKNOWN_CLASS])[0])
        if name not in known and not name.startswith(UNKNOWN_CLASS):
            step = f"Choose one of: {', '.join(known)}." if known else "Name it with --object-names."
            raise UserError(f"--extent: no object {name!r}. {step}")


def decide_metric_scale(
    sizes: Mapping[str, float],
    objects: Sequence[SeenObject],
    stated: Sequence[str] = (),
    measured: MetricScale | None = None,
    z_up: bool = False,
) -> MetricScale:
    """Return the metric scale of a reconstruction.

    Args:
        sizes: Name → largest extent in the file [its unit].
        objects: What they are, in the same order.
        stated: Sizes that a person gave for some, such as "duck=0.1" [m].
        measured: Measured lengths.
        z_up: Whether the file's kind has +z up, and metres.

    Raises:
        UserError: A size is stated of nothing that is there.
    """
    only = next(iter(sizes)) if len(sizes) == 1 else ""
    wanted = [parse_extent(text, only) for text in stated]
    wanted = [(only if name == UNKNOWN_CLASS and only else name, size) for name, size in wanted]
    strange = [name for name, _ in wanted if name not in sizes]
    if strange:
        raise UserError(f"--extent: no object {strange[0]!r}. Choose one of: {', '.join(sizes)}.")
    known = zip(sizes.items(), objects, strict=True)
    found = choose_metric_scale(
        measured,
        [ObjectExtent(name, sizes[name], extent, COMMAND_LINE_SOURCE) for name, extent in wanted],
        scale_from_file("transforms.json") if z_up else None,
        [ObjectExtent(name, size, t.extent, t.sized_by) for (name, size), t in known if t.extent],
        max(sizes.values()),
    )
    doubt = implausible_scene_extent(found.metres_per_unit * max(sizes.values()))
    return replace(found, warnings=(*found.warnings, doubt)) if doubt else found

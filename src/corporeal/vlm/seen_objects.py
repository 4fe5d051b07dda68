"""Which objects stand in a photographed scene, and which found region each of them is."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path

import numpy as np

from corporeal.core.errors import UserError
from corporeal.core.types import NOTHING_ASKED, Note, NoteKind, Usage
from corporeal.discretization.sizes import said_extent
from corporeal.multiview.metric import Extent, MetricScale, chosen, implausible, of_file
from corporeal.recognition.typical_extents import length, one_of, typical_extent, words_in
from corporeal.recognition.words import everyday, safe, unique
from corporeal.vlm import Vlm, connect
from corporeal.vlm.interview import Interview, Subject
from corporeal.vlm.sizes import ANSWERED, TABLE
from corporeal.vlm.words import usage

PERSON = "the command line"
"""The source of what a person typed, in words for the report."""


UNKNOWN = "object"
"""What nobody has a name for."""
TAKEN_WITH = frozenset(
    "camera card computer drone image laptop phone photo photograph picture snapshot tablet video "
    "webcam".split()
)
"""Words for what photographs are, are taken with or are kept on: folders are called so."""


@dataclass(frozen=True)
class SeenObject:
    """An object that pictures of a scene show."""

    class_name: str
    look: str = ""
    """In words that tell it from the others."""
    extent: float | None = None
    """Largest extent of the real object [m]; None: unknown."""
    sized_by: str = ""
    """Its source, in words for the report."""


@dataclass(frozen=True)
class Asked:
    """What was put to a model about one scene, as data, and what went wrong."""

    transcript: tuple[dict, ...] = ()
    usage: Usage = NOTHING_ASKED
    warnings: tuple[str, ...] = ()


class Viewer:
    """Somebody who is shown pictures of one scene."""

    def __init__(self, scene: str, vlm: str, record: Path | None = None) -> None:
        """Connect to whoever answers; ``looks`` is False where nobody does.

        Args:
            scene: Its name.
            vlm: Whom to ask, as a person types it; "metadata": nobody.
            record: Folder where every answer is kept for "replay:FOLDER".

        Raises:
            UserError: Nobody can be asked.

        """
        self.scene = scene
        self.model = connect(vlm, record)
        self.interviews: list[Interview] = []

    def objects(self, pictures: Sequence[np.ndarray]) -> list[SeenObject]:
        """Ask which objects there are; empty where nobody answers.

        Args:
            pictures: Of the scene, H x W x 3, uint8, sRGB.

        """
        if self.model is None:
            return []
        reply = self._interview(self.model, "things", pictures, len(pictures)).things()
        seen = reply.answer.things if reply else []
        who = "" if reply is None else f"{ANSWERED[reply.by]} ({reply.model})"
        return [SeenObject(t.class_name, t.look, t.metres, who) for t in seen]

    def regions(
        self, pictures: Sequence[np.ndarray], colours: Sequence[str], objects: Sequence[SeenObject]
    ) -> list[int | None] | None:
        """Ask which object each painted region is.

        Args:
            pictures: Each one followed by itself with painted regions.
            colours: Of the regions.
            objects: What there is.

        Returns:
            Per region the place of its object, or None where it is none of them; None where nobody
            answers.

        """
        if self.model is None:
            return None
        interview = self._interview(self.model, "regions", pictures, len(pictures) // 2)
        reply = interview.regions(colours, [f"{t.class_name}: {t.look}" for t in objects])
        if reply is None:
            return None
        object_of = {r.colour: r.thing for r in reply.answer.regions}
        return [None if (n := object_of[colour]) is None else n - 1 for colour in colours]

    def asked(self) -> Asked:
        """Return all that was asked so far."""
        rows = tuple(row for interview in self.interviews for row in interview.transcript)
        warnings = tuple(w for interview in self.interviews for w in interview.warnings)
        return Asked(rows, usage(rows), warnings)

    def _interview(
        self, model: Vlm, task: str, pictures: Sequence[np.ndarray], count: int
    ) -> Interview:
        prompt = files("corporeal.vlm").joinpath(f"{task}.md").read_text(encoding="utf-8")
        views = f"{count} of its photographs"
        subject = Subject(
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


# ---------------------------------------------------------------- how large they are


def usual(class_name: str) -> SeenObject:
    """Return an object that somebody named, as large as such objects usually are."""
    known = typical_extent(class_name)
    return (
        SeenObject(class_name, extent=known.usual, sized_by=TABLE)
        if known
        else SeenObject(class_name)
    )


def telling(source: str) -> str:
    """Return the words of a folder's name, or a film's, that can be of what the pictures show.

    Not those for what they are or were taken with: "photos" are no paper, and "Camera" no camera.
    """
    return " ".join(w for w in everyday(source).split() if not TAKEN_WITH & set(words_in(w)))


def of_name(source: str) -> SeenObject | None:
    """Return what the name of a folder or a film says is in it, as large as it usually is.

    None: it says nothing that has a usual size.
    """
    known = typical_extent(telling(source))
    if known is None or known.part:
        return None
    return SeenObject(known.words, extent=known.usual, sized_by=TABLE)


def said_by_name(source: str, seen: SeenObject, name: str) -> str:
    """Say what was taken from the name of the pictures, and how to say it better.

    Args:
        source: What the pictures are called.
        seen: What it was taken for; with an extent where that was, too.
        name: What it is called in the scene.

    """
    size, more = "", ""
    if seen.extent is not None:
        usually = one_of(seen.class_name, "usually is", "usually are")
        size = f", and made as large as {usually}, {length(seen.extent)}"
        more = f", and how large with --extent {name}=METRES"
    return Note(
        f"Nobody said what it is: by the name {source!r} it was called {seen.class_name}{size}. "
        f"Say what it is with --things{more}.",
        NoteKind.ASSUMED,
    )


def said_by_class(objects: Sequence[SeenObject], names: Sequence[str]) -> str:
    """Say that nobody stated a size, what was taken for it, and how to say it better.

    Args:
        objects: What there is, as far as it is known.
        names: What they are called in the scene.

    """
    sized = [(o, name) for o, name in zip(objects, names, strict=True) if o.extent is not None]
    usually = (one_of(one.class_name, "usually is", "usually are") for one, _ in sized)
    large = (f"{u}, {length(one.extent or 0)}" for u, (one, _) in zip(usually, sized, strict=True))
    them = "it is" if len(objects) == 1 else "they are"
    return Note(
        f"Nobody said how large {them}: made as large as {'; '.join(dict.fromkeys(large))}. "
        f"State a size with --extent {sized[0][1]}=METRES.",
        NoteKind.ASSUMED,
    )


def names_of(objects: Sequence[SeenObject]) -> list[str]:
    """Return what objects are called."""
    return unique([safe(one.class_name) or UNKNOWN for one in objects])


def check_extents(stated: Sequence[str], objects: Sequence[SeenObject], source: str = "") -> None:
    """Raise UserError where a size is stated of what no object can be called.

    Args:
        stated: Sizes that a person gave for some, such as "duck=0.1" [m].
        objects: What there is, as far as anybody will say; others are objects.
        source: What the pictures are called, by which a lone object may be called.

    """
    by_name = None if objects else of_name(source)
    known = names_of(objects or [obj for obj in [by_name] if obj])
    for text in stated:
        name, _ = said_extent(text, (known or [UNKNOWN])[0])
        if name not in known and not name.startswith(UNKNOWN):
            step = f"Choose one of: {', '.join(known)}." if known else "Name it with --things."
            raise UserError(f"--extent: no object {name!r}. {step}")


def metres(
    sizes: Mapping[str, float],
    objects: Sequence[SeenObject],
    stated: Sequence[str] = (),
    measured: MetricScale | None = None,
    z_up: bool = False,
) -> MetricScale:
    """Decide what one unit of a reconstruction is in metres.

    Args:
        sizes: Name → largest extent in the file [its unit].
        objects: What they are, in the same order.
        stated: Sizes that a person gave for some, such as "duck=0.1" [m].
        measured: What a person measured of the unit.
        z_up: Whether the file's kind has +z up, and metres.

    Raises:
        UserError: A size is stated of nothing that is there.

    """
    only = next(iter(sizes)) if len(sizes) == 1 else ""
    wanted = [said_extent(text, only) for text in stated]
    wanted = [(only if name == UNKNOWN and only else name, size) for name, size in wanted]
    strange = [name for name, _ in wanted if name not in sizes]
    if strange:
        raise UserError(f"--extent: no object {strange[0]!r}. Choose one of: {', '.join(sizes)}.")
    known = zip(sizes.items(), objects, strict=True)
    found = chosen(
        measured,
        [Extent(name, sizes[name], extent, PERSON) for name, extent in wanted],
        of_file("transforms.json") if z_up else None,
        [Extent(name, size, t.extent, t.sized_by) for (name, size), t in known if t.extent],
        max(sizes.values()),
    )
    doubt = implausible(found.metres_per_unit * max(sizes.values()))
    return replace(found, warnings=(*found.warnings, doubt)) if doubt else found

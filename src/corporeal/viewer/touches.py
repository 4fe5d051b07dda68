"""A record of what was done to a live simulation, and the same once more, as finely as a draft.

The record holds every order and the instant of every advance. What was taken hold of is told by
where its matter was at the start, so that a scene filled more finely obeys it as well.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal

from corporeal import store
from corporeal.machine import cores
from corporeal.pipeline import read_back, reopen
from corporeal.playback import FAST, cast_of, playback
from corporeal.render.take import record
from corporeal.results import Results
from corporeal.stages.fill import FillConfig, fill
from corporeal.trajectory.played import Prepared
from corporeal.treatment.problem_from_scene import Posed, pose
from corporeal.typed import typed
from corporeal.types import Frame
from corporeal.viewer.hands import Hands, Touch
from corporeal.viewer.moments import Moments
from corporeal.viewer.still_air import in_air

Progress = Callable[[float, str], None]
Contact = Literal["multi", "single"]
CONTACTS: tuple[Contact, ...] = ("multi", "single")
"""One velocity field per object, and the control beside."""
WORDS = {"multi": "objects slide and part", "single": "the control, all stick"}
MOST_THREADS = 4


@dataclass(frozen=True)
class Record:
    """What was done since time 0."""

    run: str
    """Name of the run that was touched."""
    touches: tuple[Touch, ...]

    @property
    def seconds(self) -> float:
        """Simulated time that it lasts [s]."""
        return max((touch.until for touch in self.touches), default=0.0)


def write_record(path: Path, done: Record) -> None:
    """Keep a record."""
    store.write_json(path, done)


def read_record(path: Path) -> Record:
    """Read a record that was kept."""
    return typed(Record, store.read_json(path))


def takes(place: Path, progress: Progress, run: Path, kept: Path) -> None:
    """Do again what a record says with both contacts; write ``multi.take``, ``single.take``.

    Args:
        place: Folder to write to.
        progress: Told the fraction done and what is done.
        run: That was touched.
        kept: File of the record.

    """
    done = read_record(kept)
    progress(0.0, "filling the scene as finely as a draft")
    prepared = as_draft(read_back(run), reopen(run).settings.fill)
    cast = cast_of(prepared)
    posed = pose(prepared.scene, prepared.particles, prepared.field)
    for k, contact in enumerate(CONTACTS):
        tell = partial(_tell, progress, k, contact)
        recording = record(cast, replayed(posed, contact, done, tell))
        take = playback(prepared, cast, recording=recording)
        (place / f"{contact}.take").write_bytes(take)


def as_draft(made: Results, config: FillConfig) -> Prepared:
    """Fill a run's scene again as finely as a draft, all of it in air."""
    whole = made.assembled
    scene = in_air(whole.scene)
    particles = fill(scene, whole.parts, whole.field, replace(config, detail="draft"))
    # What is touched is whole: it is not yet known to break.
    return replace(made, assemble=scene, fill=particles, simulate=None).prepared


def replayed(
    posed: Posed, contact: Contact, done: Record, tell: Callable[[float], None]
) -> Iterator[Frame]:
    """Do again what a record says; yield frames, its first and last instant among them.

    Args:
        posed: The scene.
        contact: As in life, or the control.
        done: What to do.
        tell: Told the fraction done.

    """
    problem = replace(posed.problem, contact=contact)
    hands = Hands(posed, problem, min(MOST_THREADS, cores()))
    moments, shown = Moments(posed), 0.0
    yield moments.frame(hands.engine.snapshot())
    for touch in done.touches:
        hands.again(touch)
        due = touch.until >= min(shown + 1 / FAST, done.seconds)
        if touch.order is None and due:
            shown = touch.until
            tell(shown / done.seconds)
            yield moments.frame(hands.engine.snapshot())


def _tell(progress: Progress, k: int, contact: Contact, share: float) -> None:
    progress((k + share) / len(CONTACTS), WORDS[contact])

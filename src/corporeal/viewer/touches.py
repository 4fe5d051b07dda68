"""A record of what was done to a live simulation, and the same once more, as finely as a draft.

The record holds every order and the instant of every advance. What was taken hold of is told by
where its matter was at the start, so that a scene filled more finely obeys it as well.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from corporeal.core import store
from corporeal.core.machine import cores
from corporeal.core.typed import typed
from corporeal.core.types import Frame, Particles
from corporeal.discretization.plan import QUALITIES
from corporeal.pipeline.playback import FAST, cast_of, playback
from corporeal.pipeline.results import Results
from corporeal.pipeline.runner import read_back, reopen
from corporeal.pipeline.stages.fill import FillConfig, fill
from corporeal.render.take import record
from corporeal.simulation.played import Prepared
from corporeal.viewer.growth import Added, Growth
from corporeal.viewer.hands import JOIN, Hands, Touch, falls
from corporeal.viewer.moments import Moments
from corporeal.viewer.shelf import Shelf
from corporeal.viewer.still_air import in_air
from corporeal.viewer.things import Things

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


def takes(
    place: Path, progress: Progress, run: Path, kept: Path, beside: Sequence[Path] = ()
) -> None:
    """Do again what a record says with both contacts; write ``multi.take``, ``single.take``.

    Args:
        place: Folder to write to.
        progress: Told the fraction done and what is done.
        run: That was touched.
        kept: File of the record.
        beside: Runs whose objects were dropped.

    """
    done = read_record(kept)
    progress(0.0, "filling the scene as finely as a draft")
    settings = reopen(run).settings
    prepared = as_draft(read_back(run), settings.fill)
    things = Things(Shelf(tuple(beside)))
    growth = Growth(prepared, QUALITIES["draft"], things.find, settings.ground)
    whole = growth.at(tuple(one for _, one in dropped(done))).prepared
    cast = cast_of(whole)
    for k, contact in enumerate(CONTACTS):
        tell = partial(_tell, progress, k, contact)
        recording = record(cast, replayed(growth, contact, done, tell))
        recording = replace(recording, since=appears(growth, done))
        take = playback(whole, cast, recording=recording)
        (place / f"{contact}.take").write_bytes(take)


def as_draft(made: Results, config: FillConfig) -> Prepared:
    """Fill a run's scene again as finely as a draft, all of it in air."""
    whole = made.assembled
    scene = in_air(whole.scene)
    particles = fill(scene, whole.parts, whole.field, replace(config, detail="draft"))
    # What is touched is whole: it is not yet known to break.
    return replace(made, assemble=scene, fill=particles, simulate=None).prepared


def dropped(done: Record) -> list[tuple[float, Added]]:
    """Return when something was dropped, and what."""
    found, now = [], 0.0
    for touch in done.touches:
        now = max(now, touch.until)
        if touch.order is not None and touch.order.do == JOIN:
            found.append((now, Added(touch.order.thing, touch.order.point, falls(touch.order))))
    return found


def appears(growth: Growth, done: Record) -> dict[int, float]:
    """Return from when on an object is there [s], of those that were dropped."""
    found, added = {}, ()
    for now, one in dropped(done):
        before = len(growth.at(added).prepared.scene.objects)
        added = (*added, one)
        after = len(growth.at(added).prepared.scene.objects)
        found |= dict.fromkeys(range(before, after), now)
    return found


def replayed(
    growth: Growth, contact: Contact, done: Record, tell: Callable[[float], None]
) -> Iterator[Frame]:
    """Do again what a record says; yield frames, its first and last instant among them.

    All frames hold all that is there in the end: until it is dropped, a thing waits where it will
    begin, and a page hides it.

    Args:
        growth: The scene.
        contact: As in life, or the control.
        done: What to do.
        tell: Told the fraction done.

    """
    posed = growth.at(()).posed
    whole = growth.at(tuple(one for _, one in dropped(done))).prepared.particles
    problem = replace(posed.problem, contact=contact)
    hands = Hands(posed, problem, min(MOST_THREADS, cores()), growth)
    moments, shown = Moments(posed), 0.0
    yield waiting(moments.frame(hands.engine.snapshot()), whole)
    for touch in done.touches:
        hands.again(touch)
        if touch.order is not None and touch.order.do == JOIN:
            moments = Moments(hands.posed)
        due = touch.until >= min(shown + 1 / FAST, done.seconds)
        if touch.order is None and due:
            shown = touch.until
            tell(shown / done.seconds)
            yield waiting(moments.frame(hands.engine.snapshot()), whole)


def waiting(frame: Frame, particles: Particles) -> Frame:
    """Return a frame with what is not there yet, at rest where it will begin."""
    more = particles.count - len(frame.position)
    if not more:
        return frame
    assert frame.stress is not None
    return replace(
        frame,
        position=np.concatenate([frame.position, particles.position[-more:]]),
        deformation=np.concatenate([frame.deformation, np.tile(np.eye(3), (more, 1, 1))]),
        stress=np.append(frame.stress, np.zeros(more)),
    )


def _tell(progress: Progress, k: int, contact: Contact, share: float) -> None:
    progress((k + share) / len(CONTACTS), WORDS[contact])

"""Records of live simulations, and their replay at higher resolution.

The record holds every order and the instant of every advance. What was grabbed is identified by where its material was
at the start, so that a scene filled more finely obeys it as well.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from corporeal.core import store
from corporeal.core.deserialize import from_plain
from corporeal.core.process_resources import usable_cores
from corporeal.core.progress import Progress
from corporeal.core.types import Frame, Particles
from corporeal.discretization.discretization_plan import QUALITY_PRESETS
from corporeal.mpm.engines import DEFAULT_ENGINE
from corporeal.pipeline.results import StageResults
from corporeal.pipeline.run_pipeline import read_run, read_run_request
from corporeal.pipeline.stages.fill import FillConfig, fill
from corporeal.pipeline.viewer_data import MAX_RECORDING_FPS, bind_scene, viewer_recording
from corporeal.render.recording_format import record_frames
from corporeal.simulation.simulation_result import PreparedScene
from corporeal.viewer.interaction_controller import RECORDED_ADD, InteractionController, InteractionEvent, drop_height
from corporeal.viewer.live_assets import LiveAssets
from corporeal.viewer.live_edit import AddedObject, LiveEditor
from corporeal.viewer.run_store import RunStore
from corporeal.viewer.snapshot_frames import SnapshotFrames
from corporeal.viewer.wind_faces import with_wind_faces

Contact = Literal["multi", "single"]
CONTACT_MODES: tuple[Contact, ...] = ("multi", "single")
"""One velocity field per object, and the control beside."""
CONTACT_MODE_WORDS = {"multi": "objects slide and part", "single": "the control, all stick"}
MAX_REPLAY_THREADS = 4


@dataclass(frozen=True)
class InteractionRecord:
    """What was done since time 0."""

    run: str
    """Name of the run that was touched."""
    touches: tuple[InteractionEvent, ...]

    @property
    def seconds(self) -> float:
        """Simulated time that it lasts [s]."""
        return max((touch.until for touch in self.touches), default=0.0)


def write_record(path: Path, done: InteractionRecord) -> None:
    """Keep a record."""
    store.write_json(path, done)


def read_record(path: Path) -> InteractionRecord:
    """Read a record that was kept."""
    return from_plain(InteractionRecord, store.read_json(path))


def write_replays(place: Path, progress: Progress, run: Path, kept: Path, beside: Sequence[Path] = ()) -> None:
    """Do again what a record says with both contacts; write ``multi.take``, ``single.take``."""
    done = read_record(kept)
    progress(0.0, "filling the scene as finely as a draft")
    settings = read_run_request(run).settings
    prepared = refill_as_draft(read_run(run), settings.fill)
    things = LiveAssets(RunStore(tuple(beside)))
    growth = LiveEditor(prepared, QUALITY_PRESETS["draft"], things.find, settings.ground)
    whole = growth.at(tuple(one for _, one in drop_events(done))).prepared
    cast = bind_scene(whole)
    for k, contact in enumerate(CONTACT_MODES):
        tell = partial(_tell, progress, k, contact)
        frames = replay_frames(growth, contact, done, tell, settings.simulate.engine)
        recording = record_frames(cast, frames)
        recording = replace(recording, since=appearance_times(growth, done))
        take = viewer_recording(whole, cast, recording=recording)
        (place / f"{contact}.take").write_bytes(take)


def refill_as_draft(made: StageResults, config: FillConfig) -> PreparedScene:
    """Fill a run's scene again as finely as a draft, all of it in air."""
    whole = made.assembled
    scene = with_wind_faces(whole.scene)
    particles = fill(scene, whole.parts, whole.field, replace(config, detail="draft"))
    # What is touched is whole: it is not yet known to break.
    return replace(made, assemble=scene, fill=particles, simulate=None).prepared


def drop_events(done: InteractionRecord) -> list[tuple[float, AddedObject]]:
    """Return when something was dropped, and what."""
    found, now = [], 0.0
    for touch in done.touches:
        now = max(now, touch.until)
        if touch.order is not None and touch.order.do == RECORDED_ADD:
            found.append((now, AddedObject(touch.order.thing, touch.order.point, drop_height(touch.order))))
    return found


def appearance_times(growth: LiveEditor, done: InteractionRecord) -> dict[int, float]:
    """Return from when on an object is there [s], of those that were dropped."""
    found, added = {}, ()
    for now, one in drop_events(done):
        before = len(growth.at(added).prepared.scene.objects)
        added = (*added, one)
        after = len(growth.at(added).prepared.scene.objects)
        found |= dict.fromkeys(range(before, after), now)
    return found


def replay_frames(
    growth: LiveEditor,
    contact: Contact,
    done: InteractionRecord,
    tell: Callable[[float], None],
    engine: str = DEFAULT_ENGINE,
) -> Iterator[Frame]:
    """Do again what a record says; yield frames, its first and last instant among them.

    All frames hold all that is there in the end: until it is dropped, an object waits where it will begin, and a page
    hides it.
    """
    posed = growth.at(()).posed
    whole = growth.at(tuple(one for _, one in drop_events(done))).prepared.particles
    problem = replace(posed.problem, contact=contact)
    hands = InteractionController(posed, problem, min(MAX_REPLAY_THREADS, usable_cores()), growth, engine)
    moments, shown = SnapshotFrames(posed), 0.0
    yield with_waiting_objects(moments.frame(hands.engine.snapshot()), whole)
    for touch in done.touches:
        hands.again(touch)
        if touch.order is not None and touch.order.do == RECORDED_ADD:
            moments = SnapshotFrames(hands.posed)
        due = touch.until >= min(shown + 1 / MAX_RECORDING_FPS, done.seconds)
        if touch.order is None and due:
            shown = touch.until
            tell(shown / done.seconds)
            yield with_waiting_objects(moments.frame(hands.engine.snapshot()), whole)


def with_waiting_objects(frame: Frame, particles: Particles) -> Frame:
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
    progress((k + share) / len(CONTACT_MODES), CONTACT_MODE_WORDS[contact])

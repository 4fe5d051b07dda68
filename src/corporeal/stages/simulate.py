"""Simulate: step the scene through time, keep every frame as it comes, and audit the whole.

Frames are written one by one and nothing holds a film in memory. A checkpoint lies beside them:
whatever stops a simulation, the same call goes on from there exactly as if nothing had happened.
"""

import hashlib
import time
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Literal

import numpy as np

from corporeal import backends, store
from corporeal.errors import BadFileError, SimulationError
from corporeal.mpm import audit as audits
from corporeal.mpm.frames import (
    FOLDER,
    Layout,
    frame_path,
    gather,
    read_arrays,
    write_arrays,
    write_frame,
    write_layout,
)
from corporeal.mpm.ledger_row import ledger_row
from corporeal.mpm.pose import Posed, pose
from corporeal.mpm.problem import MENU, Engine, Problem
from corporeal.types import Frame, MaterialField, Particles, Scene, Trajectory

CHECKPOINT = "checkpoint.npz"
AUDIT = "audit.json"
SAVE_EVERY = 10.0
"""Seconds of computing between checkpoints."""

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class SimulateConfig:
    """How the scene is stepped; nothing here tunes the physics."""

    engine: Literal["warp", "reference"] = "warp"
    """The fast engine, or the slow one in double precision that it is checked against."""
    contact: Literal["multi", "single"] = "multi"
    """One velocity field per object, or the control: one for all, which glues what touches."""


DEFAULT = SimulateConfig()


def simulate(
    scene: Scene,
    particles: Particles,
    field: MaterialField,
    config: SimulateConfig,
    folder: Path,
    progress: Progress = lambda fraction, words: None,
) -> Trajectory:
    """Step the scene through its duration and write frames, ledger and ``audit.json``.

    A folder that holds a checkpoint of the same problem is continued.

    Args:
        scene: What happens: gravity, pushes, duration, frames per second.
        particles: The filled scene.
        field: What every part is made of.
        config: Engine and contact.
        folder: Where the frames go.
        progress: Told the fraction done and what is going on.

    Raises:
        SimulationError: The state became impossible; the frames so far are kept.
        DiskError: The disk is full; the frames so far are kept.

    """
    posed = pose(scene, particles, field, config.contact)
    engine: Engine = backends.load("engine", config.engine, MENU)(posed.problem)
    times = frame_times(scene)
    with store.writing(folder):
        run = Run(engine, posed, folder, times, f"{fingerprint(posed.problem)} {config}")
        run.through(progress)
        trajectory = gather(folder, len(times))
        found = audits.audit(scene, particles, field, trajectory)
        store.write_json(folder / AUDIT, found)
        (folder / CHECKPOINT).unlink(missing_ok=True)
    return trajectory


def frame_times(scene: Scene) -> np.ndarray:
    """Instants of all frames [s], the start and the end included."""
    return np.arange(round(scene.duration * scene.fps) + 1) / scene.fps


def fingerprint(problem: Problem) -> str:
    """Name a problem by its content."""
    total = hashlib.sha256()
    for item in (problem, *problem.bodies):
        for f in fields(item):
            value = getattr(item, f.name)
            if isinstance(value, np.ndarray):
                total.update(np.ascontiguousarray(value).tobytes())
            elif f.name != "bodies":
                total.update(repr(value).encode())
    return total.hexdigest()[:20]


class Run:
    """One simulation in one folder, from its start or from its checkpoint."""

    def __init__(
        self, engine: Engine, posed: Posed, folder: Path, times: np.ndarray, name: str
    ) -> None:
        self.engine, self.posed, self.folder = engine, posed, folder
        self.times, self.name = times, name
        self.place = np.empty_like(posed.order)
        self.place[posed.order] = np.arange(len(posed.order))
        bodies = posed.problem.bodies
        owner = np.repeat(np.arange(len(bodies)), [len(b.position) for b in bodies])
        self.layout = Layout(object=owner[self.place], rigid=posed.rigid)

    def through(self, progress: Progress) -> None:
        """Step to the end, writing every frame as it comes."""
        for half in (self.folder / FOLDER).glob(".*.part"):
            half.unlink()  # left by a process that was killed while writing
        done = self.restore()
        if done == 0:
            write_layout(self.folder, self.layout)
            self.keep_frame(0)
            done = 1
        saved, kept = self.engine.save(), time.monotonic()
        try:
            for number in range(done, len(self.times)):
                self.engine.advance(float(self.times[number]))
                self.keep_frame(number)
                saved, done = self.engine.save(), number + 1
                if time.monotonic() - kept > SAVE_EVERY:
                    self.keep_checkpoint(saved, done)
                    kept = time.monotonic()
                progress(done / len(self.times), self.words())
        except KeyboardInterrupt:
            self.keep_checkpoint(saved, done)
            raise
        except SimulationError as error:
            raise SimulationError(
                f"{error} {done} of {len(self.times)} frames are in {self.folder}."
            ) from error

    def words(self) -> str:
        """Where the simulation is."""
        end = self.times[-1]
        return f"{self.engine.time:.2f} of {end:.2f} s, {self.engine.steps.count:,} steps"

    def keep_frame(self, number: int) -> None:
        """Write the present as frame ``number``, particles in their own order."""
        now, measure = self.engine.snapshot(), self.engine.measure()
        rigid = self.posed.rigid[self.layout.object]
        motion = np.where(rigid[:, None, None], now.deformation[self.place], now.motion[self.place])
        frame = Frame(time=now.time, position=now.position[self.place], deformation=motion)
        row = ledger_row(self.posed.problem, now, measure, self.engine.steps)
        write_frame(self.folder, number, frame, self.layout, row)

    def keep_checkpoint(self, saved: dict[str, np.ndarray], done: int) -> None:
        """Write everything needed to go on after ``done`` frames."""
        state = {f"engine.{name}": value for name, value in saved.items()}
        state |= {"done": np.int64(done), "name": np.array(self.name)}
        write_arrays(self.folder / CHECKPOINT, state)

    def restore(self) -> int:
        """Go back to the checkpoint; return how many frames are done, 0 without one."""
        path = self.folder / CHECKPOINT
        if not path.exists():
            return 0
        try:
            state = read_arrays(path)
            done = int(state["done"])
            usable = str(state["name"]) == self.name and all(
                frame_path(self.folder, k).exists() for k in range(done)
            )
        except (BadFileError, KeyError):
            return 0  # damaged: start again, at the cost of time only
        if not usable:
            return 0
        start = "engine."
        self.engine.restore(
            {k.removeprefix(start): v for k, v in state.items() if k.startswith(start)}
        )
        return done

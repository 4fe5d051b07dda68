"""Simulate: step the scene through time, keep every frame as it comes, and audit the whole.

Frames are written one by one and nothing holds a film in memory. A checkpoint lies beside them:
whatever stops a simulation, the same call goes on from there exactly as if nothing had happened.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from corporeal import __version__, backends, store
from corporeal.errors import SimulationError
from corporeal.mpm import audit as audits
from corporeal.mpm.checkpoint import Checkpoints, fingerprint
from corporeal.mpm.frames import FOLDER, Layout, frame_path, gather, write_frame, write_layout
from corporeal.mpm.ledger_row import ledger_row
from corporeal.mpm.pose import Posed, pose
from corporeal.mpm.problem import MENU, Engine
from corporeal.types import Frame, MaterialField, Particles, Scene, Trajectory

AUDIT = "audit.json"

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class SimulateConfig:
    """How the scene is stepped; nothing here tunes the physics."""

    engine: Literal["warp", "cuda", "reference"] = "warp"
    """The fast engine on the processor, the one for a CUDA card, or the slow one in double
    precision that both are checked against."""
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
        kept = Checkpoints(folder, fingerprint(__version__, posed.problem, config, times))
        Run(engine, posed, folder, times, kept).through(progress)
        trajectory = gather(folder, len(times))
        found = audits.audit(scene, particles, field, trajectory)
        store.write_json(folder / AUDIT, found)
        kept.forget()
    return trajectory


def frame_times(scene: Scene) -> np.ndarray:
    """Instants of all frames [s], the start and the end included."""
    return np.arange(round(scene.duration * scene.fps) + 1) / scene.fps


class Run:
    """One simulation in one folder, from its start or from a checkpoint."""

    def __init__(
        self,
        engine: Engine,
        posed: Posed,
        folder: Path,
        times: np.ndarray,
        checkpoints: Checkpoints,
    ) -> None:
        self.engine, self.posed, self.folder = engine, posed, folder
        self.times, self.checkpoints = times, checkpoints
        self.place = np.empty_like(posed.order)
        self.place[posed.order] = np.arange(len(posed.order))
        bodies = posed.problem.bodies
        owner = np.repeat(np.arange(len(bodies)), [len(b.position) for b in bodies])
        self.layout = Layout(object=owner[self.place], rigid=posed.rigid)

    def through(self, progress: Progress) -> None:
        """Step to the end, writing every frame as it comes."""
        done = self.begin()
        saved = self.engine.save()
        try:
            for number in range(done, len(self.times)):
                self.engine.advance(float(self.times[number]))
                self.keep_frame(number)
                saved, done = self.engine.save(), number + 1
                if self.checkpoints.due:
                    self.checkpoints.keep(saved, done)
                progress(done / len(self.times), self.words())
        except KeyboardInterrupt:
            self.checkpoints.keep(saved, done)
            raise
        except SimulationError as error:
            raise SimulationError(
                f"{error} {done} of {len(self.times)} frames are in {self.folder}."
            ) from error

    def begin(self) -> int:
        """Go back to the newest checkpoint, or write the first frame; return how many are done."""
        for half in self.folder.rglob(".*.part"):
            half.unlink()  # left by a process that was killed while writing
        done, state = self.checkpoints.newest()
        if done:
            self.engine.restore(state)
        for frame in (self.folder / FOLDER).glob("[0-9]*.npz"):
            if int(frame.stem) >= done:
                frame.unlink()
        if not done:
            write_layout(self.folder, self.layout)
            self.keep_frame(0)
        frame = frame_path(self.folder, 0).stat().st_size
        store.require_room(self.folder, frame * (len(self.times) - max(done, 1)))
        return max(done, 1)

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

"""Simulate: step the scene through time, keep every frame as it comes, and audit the whole.

Frames are written one by one and nothing holds a film in memory. A checkpoint lies beside them:
whatever stops a simulation, the same call goes on from there exactly as if nothing had happened.
A scene that is said to have settled finds its balance first (``mpm.settling``).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np

from corporeal import __version__, backends, store
from corporeal.errors import SimulationError
from corporeal.mpm import audit as audits
from corporeal.mpm.checkpoint import Checkpoints, fingerprint
from corporeal.mpm.frames import FOLDER, Layout, frame_path, gather, write_frame, write_layout
from corporeal.mpm.ledger_row import ledger_row
from corporeal.mpm.pose import Posed, pose, standing
from corporeal.mpm.problem import MENU, Engine, Problem
from corporeal.mpm.settling import Balance, Settling, before
from corporeal.types import Frame, MaterialField, Particles, Scene, Trajectory

AUDIT = "audit.json"
SETTLING = "settling.json"
"""How what is soft found its balance before time 0."""

Progress = Callable[[float, str], None]
Build = Callable[[Problem], Engine]
Settle = Callable[[], dict[str, np.ndarray]]


@dataclass(frozen=True)
class SimulateConfig:
    """How the scene is stepped; nothing here tunes the physics."""

    engine: Literal["warp", "cuda", "reference"] = "warp"
    """The fast engine on the processor, the one for a CUDA card, or the slow one in double
    precision that both are checked against."""
    contact: Literal["multi", "single"] = "multi"
    """One velocity field per object, or the control: one for all, which glues what touches."""


DEFAULT = SimulateConfig()


def accept(config: SimulateConfig) -> None:
    """Raise UserError where there is no engine as asked for, whatever the scene."""
    if config.engine == "cuda":
        backends.load("engine", "cuda", {"cuda": "corporeal.mpm.device:present"})("cuda")


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
    build: Build = backends.load("engine", config.engine, MENU)
    times = frame_times(scene)
    lying = what_settles(scene, particles, posed)
    if lying:
        posed = replace(posed, problem=replace(posed.problem, gravity_ramp=0.0))
    name = fingerprint(__version__, posed.problem, config, times, lying)
    with store.writing(folder):
        kept, slept = Checkpoints(folder, name), Checkpoints(folder / "settling", name)
        settle = partial(settled, scene, posed, lying, build, slept, progress)
        run = Run(build(posed.problem), posed, folder, times, kept)
        run.through(progress, lying, settle)
        trajectory = gather(folder, len(times))
        said = store.read_json(folder / SETTLING) if lying else None
        found = audits.audit(scene, particles, field, trajectory, said)
        store.write_json(folder / AUDIT, found)
        kept.forget()
        slept.forget()
    return trajectory


# ------------------------------------------------------------------ before time 0


def what_settles(scene: Scene, particles: Particles, posed: Posed) -> tuple[int, ...]:
    """Bodies that find their balance first: all that stand or lie, where any of them is soft."""
    if not scene.settled or not any(scene.gravity):
        return ()
    carried = standing(scene, particles)
    lying = [b for b, k in enumerate(posed.object_of_body) if int(k) in carried]
    return tuple(lying) if not posed.rigid[lying].all() else ()


def settled(
    scene: Scene,
    posed: Posed,
    lying: tuple[int, ...],
    build: Build,
    kept: Checkpoints,
    progress: Progress,
) -> dict[str, np.ndarray]:
    """Let what lies find its balance, or go on with it; return where everything is then."""
    told = kept.folder.parent / SETTLING
    _, state = kept.newest()
    if state and told.exists():
        return state
    hung = set(range(len(posed.problem.bodies))) - set(lying)
    problem = before(posed.problem, hung)
    settling = Settling(build(problem), problem, hung)
    if state:
        settling.restore(state)
    good = {"state": settling.saved()}

    def breathe(time: float) -> None:
        good["state"] = settling.saved()
        if kept.due:
            kept.keep(good["state"], 0)
        progress(0.0, f"settling, {time:.2f} s")

    try:
        balance = settling.run(breathe)
    except KeyboardInterrupt:
        kept.keep(good["state"], 0)
        raise
    except SimulationError as error:
        raise SimulationError(f"While things settled: {error}") from error
    kept.keep(balance.state, 0)
    store.write_json(told, settling_row(scene, posed, balance))
    return balance.state


def settling_row(scene: Scene, posed: Posed, balance: Balance) -> dict[str, Any]:
    """Say how the balance was found, as data."""
    cell = posed.problem.cell
    moved = zip(scene.objects, balance.moved.tolist(), balance.farthest.tolist(), strict=True)
    return {
        "seconds": balance.seconds,
        "found": balance.found,
        "objects": [
            {
                "name": thing.name,
                "moved_m": shift,
                "moved_dx": float(np.linalg.norm(shift)) / cell,
                "farthest_m": far,
            }
            for thing, shift, far in moved
        ],
    }


# ------------------------------------------------------------------ from time 0 on


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

    def through(self, progress: Progress, lying: tuple[int, ...], settle: Settle) -> None:
        """Step to the end, writing every frame as it comes.

        Args:
            progress: Told the fraction done and what is going on.
            lying: Bodies that find their balance before time 0.
            settle: Says where they do.

        """
        done = self.begin(lying, settle)
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

    def begin(self, lying: tuple[int, ...], settle: Settle) -> int:
        """Go back to the newest checkpoint, or write the first frame; return how many are done."""
        for half in self.folder.rglob(".*.part"):
            half.unlink()  # left by a process that was killed while writing
        done, state = self.checkpoints.newest()
        if done:
            self.engine.restore(state)
        elif lying:
            self.engine.begin(settle(), lying)
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

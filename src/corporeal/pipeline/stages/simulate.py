"""Simulate: step the scene through time, write every frame, and audit the result.

Frames are streamed to the disk with checkpoints: an interrupted simulation resumes bit for bit. A scene declared as
settled is brought to equilibrium first (``trajectory.static_equilibrium``).
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from corporeal.core import store
from corporeal.core.audit_data import SettledObjectOutcome, SettlingOutcome
from corporeal.core.deserialize import from_plain
from corporeal.core.errors import SimulationError
from corporeal.core.progress import Progress, no_progress
from corporeal.core.types import FractureEvent, Frame, MaterialField, Particles, Scene, Trajectory
from corporeal.core.version import __version__
from corporeal.discretization.build_model import ModelMapping, build_model, standing_objects
from corporeal.mpm.engines import build_engine
from corporeal.mpm.problem import Engine, Problem
from corporeal.pipeline.settings import SimulateConfig, validate_simulate
from corporeal.simulation.audit import audit
from corporeal.simulation.audit_file import write_audit
from corporeal.simulation.checkpoint import Checkpoints, fingerprint
from corporeal.simulation.energy_gain import EnergyWatch
from corporeal.simulation.equivalent_stress import VonMises
from corporeal.simulation.fracture_simulation import fracture_body, next_breaking_impact
from corporeal.simulation.fracture_state import FractureState
from corporeal.simulation.ledger_row import ledger_row
from corporeal.simulation.rewrite_history import rewrite_history
from corporeal.simulation.static_equilibrium import DynamicRelaxation, StaticEquilibrium, settling_problem
from corporeal.simulation.trajectory_files import (
    BREAKS_FILE,
    FRAMES_FOLDER,
    FrameLayout,
    frame_path,
    gather_ledgers,
    write_frame,
    write_layout,
)

SETTLING_FILE = "settling.json"
"""File on the static equilibrium before time 0."""

EngineBuilder = Callable[[Problem], Engine]
Relax = Callable[[], dict[str, np.ndarray]]


def simulate(
    scene: Scene,
    particles: Particles,
    field: MaterialField,
    config: SimulateConfig,
    folder: Path,
    progress: Progress = no_progress,
) -> Trajectory:
    """Step the scene through its duration and write frames, ledger and ``audit.json``.

    A folder that holds a checkpoint of the same problem is continued.

    Args:
        scene: Gravity, forces, duration, frames per second.
        particles: The filled scene.
        field: Materials of all parts.
        config: Engine and contact.
        folder: Folder of the frames.
        progress: Called with the fraction done and a description.

    Raises:
        SimulationError: The simulation diverged; the frames so far are kept.
        DiskError: The disk is full; the frames so far are kept.
    """
    validate_simulate(config)
    posed = build_model(scene, particles, field, config.contact)
    build: EngineBuilder = partial(build_engine, engine=config.engine)
    times = frame_times(scene)
    lying = bodies_to_relax(scene, particles, posed)
    if lying:
        posed = replace(posed, problem=replace(posed.problem, gravity_ramp=0.0))
    name = fingerprint(__version__, posed.problem, store.to_plain(config), times, lying)
    with store.disk_errors(folder):
        kept, slept = Checkpoints(folder, name), Checkpoints(folder / "settling", name)
        relax = partial(relax_to_equilibrium, scene, posed, lying, build, slept, progress)
        begun = FractureState.at_start(scene, particles, field, posed)
        run = SimulationRun(build(posed.problem), begun, folder, times, kept, config.breaking)
        run.through(progress, lying, relax)
        trajectory = gather_ledgers(folder, len(times))
        found = from_plain(SettlingOutcome, store.read_json(folder / SETTLING_FILE)) if lying else None
        end = run.stage
        write_audit(folder, audit(end.scene, end.particles, end.field, trajectory, found))
        kept.forget()
        slept.forget()
    return trajectory


def bodies_to_relax(scene: Scene, particles: Particles, posed: ModelMapping) -> tuple[int, ...]:
    """Return bodies to relax: all supported ones, if any deforms."""
    if not scene.settled or not any(scene.gravity):
        return ()
    carried = standing_objects(scene, particles)
    lying = [b for b, k in enumerate(posed.object_of_body) if int(k) in carried]
    return tuple(lying) if not posed.rigid[lying].all() else ()


def relax_to_equilibrium(
    scene: Scene,
    posed: ModelMapping,
    lying: tuple[int, ...],
    build: EngineBuilder,
    kept: Checkpoints,
    progress: Progress,
) -> dict[str, np.ndarray]:
    """Find static equilibrium, or resume; return the engine's state in it."""
    record = kept.folder.parent / SETTLING_FILE
    state = kept.newest().state
    if state and record.exists():
        return state
    hung = set(range(len(posed.problem.bodies))) - set(lying)
    problem = settling_problem(posed.problem, hung)
    relaxation = DynamicRelaxation(build(problem), problem, hung)
    if state:
        relaxation.restore(state)
    good = {"state": relaxation.saved()}

    def pause(time: float) -> None:
        good["state"] = relaxation.saved()
        if kept.due:
            kept.keep(good["state"], 0)
        progress(0.0, f"finding static equilibrium, {time:.2f} s")

    try:
        balance = relaxation.run(pause)
    except KeyboardInterrupt:
        kept.keep(good["state"], 0)
        raise
    except SimulationError as error:
        raise SimulationError(f"While objects found their static equilibrium: {error}") from error
    kept.keep(balance.state, 0)
    store.write_json(record, equilibrium_found(scene, posed, balance))
    return balance.state


def equilibrium_found(scene: Scene, posed: ModelMapping, balance: StaticEquilibrium) -> SettlingOutcome:
    """Return how equilibrium was found, by object."""
    cell = posed.problem.cell
    moved = zip(scene.objects, balance.moved.tolist(), balance.farthest.tolist(), strict=True)
    objects = [
        SettledObjectOutcome(obj.name, (x, y, z), float(np.linalg.norm([x, y, z])) / cell, far)
        for obj, (x, y, z), far in moved
    ]
    return SettlingOutcome(balance.seconds, balance.found, tuple(objects))


def frame_times(scene: Scene) -> np.ndarray:
    """Instants of all frames [s], the start and the end included."""
    return np.arange(round(scene.duration * scene.fps) + 1) / scene.fps


class SimulationRun:
    """One simulation in one folder, from its start or from a checkpoint."""

    def __init__(
        self,
        engine: Engine,
        stage: FractureState,
        folder: Path,
        times: np.ndarray,
        checkpoints: Checkpoints,
        breaking: bool = False,
    ) -> None:
        self.engine, self.folder, self.breaking = engine, folder, breaking
        self.times, self.checkpoints = times, checkpoints
        self.breaks: tuple[FractureEvent, ...] = ()
        self.whole: set[int] = set()
        self._take(stage)

    def _take(self, stage: FractureState) -> None:
        """Update the ledgers."""
        self.stage, self.posed = stage, stage.posed
        order = stage.posed.order
        self.place = np.empty_like(order)
        self.place[order] = np.arange(len(order))
        self.layout = FrameLayout.of(stage.posed)
        self.watch = EnergyWatch.of(stage.posed.problem)
        self.stress = VonMises(stage.posed.problem)

    def through(self, progress: Progress, lying: tuple[int, ...], relax: Relax) -> None:
        """Step to the end, writing every frame.

        Args:
            progress: Called with the fraction done and a description.
            lying: Bodies that are brought to static equilibrium before time 0.
            relax: Returns the state in it.
        """
        done = self.begin(lying, relax)
        saved = self.engine.save()
        try:
            for number in range(done, len(self.times)):
                since = self.engine.time
                self.engine.advance(float(self.times[number]))
                self.keep_frame(number)
                if self.breaking:
                    self._break(number, since, saved)
                saved, done = self.engine.save(), number + 1
                # after a fracture, an interrupted run restarts from here
                if self.checkpoints.due and not self.breaks:
                    self.checkpoints.keep(saved, done)
                progress(done / len(self.times), self.words())
        except KeyboardInterrupt:
            if not self.breaks:
                self.checkpoints.keep(saved, done)
            raise
        except SimulationError as error:
            raise SimulationError(f"{error} {done} of {len(self.times)} frames are in {self.folder}.") from error

    def _break(self, number: int, since: float, saved: dict[str, np.ndarray]) -> None:
        """Fracture what was overloaded since the last frame, and simulate again from there."""
        while True:
            impact = next_breaking_impact(self.stage, self.breaks, self.whole, self.folder, number, since)
            if impact is None:
                return
            self.engine.restore(saved)
            broken = fracture_body(self.stage, self.engine, impact, self.breaks)
            if broken is None:
                # objects that cannot be cut stay whole
                self.whole.add(impact.object)
            else:
                self.checkpoints.forget()
                rewrite_history(self.folder, number, self.stage, broken.stage, broken.breaks[-1])
                self.engine, self.breaks = broken.engine, broken.breaks
                self._take(broken.stage)
                store.save(self.folder / BREAKS_FILE, self.breaks)
                since, saved = self.engine.time, self.engine.save()
            self.engine.advance(float(self.times[number]))
            self.keep_frame(number)

    def begin(self, lying: tuple[int, ...], relax: Relax) -> int:
        """Load the newest checkpoint, or write the first frame; return the number of frames."""
        for half in self.folder.rglob(".*.part"):
            half.unlink()  # left by a process that was killed while writing
        newest = self.checkpoints.newest()
        done, state = newest.done, newest.state
        if done:
            self.engine.restore(state)
        elif lying:
            self.engine.start_from(relax(), lying)
        for frame in (self.folder / FRAMES_FOLDER).glob("[0-9]*.npz"):
            if int(frame.stem) >= done:
                frame.unlink()
        if not done:
            (self.folder / BREAKS_FILE).unlink(missing_ok=True)
            write_layout(self.folder, self.layout)
            self.keep_frame(0)
        frame = frame_path(self.folder, 0).stat().st_size
        store.require_disk_space(self.folder, frame * (len(self.times) - max(done, 1)))
        return max(done, 1)

    def words(self) -> str:
        """Progress of the simulation in words."""
        end = self.times[-1]
        return f"{self.engine.time:.2f} of {end:.2f} s, {self.engine.steps.count:,} steps"

    def keep_frame(self, number: int) -> None:
        """Write the current state as frame ``number``, particles in original order."""
        now, measure = self.engine.snapshot(), self.engine.measure()
        rigid = self.posed.rigid[self.layout.object]
        motion = now.motion[self.place]
        if rigid.any():
            # a rigid fragment may have rotated before the fracture
            turned = now.deformation[self.place] @ self.stage.turned[self.layout.object]
            motion = np.where(rigid[:, None, None], turned, motion)
        stress = self.stress.at(now)[self.place]
        frame = Frame(now.time, now.position[self.place], motion, stress)
        row = ledger_row(self.posed.problem, now, measure, self.engine.steps)
        write_frame(self.folder, number, frame, self.layout, row)
        if self.watch is not None:
            self.watch.see(row)

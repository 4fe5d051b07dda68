"""A simulation keeps every frame, goes on after any interruption, and says how it went."""

import errno
import json
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from corporeal.core import store
from corporeal.core.errors import SimulationError
from corporeal.core.store import DiskError
from corporeal.core.types import (
    Discretization,
    Law,
    Material,
    MaterialField,
    PartDescription,
    Particles,
    Push,
    Scene,
    SceneObject,
    Structure,
)
from corporeal.mpm import problem as contract
from corporeal.mpm.problem import Diagnostics, Problem, Snapshot, StepStatistics
from corporeal.pipeline.stages import simulate as stage
from corporeal.pipeline.stages.simulate import SimulateConfig, simulate
from corporeal.simulation import checkpoint
from corporeal.simulation import trajectory_files as disk
from corporeal.simulation.trajectory_files import read_trajectory

RUBBER = Material("rubber", Law.NEO_HOOKEAN, 1e6, 0.4, 1000.0, loss=0.1)
CELL = 0.02


class Ballistic:
    """Bodies that fly through everything: enough to try the plumbing."""

    name = "cpu"
    explode_at = np.inf
    interrupt_at = np.inf

    def __init__(self, problem: Problem) -> None:
        self.problem, self.steps, self.time = problem, StepStatistics(), 0.0
        self.x = np.concatenate([b.position for b in problem.bodies])
        self.v = np.concatenate([b.velocity for b in problem.bodies])
        self.owner = np.repeat(np.arange(len(problem.bodies)), [len(b.position) for b in problem.bodies])

    def advance(self, until: float) -> None:
        if until > Ballistic.interrupt_at:
            self.x += 1.0  # half a step done: nothing that may be kept
            raise KeyboardInterrupt
        if until > Ballistic.explode_at:
            raise SimulationError("It fell apart.")
        dt = until - self.time
        g = np.array(self.problem.gravity)
        self.x += dt * self.v + 0.5 * dt**2 * g
        self.v += dt * g
        self.time = until
        self.steps.count += 1
        self.steps.smallest, self.steps.largest = dt, dt

    def snapshot(self) -> Snapshot:
        eye = np.broadcast_to(np.eye(3), (len(self.x), 3, 3)).copy()
        return Snapshot(self.time, self.x.copy(), self.v.copy(), eye, eye, np.zeros(len(self.x)))

    def measure(self) -> Diagnostics:
        p, count = self.problem, len(self.problem.bodies)
        mass = np.concatenate([b.volume * b.density for b in p.bodies])
        g = np.array(p.gravity)
        total = np.bincount(self.owner, mass)

        def added(values):
            return np.stack([np.bincount(self.owner, mass * column) for column in values.T], axis=1)

        everything = count + len(p.planes)
        return Diagnostics(
            time=self.time,
            mass=total,
            centre=added(self.x) / total[:, None],
            momentum=added(self.v),
            angular_momentum=added(np.cross(self.x, self.v)),
            kinetic=np.bincount(self.owner, 0.5 * mass * (self.v**2).sum(1)),
            elastic=np.zeros(count),
            potential=np.bincount(self.owner, -mass * (self.x @ g)),
            speed=float(np.linalg.norm(self.v, axis=1).max()),
            external_impulse=total[:, None] * g * self.time,
            plane_impulse=np.zeros((len(p.planes), count, 3)),
            pair_impulse=np.zeros((count, count)),
            push_work=0.0,
            friction_loss=0.0,
            impact_loss=0.0,
            impact_of_pair=np.zeros((everything, everything)),
            plastic_loss=0.0,
            viscous_loss=0.0,
            first_contact=np.full((everything, everything), np.nan),
            last_contact=np.full((everything, everything), np.nan),
            contact_point=np.full((everything, everything, 3), np.nan),
            lost=np.zeros(len(self.x), dtype=bool),
        )

    def stable_step(self):
        return np.inf

    def step(self, dt):
        self.advance(self.time + dt)

    def save(self):
        return {"x": self.x.copy(), "v": self.v.copy(), "time": np.float64(self.time)}

    def restore(self, saved):
        self.x, self.v, self.time = saved["x"], saved["v"], float(saved["time"])

    def stop(self, bodies):
        self.v[np.isin(self.owner, list(bodies))] = 0.0

    def start_from(self, saved, bodies):
        mine = np.isin(self.owner, list(bodies))
        self.x[mine] = saved["x"][mine]


@pytest.fixture(autouse=True)
def ballistic(monkeypatch):
    monkeypatch.setitem(contract.ENGINES, "cpu", f"{__name__}:Ballistic")
    monkeypatch.setattr(Ballistic, "explode_at", np.inf)
    monkeypatch.setattr(Ballistic, "interrupt_at", np.inf)


def lattice(low, high):
    axes = [np.arange(a + CELL / 4, b, CELL / 2) for a, b in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)


def treated(material=RUBBER, kind="deformable"):
    return Discretization(
        kind, material.young_pa, material.young_pa, material.poisson, material.density,
        material.yield_stress, None, 0.1, 1.0, 38.0, 2e-4, "Deformable.", material.loss,
    )  # fmt: skip


def scene_of(heights=(0.1, 0.5), velocity=(0.0, 0.0, 0.0), push=None, duration=0.2):
    """Cubes of 8 cm, one above the other, with their particles mixed."""
    blocks = [lattice((0, 0, h), (0.08, 0.08, h + 0.08)) for h in heights]
    position = np.concatenate(blocks)
    owner = np.repeat(np.arange(len(blocks)), [len(b) for b in blocks])
    shuffle = np.random.default_rng(0).permutation(len(position))
    position, owner = position[shuffle], owner[shuffle]
    count, kinds = len(position), len(heights)
    objects = tuple(SceneObject(f"cube_{k}", "cube", 0.08, velocity=velocity, push=push) for k in range(kinds))
    scene = Scene("cubes", "", objects, (), (), duration=duration, fps=50)
    particles = Particles(
        position=position,
        velocity=np.broadcast_to(np.array(velocity), (count, 3)).copy(),
        volume=np.full(count, (CELL / 2) ** 3),
        density=np.full(count, 1000.0),
        object=owner,
        part=owner.copy(),
        cell=CELL,
        treatments=(treated(),) * kinds,
        surface=np.zeros((0, 3)),
        object_of_surface=np.zeros(0, dtype=np.int64),
        mass_real=(0.512,) * kinds,
    )
    table = np.full((kinds + 1, kinds + 1), 0.5)
    field = MaterialField(
        materials=(RUBBER,) * kinds,
        structures=(Structure("solid"),) * kinds,
        words=tuple(PartDescription(f"part_{k}", "rubber") for k in range(kinds)),
        friction=table,
        restitution=table,
    )
    return scene, particles, field


def test_frames_come_back_in_the_order_of_the_particles(tmp_path):
    scene, particles, field = scene_of()
    trajectory = simulate(scene, particles, field, SimulateConfig(), tmp_path)
    assert len(trajectory.frames) == len(trajectory.time) == 11
    np.testing.assert_allclose(trajectory.frames[0].position, particles.position, atol=1e-6)
    fallen = particles.position - [0, 0, 0.5 * 9.81 * 0.2**2]
    np.testing.assert_allclose(trajectory.frames[-1].position, fallen, atol=1e-6)
    assert len(read_trajectory(tmp_path).frames) == 11
    assert not (tmp_path / checkpoint.CHECKPOINT_FILE).exists()


def test_the_audit_names_every_field_and_finds_the_hole_in_the_floor(tmp_path):
    scene, particles, field = scene_of()
    simulate(scene, particles, field, SimulateConfig(), tmp_path)
    audit = json.loads((tmp_path / "audit.json").read_text())
    for name in ("particles", "objects", "steps", "dt_min", "dt_max", "nan_count",
                 "particles_out_of_domain", "momentum_residual", "energy_growth",
                 "max_penetration_m", "max_penetration_dx", "parts"):  # fmt: skip
        assert name in audit
    for name in ("name", "object", "material", "law", "treatment", "structure", "young_pa", "simulated_young_pa",
                 "nu", "density", "yield_stress", "mass_kg"):  # fmt: skip
        assert name in audit["parts"][0]
    assert audit["momentum_residual"] < 1e-12
    assert audit["energy_growth"] < 1e-12
    sunk = 0.5 * 9.81 * 0.2**2 - 0.1
    assert audit["max_penetration_m"] == pytest.approx(sunk, abs=1e-6)
    assert any("penetrate" in w and "floor" in w for w in audit["warnings"])


def final(folder: Path):
    return {p.name: p.read_bytes() for p in sorted((folder / "frames").glob("0*.npz"))}


def test_an_interrupted_simulation_goes_on_as_if_nothing_had_happened(tmp_path, monkeypatch):
    asked = scene_of()
    simulate(*asked, SimulateConfig(), tmp_path / "whole")
    monkeypatch.setattr(Ballistic, "interrupt_at", 0.11)
    with pytest.raises(KeyboardInterrupt):
        simulate(*asked, SimulateConfig(), tmp_path / "broken")
    assert len(final(tmp_path / "broken")) == 6
    monkeypatch.setattr(Ballistic, "interrupt_at", np.inf)
    told = []
    simulate(*asked, SimulateConfig(), tmp_path / "broken", lambda f, words: told.append(f))
    assert told[0] > 0.5, "it should not begin again"
    whole, resumed = (read_trajectory(tmp_path / n) for n in ("whole", "broken"))
    for a, b in zip(whole.frames, resumed.frames, strict=True):
        np.testing.assert_array_equal(a.position, b.position)


OFTEN = checkpoint.CheckpointConfig(min_interval_s=0.0, max_write_time_fraction=np.inf)


def test_a_killed_simulation_goes_on_from_its_last_checkpoint(tmp_path, monkeypatch):
    asked = scene_of()
    monkeypatch.setattr(stage, "Checkpoints", partial(checkpoint.Checkpoints, config=OFTEN))

    class KilledError(BaseException):
        pass

    def kill(fraction, words):
        if fraction > 0.6:
            raise KilledError

    with pytest.raises(KilledError):
        simulate(*asked, SimulateConfig(), tmp_path, kill)
    assert (tmp_path / checkpoint.CHECKPOINT_FILE).exists()
    told = []
    trajectory = simulate(*asked, SimulateConfig(), tmp_path, lambda f, w: told.append(f))
    assert told[0] > 0.6
    assert trajectory.ledger.steps[0] == 0
    assert len(trajectory.frames) == 11


def test_a_checkpoint_of_another_scene_is_not_continued(tmp_path, monkeypatch):
    monkeypatch.setattr(Ballistic, "interrupt_at", 0.11)
    with pytest.raises(KeyboardInterrupt):
        simulate(*scene_of(), SimulateConfig(), tmp_path)
    monkeypatch.setattr(Ballistic, "interrupt_at", np.inf)
    told = []
    simulate(*scene_of((0.2, 0.6)), SimulateConfig(), tmp_path, lambda f, w: told.append(f))
    assert told[0] < 0.3


def test_a_failed_simulation_says_what_is_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(Ballistic, "explode_at", 0.11)
    with pytest.raises(SimulationError, match="6 of 11 frames"):
        simulate(*scene_of(), SimulateConfig(), tmp_path)
    assert len(final(tmp_path)) == 6


def test_a_full_disk_is_one_clear_sentence(tmp_path, monkeypatch):
    wrote = np.savez

    def full(file, **arrays):
        if len(list(tmp_path.rglob("0*.npz"))) >= 4:
            raise OSError(errno.ENOSPC, "No space left on device")
        wrote(file, **arrays)

    monkeypatch.setattr(disk.np, "savez", full)
    with pytest.raises(DiskError, match="disk is full"):
        simulate(*scene_of(), SimulateConfig(), tmp_path)
    assert not list(tmp_path.rglob("*.part"))
    assert not (tmp_path / "ledger.npz").exists()


def test_what_the_disk_cannot_hold_is_not_begun(tmp_path, monkeypatch):
    usage = SimpleNamespace(free=50_000)
    monkeypatch.setattr(store.shutil, "disk_usage", lambda folder: usage)
    with pytest.raises(DiskError, match=r": \d\.\d+ MB are needed, and 0\.05 MB are free"):
        simulate(*scene_of(), SimulateConfig(), tmp_path)
    assert len(final(tmp_path)) == 1
    usage.free = 50_000_000
    assert len(simulate(*scene_of(), SimulateConfig(), tmp_path).frames) == 11


def problem_of(monkeypatch, tmp_path, asked):
    seen = []
    monkeypatch.setattr(stage, "build_engine", lambda problem, engine: seen.append(problem) or Ballistic(problem))
    simulate(*asked, SimulateConfig(), tmp_path)
    return seen[0]


@pytest.mark.parametrize(
    ("asked", "ramp"),
    [
        (scene_of((0.0, 0.08)), 0.1),
        (scene_of((0.0, 0.5)), 0.0),
        (scene_of((0.0, 0.08), velocity=(0.0, 0.0, -1.0)), 0.0),
        (scene_of((0.0, 0.08), push=Push((3.0, 0.0, 0.0))), 0.0),
    ],
    ids=["all at rest", "one falls", "moving", "pushed"],
)
def test_gravity_grows_gently_only_where_everything_stands(tmp_path, monkeypatch, asked, ramp):
    assert problem_of(monkeypatch, tmp_path, asked).gravity_ramp == ramp


def test_friction_with_the_floor_is_that_of_the_part_that_stands_on_it(tmp_path, monkeypatch):
    scene, particles, field = scene_of((0.0,))
    low = particles.position[:, 2] < 0.04
    friction = np.array([[0.1, 0.2, 0.3], [0.2, 0.4, 0.9], [0.3, 0.9, 0.0]])
    particles = replace(particles, part=np.where(low, 1, 0), treatments=(treated(),) * 2, mass_real=(0.256, 0.256))
    field = replace(
        field,
        materials=(RUBBER,) * 2,
        structures=(Structure("solid"),) * 2,
        words=(PartDescription("lid", "rubber"), PartDescription("foot", "rubber")),
        friction=friction,
        restitution=friction,
    )
    problem = problem_of(monkeypatch, tmp_path, (scene, particles, field))
    assert problem.friction[0, 1] == pytest.approx(0.9)
    assert problem.friction[0, 0] == pytest.approx((0.1 + 2 * 0.2 + 0.4) / 4)


def test_what_is_lossy_is_damped_and_what_is_not_is_not(tmp_path, monkeypatch):
    scene, particles, field = scene_of()
    particles = replace(particles, treatments=(treated(), treated(replace(RUBBER, loss=0.0))))
    problem = problem_of(monkeypatch, tmp_path, (scene, particles, field))
    assert problem.bodies[0].loss.min() > 0
    assert problem.bodies[1].loss.max() == 0


def test_an_object_is_rigid_only_when_all_its_parts_are(tmp_path, monkeypatch):
    scene, particles, field = scene_of()
    particles = replace(particles, treatments=(treated(kind="rigid"), treated()))
    problem = problem_of(monkeypatch, tmp_path, (scene, particles, field))
    assert [b.rigid for b in problem.bodies] == [True, False]

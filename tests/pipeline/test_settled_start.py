"""A scene that had come to rest begins in its balance; one that does not say so begins as it is."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from corporeal.core.audit_data import SettledObjectOutcome, SettlingOutcome
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
    Wind,
)
from corporeal.discretization.build_model import build_model
from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.pipeline.stages import simulate as stage
from corporeal.pipeline.stages.simulate import SETTLING_FILE, SimulateConfig, simulate
from corporeal.simulation.audit_file import read_audit
from corporeal.simulation.audit_messages import equilibrium_message, equilibrium_warnings
from corporeal.simulation.checkpoint import CheckpointConfig, Checkpoints
from corporeal.simulation.static_equilibrium import settling_problem

CELL, SIZE = 0.02, 0.08
FOAM = Material("foam", Law.NEO_HOOKEAN, 8e3, 0.3, 500.0, loss=0.1)
STONE = Material("stone", Law.HENCKY, 5e10, 0.25, 2500.0)
ASKED = SimulateConfig()


def cube(height):
    axis = np.arange(CELL / 4, SIZE, CELL / 2)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    return points + np.array([0.0, 0.0, height])


def treated(material):
    stiff = material is STONE
    return Discretization(
        "rigid" if stiff else "deformable", material.young_pa, material.young_pa, material.poisson,
        material.density, None, None, 0.1, 1.0, 0.0 if stiff else 5.0, 1e-3, "As it is.",
        material.loss,
    )  # fmt: skip


def scene_of(heights, materials, velocity=(0.0, 0.0, 0.0), settled=True, **last):
    """Cubes of 8 cm above each other; the last one is moved as said."""
    count = len(heights)
    position = np.concatenate([cube(h) for h in heights])
    owner = np.repeat(np.arange(count), len(position) // count)
    things = [SceneObject(f"cube_{k}", "cube", SIZE) for k in range(count)]
    things[-1] = replace(things[-1], velocity=velocity, **last)
    scene = Scene("cubes", "", tuple(things), (), (), duration=0.2, fps=50, settled=settled)
    moving = np.zeros_like(position)
    moving[owner == count - 1] = velocity
    rigid = [k for k, m in enumerate(materials) if m is STONE]
    particles = Particles(
        position=position,
        velocity=moving,
        volume=np.full(len(position), (CELL / 2) ** 3),
        density=np.array([m.density for m in materials])[owner],
        object=owner,
        part=owner.copy(),
        cell=CELL,
        treatments=tuple(treated(m) for m in materials),
        surface=np.concatenate([np.zeros((0, 3)), *(corners(heights[k]) for k in rigid)]),
        object_of_surface=np.repeat(np.array(rigid, int), 8),
        mass_real=tuple(m.density * SIZE**3 for m in materials),
    )
    table = np.full((count + 1, count + 1), 0.5)
    field = MaterialField(
        materials=tuple(materials),
        structures=(Structure("solid"),) * count,
        words=tuple(PartDescription(m.name, m.name) for m in materials),
        friction=table,
        restitution=table,
    )
    return scene, particles, field


def corners(height):
    return np.array(list(np.ndindex(2, 2, 2))) * SIZE + np.array([0.0, 0.0, height])


def drift(trajectory):
    """How far centres of mass get from where they start [cells], by object."""
    centre = trajectory.ledger.centre
    return np.linalg.norm(centre - centre[0], axis=2).max(axis=0) / CELL


def test_what_had_come_to_rest_stays_and_the_control_does_not(tmp_path):
    asked = scene_of((0.0, SIZE), (FOAM, STONE))
    rested = simulate(*asked, ASKED, tmp_path / "settled")
    assert drift(rested).max() < 0.02
    first, start = rested.frames[0].position, asked[1].position
    assert (start - first)[asked[1].object == 1, 2].mean() > 0.5 * CELL, "it must have sunk"
    control = simulate(replace(asked[0], settled=False), *asked[1:], ASKED, tmp_path / "not")
    assert drift(control).min() > 0.25
    np.testing.assert_allclose(control.frames[0].position, start, atol=1e-6)
    assert not (tmp_path / "not" / SETTLING_FILE).exists()
    assert read_audit(tmp_path / "not").settling is None


def test_the_audit_says_how_long_it_took_and_what_sank(tmp_path):
    trajectory = simulate(*scene_of((0.0, SIZE), (FOAM, STONE)), ASKED, tmp_path)
    audit = read_audit(tmp_path)
    said = audit.settling
    assert said.found
    assert 0.25 < said.seconds < 2.0
    assert [thing.name for thing in said.objects] == ["cube_0", "cube_1"]
    stone = said.objects[1]
    assert stone.moved_dx == pytest.approx(-stone.moved_m[2] / CELL, rel=1e-3)
    assert stone.farthest_m >= -stone.moved_m[2]
    start = trajectory.ledger.centre[0, 1, 2]
    assert start == pytest.approx(1.5 * SIZE + stone.moved_m[2], abs=1e-6)
    assert any("cube_1 moved by" in w for w in audit.warnings) == (stone.moved_dx > 1)
    assert audit.energy_growth < 0.05
    assert trajectory.time[0] == 0.0
    assert trajectory.ledger.steps[0] == 0


def test_the_words_say_who_sank_by_how_much_and_whether_it_ended():
    rows = [
        SettledObjectOutcome(name, (0.0, 0.0, -sunk * 0.01), sunk, 0.05)
        for name, sunk in (("quilt_0", 4.2), ("toy_0", 0.5), ("vase_0", 0.01))
    ]
    said = SettlingOutcome(0.5512, True, tuple(rows))
    words = equilibrium_message(said)
    assert "for 0.55 s: quilt_0 moved by 42 mm (4.2 cells), toy_0 moved by 5 mm" in words
    assert "vase_0" not in words
    (warning,) = equilibrium_warnings(said)
    assert warning.startswith("quilt_0 moved by 42 mm")
    *_, last = equilibrium_warnings(replace(said, found=False))
    assert "equilibrium was not reached" in last
    assert equilibrium_message(None) == "" and equilibrium_warnings(None) == []


def test_what_hangs_is_held_and_falls_from_time_0(tmp_path):
    asked = scene_of((0.0, 0.5), (FOAM, STONE))
    trajectory = simulate(*asked, ASKED, tmp_path)
    centre = trajectory.ledger.centre[:, 1, 2]
    assert centre[0] == pytest.approx(0.5 + SIZE / 2, abs=1e-9)
    fallen = 0.5 * 9.81 * trajectory.time**2
    np.testing.assert_allclose(centre[0] - centre, fallen, atol=2e-3)


@pytest.mark.parametrize("kind", ["velocity", "push", "wind"])
def test_what_moves_objects_begins_at_time_0(tmp_path, kind):
    given = {
        "velocity": {"velocity": (0.5, 0.0, 0.0)},
        "push": {"push": Push((20.0, 0.0, 0.0))},
        "wind": {"wind": Wind((30.0, 0.0, 0.0))},
    }[kind]
    scene, particles, field = scene_of((0.0,), (FOAM,), **given)
    if kind == "wind":
        area = np.tile([[-SIZE * CELL / 2, 0.0, 0.0]], (8, 1))
        edge = np.flatnonzero(particles.position[:, 0] < CELL / 2)[:8]
        particles = replace(particles, face=area, particle_of_face=edge)
    trajectory = simulate(scene, particles, field, ASKED, tmp_path)
    centre, momentum = trajectory.ledger.centre[:, 0], trajectory.ledger.momentum[:, 0]
    assert abs(centre[0, 0] - SIZE / 2) < 1e-3
    begins = 0.5 * FOAM.density * SIZE**3 if kind == "velocity" else 0.0
    assert momentum[0, 0] == pytest.approx(begins, abs=1e-6)
    assert centre[:, 0].max() > SIZE / 2 + {"velocity": 5e-3, "push": 5e-2, "wind": 1e-3}[kind]


def test_what_is_all_rigid_begins_at_once(tmp_path):
    trajectory = simulate(*scene_of((0.0, SIZE), (STONE, STONE)), ASKED, tmp_path)
    assert not (tmp_path / SETTLING_FILE).exists()
    assert trajectory.ledger.centre[0, 1, 2] == pytest.approx(1.5 * SIZE, abs=1e-9)


def test_a_settling_that_was_cut_off_goes_on_to_the_last_bit(tmp_path, monkeypatch):
    asked = scene_of((0.0, SIZE), (FOAM, STONE))
    whole = simulate(*asked, ASKED, tmp_path / "whole")
    often = CheckpointConfig(min_interval_s=0.0, max_write_time_fraction=np.inf)
    monkeypatch.setattr(stage, "Checkpoints", partial(Checkpoints, config=often))

    class KilledError(BaseException):
        pass

    def kill(fraction, words):
        if "equilibrium, 0.1" in words:
            raise KilledError

    with pytest.raises(KilledError):
        simulate(*asked, ASKED, tmp_path / "broken", kill)
    told = []
    resumed = simulate(*asked, ASKED, tmp_path / "broken", lambda f, words: told.append(words))
    assert not any("equilibrium, 0.0" in words for words in told), "it began again"
    for a, b in zip(whole.frames, resumed.frames, strict=True):
        np.testing.assert_array_equal(a.position, b.position)
    assert not list((tmp_path / "broken").rglob("checkpoint*"))


def test_ctrl_c_while_objects_settle_keeps_what_was_done(tmp_path):
    asked = scene_of((0.0, SIZE), (FOAM, STONE))

    def stop(fraction, words):
        if "equilibrium, 0.2" in words:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(*asked, ASKED, tmp_path, stop)
    told = []
    simulate(*asked, ASKED, tmp_path, lambda f, words: told.append(words))
    assert "equilibrium, 0.2" in told[0]


def test_what_is_lossy_sinks_as_far_as_what_is_not(tmp_path):
    sunk = {}
    for loss in (0.0, 0.6):
        foam = replace(FOAM, loss=loss)
        rested = simulate(*scene_of((0.0, SIZE), (foam, STONE)), ASKED, tmp_path / f"{loss}")
        assert drift(rested).max() < 0.02
        sunk[loss] = 1.5 * SIZE - rested.ledger.centre[0, 1, 2]
    assert sunk[0.6] == pytest.approx(sunk[0.0], rel=0.05)


def test_equilibrium_is_sought_without_loss_and_the_video_has_it():
    scene, particles, field = scene_of((0.0,), (replace(FOAM, loss=0.6),))
    problem = build_model(scene, particles, field).problem
    lost = []
    for asked in (problem, settling_problem(problem, set())):
        engine = CpuEngine(asked)
        engine.advance(0.05)
        lost.append(float(engine.measure().viscous_loss))
    assert lost[1] < 1e-3 * lost[0]

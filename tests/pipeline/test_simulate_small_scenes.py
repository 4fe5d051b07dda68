"""Small real scenes through the whole stage, with the production engine."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import trimesh

from corporeal.core.types import Law, Material, MaterialField, PartDescription, Particles, Scene, SceneObject, Structure
from corporeal.discretization.discretization_plan import ExpectedMotion, PartGeometry, plan_discretization
from corporeal.discretization.point_filling import fill_body
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.pipeline.stages import simulate as stage
from corporeal.pipeline.stages.simulate import SimulateConfig, simulate
from corporeal.simulation.audit_file import read_audit
from corporeal.simulation.checkpoint import CheckpointConfig, Checkpoints
from corporeal.simulation.outcome import measure_outcome
from corporeal.simulation.trajectory_files import read_trajectory

JELLY = Material("jelly", Law.NEO_HOOKEAN, 1e5, 0.4, 1000.0, restitution=0.95)
RUBBER = Material("rubber", Law.NEO_HOOKEAN, 3e6, 0.48, 1100.0)
STEEL = Material("steel", Law.HENCKY, 200e9, 0.3, 7850.0)
SIZE, FALL = 0.1, 0.05


def golden_sphere(count):
    """Points spread evenly over the unit sphere (Fibonacci)."""
    k = np.arange(count) + 0.5
    polar, turn = np.arccos(1 - 2 * k / count), np.pi * (1 + 5**0.5) * k
    return np.stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)], axis=1)


def ball(spacing):
    """Concentric shells of evenly spread points: round outside, no lattice."""
    layers = []
    for radius in np.arange(SIZE / 2 - spacing / 2, 0, -spacing):
        layers.append(radius * golden_sphere(max(4, round(4 * np.pi * (radius / spacing) ** 2))))
    return np.concatenate(layers)


def balls(materials, heights, velocities=None, duration=0.5):
    """Balls of 10 cm whose lowest points are at the given heights, one above the other."""
    speed = float(np.sqrt(2 * 9.81 * max(heights)))
    count = len(materials)
    volume = np.pi / 6 * SIZE**3
    parts = [
        PartGeometry(k, m, Structure("solid"), (SIZE,) * 3, volume, np.pi * SIZE**2) for k, m in enumerate(materials)
    ]
    chosen = plan_discretization(parts, [ExpectedMotion(speed, 9.81)] * count, "draft")
    one = ball(chosen.cell / 2)
    skin = SIZE / 2 * golden_sphere(1000)
    at = [np.array([0.0, 0.0, h + SIZE / 2]) for h in heights]
    velocities = velocities or [(0.0, 0.0, 0.0)] * count
    owner = np.repeat(np.arange(count), len(one))
    rigid = [k for k in range(count) if chosen.treatments[k].kind == "rigid"]
    density = np.array([m.density for m in materials])
    particles = Particles(
        position=np.concatenate([one + x for x in at]),
        velocity=np.repeat(np.array(velocities), len(one), axis=0),
        volume=np.full(count * len(one), volume / len(one)),
        density=density[owner],
        object=owner,
        part=owner.copy(),
        cell=chosen.cell,
        treatments=chosen.treatments,
        surface=np.concatenate([np.zeros((0, 3)), *(skin + at[k] for k in rigid)]),
        object_of_surface=np.repeat(np.array(rigid, dtype=np.int64), len(skin)),
        mass_real=tuple(float(volume * rho) for rho in density),
    )
    objects = tuple(SceneObject(f"ball_{k}", "ball", SIZE, velocity=v) for k, v in enumerate(velocities))
    scene = Scene("balls", "", objects, (), (), duration=duration, fps=60)
    table = np.full((count + 1, count + 1), 0.6)
    field = MaterialField(
        materials=tuple(materials),
        structures=(Structure("solid"),) * count,
        words=tuple(PartDescription(f"ball {k}", m.name) for k, m in enumerate(materials)),
        friction=table,
        restitution=table,
    )
    return scene, particles, field


@pytest.fixture(scope="module")
def bounce(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bounce")
    asked = balls([JELLY], [FALL])
    return asked, simulate(*asked, SimulateConfig(), folder), folder


def test_a_jelly_ball_bounces_and_is_round_again(bounce):
    (scene, particles, field), trajectory, _ = bounce
    row = measure_outcome(scene, particles, field, trajectory).objects["ball_0"]
    assert row.fall_m == pytest.approx(FALL, abs=0.3 * particles.cell)
    assert 0.6 < row.rebound_ratio < 1.0
    assert row.shape_error_max > 0.008
    assert row.shape_error_end < 0.006


def test_its_audit_finds_nothing_but_what_a_coarse_grid_takes(bounce):
    _, trajectory, folder = bounce
    audit = read_audit(folder)
    assert [finding.severity for finding in audit.findings] == ["warning"]
    assert [effect.kind for effect in audit.findings[0].effects] == ["unaccounted_energy"]
    assert len(audit.warnings) == 1 and "16% of the energy is lost in transfers" in audit.warnings[0]
    assert audit.momentum_residual < 1e-5
    assert audit.energy_growth < 1e-3
    assert audit.max_penetration_dx < 0.5
    assert audit.dt_max >= audit.dt_min > 0
    first = trajectory.ledger.first_contact[-1, 0, 1]
    assert first == pytest.approx(np.sqrt(2 * FALL / 9.81), rel=0.05)


def test_a_steel_ball_rebounds_by_its_coefficient_of_restitution(tmp_path):
    scene, particles, field = balls([STEEL], [FALL], duration=0.4)
    moved = simulate(scene, particles, field, SimulateConfig(), tmp_path)
    row = measure_outcome(scene, particles, field, moved).objects["ball_0"]
    assert particles.treatments[0].kind == "rigid"
    assert row.rebound_ratio == pytest.approx(0.36, abs=0.04)
    assert row.shape_error_max < 1e-6


@pytest.mark.slow
def test_a_ball_dropped_upright_bounces_upright(tmp_path):
    """Its middle is where its mass is; with points that all weigh alike it goes aside."""
    sphere = trimesh.creation.icosphere(4, SIZE / 2)
    shape = QueryMesh(Mesh(np.asarray(sphere.vertices), np.asarray(sphere.faces)))
    aside = {"cells": [], "alike": []}
    for seed in range(3):
        scene, particles, field = balls([RUBBER], [3 * FALL], duration=0.4)
        spacing, rng = particles.cell / 2, np.random.default_rng(seed)
        made = fill_body(shape, shape, spacing, lambda p: np.full(len(p), np.inf), rng)
        for way, volumes in (("cells", made.volumes), ("alike", np.ones(len(made.points)))):
            dropped = replace(
                particles,
                position=made.points + np.array([0, 0, 3 * FALL + SIZE / 2]),
                velocity=np.zeros_like(made.points),
                volume=volumes * (np.pi / 6 * SIZE**3 / volumes.sum()),
                density=np.full(len(volumes), RUBBER.density),
                object=np.zeros(len(volumes), np.int64),
                part=np.zeros(len(volumes), np.int64),
            )
            out = tmp_path / f"{way}{seed}"
            middle = simulate(scene, dropped, field, SimulateConfig(), out).ledger.centre[:, 0]
            low = np.argmin(middle[:, 2])
            risen = middle[low:][np.argmax(middle[low:, 2])] - middle[low]
            aside[way].append(np.hypot(*risen[:2]) / risen[2])
    assert np.mean(aside["cells"]) < 0.01
    assert np.mean(aside["alike"]) > 2 * np.mean(aside["cells"])


def test_two_balls_that_meet_part_again_and_one_field_glues_them(tmp_path):
    towards = [(0.0, 0.0, 0.0), (0.0, 0.0, -1.0)]
    asked = balls([JELLY, JELLY], [1.0, 1.0 + SIZE + 0.01], towards, duration=0.3)
    asked = (replace(asked[0], gravity=(0.0, 0.0, 0.0)), *asked[1:])
    pairs = {}
    for contact in ("multi", "single"):
        trajectory = simulate(*asked, SimulateConfig(contact=contact), tmp_path / contact)
        pairs[contact] = measure_outcome(*asked, trajectory).pair("ball_0", "ball_1")
    assert pairs["multi"].separated
    assert not pairs["single"].separated


def test_a_run_that_was_cut_off_ends_exactly_like_one_that_was_not(bounce, tmp_path, monkeypatch):
    asked, whole, _ = bounce
    often = CheckpointConfig(min_interval_s=0.0, max_write_time_fraction=np.inf)
    monkeypatch.setattr(stage, "Checkpoints", partial(Checkpoints, config=often))

    def cut(fraction, words):
        if fraction > 0.4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate(*asked, SimulateConfig(), tmp_path, cut)
    simulate(*asked, SimulateConfig(), tmp_path)
    resumed = read_trajectory(tmp_path)
    np.testing.assert_array_equal(whole.frames[-1].position, resumed.frames[-1].position)
    assert whole.ledger.steps[-1] == resumed.ledger.steps[-1]

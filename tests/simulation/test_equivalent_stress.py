"""Von Mises stress is that of the law, from the elastic strain."""

import numpy as np
import pytest

import corporeal as co
from corporeal.mpm.problem import Snapshot
from corporeal.simulation.equivalent_stress import VonMises, equivalent_of_principal


@pytest.fixture(scope="module")
def problem():
    scene = co.build_scene(co.ball("seat_foam", radius=0.05, at=(0, 0, 0.3)))
    return co.pose_problem(co.prepare_scene(scene))


def snapshot(problem, F):
    body = problem.bodies[0]
    count = len(body.position)
    whole = np.broadcast_to(F, (count, 3, 3)).astype(np.float32)
    return Snapshot(0.0, body.position, body.velocity, whole, whole, np.zeros(count))


def test_uniaxial_tension_gives_its_stress_and_pressure_none():
    pull, press = np.diag([7.0, 0, 0]), -3.0 * np.eye(3)
    shear = np.array([[0, 2.0, 0], [2, 0, 0], [0, 0, 0]])
    found = equivalent_of_principal(np.linalg.eigvalsh(np.stack([pull, press, shear])))
    np.testing.assert_allclose(found, [7.0, 0.0, 2 * np.sqrt(3)], atol=1e-12)


def test_a_small_stretch_follows_hooke(problem):
    """E ε along a free bar: the strain across it is -ν ε."""
    body, strain = problem.bodies[0], 1e-3
    across = -body.poisson[0] * strain
    F = np.eye(3) + np.diag([strain, across, across])
    found = VonMises(problem).at(snapshot(problem, F))
    np.testing.assert_allclose(found, body.young_pa * strain, rtol=5e-3)


def test_turning_costs_no_stress_and_swelling_has_no_equivalent_stress(problem):
    turn = np.array([[0, -1.0, 0], [1, 0, 0], [0, 0, 1]])
    scale = problem.bodies[0].young_pa.max()
    for F in (turn, 1.2 * np.eye(3)):
        assert VonMises(problem).at(snapshot(problem, F)).max() < 1e-5 * scale


def test_stress_survives_the_disk_to_the_precision_of_half_floats(tmp_path):
    played = co.simulate_scene(
        co.build_scene(co.ball("seat_foam", radius=0.04, at=(0, 0, 0.05)), duration=0.05), folder=tmp_path
    )
    posed = co.pose_problem(played.prepared)
    frame = played.trajectory.frames[-1]
    assert frame.stress is not None
    now = Snapshot(
        frame.time, frame.position, frame.position, frame.deformation, frame.deformation,
        np.zeros(len(frame.position)),
    )  # fmt: skip
    fresh = VonMises(posed).at(now)
    np.testing.assert_allclose(frame.stress, fresh, rtol=0.1, atol=0.02 * fresh.max())

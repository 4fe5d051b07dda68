"""What touches on the device engine keeps the laws of nature."""

import numpy as np
import pytest
from laws.asked import on_device
from test_cuda import AS_IT_WAS, CELL, ball, body, problem, same

from corporeal.core.types import Law
from corporeal.mpm.problem import Plane
from corporeal.mpm.reference.engine import ReferenceEngine

G = 9.81
REST = (0.0, 0.0, 0.0)


def brick(centre, size, **more):
    axes = [np.arange(-s / 2 + CELL / 4, s / 2, CELL / 2) for s in size]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    edge = np.stack(np.meshgrid(*[np.linspace(-s / 2, s / 2, 4) for s in size]), -1).reshape(-1, 3)
    skin = edge[(np.abs(edge) > np.array(size) / 2 - 1e-9).any(axis=1)]
    surface = skin + centre if more.get("rigid") else np.zeros((0, 3))
    return body(points + centre, surface=surface, **more)


def energy(measure):
    return float((measure.kinetic + measure.elastic + measure.potential).sum())


@pytest.mark.parametrize("rigid", [(False, False), (False, True), (True, True)])
def test_a_collision_conserves_momentum_and_never_gains_energy(rigid):
    shift, far = np.array([0.003, 0.006, 0.004]), np.array([0.11, 0.03, 0.01])
    one = body(ball(shift), velocity=(1.0, 0, 0), rigid=rigid[0], loss=0.0)
    two = body(ball(shift + far), velocity=(-1, 0, 0), rigid=rigid[1], density=2e3, loss=0.0)
    given = problem(one, two, planes=(), gravity=REST, friction=0.3, transfer="apic")
    engine = on_device(given)
    before = engine.measure()
    exact = 1e-12 if all(rigid) else 1e-6
    whole = np.abs(before.angular_momentum.sum(axis=0)).max()
    for time in (0.01, 0.02, 0.04):
        engine.advance(time)
        now = engine.measure()
        drift = np.abs(now.momentum.sum(axis=0) - before.momentum.sum(axis=0)).max()
        assert drift < exact * np.abs(before.momentum).max()
        assert energy(now) <= 1.0005 * energy(before)
    turn = now.angular_momentum.sum(axis=0) - before.angular_momentum.sum(axis=0)
    assert np.abs(turn).max() < 10 * exact * whole
    assert now.pair_impulse[0, 1] > 0
    assert now.momentum[0, 0] < 0.5 * before.momentum[0, 0]


def test_a_rigid_ball_rebounds_with_its_coefficient_of_restitution():
    points = ball((0, 0, 0.06))
    down = np.array([[0.0, 0.0, 0.01]])
    stone = body(points, rigid=True, surface=down, velocity=(0, 0, -1.0))
    engine = on_device(problem(stone, restitution=0.6, gravity=REST))
    engine.advance(0.02)
    measure = engine.measure()
    assert measure.momentum[0] == pytest.approx([0, 0, 0.6 * measure.mass[0]], rel=1e-6, abs=1e-9)
    assert measure.first_contact[0, 1] == pytest.approx(0.01, abs=1.1e-3)
    assert measure.plane_impulse[0, 0, 2] == pytest.approx(1.6 * measure.mass[0], rel=1e-6)


@pytest.mark.parametrize("friction", [0.3, 0.8])
def test_a_rigid_block_on_an_incline_slides_as_coulomb_says(friction):
    """s = ½ g (sin θ - μ cos θ) t² on 30°, and stays where μ > tan θ."""
    slope = np.radians(30.0)
    block = brick((0, 0, 0.05), (0.2, 0.2, 0.1), rigid=True)
    down = (G * np.sin(slope), 0.0, -G * np.cos(slope))
    engine = on_device(problem(block, friction=friction, gravity=down, restitution=0.0))
    engine.advance(0.25)
    pull = max(0.0, np.sin(slope) - friction * np.cos(slope))
    measure = engine.measure()
    moved = measure.centre[0] - [0, 0, 0.05]
    expected = 0.5 * G * pull * 0.25**2
    # The place is of first order in the step, 1.8 % of the time here at most; the speed is exact.
    assert moved[0] == pytest.approx(expected, rel=0.018, abs=1e-4 * CELL)
    assert measure.momentum[0, 0] == pytest.approx(measure.mass[0] * G * pull * 0.25, rel=1e-5, abs=1e-4)
    assert np.abs(moved[1:]).max() < 2e-3 * CELL
    if pull:
        grip = friction * measure.mass[0] * G * np.cos(slope)
        assert measure.friction_loss == pytest.approx(grip * moved[0], rel=0.02)


@pytest.mark.slow
def test_a_soft_block_comes_to_rest_on_the_floor_and_is_borne_by_it():
    block = brick((0.005, 0.003, 0.05), (0.1, 0.1, 0.1), young_pa=3e5, loss=1.0)
    engine = on_device(problem(block, gravity_ramp=0.05, friction=0.5))
    engine.advance(0.2)
    measure = engine.measure()
    weight = measure.mass[0] * G * (0.2 - 0.025)
    assert measure.plane_impulse[0, 0, 2] == pytest.approx(weight, rel=0.02)
    assert np.abs(measure.centre[0, :2] - [0.005, 0.003]).max() < 2e-3 * CELL
    assert measure.speed < 0.02


def test_a_tall_stack_of_rigid_cubes_stands_still():
    """Jacobi sweeps with a pace: nothing creeps, as no contact comes before another."""
    size = (0.1, 0.1, 0.1)
    cubes = [brick((0.005, 0.01, 0.05 + 0.1 * k), size, rigid=True) for k in range(4)]
    engine = on_device(problem(*cubes, gravity_ramp=0.05, friction=0.5, restitution=0.0))
    engine.advance(0.2)
    moved = engine.measure().centre - [[0.005, 0.01, 0.05 + 0.1 * k] for k in range(4)]
    assert np.abs(moved).max() < 1e-3 * CELL


def test_walls_hold_whichever_way_they_face():
    wall = Plane((1.0, 0.0, 0.0), 0.0)
    soft = body(ball((0.06, 0, 0)), Law.COROTATED, velocity=(-2.0, 0, 0))
    engine = on_device(problem(soft, planes=(wall,), gravity=REST))
    engine.advance(0.05)
    measure = engine.measure()
    assert measure.plane_impulse[0, 0, 0] > 2.0 * measure.mass[0]
    assert measure.momentum[0, 0] > 0


def test_the_control_glues_what_separate_fields_let_go():
    gap = 0.1 * CELL
    cubes = [
        brick((x, 0.003, 0.004), (0.1, 0.1, 0.1), velocity=(v, 0, 0), loss=0.0)
        for x, v in ((0.0, 0.5), (0.1 + gap, 0.0))
    ]
    away = []
    for contact in ("multi", "single"):
        engine = on_device(problem(*cubes, planes=(), gravity=REST, contact=contact))
        engine.advance(0.08)
        centre = engine.measure().centre
        away.append((centre[1, 0] - centre[0, 0] - 0.1) / CELL)
    assert away[0] > 0.5
    assert abs(away[1]) < 0.3


@AS_IT_WAS
def test_two_runs_on_the_processor_are_the_same():
    def heap():
        low = brick((0, 0, 0.05), (0.1, 0.1, 0.1))
        return problem(low, body(ball((0.01, 0, 0.16)), rigid=True, velocity=(0, 0, -2)))

    first, second = on_device(heap()), on_device(heap())
    for engine in (first, second):
        engine.advance(0.03)
    assert first.measure().pair_impulse[0, 1] > 0
    same(first.measure(), second.measure())


def test_what_a_pair_that_never_touches_leaves_room_for_is_not_booked():
    """Room for contacts of the pair held what others gave in earlier steps: twice the impulse."""
    one = body(ball((0, 0, 0.055)), velocity=(1.0, 0, -1.0))
    two = body(ball((0.02, 0.03, 0.055)), velocity=(-1.0, 0.5, -1.0))
    given = problem(one, two, excluded_pairs=((0, 1),))
    ours, sure = on_device(given), ReferenceEngine(given)
    for engine in (ours, sure):
        for _ in range(40):
            engine.step(5e-4)
    mine, theirs = ours.measure(), sure.measure()
    assert theirs.plane_impulse[0, :, 2].min() > 0.1
    assert mine.plane_impulse == pytest.approx(theirs.plane_impulse, rel=1e-4, abs=1e-6)
    assert mine.friction_loss == pytest.approx(theirs.friction_loss, rel=1e-4)

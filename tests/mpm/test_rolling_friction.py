"""Rolling friction: a moment of up to c N; the formula at both widths, and the engines."""

from dataclasses import replace

import numpy as np
import pytest
from laws.asked import on_device
from point_bodies import CELL, SIZE, board, problem, round_body, step_together

from corporeal.core.types import Keyframes, Push
from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.mpm.cuda.layout import wp
from corporeal.mpm.formulas import formula_options, one_lane
from corporeal.mpm.reference.engine import ReferenceEngine
from corporeal.mpm.reference.rolling_contacts import RollingSide, brake_roll
from corporeal.mpm.state import ParticleConstants

wp.set_module_options(formula_options())
COUNT, RADIUS, G = 100, 0.05, 9.81
ENGINES = {"cpu": lambda p: CpuEngine(p, threads=1), "cuda": on_device}


@wp.kernel
def brakes(
    light: wp.array(dtype=wp.vec2d),
    inertia: wp.array2d(dtype=wp.mat33d),
    arm: wp.array2d(dtype=wp.vec3d),
    spin: wp.array(dtype=wp.vec3d),
    n: wp.array(dtype=wp.vec3d),
    J: wp.array(dtype=wp.vec3d),
    bounds: wp.array(dtype=wp.vec2d),
    out: wp.array(dtype=one_lane.BrakeVector),
):
    i = wp.tid()
    out[i] = one_lane.rolling_brake(
        light[i][0],
        inertia[i, 0],
        arm[i, 0],
        light[i][1],
        inertia[i, 1],
        arm[i, 1],
        spin[i],
        n[i],
        J[i],
        bounds[i][0],
        bounds[i][1],
    )


def some():
    """Contacts of any two bodies, and of one with a plane; J within Coulomb's cone."""
    rng = np.random.default_rng(0)
    light = rng.uniform(0.1, 10, (COUNT, 2))
    root = rng.normal(size=(COUNT, 2, 3, 3))
    inertia = root @ root.transpose(0, 1, 3, 2) + np.eye(3)
    arm, spin = rng.normal(size=(COUNT, 2, 3)), rng.normal(size=(COUNT, 3))
    light[::3, 1], inertia[::3, 1], arm[::3, 1] = 0, 0, 0
    n = rng.normal(size=(COUNT, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    rub = rng.normal(size=(COUNT, 3)) * rng.choice([0.0, 0.3], (COUNT, 1))
    bounds = np.stack([rng.uniform(0.1, 1, COUNT), 10.0 ** rng.uniform(-4, 2, COUNT)], axis=1)
    return light, inertia, arm, spin, n, n + rub, bounds


def test_the_fast_engines_brake_as_numpy_does():
    light, inertia, arm, spin, n, J, bounds = given = some()
    kinds = (wp.vec2d, wp.mat33d, wp.vec3d, wp.vec3d, wp.vec3d, wp.vec3d, wp.vec2d)
    arrays = [wp.array(x, dtype=k, device="cpu") for x, k in zip(given, kinds, strict=True)]
    out = wp.zeros(COUNT, dtype=one_lane.BrakeVector, device="cpu")
    wp.launch(brakes, COUNT, inputs=[*arrays, out], device="cpu")
    for i, row in enumerate(out.numpy()):
        a, c = (RollingSide(light[i, k], inertia[i, k], arm[i, k]) for k in (0, 1))
        sure = brake_roll(a, c, spin[i], n[i], J[i], (bounds[i, 0], bounds[i, 1]))
        assert row == pytest.approx([*sure.moment, *sure.impulse, sure.energy], rel=1e-10)


def test_a_brake_takes_spin_never_gives_it_and_keeps_to_its_bounds():
    stopped = 0
    for light, inertia, arm, spin, n, J, bounds in zip(*some(), strict=True):
        a, c = (RollingSide(light[k], inertia[k], arm[k]) for k in (0, 1))
        done = brake_roll(a, c, spin, n, J, tuple(bounds))
        assert np.linalg.norm(done.moment) <= bounds[1] * (1 + 1e-12)
        assert done.energy > 0
        assert done.moment @ n == pytest.approx(0, abs=1e-12)
        turned = [s.inertia @ (done.moment + np.cross(s.arm, done.impulse)) for s in (a, c)]
        left = spin - turned[0] - turned[1]
        e = done.moment / np.linalg.norm(done.moment)
        assert -1e-9 < left @ e < spin @ e
        stopped += abs(left @ e) < 1e-9
    assert 10 < stopped < COUNT - 10


def rolling(c, speed=0.3, slope=0.0):
    """A ball on the floor, which may slope: it slides, and then rolls."""
    one = round_body((0.0, 0.0, RADIUS), RADIUS, velocity=(speed, 0.0, 0.0))
    gravity = (G * np.sin(slope), 0.0, -G * np.cos(slope))
    return problem(one, gravity=gravity, restitution=0.0, rolling_resistance=np.full((2, 2), c))


def test_a_ball_stops_where_rolling_friction_has_taken_its_energy():
    """½ (m + I/r²) v² = c/r m g s, by the inertia of its particles; 7/10 m v² of a solid ball."""
    c = 5e-3
    given = rolling(c)
    matter = ParticleConstants.of(given)
    share = matter.inertia[0][1, 1] / (matter.total[0] * RADIUS**2)
    engine = CpuEngine(given, threads=1)
    engine.advance(0.05)  # it slides first
    start = engine.measure()
    v, booked = start.momentum[0, 0] / start.mass[0], float(start.friction_loss)
    engine.advance(1.0)
    end = engine.measure()
    way = end.centre[0, 0] - start.centre[0, 0]
    late = 0.5 * v * engine.steps.largest  # a step moves with the velocity at its end
    expected = 0.5 * (1 + share) * v**2 * RADIUS / (c * G)
    assert way + late == pytest.approx(expected, rel=2e-3)
    assert np.abs(end.momentum).max() < 1e-9 * end.mass[0]
    lost = float(end.friction_loss) - booked
    assert lost == pytest.approx(start.kinetic[0] - end.kinetic[0], rel=1e-3)


@pytest.mark.parametrize("steep", [0.9, 1.1])
def test_a_ball_at_rest_begins_to_roll_where_the_slope_exceeds_c_over_r(steep):
    c = 2e-3
    engine = CpuEngine(rolling(c, 0.0, np.arctan(steep * c / RADIUS)), threads=1)
    engine.advance(0.5)
    way = engine.measure().centre[0, 0]
    if steep < 1:
        assert abs(way) < 1e-6
    else:
        assert way > 1e-4


def over_a_board(**given):
    """A ball that is pushed onto a board, which yields or moves as it is told, and rolls on it."""
    down = Push((0.0, 0.0, -G), 0.0, 1.0)
    one = round_body((0.0, 0.0, RADIUS), RADIUS, velocity=(0.3, 0.05, 0.0), push=down)
    under = board(np.array([0.0, 0.0, -SIZE[2] / 2]), **given)
    rolls = np.full((2, 2), 5e-3)
    still = (0.0, 0.0, 0.0)
    return problem(one, under, planes=(), gravity=still, restitution=0.0, rolling_resistance=rolls)


ALONG = Keyframes((0.0, 1.0), ((0.0, 0.0, 0.0), (0.0, 0.4, 0.0)), ((0.0, 0.0, 0.0),) * 2)
CASES = {"floor": lambda: rolling(5e-3), "sloping floor": lambda: rolling(5e-3, 0.1, 0.03)}
CASES["board that moves"] = lambda: over_a_board(path=ALONG)
CASES["light board"] = lambda: over_a_board(density=2000.0)


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("engine", ["cpu", "cuda"])
def test_what_is_braked_moves_as_in_the_reference(engine, case):
    given = CASES[case]()
    ours, sure = ENGINES[engine](given), ReferenceEngine(given)
    step_together(ours, sure, 20)
    mine, theirs = ours.measure(), sure.measure()
    assert np.abs(ours.snapshot().position - sure.snapshot().position).max() < 2e-5 * CELL
    # Where two surface points of a ball are equally near, either may carry it.
    assert mine.momentum == pytest.approx(theirs.momentum, rel=2e-4, abs=1e-6)
    assert mine.angular_momentum == pytest.approx(theirs.angular_momentum, rel=2e-4, abs=1e-6)
    assert mine.friction_loss == pytest.approx(theirs.friction_loss, rel=1e-4, abs=1e-9)
    assert mine.push_work == pytest.approx(theirs.push_work, rel=1e-4, abs=1e-8)
    free = ReferenceEngine(replace(given, rolling_resistance=None))
    step_together(free, ReferenceEngine(given), 20)
    apart = np.abs(free.measure().angular_momentum - theirs.angular_momentum).max()
    assert apart > 1e-3 * np.abs(theirs.angular_momentum).max()

"""What moving air does to bodies."""

from dataclasses import replace

import numpy as np
import pytest
from laws.bodies import Stuff, ball, ball_surface, box, problem
from scipy.spatial import cKDTree

from corporeal.core.types import Wind
from corporeal.mpm.constants import AIR_DENSITY, PLATE_DRAG_COEFFICIENT
from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.mpm.physics import wind_pressure
from corporeal.mpm.problem import WindFaces
from corporeal.mpm.reference.engine import ReferenceEngine

CELL, R = 0.02, 0.05
LIGHT = Stuff(density=30.0, young_pa=1e4)
STILL_AIR = Wind((0.0, 0.0, 0.0))
FALL = (0.0, 0.0, -9.81)


def facing(body, points, area, air):
    """Let a body show faces at some points to the air."""
    return replace(body, wind=air, faces=WindFaces(area, cKDTree(body.position).query(points)[1]))


def a_sphere(air, count=1500, **more):
    points = ball_surface((0, 0, 0), R, count)
    area = points / R * (4 * np.pi * R**2 / count)
    return facing(ball((0, 0, 0), R, CELL / 2, **more), points, area, air)


def a_plate(air, size=(0.1, 0.1, 0.02), **more):
    """Its two large sides meet the air."""
    n = 20
    axis = (np.arange(n) + 0.5) / n - 0.5
    x, y = (a.ravel() for a in np.meshgrid(axis * size[0], axis * size[1]))
    up = np.stack([x, y, np.full(n * n, size[2] / 2)], 1)
    area = np.tile([0.0, 0.0, size[0] * size[1] / n**2], (n * n, 1))
    points = np.concatenate([up, up * [1, 1, -1]])
    return facing(box((0, 0, 0), size, CELL / 2, **more), points, np.concatenate([area, -area]), air)


def falling(speed, time):
    """Speed of a fall in air whose terminal speed is ``speed``: v tanh(g t/v)."""
    return speed * np.tanh(9.81 * time / speed)


@pytest.mark.parametrize("rigid", [False, True])
def test_a_sphere_falls_through_air_as_its_drag_coefficient_says(fast_engine, rigid):
    """Half a second brings a sphere of C_d = .47 to 53 % of its terminal 8.3 m/s."""
    run = fast_engine(problem(a_sphere(STILL_AIR, rigid=rigid, stuff=LIGHT), cell=CELL, gravity=FALL))
    run.advance(0.5)
    measure = run.measure()
    speed = -measure.momentum[0, 2] / measure.mass[0]
    terminal = np.sqrt(8 * 30.0 * R * 9.81 / (3 * AIR_DENSITY * 0.47))
    assert speed == pytest.approx(falling(terminal, 0.5), rel=0.003)


def test_a_sphere_in_its_terminal_fall_keeps_its_speed(fast_engine):
    terminal = np.sqrt(8 * 30.0 * R * 9.81 / (3 * AIR_DENSITY * 0.47))
    body = a_sphere(STILL_AIR, rigid=True, stuff=LIGHT, velocity=(0, 0, -terminal))
    run = fast_engine(problem(body, cell=CELL, gravity=FALL))
    run.advance(1.0)
    measure = run.measure()
    assert -measure.momentum[0, 2] / measure.mass[0] == pytest.approx(terminal, rel=0.003)


def test_a_plate_falls_slower_than_a_sphere_as_its_drag_coefficient_says(fast_engine):
    run = fast_engine(problem(a_plate(STILL_AIR, rigid=True, stuff=LIGHT), cell=CELL, gravity=FALL))
    run.advance(1.0)
    measure = run.measure()
    terminal = np.sqrt(2 * 30.0 * 0.02 * 9.81 / (AIR_DENSITY * 1.17))
    speed = -measure.momentum[0, 2] / measure.mass[0]
    assert speed == pytest.approx(falling(terminal, 1.0), rel=0.003)


def test_wind_blows_a_body_along_with_it_and_no_faster(fast_engine):
    thin = Stuff(density=2.0, young_pa=1e3)
    run = fast_engine(problem(a_sphere(Wind((5.0, 0.0, 0.0)), rigid=True, stuff=thin), cell=CELL))
    run.advance(3.0)
    velocity = run.measure().momentum[0] / run.measure().mass[0]
    assert 4.0 < velocity[0] < 5.0
    assert np.abs(velocity[1:]).max() < 0.02


@pytest.mark.parametrize(("rigid", "shift"), [(False, 0.0), (False, 0.25), (True, 0.0)])
def test_the_work_of_the_wind_is_in_the_books(engine, rigid, shift):
    """E after - E before = work; impulse = momentum; outside the window nothing happens.

    Particles half way between nodes have no share in the outermost ones, which bear no mass.
    """
    air = Wind((3.0, 0.0, 12.0), gust=0.5, start=0.01, end=0.05)
    body = a_plate(air, size=(0.06, 0.06, 0.04), rigid=rigid, stuff=Stuff(density=100.0, young_pa=1e4))
    body = replace(body, position=body.position + shift * CELL)
    run = engine(problem(body, cell=CELL))
    run.advance(0.01)
    assert np.abs(run.measure().momentum).max() == 0.0
    run.advance(0.05)
    blown = run.measure()
    assert blown.external_impulse[0] == pytest.approx(blown.momentum[0], rel=1e-4, abs=1e-9)
    gained = blown.kinetic.sum() + blown.elastic.sum()
    assert gained > 1e-6
    assert blown.push_work == pytest.approx(gained, rel=0.02)
    run.advance(0.06)
    assert run.measure().external_impulse == pytest.approx(blown.external_impulse)


def test_a_face_in_the_lee_feels_nothing_and_an_oblique_one_less():
    area = np.array([[0, 0, -1.0], [0, 0, 1.0], [0, 1.0, -1.0]])
    seen = np.tile([0.0, 0.0, 2.0], (3, 1))
    given = wind_pressure.wind_impulses(area, seen, np.full(3, 1e9), 1.0)
    whole = 0.5 * AIR_DENSITY * PLATE_DRAG_COEFFICIENT * 4.0
    assert given[0] == pytest.approx([0, 0, whole])
    assert np.all(given[1] == 0.0)
    assert np.linalg.norm(given[2]) == pytest.approx(np.sqrt(2) * whole * 0.5**1.5)


def test_gusts_are_smooth_bounded_and_always_the_same():
    signal = np.array([wind_pressure.gust_signal(t) for t in np.arange(0, 60, 0.01)])
    assert 0.5 < np.abs(signal).max() <= 1.0
    assert abs(signal.mean()) < 0.05
    steepest = 2 * np.pi * wind_pressure.GUST_FREQUENCY @ wind_pressure.GUST_SHARE
    assert np.abs(np.diff(signal)).max() < 0.01 * steepest
    assert wind_pressure.gust_signal(1.0) == pytest.approx(float(signal[100]))


@pytest.mark.parametrize(
    ("stiff", "contact", "spin"), [(False, "multi", 40.0), (True, "multi", 40.0), (True, "single", 0.0)]
)
def test_the_production_engine_is_blown_as_the_reference(stiff, contact, spin):
    air = Wind((9.0, -4.0, 2.0), gust=0.6, start=0.002)
    first = a_sphere(air, count=300, rigid=stiff, stuff=Stuff(density=50.0), spin=(0, spin, 0))
    second = a_plate(air, size=(0.06, 0.06, 0.02), stuff=Stuff(density=50.0), spin=(0, 9, 0))
    second = replace(second, position=second.position + np.array([0.0, 0.2, 0.0]))
    given = problem(first, second, cell=CELL, contact=contact)
    fast, sure = CpuEngine(given, threads=1), ReferenceEngine(given)
    for _ in range(40):
        dt = min(fast.stable_step(), sure.stable_step())
        fast.step(dt)
        sure.step(dt)
    ours, theirs = fast.measure(), sure.measure()
    assert np.abs(theirs.external_impulse).min(axis=1).min() > 0
    assert ours.external_impulse == pytest.approx(theirs.external_impulse, rel=1e-4)
    assert ours.angular_momentum == pytest.approx(theirs.angular_momentum, rel=1e-3, abs=1e-8)
    assert ours.push_work == pytest.approx(theirs.push_work, rel=1e-4)
    assert np.abs(fast.snapshot().position - sure.snapshot().position).max() < 2e-5 * CELL

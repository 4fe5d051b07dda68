"""Bodies too stiff to bend."""

import numpy as np
import pytest
from laws.bodies import Stuff, ball, ball_surface, floor, problem

G = 9.81
DOWN = (0.0, 0.0, -G)
RADIUS, CELL = 0.05, 0.0125
STEEL = Stuff(density=7850.0)


def steel_ball(centre, **more):
    more.setdefault("surface", ball_surface(centre, RADIUS, 1000))
    return ball(centre, RADIUS, CELL / 2, stuff=STEEL, rigid=True, **more)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.8])
def test_a_rigid_ball_bounces_to_the_height_its_restitution_says(patient_engine, restitution):
    drop = 0.1
    start = (0.003, 0.002, drop + RADIUS)
    run = patient_engine(
        problem(
            steel_ball(start), cell=CELL, restitution=restitution, planes=[floor()], gravity=DOWN
        )
    )
    fall = np.sqrt(2 * drop / G)
    before = run.measure()
    run.advance(fall + 0.005)
    assert run.measure().centre[0, 2] > RADIUS - 0.05 * CELL
    peak = 0.0
    for time in np.linspace(0.8, 1.2, 9) * fall * restitution + fall:
        run.advance(max(time, run.time))
        m = run.measure()
        peak = max(peak, m.centre[0, 2] - RADIUS)
        total = m.kinetic.sum() + m.potential.sum()
        assert total <= before.potential.sum() + 1e-3 * 7850 * 5.2e-4 * G * drop
    assert peak == pytest.approx(restitution**2 * drop, rel=0.03, abs=0.03 * CELL)


def test_two_rigid_balls_rebound_as_newton_says(patient_engine):
    restitution, v, ratio, cell = 0.9, 1.0, 0.3, RADIUS / 5
    shift = np.array([0.13, 0.31, 0.22]) * cell
    far = shift + np.array([2 * RADIUS + 0.9 * cell, 0.0, 0.0])
    one = ball(shift, RADIUS, cell / 2, stuff=STEEL, rigid=True, velocity=(v, 0.0, 0.0))
    light = Stuff(density=7850.0 * ratio)
    two = ball(far, RADIUS, cell / 2, stuff=light, rigid=True, velocity=(-v / 2, 0.0, 0.0))
    run = patient_engine(problem(one, two, cell=cell, restitution=restitution))
    before = run.measure()
    run.advance(0.03)
    after = run.measure()
    u = after.momentum / after.mass[:, None]
    assert u[1, 0] - u[0, 0] == pytest.approx(restitution * 1.5 * v, rel=0.02)
    drift = np.abs(after.momentum.sum(0) - before.momentum.sum(0)).max()
    assert drift < run.round_off * np.abs(before.momentum).max()
    swing = np.abs(after.angular_momentum.sum(0) - before.angular_momentum.sum(0)).max()
    assert swing < 10 * run.round_off * np.abs(before.momentum).max() * RADIUS
    reduced = after.mass[0] * after.mass[1] / after.mass.sum()
    lost = 0.5 * reduced * (1.5 * v) ** 2 * (1 - restitution**2)
    assert before.kinetic.sum() - after.kinetic.sum() == pytest.approx(lost, rel=0.1)


def test_a_rigid_ball_rolls_down_a_slope_without_slipping(patient_engine):
    """x = 5/14 g sin θ t² where μ ≥ 2/7 tan θ, and ω = v/R."""
    angle, time = np.radians(20), 0.25
    start = (0.003, 0.002, RADIUS)
    surface = ball_surface(start, RADIUS, 4000)
    gravity = (G * np.sin(angle), 0.0, -G * np.cos(angle))
    run = patient_engine(
        problem(
            steel_ball(start, surface=surface),
            cell=CELL,
            friction=0.5,
            planes=[floor()],
            gravity=gravity,
        )
    )
    run.advance(time)
    m = run.measure()
    rolled = m.centre[0, 0] - start[0]
    assert rolled == pytest.approx(5 / 14 * G * np.sin(angle) * time**2, rel=0.05)
    spin = m.angular_momentum[0] - np.cross(m.centre[0], m.momentum[0])
    inertia = 0.4 * m.mass[0] * RADIUS**2
    assert spin[1] / inertia * RADIUS == pytest.approx(m.momentum[0, 0] / m.mass[0], rel=0.05)


def test_a_rigid_body_keeps_its_shape_to_the_last_digit(patient_engine):
    start = (0.003, 0.002, 0.1 + RADIUS)
    run = patient_engine(
        problem(
            steel_ball(start, spin=(3.0, 20.0, -5.0)),
            cell=CELL,
            restitution=0.5,
            friction=0.4,
            planes=[floor()],
            gravity=DOWN,
        )
    )
    rest = run.snapshot().position
    run.advance(0.2)
    now = run.snapshot().position
    pick = np.random.default_rng(0).integers(0, len(rest), (200, 2))
    before = np.linalg.norm(rest[pick[:, 0]] - rest[pick[:, 1]], axis=1)
    after = np.linalg.norm(now[pick[:, 0]] - now[pick[:, 1]], axis=1)
    assert np.abs(after - before).max() < run.round_off * 10 * RADIUS

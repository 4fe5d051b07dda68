"""Bodies that slide or stick. The slope is made by tilting gravity over a level floor."""

import numpy as np
import pytest
from laws.bodies import Stuff, ball, box, box_surface, floor, problem

G, ANGLE = 9.81, np.radians(30)
CELL, SIZE = 0.025, (0.2, 0.1, 0.1)
SLOPE = (G * np.sin(ANGLE), 0.0, -G * np.cos(ANGLE))
CENTRE = (0.1, 0.05, 0.05)


def block_on_slope(friction, gravity=SLOPE, rigid=False, **more):
    stuff = Stuff(young_pa=1e5)
    surface = box_surface(CENTRE, SIZE) if rigid else None
    block = box(CENTRE, SIZE, CELL / 2, stuff=stuff, rigid=rigid, surface=surface)
    return problem(block, cell=CELL, friction=friction, planes=[floor()], gravity=gravity, **more)


def slide(friction, time):
    """s = ½ g (sin θ - μ cos θ) t²."""
    return 0.5 * G * (np.sin(ANGLE) - friction * np.cos(ANGLE)) * time**2


@pytest.mark.parametrize("rigid", [False, True])
def test_a_block_slides_down_a_slope_as_coulomb_says(patient_engine, rigid):
    run = patient_engine(block_on_slope(0.3, rigid=rigid))
    run.advance(0.3)
    m = run.measure()
    assert m.centre[0, 0] - CENTRE[0] == pytest.approx(slide(0.3, 0.3), rel=0.05)
    assert abs(m.centre[0, 1] - CENTRE[1]) < 0.01 * CELL


def test_friction_takes_exactly_the_energy_that_is_missing(engine):
    """Work of gravity = kinetic energy + friction loss, for a block that only slides."""
    run = engine(block_on_slope(0.3, rigid=True))
    before = run.measure()
    for _ in range(200):
        run.step(0.001)
    after = run.measure()
    released = before.potential[0] - after.potential[0]
    assert after.friction_loss == pytest.approx(released - after.kinetic[0], rel=0.02)
    normal = after.mass[0] * G * np.cos(ANGLE)
    path = after.centre[0, 0] - CENTRE[0]
    assert after.friction_loss == pytest.approx(0.3 * normal * path, rel=0.02)


@pytest.mark.parametrize("rigid", [False, True])
def test_what_sticks_loses_nothing_to_friction(patient_engine, rigid):
    """Work of friction needs slip: holding against a steady pull takes no energy."""
    run = patient_engine(block_on_slope(0.8, rigid=rigid, gravity_ramp=0.1))
    before = run.measure()
    run.advance(0.25)
    after = run.measure()
    released = before.potential[0] - after.potential[0]
    weight = after.mass[0] * G * CELL
    assert -1e-6 * weight < after.friction_loss < 0.2 * released + 1e-3 * weight


def test_a_soft_ball_that_settles_loses_little_to_friction(fast_engine):
    """It widens a little on the floor: a few per cent of what it fell, not a third."""
    soft = Stuff(young_pa=2e4, density=900.0, loss=0.3)
    falling = ball((0.003, 0.002, 0.07), 0.05, 0.00625, stuff=soft)
    run = fast_engine(problem(falling, cell=0.0125, friction=0.5, planes=[floor()], gravity=(0.0, 0.0, -G)))
    before = run.measure()
    run.advance(0.5)
    after = run.measure()
    fallen = before.potential[0] - after.potential[0]
    energy = after.kinetic[0] + after.elastic[0] + after.viscous_loss
    assert 0.0 < after.friction_loss < 0.05 * fallen
    assert energy + after.friction_loss < fallen


@pytest.mark.parametrize("rigid", [False, True])
def test_a_block_sticks_when_friction_exceeds_the_slope(patient_engine, rigid):
    run = patient_engine(block_on_slope(0.8, rigid=rigid, gravity_ramp=0.1))
    run.advance(0.25)
    moved = run.measure().centre[0] - CENTRE
    assert abs(moved[0]) < 0.04 * CELL
    assert abs(moved[1]) < 0.01 * CELL


LOSSY, LOSSLESS = Stuff(young_pa=1e6, loss=0.3), Stuff(young_pa=1e6)
LIMIT = float(np.tan(ANGLE))
"""Friction that just holds a block on the slope [-]."""


def slid(build, friction, stuff, cells=4, **more):
    """How far [m] a soft block came in .5 s; gravity grows in .1 s, so that hardly a wave runs."""
    cell = SIZE[2] / cells
    block = box(CENTRE, SIZE, cell / 2, stuff=stuff)
    given = {"planes": [floor()], "gravity": SLOPE, "gravity_ramp": 0.1} | more
    run = build(problem(block, cell=cell, friction=friction, **given))
    run.advance(0.5)
    return float(run.measure().centre[0, 0] - CENTRE[0])


def creeping(share):
    """Way of a rigid block [m] at this share of the friction that holds it."""
    pull = G * np.sin(ANGLE) * (1.0 - share)
    return pull * (0.5**2 / 2 - 0.1 * 0.5 / 2 + 0.1**2 / 6)


def test_a_soft_block_near_the_limit_of_friction_slides_as_coulomb_says(fast_engine):
    """A tenth of its weight drives it: an error of friction shows ten times as large."""
    assert slid(fast_engine, 0.9 * LIMIT, LOSSY) == pytest.approx(creeping(0.9), rel=0.03)
    assert slid(fast_engine, 0.8 * LIMIT, LOSSY) == pytest.approx(creeping(0.8), rel=0.015)


@pytest.mark.parametrize("stuff", [LOSSY, LOSSLESS])
def test_a_soft_block_just_beyond_the_limit_of_friction_does_not_creep(fast_engine, stuff):
    assert abs(slid(fast_engine, 1.1 * LIMIT, stuff)) < 0.02 * CELL


@pytest.mark.slow
def test_a_block_without_loss_shakes_and_slides_farther_on_any_grid(fast_engine):
    """The control: friction excites its vibrations, which stick in places and let others slip.

    That is elastodynamics and no error of the grid, which twice the resolution would halve.
    """
    coarse, fine = (slid(fast_engine, 0.9 * LIMIT, LOSSLESS, cells) for cells in (4, 8))
    rigid = creeping(0.9)
    assert coarse > 1.2 * rigid
    assert fine - rigid > 0.8 * (coarse - rigid)


def test_a_block_without_friction_slides_freely(patient_engine):
    run = patient_engine(block_on_slope(0.0))
    run.advance(0.2)
    m = run.measure()
    assert m.centre[0, 0] - CENTRE[0] == pytest.approx(slide(0.0, 0.2), rel=0.01)
    assert m.friction_loss == pytest.approx(0.0, abs=1e-9)


def test_a_thrown_block_stops_after_its_braking_distance(fast_engine):
    """v₀² / 2 μ g."""
    block = box(CENTRE, SIZE, CELL / 2, stuff=Stuff(young_pa=1e5), velocity=(1.0, 0.0, 0.0))
    run = fast_engine(problem(block, cell=CELL, friction=0.5, planes=[floor()], gravity=(0.0, 0.0, -G)))
    run.advance(1.0 / (0.5 * G) + 0.1)
    m = run.measure()
    assert m.centre[0, 0] - CENTRE[0] == pytest.approx(1.0 / (2 * 0.5 * G), rel=0.05)
    assert np.abs(m.momentum[0] / m.mass[0]).max() < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("case", ["7", "9"])
def test_a_block_slides_down_a_slab_as_coulomb_says_however_it_lies_on_the_grid(holds, case):
    found = holds(case, quick=False)
    glued = found.checks[0].control
    assert abs(glued) < 0.05 * found.checks[0].reference


def test_a_block_sticks_to_a_slab_where_friction_exceeds_the_slope(holds):
    holds("8", quick=True)


@pytest.mark.slow
def test_balls_and_cylinders_roll_and_slip_down_a_slope(holds):
    holds("10", quick=True)

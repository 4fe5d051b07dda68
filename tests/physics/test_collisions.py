"""Bodies that meet."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from laws import collisions
from laws.bodies import Stuff, ball, box, problem

from corporeal.mpm.problem import FLOOR

RADIUS, CELL, SPEED = 0.1, 0.1 / 3, 0.3
CONTACT_TIME = 0.113
"""Hertz's for these two balls [s]."""


def two_balls(gap=0.5, **more):
    """Head-on along x with relative speed SPEED, off the grid's symmetry."""
    shift = np.array([0.13, 0.31, 0.22]) * CELL
    far = shift + np.array([2 * RADIUS + gap * CELL, 0.0, 0.0])
    v = np.array([SPEED / 2, 0.0, 0.0])
    balls = (
        ball(shift, RADIUS, CELL / 2, velocity=v, name="left"),
        ball(far, RADIUS, CELL / 2, velocity=-v, name="right"),
    )
    return problem(*balls, cell=CELL, **more)


def watched(run, until, looks=10):
    """Measure several times on the way."""
    measures = [run.measure()]
    for k in range(looks):
        run.advance(until * (k + 1) / looks)
        measures.append(run.measure())
    return measures


@cache
def head_on(engine, **more):
    run = engine(two_balls(**more))
    return run, watched(run, 0.5 * CELL / SPEED + 1.5 * CONTACT_TIME)


def velocities(measure):
    return measure.momentum / measure.mass[:, None]


def energy(measure):
    return measure.kinetic.sum() + measure.elastic.sum() + measure.potential.sum()


@pytest.mark.slow
def test_contact_starts_when_the_surfaces_meet(engine):
    _, measures = head_on(engine)
    expected = 0.5 * CELL / SPEED
    start = measures[-1].first_contact[0, 1]
    assert abs(start - expected) * SPEED < 0.3 * CELL
    place = measures[-1].contact_point[0, 1]
    middle = (measures[0].centre[0] + measures[0].centre[1]) / 2
    assert np.abs(place - middle).max() < CELL


def test_the_pair_impulse_is_what_the_bodies_gained(engine):
    _, measures = head_on(engine)
    gained = measures[-1].momentum[1, 0] - measures[0].momentum[1, 0]
    assert measures[-1].pair_impulse[0, 1] == pytest.approx(gained, rel=0.1)
    assert np.array_equal(measures[-1].pair_impulse, measures[-1].pair_impulse.T)


def cubes_in_a_row(count, **more):
    """One moving cube, the others at rest and almost touching."""
    side, v = 0.1, 0.2
    cubes = [
        box(
            (0.11 * CELL + k * (side + 0.1 * CELL), 0.3 * CELL, 0.2 * CELL),
            (side,) * 3,
            CELL / 2,
            velocity=(v if k == 0 else 0.0, 0.0, 0.0),
        )
        for k in range(count)
    ]
    return problem(*cubes, cell=CELL, **more)


def distances(run, times):
    """Between the centres of neighbours, in cells."""
    found = []
    for time in times:
        run.advance(time)
        found.append(np.diff(run.measure().centre[:, 0]) / CELL)
    return np.array(found)


@pytest.mark.parametrize("count", [2, 3])
def test_what_separate_fields_let_go_a_single_grid_glues(fast_engine, count):
    """The control: the same experiment in one velocity field must fail to separate."""
    free = distances(fast_engine(cubes_in_a_row(count)), (0.2, 0.35, 0.5))
    glued = distances(fast_engine(cubes_in_a_row(count, contact="single")), (0.2, 0.35, 0.5))
    assert np.all(np.diff(free, axis=0) > 0.05)
    assert free[-1, -1] > 3.0 + 1.0
    assert np.abs(glued - 3.1).max() < 0.1


def test_two_cubes_separate_in_the_reference_and_stick_in_its_single_grid(engine):
    free = distances(engine(cubes_in_a_row(2)), (0.1, 0.15))
    glued = distances(engine(cubes_in_a_row(2, contact="single")), (0.1, 0.15))
    assert free[1, 0] - free[0, 0] > 0.15
    assert abs(glued[1, 0] - glued[0, 0]) < 0.1


def test_an_impact_runs_through_a_row_and_only_the_last_flies_off(fast_engine):
    """Like Newton's cradle: three balls, gaps wide enough that they meet one after the other."""
    shift, step = np.array([0.11, 0.3, 0.2]) * CELL, 2 * RADIUS + 0.4 * CELL
    balls = [
        ball(shift + np.array([k * step, 0.0, 0.0]), RADIUS, CELL / 2, velocity=(0.0 if k else SPEED, 0, 0))
        for k in range(3)
    ]
    run = fast_engine(problem(*balls, cell=CELL))
    measures = watched(run, 0.38)
    v = velocities(measures[-1])[:, 0] / SPEED
    assert v[2] > 0.75
    assert abs(v[0]) < 0.15 and abs(v[1]) < 0.15
    total = measures[-1].momentum.sum(0) - measures[0].momentum.sum(0)
    assert np.abs(total).max() < 1e-5 * np.abs(measures[0].momentum).max()
    assert max(energy(m) for m in measures) <= 1.001 * energy(measures[0])
    assert measures[-1].pair_impulse[0, 2] == 0.0


def test_light_and_heavy_collide_as_their_masses_say(patient_engine):
    """One tenth of the mass: v1' = (m1 - e m2)/(m1 + m2) v, v2' = (1 + e) m1/(m1 + m2) v."""
    shift, v = np.array([0.13, 0.31, 0.22]) * CELL, np.array([SPEED, 0.0, 0.0])
    far = shift + np.array([2 * RADIUS + 0.5 * CELL, 0.0, 0.0])
    light = ball(shift, RADIUS, CELL / 2, stuff=Stuff(density=200.0), velocity=v)
    heavy = ball(far, RADIUS, CELL / 2, stuff=Stuff(density=2000.0))
    run = patient_engine(problem(light, heavy, cell=CELL))
    measures = watched(run, 0.5 * CELL / SPEED + 0.12)
    after = velocities(measures[-1])[:, 0] / SPEED
    restitution = after[1] - after[0]
    assert 0.65 < restitution < 1.0
    assert after[0] == pytest.approx((1 - 10 * restitution) / 11, abs=0.005)
    assert after[1] == pytest.approx((1 + restitution) / 11, abs=0.005)
    drift = np.abs(measures[-1].momentum.sum(0) - measures[0].momentum.sum(0)).max()
    assert drift < run.round_off * measures[0].momentum.max()


@pytest.mark.slow
def test_a_collision_conserves_momentum_and_never_gains_energy(holds):
    holds("1", quick=True)


def test_many_bodies_in_a_node_conserve_momentum_and_never_gain_energy(holds):
    holds("2", quick=True)


def test_two_discs_rebound_as_other_codes_say():
    found = collisions.discs(8)
    assert found.restitution == pytest.approx(0.90, abs=0.02)
    assert found.duration == pytest.approx(0.95, abs=0.03)
    assert abs(found.gap) < 0.4
    assert found.tangential < 0.03


@pytest.mark.slow
def test_two_discs_rebound_alike_at_any_angle_on_the_grid(holds):
    holds("4", quick=True)


@pytest.mark.slow
def test_two_spheres_meet_as_hertz_says(holds):
    holds("6", quick=False)


def test_a_rebound_books_what_it_took(patient_engine):
    """½ m (1 - e²) v² of a rigid ball; of a soft one nodes take a part."""
    fall = np.array([0.0, 0.0, -2.0])
    rigid = ball((0.0, 0.0, 0.06), 0.05, 0.01, rigid=True, velocity=tuple(fall))
    run = patient_engine(problem(rigid, cell=0.02, planes=(FLOOR,), restitution=0.6))
    before = run.measure()
    run.advance(0.03)
    after = run.measure()
    energy = before.kinetic.sum()
    assert after.impact_loss == pytest.approx((1 - 0.6**2) * energy, rel=1e-3)
    assert after.kinetic.sum() == pytest.approx(0.6**2 * energy, rel=1e-3)
    stuff = Stuff(young_pa=60e3, poisson=0.1, density=60.0)
    soft = ball((0.0, 0.0, 0.06), 0.05, 0.00625, stuff=stuff, velocity=tuple(fall))
    run = patient_engine(problem(soft, cell=0.0125, planes=(FLOOR,)))
    before = run.measure()
    run.advance(0.025)
    after = run.measure()
    energy = before.kinetic.sum()
    left = (after.kinetic + after.elastic).sum()
    assert 0.01 * energy < after.impact_loss < 0.12 * energy
    # Transfers take the rest, at eight cells across a tenth; nothing is booked that was not there.
    assert 0.88 * energy < left + after.impact_loss + after.friction_loss < energy


def test_what_each_pair_takes_is_booked_apart(patient_engine):
    """Balls that keep .6 and .9 of their speed on one floor; they never meet each other."""
    fall = (0.0, 0.0, -2.0)
    balls = [ball((x, 0.0, 0.06), 0.05, 0.01, rigid=True, velocity=fall) for x in (-0.2, 0.2)]
    posed = problem(*balls, cell=0.02, planes=(FLOOR,), restitution=0.6)
    table = posed.restitution.copy()
    table[1, 2] = table[2, 1] = 0.9
    run = patient_engine(replace(posed, restitution=table))
    energy = run.measure().kinetic
    run.advance(0.03)
    found = run.measure()
    taken = found.impact_of_pair
    assert taken[0, 2] == pytest.approx((1 - 0.6**2) * energy[0], rel=1e-3)
    assert taken[1, 2] == pytest.approx((1 - 0.9**2) * energy[1], rel=1e-3)
    assert taken[0, 1] == 0.0
    assert np.array_equal(taken, taken.T)
    assert np.triu(taken).sum() == pytest.approx(found.impact_loss, rel=1e-9)

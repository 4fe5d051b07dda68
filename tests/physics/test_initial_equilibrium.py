"""What is soft finds its balance before time 0, and stays in it."""

from dataclasses import replace

import numpy as np
import pytest
from laws.asked import in_fixed_order
from laws.bodies import Stuff, box, box_surface, floor, problem

from corporeal.mpm.problem import Plane
from corporeal.simulation.static_equilibrium import (
    MAX_RELAXATION_S,
    WATCH_WINDOW_S,
    DynamicRelaxation,
    settling_problem,
)

G = 9.81
DOWN = (0.0, 0.0, -G)
CELL = 0.02
FOAM = Stuff(young_pa=2e4, poisson=0.3, density=1000.0)
LENGTH, WIDTH = 0.2, 0.04


def column():
    """Foam that smooth walls keep from bulging."""
    thing = box((WIDTH / 2, WIDTH / 2, LENGTH / 2), (WIDTH, WIDTH, LENGTH), CELL / 2, stuff=FOAM)
    walls = [
        floor(),
        Plane((1.0, 0.0, 0.0), 0.0),
        Plane((-1.0, 0.0, 0.0), -WIDTH),
        Plane((0.0, 1.0, 0.0), 0.0),
        Plane((0.0, -1.0, 0.0), -WIDTH),
    ]
    return problem(thing, cell=CELL, planes=walls, gravity=DOWN)


def rested(build, given, hung=frozenset(), max_seconds=MAX_RELAXATION_S):
    posed = settling_problem(given, set(hung))
    return DynamicRelaxation(build(posed), posed, set(hung)).run(lambda time: None, max_seconds)


def drift(run, seconds):
    """How far centres of mass get from where they are [cells]."""
    start, most = run.measure().centre, 0.0
    for k in range(10):
        run.advance((k + 1) * seconds / 10)
        most = max(most, float(np.linalg.norm(run.measure().centre - start, axis=1).max()))
    return most / run.problem.cell


def test_a_column_sinks_to_the_balance_of_statics_and_stays_there(fast_engine):
    """The centre of mass sinks by ρ g L² / 3 M where strains are small."""
    given = column()
    balance = rested(fast_engine, given)
    assert balance.found
    assert WATCH_WINDOW_S < balance.seconds < 1.0
    sag = 1000.0 * G * LENGTH**2 / (3.0 * FOAM.p_wave_modulus)
    assert sag > 0.2 * CELL, "too little to be seen"
    assert -balance.moved[0, 2] == pytest.approx(sag, rel=0.1)
    video = fast_engine(given)
    video.start_from(balance.state, [0])
    assert drift(video, 0.3) < 0.01
    assert drift(fast_engine(given), 0.3) > 1.5 * sag / CELL, "the control must move"


def test_the_books_begin_at_time_0_with_the_velocities_of_the_problem(engine):
    size = (0.06, 0.06, 0.06)
    block = box((0.05, 0.05, 0.03), size, CELL / 2, stuff=FOAM, velocity=(1.0, 0, 0))
    stone = box((0.05, 0.05, 0.5), size, CELL / 2, rigid=True, velocity=(0, 0, -2.0))
    given = problem(block, stone, cell=CELL, friction=0.5, planes=[floor()], gravity=DOWN)
    posed = settling_problem(given, {1})
    other = engine(posed)
    other.advance(0.02)
    video = engine(given)
    video.start_from(other.save(), [0])
    m, start = video.measure(), engine(given).measure()
    assert m.time == 0.0
    assert video.steps.count == 0
    np.testing.assert_allclose(m.momentum, start.momentum, rtol=1e-6, atol=1e-6)
    np.testing.assert_array_equal(m.centre[1], start.centre[1])
    assert m.centre[0, 2] < start.centre[0, 2] - 1e-5
    assert m.elastic[0] == pytest.approx(other.measure().elastic[0], rel=1e-6)
    assert m.elastic[0] > 0.0
    assert not m.external_impulse.any()
    assert not m.plane_impulse.any()
    assert np.isnan(m.first_contact).all()
    assert m.friction_loss == m.viscous_loss == m.plastic_loss == m.push_work == 0.0
    video.advance(0.02)
    assert video.measure().momentum[0, 0] == pytest.approx(m.mass[0], rel=0.2)


def test_only_what_is_stopped_stops(engine):
    size = (0.06, 0.06, 0.06)
    here, there = (box((x, 0.05, 0.2), size, CELL / 2, stuff=FOAM) for x in (0.0, 0.3))
    stone = box((0.6, 0.05, 0.2), size, CELL / 2, rigid=True)
    run = engine(problem(here, there, stone, cell=CELL, gravity=DOWN))
    run.advance(0.02)
    run.stop([0, 2])
    m = run.measure()
    assert m.kinetic[0] == m.kinetic[2] == 0.0
    assert m.momentum[1, 2] == pytest.approx(-m.mass[1] * G * 0.02, rel=1e-4)
    run.advance(0.04)
    m = run.measure()
    for b, seconds in enumerate((0.02, 0.04, 0.02)):
        assert m.momentum[b, 2] == pytest.approx(-m.mass[b] * G * seconds, rel=1e-3)


def overhanging(share):
    """A plank on a cushion; so much of it hangs over the edge."""
    cushion = box((0.0, 0.0, 0.05), (0.2, 0.1, 0.1), CELL / 2, stuff=FOAM)
    centre, size = (0.1 + (share - 0.5) * 0.2, 0.0, 0.11), (0.2, 0.06, 0.02)
    light = replace(FOAM, density=300.0)
    plank = box(centre, size, CELL / 2, rigid=True, surface=box_surface(centre, size), stuff=light)
    return problem(cushion, plank, cell=CELL, friction=0.5, planes=[floor()], gravity=DOWN)


def test_what_falls_over_is_not_held_up(fast_engine):
    """A plank with its middle beyond the edge of a cushion comes to lean on it, else it stays."""
    fallen, stays = (rested(fast_engine, overhanging(s)) for s in (0.7, 0.2))
    assert fallen.found
    assert fallen.moved[1, 2] < -0.03
    assert stays.found
    assert stays.moved[1, 2] > -0.01


def test_what_never_rests_is_reported(fast_engine):
    """A block without friction slides down a slope for ever."""
    slope = Plane((np.sin(0.3), 0.0, np.cos(0.3)), 0.0)
    block = box((0.0, 0.0, 0.06), (0.1, 0.1, 0.1), CELL / 2, stuff=FOAM)
    given = problem(block, cell=CELL, planes=[slope], gravity=DOWN)
    balance = rested(fast_engine, given, max_seconds=0.5)
    assert not balance.found
    assert balance.seconds == pytest.approx(0.5, abs=0.01)


def test_settling_goes_on_from_where_it_was_left_to_the_last_bit(fast_engine):
    given = column()
    posed = settling_problem(given, set())
    kept = []
    whole = DynamicRelaxation(fast_engine(posed), posed, set())
    first = whole.run(lambda time: kept.append(whole.saved()))
    for state in (kept[2], kept[-1]):
        again = DynamicRelaxation(fast_engine(posed), posed, set())
        again.restore(state)
        second = again.run(lambda time: None)
        assert second.seconds == first.seconds
        if not in_fixed_order():
            np.testing.assert_allclose(second.moved, first.moved, rtol=fast_engine.round_off)
            continue
        np.testing.assert_array_equal(second.moved, first.moved)
        for name, value in first.state.items():
            np.testing.assert_array_equal(second.state[name], value, err_msg=name)

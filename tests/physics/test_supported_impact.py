"""What is struck while it rests on something is held by it, if it swings quickly between both."""

from dataclasses import replace

import numpy as np
import pytest
from laws import squeezed
from laws.bodies import Stuff, ball, ball_surface, box, box_surface, floor, problem

from corporeal.mpm.physics import impact_support

RADIUS, SPEED = 0.05, 2.0
CELL = RADIUS / 4
SHEET = (0.3, 0.3, 1.5 * CELL)
LOW = np.array([0.13, 0.31, 0.0]) * CELL


@pytest.mark.slow
def test_a_rule_for_impacts_is_as_good_as_fine_springs():
    given = squeezed.cases()
    off = np.abs(squeezed.errors("held where it swings quickly", given))
    assert off.mean() < 0.015
    assert (off < 0.05).mean() > 0.93
    before = np.abs(squeezed.errors("in rounds", given))
    assert before.mean() > 0.2
    assert (before < 0.05).mean() < 0.5
    assert np.abs(squeezed.errors("always held, in series", given)).mean() > 2.0 * off.mean()


def sheet(mass, below=0.0):
    """Give a sheet that lies at a height, of this mass [kg]."""
    middle = (LOW[0], LOW[1], below + SHEET[2] / 2)
    return box(
        middle,
        SHEET,
        CELL / 2,
        stuff=Stuff(density=mass / np.prod(SHEET)),
        rigid=True,
        surface=box_surface(middle, SHEET, 9),
    )


def struck(engine, masses, restitution):
    """Drop a ball of 1 kg on sheets of these masses on a floor; the engine after the impact."""
    top = SHEET[2] * len(masses)
    at = (LOW[0] + 0.2 * CELL, LOW[1] + 0.1 * CELL, top + RADIUS + 0.5 * CELL)
    stuff = Stuff(density=1.0 / (4 / 3 * np.pi * RADIUS**3))
    above = ball(at, RADIUS, CELL / 2, stuff=stuff, rigid=True, velocity=(0, 0, -SPEED))
    sheets = [sheet(mass, k * SHEET[2]) for k, mass in enumerate(masses)]
    given = problem(above, *sheets, cell=CELL, friction=0.3, planes=[floor()])
    table = np.array(restitution, float)
    run = engine(replace(given, restitution=table))
    run.advance(0.6 * CELL / SPEED + 0.004)
    return run


def rises(run):
    measure = run.measure()
    return (measure.momentum / measure.mass[:, None])[:, 2] / SPEED


@pytest.mark.parametrize(
    ("patient_engine", "mass"),
    [
        *(("cpu", mass) for mass in (0.02, 0.3, 1.0, 30.0)),
        *(pytest.param(e, 1.0, marks=pytest.mark.slow) for e in ("reference", "cuda")),
    ],
    indirect=["patient_engine"],
)
def test_a_ball_rebounds_from_a_sheet_on_a_floor_as_springs_do(patient_engine, mass):
    e = [[0, 0.8, 0.8], [0.8, 0, 0.8], [0.8, 0.8, 0]]
    run = struck(patient_engine, [mass], e)
    # Wide and thin, it is pressed on the floor as a layer.
    wide = impact_support.equivalent_punch_radius(np.hypot(0.3 / np.sqrt(6.0), CELL), SHEET[2], CELL) / (2.0 * CELL)
    exact, _ = squeezed.in_springs(squeezed.Case(mass, wide, 0.8, 0.8))
    u = rises(run)
    assert u[0] == pytest.approx(exact, abs=0.03)
    measure = run.measure()
    given = measure.plane_impulse[0, :, 2].sum()
    assert given == pytest.approx(SPEED * (u[0] + mass * u[1] + 1.0), rel=1e-6)
    assert measure.kinetic.sum() <= 0.5 * SPEED**2


def test_what_is_thin_and_wide_is_pressed_as_a_layer():
    # A disc of radius a on a layer of thickness h: E pi a^2/h, over 2 E of a punch.
    assert impact_support.equivalent_punch_radius(0.05, 0.001, 0.0) == pytest.approx(np.pi * 0.05**2 / 0.001 / 2)
    assert impact_support.equivalent_punch_radius(0.05, 0.2, 0.0) == 0.05
    # One point of contact spreads over a cell, and is no layer.
    assert impact_support.equivalent_punch_radius(0.01, 1e-4, 0.01) == 0.01
    assert impact_support.equivalent_punch_radius(0.05, 0.0, 0.01) > 1e6


def test_light_sheets_on_one_another_are_squeezed_together(fast_engine):
    e = np.full((4, 4), 0.7)
    u = rises(struck(fast_engine, [0.5, 0.5], e))
    assert u[0] == pytest.approx(0.7, abs=0.01)
    assert np.abs(u[1:]).max() < 0.01


def test_what_the_floor_takes_is_lost_to_the_ball(fast_engine):
    """Springs in series: the layer below is some hundred times as stiff and takes as little."""
    dead = rises(struck(fast_engine, [1.0], [[0, 0.8, 0], [0.8, 0, 0], [0, 0, 0]]))[0]
    lively = rises(struck(fast_engine, [1.0], [[0, 0.8, 0], [0.8, 0, 0.8], [0, 0.8, 0]]))[0]
    assert lively == pytest.approx(0.8, abs=0.003)
    assert 0.8 * np.sqrt(50 / 51) < dead < 0.8 * np.sqrt(400 / 401)


def test_a_light_ball_on_a_heavy_one_is_no_support(fast_engine):
    """Two balls that are dropped on one another: the light one flies off, as in rounds."""
    balls = [
        ball(
            (LOW[0], LOW[1], z),
            radius,
            CELL / 2,
            stuff=Stuff(density=density),
            rigid=True,
            velocity=(0, 0, -SPEED),
            surface=ball_surface((LOW[0], LOW[1], z), radius, 2000),
        )
        for z, radius, density in ((0.055, 0.05, 1000.0), (0.155, 0.05, 100.0))
    ]
    given = problem(*balls, cell=CELL, restitution=1.0, planes=[floor()])
    run = fast_engine(given)
    run.advance(0.01)
    assert rises(run)[1] == pytest.approx(2.636, abs=0.05)


def test_engines_agree_about_what_is_held(patient_engine):
    e = [[0, 0, 0.8, 0], [0, 0, 0.5, 0.3], [0.8, 0.5, 0, 0], [0, 0.3, 0, 0]]
    assert rises(struck(patient_engine, [0.8, 0.4], e))[0] == pytest.approx(0.7948, abs=1e-3)

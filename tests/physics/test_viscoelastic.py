"""A soft ball rebounds as its loss factor says, whatever the grid: hereditary Hertz contact."""

import numpy as np
import pytest
from laws.bodies import Stuff, ball, box, problem

from corporeal.mpm.problem import FLOOR

RADIUS, SPEED, DENSITY, YOUNG_PA = 0.05, 2.0, 60.0, 60e3


def half_period(poisson):
    """Half of the slowest vibration's period [s]."""
    return 2 * RADIUS / np.sqrt(YOUNG_PA / (2 * (1 + poisson)) / DENSITY)


def rebound(engine, loss, poisson, cells):
    """Speed after the floor's push over that before it, for a foam ball without weight."""
    cell = 2 * RADIUS / cells
    stuff = Stuff(young_pa=YOUNG_PA, poisson=poisson, density=DENSITY, loss=loss)
    start, down = (0.0, 0.0, RADIUS + 0.6 * cell), (0.0, 0.0, -SPEED)
    thing = ball(start, RADIUS, cell / 2, stuff=stuff, velocity=down)
    run = engine(problem(thing, cell=cell, planes=(FLOOR,)))
    run.advance(5.0 * half_period(poisson))
    m = run.measure()
    assert m.viscous_loss >= 0.0
    return m.momentum[0, 2] / m.mass[0] / SPEED


@pytest.mark.parametrize(
    ("poisson", "loss", "theory"),
    [(0.1, 0.1, 0.872), (0.1, 0.3, 0.665), (0.1, 0.6, 0.450), (0.49, 0.1, 0.872), (0.49, 0.3, 0.665)],
)
def test_a_foam_ball_rebounds_as_hereditary_hertz_contact_says(fast_engine, poisson, loss, theory):
    """Lee and Radok (1960), integrated for a loss factor that is flat around the impact.

    The grid takes its own part, which the same ball without loss shows.
    """
    undamped = rebound(fast_engine, 0.0, poisson, 8)
    found = rebound(fast_engine, loss, poisson, 8)
    assert found == pytest.approx(theory * undamped, abs=0.045)
    assert found < undamped


def test_a_finer_grid_hardly_changes_a_damped_rebound(fast_engine):
    coarse, fine = (rebound(fast_engine, 0.3, 0.1, cells) for cells in (8, 16))
    assert abs(fine - coarse) < 0.05


def turns_after(engine, loss):
    """Time from the floor's first touch to where a foam ball turns [s]."""
    cell, step = RADIUS / 4, half_period(0.1) / 50
    stuff = Stuff(young_pa=YOUNG_PA, poisson=0.1, density=DENSITY, loss=loss)
    start, down = (0.0, 0.0, RADIUS + 0.6 * cell), (0.0, 0.0, -SPEED)
    thing = ball(start, RADIUS, cell / 2, stuff=stuff, velocity=down)
    run = engine(problem(thing, cell=cell, planes=(FLOOR,)))
    while run.measure().momentum[0, 2] < 0.0:
        run.advance(run.time + step)
    return run.time - float(np.nanmin(run.measure().first_contact))


def sag(engine, loss, side=0.1):
    """How far the middle of a foam cube sinks under twenty times its weight, at rest [m]."""
    stuff = Stuff(young_pa=YOUNG_PA, poisson=0.1, density=DENSITY, loss=loss)
    cube = box((0.0, 0.0, side / 2), (side,) * 3, side / 16, stuff=stuff)
    load = {"gravity": (0.0, 0.0, -200.0), "gravity_ramp": 0.1}
    run = engine(problem(cube, cell=side / 8, planes=(FLOOR,), **load))
    run.advance(0.3)
    return side / 2 - float(run.measure().centre[0, 2])


@pytest.mark.slow
def test_loss_stiffens_an_impact_and_no_load_that_rests(fast_engine):
    """Loss over a band is stiffening (causality): at .3 an impact meets 1/G∞ = 1.54 times E.

    Hertz: a ball turns after a time that goes as E to the power of -2/5.
    """
    stiffer = (turns_after(fast_engine, 0.0) / turns_after(fast_engine, 0.3)) ** 2.5
    assert stiffer == pytest.approx(1.5, abs=0.1)
    assert sag(fast_engine, 0.3) == pytest.approx(sag(fast_engine, 0.6), rel=2e-3)
    assert sag(fast_engine, 0.3) == pytest.approx(DENSITY * 200.0 * 0.1**2 / 3 / YOUNG_PA, rel=0.1)

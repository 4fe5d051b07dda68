"""A soft ball rebounds as its loss factor says, whatever the grid: hereditary Hertz contact."""

import numpy as np
import pytest
from laws.bodies import Stuff, ball, problem

from corporeal.mpm.problem import FLOOR

RADIUS, SPEED, DENSITY, YOUNG = 0.05, 2.0, 60.0, 60e3


def half_period(poisson):
    """Half of the slowest vibration's period [s]."""
    return 2 * RADIUS / np.sqrt(YOUNG / (2 * (1 + poisson)) / DENSITY)


def rebound(engine, loss, poisson, cells):
    """Speed after the floor's push over that before it, for a foam ball without weight."""
    cell = 2 * RADIUS / cells
    stuff = Stuff(young=YOUNG, poisson=poisson, density=DENSITY, loss=loss)
    start, down = (0.0, 0.0, RADIUS + 0.6 * cell), (0.0, 0.0, -SPEED)
    thing = ball(start, RADIUS, cell / 2, stuff=stuff, velocity=down)
    run = engine(problem(thing, cell=cell, planes=(FLOOR,)))
    run.advance(5.0 * half_period(poisson))
    m = run.measure()
    assert m.viscous_loss >= 0.0
    return m.momentum[0, 2] / m.mass[0] / SPEED


@pytest.mark.parametrize(
    ("poisson", "loss", "theory"),
    [
        (0.1, 0.1, 0.872),
        (0.1, 0.3, 0.665),
        (0.1, 0.6, 0.450),
        (0.49, 0.1, 0.872),
        (0.49, 0.3, 0.665),
    ],
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

"""A rigid ball on something soft rebounds as if it were dented, too, and lost its share."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from laws.bodies import Stuff, ball, box, problem

from corporeal.core.types import Law, Material
from corporeal.discretization.hertz_indentation import hertz_contact_time
from corporeal.discretization.impact_frequency import LOSS_BAND_MIDDLE_RATIO
from corporeal.discretization.pair_damping import pair_loss_factor_of_parts
from corporeal.discretization.part_geometry import ExpectedMotion, ImpactPartner
from corporeal.materials.loss_restitution import restitution_of_loss
from corporeal.mpm.problem import FLOOR

YOUNG_PA, DENSITY, POISSON, CELL = 60e3, 60.0, 0.2, 0.0125
SIDE, HEIGHT, RADIUS = 0.2, 0.1, 0.04
SPEED, BALL = 0.5, 2000.0
"""Slow and heavy, so that the inertia of the block takes little of the impact [m/s, kg/m³]."""
SOFT = Material("foam", Law.NEO_HOOKEAN, YOUNG_PA, POISSON, DENSITY, loss=0.3)


def series(soft, other):
    """Loss factor of two springs in series, of moduli E (1 + iη)/(1 - ν²)."""
    moduli = [m.young_pa * (1 + 1j * m.loss) / (1 - m.poisson**2) for m in (soft, other)]
    both = 1 / sum(1 / m for m in moduli)
    return both.imag / both.real


@cache
def falls_on(engine, loss):
    """Speed of a rigid ball after a block of foam threw it back, over that before; no weight."""
    mass = 4 / 3 * np.pi * RADIUS**3 * BALL
    lasts = hertz_contact_time(mass, RADIUS, SPEED, YOUNG_PA / (1 - POISSON**2), HEIGHT)
    foam = Stuff(young_pa=YOUNG_PA, poisson=POISSON, density=DENSITY, loss=loss)
    block = box((0.0, 0.0, HEIGHT / 2), (SIDE, SIDE, HEIGHT), CELL / 2, stuff=foam)
    block = replace(block, vibration=np.full(len(block.loss), np.pi / lasts / LOSS_BAND_MIDDLE_RATIO))
    start, down = (0.0, 0.0, HEIGHT + RADIUS + CELL / 10), (0.0, 0.0, -SPEED)
    hard = Stuff(density=BALL)
    thing = ball(start, RADIUS, CELL / 2, stuff=hard, velocity=down, rigid=True)
    run = engine(problem(thing, block, cell=CELL, planes=(FLOOR,)))
    run.advance(2.5 * lasts)
    m = run.measure()
    return m.momentum[0, 2] / m.mass[0] / SPEED


@pytest.mark.slow
@pytest.mark.parametrize(("ratio", "loss"), [(1 / 3, 0.6), (1.0, 0.6), (3.0, 0.6), (1.0, 0.1)])
def test_a_rigid_ball_loses_its_share_of_the_compliance(fast_engine, ratio, loss):
    """Whichever loses more: a composite of two lossy half-spaces, at three ratios of moduli."""
    rigid = Material("cork", Law.NEO_HOOKEAN, ratio * YOUNG_PA, 0.1, BALL, loss=loss)
    struck = pair_loss_factor_of_parts(SOFT, ExpectedMotion(SPEED, 0.0, partners=(ImpactPartner(rigid, 1.0),)))
    theory = series(SOFT, rigid)
    assert struck == pytest.approx(theory, rel=0.1)
    kept = falls_on(fast_engine, struck) / falls_on(fast_engine, 0.0)
    assert kept == pytest.approx(restitution_of_loss(theory), abs=0.03)
    # What deforms alone loses otherwise.
    assert abs(kept - restitution_of_loss(SOFT.loss)) > 0.05

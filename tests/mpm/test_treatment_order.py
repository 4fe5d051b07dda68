"""Materials answer in their order of stiffness; under the published cap, a control, they do not."""

import numpy as np
from laws.bodies import Stuff, ball, box, floor, problem

from corporeal.mpm.part import Motion, PartGeometry
from corporeal.mpm.treatment import plan
from corporeal.mpm.warp import WarpEngine
from corporeal.types import Law, Material, Structure

RUBBER = Material("rubber", Law.NEO_HOOKEAN, 20e6, 0.4999, 1100.0)
FOAM = Material("foam", Law.NEO_HOOKEAN, 5e6, 0.375, 30.0)
DIAMETER = 0.125


def pressed(stiffness):
    """How far a plate of .3 kg at .5 m/s presses a rubber and a foam ball together [m]."""
    size = (DIAMETER,) * 3
    parts = [
        PartGeometry(k, m, Structure("solid"), size, np.pi / 6 * DIAMETER**3, np.pi * DIAMETER**2)
        for k, m in enumerate((RUBBER, FOAM))
    ]
    found = plan(parts, [Motion(3.0, 9.81)] * 2, "draft", stiffness)
    cell, balls, plates = found.cell, [], []
    for k, t in enumerate(found.treatments):
        stuff = Stuff(young=t.young, poisson=t.poisson, density=t.density)
        place = (3.0 * k * DIAMETER, 0.0, DIAMETER / 2)
        balls.append(ball(place, DIAMETER / 2, cell / 2, stuff=stuff))
        wide = (DIAMETER, DIAMETER, 2 * cell)
        above = (3.0 * k * DIAMETER, 0.0, DIAMETER + cell)
        heavy = Stuff(density=0.3 / np.prod(wide))
        plates.append(box(above, wide, cell / 2, stuff=heavy, rigid=True, velocity=(0, 0, -0.5)))
    run = WarpEngine(problem(*balls, *plates, cell=cell, planes=[floor()]), threads=1)
    start, most = run.measure().centre[2:, 2], np.zeros(2)
    for _ in range(40):
        run.advance(run.time + 1e-3)
        most = np.maximum(most, start - run.measure().centre[2:, 2])
    return most


def test_under_the_published_cap_rubber_is_softer_than_foam_and_in_truth_it_is_not():
    rubber, foam = pressed("capped")
    assert rubber > 1.4 * foam
    rubber, foam = pressed("true")
    assert foam > 1.7 * rubber

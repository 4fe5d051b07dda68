"""Materials answer in their order of stiffness; under the published cap, a control, they do not."""

import numpy as np
import pytest
from laws.bodies import Stuff, ball, box, floor, problem

from corporeal.core.types import Law, Material, Structure
from corporeal.discretization.discretization_plan import plan_discretization
from corporeal.discretization.part_geometry import ExpectedMotion, PartGeometry
from corporeal.mpm.cpu.engine import CpuEngine

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
    found = plan_discretization(parts, [ExpectedMotion(3.0, 9.81)] * 2, "draft", stiffness)
    cell, balls, plates = found.cell, [], []
    for k, t in enumerate(found.treatments):
        stuff = Stuff(young_pa=t.simulated_young_pa, poisson=t.poisson, density=t.density)
        place = (3.0 * k * DIAMETER, 0.0, DIAMETER / 2)
        balls.append(ball(place, DIAMETER / 2, cell / 2, stuff=stuff))
        wide = (DIAMETER, DIAMETER, 2 * cell)
        above = (3.0 * k * DIAMETER, 0.0, DIAMETER + cell)
        heavy = Stuff(density=0.3 / np.prod(wide))
        plates.append(box(above, wide, cell / 2, stuff=heavy, rigid=True, velocity=(0, 0, -0.5)))
    run = CpuEngine(problem(*balls, *plates, cell=cell, planes=[floor()]), threads=1)
    start, most = run.measure().centre[2:, 2], np.zeros(2)
    for _ in range(40):
        run.advance(run.time + 1e-3)
        most = np.maximum(most, start - run.measure().centre[2:, 2])
    return most


@pytest.mark.slow
def test_under_the_published_cap_rubber_is_softer_than_foam_and_in_truth_it_is_not():
    rubber, foam = pressed("capped")
    assert rubber > 1.4 * foam
    rubber, foam = pressed("true")
    assert foam > 1.7 * rubber


# ---------------------------------------------------------------- balls on foam

RADIUS, THICK, SOFT = 0.04, 0.1, 2.5e5


def dent_expected(mass, speed, young_pa):
    """Deepest dent [m] of a ball in a foam layer on the floor, from the energy of its fall.

    F = 4/3 E* √(R δ³) (1 + .884 χ + .781 χ² + .386 χ³), χ = √(R δ)/h (Hertz; a layer that is not
    bonded: Dimitriadis et al. 2002), and ½ m v² = ∫ F dδ.
    """
    hardness = 1.0 / ((1 - 0.35**2) / SOFT + (1 - 0.49**2) / young_pa)
    depth = np.linspace(0.0, RADIUS, 4001)
    chi = np.sqrt(RADIUS * depth) / THICK
    layer = 1.0 + 0.884 * chi + 0.781 * chi**2 + 0.386 * chi**3
    force = 4 / 3 * hardness * np.sqrt(RADIUS * depth**3) * layer
    work = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(depth))])
    return float(np.interp(0.5 * mass * speed**2, work, depth))


def dented(density, young_pa, speed=1.2):
    """Dent of a ball [m], and that over the expected one; stiffer than 1 GPa: rigid."""
    cell, rigid = 0.01, young_pa > 1e9
    foam = Stuff(young_pa=SOFT, poisson=0.35, density=30.0)
    block = box((0.0, 0.0, THICK / 2), (0.2, 0.2, THICK), cell / 2, stuff=foam)
    stuff = Stuff(young_pa=young_pa, poisson=0.49, density=density)
    place = (0.0, 0.0, THICK + RADIUS)
    thing = ball(place, RADIUS, cell / 2, stuff=stuff, velocity=(0, 0, -speed), rigid=rigid)
    run = CpuEngine(problem(block, thing, cell=cell, planes=[floor()]), threads=1)
    mass, start, deepest = run.measure().mass[1], run.measure().centre[1, 2], 0.0
    expected = dent_expected(mass, speed, young_pa)
    while run.time < 2.5 * expected / speed:
        run.advance(run.time + 0.1 * expected / speed)
        deepest = max(deepest, start - run.measure().centre[1, 2])
    return deepest, deepest / expected


@pytest.mark.slow
def test_steel_and_rubber_balls_dent_foam_as_their_masses_and_moduli_say():
    steel, rubber = dented(7850.0, 2e11), dented(1100.0, 5e6)
    assert steel[1] == pytest.approx(1.0, abs=0.15)
    assert rubber[1] == pytest.approx(1.0, abs=0.15)
    assert steel[0] / rubber[0] == pytest.approx((7850 / 1100) ** 0.4, rel=0.1)

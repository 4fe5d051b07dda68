"""Bodies that stand still, and what holds them up."""

import numpy as np
import pytest
from laws.bodies import Stuff, box, box_surface, floor, problem
from laws.fluids import WATER, Tank, level, moved

from corporeal.core.types import Law
from corporeal.mpm.problem import Plane

G = 9.81
CELL = 0.025
DOWN = (0.0, 0.0, -G)
CENTRE, SIZE = (0.103, 0.052, 0.05), (0.1, 0.1, 0.1)


@pytest.mark.parametrize("rigid", [False, True])
def test_a_block_at_rest_on_the_floor_stays(patient_engine, rigid):
    stuff = Stuff(young_pa=2e5, loss=1.0)
    surface = box_surface(CENTRE, SIZE) if rigid else None
    block = box(CENTRE, SIZE, CELL / 2, stuff=stuff, rigid=rigid, surface=surface)
    run = patient_engine(problem(block, cell=CELL, friction=0.5, planes=[floor()], gravity=DOWN, gravity_ramp=0.05))
    run.advance(0.15)
    m = run.measure()
    moved = (m.centre[0] - CENTRE) / CELL
    assert np.abs(moved[:2]).max() < 0.0025
    assert abs(moved[2]) < 0.03
    assert m.kinetic[0] < 1e-5 * m.mass[0]
    weight = m.mass[0] * G * (0.15 - 0.025)
    assert m.plane_impulse[0, 0, 2] == pytest.approx(weight, rel=0.015)
    assert m.external_impulse[0, 2] == pytest.approx(-weight, rel=1e-4)


def test_a_stack_of_two_stands(patient_engine):
    low = box(CENTRE, SIZE, CELL / 2, stuff=Stuff(young_pa=2e5, loss=1.0))
    high = box(np.add(CENTRE, (0, 0, 0.1)), SIZE, CELL / 2, stuff=Stuff(young_pa=2e5, loss=1.0))
    run = patient_engine(problem(low, high, cell=CELL, friction=0.5, planes=[floor()], gravity=DOWN, gravity_ramp=0.05))
    run.advance(0.15)
    m = run.measure()
    moved = (m.centre - np.array([CENTRE, np.add(CENTRE, (0, 0, 0.1))])) / CELL
    assert np.abs(moved[:, :2]).max() < 0.012
    assert np.abs(moved[:, 2]).max() < 0.1
    carried = m.plane_impulse[0, 0, 2]
    assert carried == pytest.approx(m.mass.sum() * G * 0.125, rel=0.03)
    assert m.plane_impulse[0, 1, 2] == 0.0


def test_a_rigid_stack_stands(patient_engine):
    tops = [np.add(CENTRE, (0, 0, 0.1 * k)) for k in range(2)]
    blocks = [box(c, SIZE, CELL / 2, rigid=True, surface=box_surface(c, SIZE)) for c in tops]
    run = patient_engine(problem(*blocks, cell=CELL, friction=0.5, planes=[floor()], gravity=DOWN))
    run.advance(0.3)
    moved = (run.measure().centre - tops) / CELL
    assert np.abs(moved[:, :2]).max() < 0.1
    assert np.abs(moved[:, 2]).max() < 0.1


@pytest.mark.parametrize("law", [Law.COROTATED, Law.NEO_HOOKEAN, Law.HENCKY])
def test_every_elastic_law_is_hookes_where_strains_are_small(patient_engine, law):
    """The top sinks by ρ g L² / 2 (λ + 2μ); smooth walls keep the sides."""
    length, width, cell = 0.2, 0.04, 0.02
    stuff = Stuff(law=law, young_pa=2e5, poisson=0.3, loss=0.5)
    column = box((width / 2, width / 2, length / 2), (width, width, length), cell / 2, stuff=stuff)
    walls = [
        floor(),
        Plane((1.0, 0.0, 0.0), 0.0),
        Plane((-1.0, 0.0, 0.0), -width),
        Plane((0.0, 1.0, 0.0), 0.0),
        Plane((0.0, -1.0, 0.0), -width),
    ]
    run = patient_engine(problem(column, cell=cell, planes=walls, gravity=DOWN, gravity_ramp=0.03))
    top = run.snapshot().position[:, 2] > length - cell / 2
    rest = run.snapshot().position[top, 2].mean()
    foot = run.snapshot().position[:, 2] < cell / 2
    start = run.snapshot().position[foot, 2].mean()
    run.advance(0.15)
    now = run.snapshot().position
    shortened = (rest - start) - (now[top, 2].mean() - now[foot, 2].mean())
    modulus = 2e5 * 0.7 / (1.3 * 0.4)
    between = 1000 * G / modulus * (length * (rest - start) - (rest**2 - start**2) / 2)
    assert shortened == pytest.approx(between, rel=0.03)


def test_a_wall_holds_whichever_way_it_faces(patient_engine):
    """The same rest on a wall that faces sideways, with gravity turned along."""
    wall = Plane((1.0, 0.0, 0.0), 0.0)
    centre = (0.05, 0.103, 0.052)
    block = box(centre, SIZE, CELL / 2, stuff=Stuff(young_pa=2e5, loss=1.0))
    run = patient_engine(
        problem(block, cell=CELL, friction=0.5, planes=[wall], gravity=(-G, 0.0, 0.0), gravity_ramp=0.05)
    )
    run.advance(0.12)
    m = run.measure()
    assert m.plane_impulse[0, 0, 0] == pytest.approx(m.mass[0] * G * 0.095, rel=0.03)
    assert np.abs((m.centre[0] - centre) / CELL).max() < 0.05


@pytest.mark.slow
def test_blocks_and_stacks_of_five_stay_and_the_floor_carries_them(holds):
    holds("11", quick=False)


@pytest.mark.slow
@pytest.mark.parametrize("walls_off", [0.0, 1.0])
def test_water_stands_as_high_wherever_planes_lie_on_the_grid(fast_engine, walls_off):
    """Six cells deep, the floor or the walls at ten places between nodes; level within 1 %."""
    tank = Tank(WATER, 0.2, 0.1, 6, np.sqrt(G * 0.1), ramp=0.5)
    for off in np.arange(10) / 10 * tank.cell:
        sideways, up = off * walls_off, off * (1.0 - walls_off)
        run = fast_engine(moved(tank.posed(), np.array([sideways, 0.0, up])))
        run.advance(0.8)
        assert level(run, tank) - up == pytest.approx(tank.height, rel=0.01)


@pytest.mark.parametrize("rigid", [False, True])
def test_a_block_lies_as_high_wherever_the_floor_is_on_the_grid(fast_engine, rigid):
    """Ten places between nodes; a soft block's foot sinks by no more than its strain over ¾ dx."""
    stuff = Stuff(young_pa=2e5, loss=1.0)
    strain = 1000.0 * G * SIZE[2] / stuff.young_pa
    for off in np.arange(10) / 10 * CELL:
        centre = np.add(CENTRE, (0.0, 0.0, off))
        surface = box_surface(tuple(centre), SIZE) if rigid else None
        block = box(centre, SIZE, CELL / 2, stuff=stuff, rigid=rigid, surface=surface)
        run = fast_engine(problem(block, cell=CELL, friction=0.5, planes=[floor(off)], gravity=DOWN, gravity_ramp=0.05))
        foot = run.snapshot().position[:, 2] < off + CELL / 2
        start = run.snapshot().position[foot, 2].mean()
        run.advance(0.3)
        sunk = (start - run.snapshot().position[foot, 2].mean()) / CELL
        # The foot's particles lie a quarter of a cell up: by Hooke a quarter of the strain.
        assert -1e-3 < sunk < (1e-3 if rigid else strain * 1.25)

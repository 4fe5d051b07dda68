"""How different kinds of matter take an impact."""

from dataclasses import replace

import numpy as np
import pytest
from laws import grains
from laws.bodies import Stuff, ball, box, cylinder, cylinder_sdf, floor, problem

from corporeal.core.types import Law

G = 9.81
DOWN = (0.0, 0.0, -G)
CELL = 0.02
SIDE = 0.04


def thrown_down(engine, stuff, speed, until, friction=0.3):
    """A cube that hits the floor: first and last measure, and the largest booked energy."""
    cube = box((0.003, 0.0, 0.021), (SIDE,) * 3, CELL / 2, stuff=stuff, velocity=(0, 0, -speed))
    run = engine(problem(cube, cell=CELL, friction=friction, planes=[floor()], gravity=DOWN))
    before, booked = run.measure(), []
    for time in np.linspace(until / 8, until, 8):
        run.advance(time)
        m = run.measure()
        losses = m.friction_loss + m.plastic_loss + m.viscous_loss
        booked.append(m.kinetic.sum() + m.elastic.sum() + m.potential.sum() + losses)
    return run, before, run.measure(), max(booked)


@pytest.mark.parametrize("law", [Law.DRUCKER_PRAGER, Law.VON_MISES])
def test_what_yields_pays_for_it_and_no_more(engine, law):
    """Energy left plus energy lost never exceeds what there was, however coarse the steps."""
    stuff = Stuff(law=law, yield_stress=500.0)
    _, before, after, booked = thrown_down(engine, stuff, 2.0, 0.03)
    start = before.kinetic.sum() + before.potential.sum()
    assert after.plastic_loss > 0.1 * start
    assert booked <= 1.01 * start


def test_metal_hit_softly_springs_back_and_hit_hard_keeps_a_dent(engine):
    """It yields first where the speed passes σ_y / (ρ c)."""
    metal = Stuff(law=Law.VON_MISES, young_pa=1e6, density=1000.0, yield_stress=1.5e4)
    soft, _, _, _ = thrown_down(engine, metal, 0.1, 0.03)
    hard, _, _, _ = thrown_down(engine, metal, 3.0, 0.03)
    assert soft.snapshot().plastic_strain.max() == 0.0
    assert hard.snapshot().plastic_strain.max() > 0.02


def test_hardening_metal_deforms_less(engine):
    plain = Stuff(law=Law.VON_MISES, yield_stress=1e3)
    tough = Stuff(law=Law.VON_MISES, yield_stress=1e3, hardening=1e5)
    strain = [thrown_down(engine, stuff, 2.0, 0.02)[0].snapshot().plastic_strain.mean() for stuff in (plain, tough)]
    assert strain[1] < 0.7 * strain[0]


def test_lossy_matter_bounces_less(engine):
    rebound = []
    for loss in (0.0, 0.3):
        _, _, after, _ = thrown_down(engine, Stuff(loss=loss), 1.0, 0.02)
        rebound.append(after.momentum[0, 2] / after.mass[0])
        assert (after.viscous_loss > 0) == (loss > 0)
    assert 0 < rebound[1] < 0.9 * rebound[0]


def test_plastic_flow_keeps_the_volume_of_metal(engine):
    metal = Stuff(law=Law.VON_MISES, yield_stress=500.0)
    run, _, _, _ = thrown_down(engine, metal, 2.0, 0.03)
    s = run.snapshot()
    assert s.plastic_strain.mean() > 0.05
    J_all, J_elastic = np.linalg.det(s.motion), np.linalg.det(s.deformation)
    assert np.abs(J_all - J_elastic).max() < 1e-3


def test_cohesion_keeps_a_column_standing_that_sand_would_let_slump(fast_engine):
    cell, radius = 0.02, 0.06
    heights = []
    for cohesion in (0.0, 2000.0):
        soil = Stuff(
            law=Law.DRUCKER_PRAGER, young_pa=2e5, density=1500.0, friction_angle=np.radians(25.0), cohesion=cohesion
        )
        column = cylinder((0.003, 0.002, 0.06), radius, 0.12, cell / 2, stuff=soil)
        run = fast_engine(problem(column, cell=cell, friction=0.6, planes=[floor()], gravity=DOWN))
        run.advance(0.4)
        heights.append(np.percentile(run.snapshot().position[:, 2], 99))
    assert heights[0] < 0.085
    assert heights[1] > 0.105


def test_a_ball_dents_mud_and_the_dent_stays(fast_engine):
    cell = 0.02
    mud = Stuff(law=Law.VON_MISES, young_pa=2e5, poisson=0.4, density=1600.0, yield_stress=2e3)
    bed = box((0.003, 0.002, 0.04), (0.24, 0.24, 0.08), cell / 2, stuff=mud)
    stone = ball(
        (0.003, 0.002, 0.145), 0.04, cell / 2, stuff=Stuff(density=2500.0), rigid=True, velocity=(0.0, 0.0, -2.0)
    )
    run = fast_engine(problem(bed, stone, cell=cell, friction=0.5, planes=[floor()], gravity=DOWN))
    count = len(bed.position)
    top = run.snapshot().position[:count, 2] > 0.08 - cell / 2
    near = np.hypot(*(run.snapshot().position[:count, :2] - (0.003, 0.002)).T) < 0.02
    run.advance(0.25)
    first = run.snapshot().position[:count][top & near, 2].mean()
    run.advance(0.4)
    last = run.snapshot().position[:count][top & near, 2].mean()
    assert last < 0.075 - 0.3 * cell
    assert last == pytest.approx(first, abs=0.1 * cell)
    assert run.snapshot().plastic_strain[:count].max() > 0.1


@pytest.mark.slow
def test_how_far_sand_runs_out_does_not_depend_on_how_stiff_its_grains_are():
    """Heaps of stiff grains once came out shorter: they took more steps, each with its loss."""
    cell, far = grains.RADIUS / 5, []
    whole = cylinder_sdf((0.0, 0.0, grains.RADIUS / 2), grains.RADIUS, grains.RADIUS)
    for young_pa in (1e6, 2e7):
        sand = grains.quarter(whole, 1.5 * grains.RADIUS, cell / 2, np.pi * grains.RADIUS**3)
        sand = replace(sand, young_pa=np.full(len(sand.volume), young_pa))
        given = grains.on_rough_floor(sand, cell)
        far.append(grains.settled(given, grains.RADIUS, 0.6).farthest)
    assert far[1] == pytest.approx(far[0], rel=0.03)


@pytest.mark.slow
def test_a_column_of_sand_runs_out_as_lube_measured_and_stops():
    heap = grains.sand_column(8)
    assert heap.spread == pytest.approx(grains.LUBE, rel=0.15)
    assert heap.speed < 0.01


@pytest.mark.slow
def test_sand_heaps_up_to_its_friction_angle(holds):
    holds("16", quick=True)


@pytest.mark.slow
def test_a_copper_bar_mushrooms_on_a_wall_as_taylors(holds):
    holds("15", quick=False)

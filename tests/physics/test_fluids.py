"""Liquids and pastes that flow: films, spreading columns, pastes that stop, a broken dam."""

import numpy as np
import pytest
from laws.bodies import DOWN, Stuff, box, floor, problem
from laws.fluids import (
    WATER,
    Liquid,
    Tank,
    dam_break,
    film_on_a_slope,
    moved,
    resting_level,
    spreading_column,
    stopped_paste,
)

from corporeal.core.types import Law
from corporeal.mpm.physics.liquid_stiffness import bulk_modulus, elastic_moduli
from corporeal.mpm.reference.engine import ReferenceEngine

G = 9.81


@pytest.mark.slow
def test_a_film_of_honey_runs_down_a_slope_as_a_parabola(fast_engine):
    assert film_on_a_slope(10.0, cells=6) < 0.08


@pytest.mark.slow
def test_a_column_of_honey_spreads_as_huppert_says():
    """x_N = 1.411 (g q³ t/3ν)^⅕."""
    errors = spreading_column(10.0, 16, (1.0, 2.0))
    assert np.abs(errors).max() < 0.06


@pytest.mark.slow
def test_a_paste_stops_where_its_yield_stress_holds_it():
    """Within 1 % here: the layer's own yield stress holds it back too (``stopped_length``)."""
    error, speed = stopped_paste(40.0, 16, 2.0)
    assert abs(error) < 0.1
    assert speed < 1e-3
    assert stopped_paste(1e-3, 8, 0.5)[1] > 0.01


@pytest.mark.slow
def test_the_front_of_a_broken_dam_runs_as_it_was_measured():
    assert np.abs(dam_break(6)).max() < 0.25


def test_water_at_rest_stands_as_high_as_it_was_poured():
    assert abs(resting_level(8)) < 0.03


@pytest.mark.parametrize("viscosity", [1e-3, 1.0, 1e3])
def test_the_step_does_not_see_the_viscosity(engine, viscosity):
    """Explicit viscosity would need steps of ρ dx²/4η: a millionth of those of water here."""
    steps = []
    for consistency in (1e-3, viscosity):
        tank = Tank(Liquid(1000.0, consistency), 0.05, 0.05, 4, 1.0)
        steps.append(engine(tank.posed()).stable_step())
    assert steps[0] == steps[1]


@pytest.mark.slow
@pytest.mark.parametrize(("yield_shear", "index"), [(0.0, 1.0), (20.0, 1.0), (10.0, 0.5)])
def test_engines_agree_on_how_a_liquid_flows(engine, yield_shear, index):
    """A lump that spins apart: what it loses is the reference's, momentum stays."""
    young_pa, poisson = elastic_moduli(bulk_modulus(1000.0, 1.0))
    stuff = Stuff(
        law=Law.FLUID,
        young_pa=young_pa,
        poisson=poisson,
        yield_stress=np.sqrt(3.0) * yield_shear,
        consistency=2.0,
        flow_index=index,
    )
    lump = box((0.003, 0.002, 0.0), (0.05,) * 3, 0.00625, stuff=stuff, spin=(0.0, 0.0, 8.0))
    run, exact = (build(problem(lump, cell=0.0125)) for build in (engine, ReferenceEngine))
    before = run.measure()
    for one in (run, exact):
        one.advance(0.05)
    after, other = run.measure(), exact.measure()
    assert np.abs(after.momentum - before.momentum).max() < 1e-6
    assert after.kinetic == pytest.approx(other.kinetic, rel=1e-3)
    assert after.elastic == pytest.approx(other.elastic, rel=1e-2)
    assert after.plastic_loss == pytest.approx(other.plastic_loss, rel=1e-2)
    lost = before.kinetic.sum() - after.kinetic.sum() - after.elastic.sum()
    assert 0.0 < after.plastic_loss < lost
    assert run.snapshot().motion == pytest.approx(exact.snapshot().motion, abs=1e-3)


def test_water_is_not_a_solid(fast_engine):
    """Control: the same lump as a jelly of the same waves stands; water does not."""
    fallen = {}
    for name in ("water", "jelly"):
        tank = Tank(WATER, 0.05, 0.05, 6, 1.0, room=0.2)
        posed = tank.posed()
        if name == "jelly":
            posed.bodies[0].law[:] = Law.NEO_HOOKEAN.value
        run = fast_engine(posed)
        run.advance(0.3)
        fallen[name] = 0.025 - run.measure().centre[0, 2]
    assert fallen["water"] > 0.012
    assert fallen["jelly"] < 0.004


def falling_sheet(place, *, cell=0.008):
    """Water one particle thick that slides at .8 m/s and falls onto a floor; place in cells."""
    young_pa, poisson = elastic_moduli(bulk_modulus(1000.0, 0.8))
    stuff = Stuff(law=Law.FLUID, young_pa=young_pa, poisson=poisson, yield_stress=0.0, consistency=1e-3, flow_index=1.0)
    size = (8 * cell, 8 * cell, 0.5 * cell)
    middle = (0.0, 0.0, (place + 1.75) * cell)
    sheet = box(middle, size, 0.5 * cell, stuff=stuff, velocity=(0.8, 0.0, 0.0))
    return problem(sheet, cell=cell, friction=0.11, planes=[floor(place * cell)], gravity=DOWN)


@pytest.mark.parametrize("place", [0.0, 0.35, 0.7])
def test_a_sheet_of_water_lies_on_the_floor_and_is_braked(fast_engine, place):
    """It used to hover at the highest node within 1.5 cells, where nothing brakes."""
    given = falling_sheet(place)
    run = fast_engine(given)
    run.advance(0.4)
    seen = run.measure()
    assert seen.centre[0, 2] / given.cell - place < 0.51
    speed = seen.momentum[0, 0] / seen.mass[0]
    # μ g t from the moment that it lands, √(2 h/g) after it began to fall.
    least = 0.8 - 0.11 * G * 0.4
    assert least - 0.02 < speed < least + 0.11 * G * 0.06


@pytest.mark.slow
@pytest.mark.parametrize("name", ["reference", "cuda"])
def test_engines_agree_on_a_sheet_that_lands(engines, name):
    given = falling_sheet(0.35)
    run, exact = engines(name)(given), engines("cpu")(given)
    for one in (run, exact):
        one.advance(0.08)
    assert run.measure().centre == pytest.approx(exact.measure().centre, abs=0.02 * given.cell)
    assert run.measure().momentum == pytest.approx(exact.measure().momentum, rel=0.02, abs=2e-5)


@pytest.mark.parametrize("name", ["reference", "cuda"])
def test_engines_agree_on_water_between_walls_that_lie_off_nodes(engines, name):
    tank = Tank(WATER, 0.05, 0.05, 4, 0.7)
    given = moved(tank.posed(), tank.cell * np.array([0.4, 0.3, 0.35]))
    run, exact = engines(name)(given), engines("cpu")(given)
    for one in (run, exact):
        one.advance(0.005)
    assert run.snapshot().position == pytest.approx(exact.snapshot().position, abs=2e-7)
    assert run.measure().plane_impulse == pytest.approx(exact.measure().plane_impulse, rel=2e-3, abs=1e-6)

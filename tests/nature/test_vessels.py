"""Water stands in a glass whose wall is thinner than a cell as high as it was poured."""

import pytest
from laws.vessels import Tumbler, level_error, outside


@pytest.mark.parametrize("wall", [0.003, 0.0005])
def test_water_stands_in_a_glass_as_high_as_it_was_poured(fast_engine, wall):
    """Eight cells across, and walls of .38 and .06 cells."""
    glass = Tumbler(0.008, wall=wall)
    run = fast_engine(glass.posed())
    run.advance(0.12)
    assert abs(level_error(run, glass)) < 0.03
    assert outside(run, glass) < 0.005


def test_a_wall_that_does_not_fall_on_nodes_holds_it_too(fast_engine):
    glass = Tumbler(0.0085)
    run = fast_engine(glass.posed())
    run.advance(0.12)
    assert abs(level_error(run, glass)) < 0.03


def test_without_its_true_surface_water_sinks_into_the_glass(fast_engine):
    """Control: half spaces meet where a wall is taken for one, a third of a cell inside of it."""
    glass = Tumbler(0.008, wetted=False)
    run = fast_engine(glass.posed())
    run.advance(0.12)
    assert level_error(run, glass) < -0.04


@pytest.mark.parametrize("name", ["reference", "cpu", "cuda"])
def test_engines_agree_on_where_water_touches_glass(engines, name):
    glass = Tumbler(0.014)
    run, exact = (engines(kind)(glass.posed()) for kind in (name, "cpu"))
    for one in (run, exact):
        one.advance(0.003)
    assert run.snapshot().position == pytest.approx(exact.snapshot().position, abs=2e-7)
    assert run.measure().pair_impulse == pytest.approx(exact.measure().pair_impulse, rel=1e-3)

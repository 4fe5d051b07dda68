"""What a ball loses by its own vibrations is not lost in its matter as well."""

from dataclasses import replace

import pytest

import corporeal as co
from corporeal.discretization.impact_vibration import MAX_IMPACT_NUMBER, VIBRATION_LOSS_COEFFICIENT, vibration_loss
from corporeal.lab.evaluation.drop_test import drop_scene, simulate_drop
from corporeal.lab.evaluation.rebound_data import measured_rebounds
from corporeal.materials.loss_restitution import restitution_of_loss
from corporeal.pipeline.run_pipeline import Settings

DRAFT = Settings()


def row(name):
    return next(r for r in measured_rebounds() if r.name == name)


def prepared(name):
    return co.prepare_scene(drop_scene(row(name)))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["red tennis ball", "racquetball"])
def test_a_ball_full_of_air_rebounds_as_stated_however_deep_it_is_dented(name):
    """Both are dented by half of their radius: the loss of their matter alone was 0.04 too much."""
    inner = prepared(name).field.structures[0].contents
    assert inner is not None
    told = inner.restitution if name.startswith("red") else 0.87
    assert simulate_drop(row(name), DRAFT).restitution == pytest.approx(told, abs=0.015)


def test_a_ball_that_steps_have_softened_loses_no_more_than_a_stiff_one():
    """As soft as at draft it is dented more deeply than in life, and rang for it."""
    softened = prepared("bouncy ball").particles.treatments[0]
    speed = row("bouncy ball").speed
    beyond = vibration_loss(softened.density, speed, softened.simulated_young_pa)
    beyond -= vibration_loss(softened.density, speed, softened.young_pa)
    assert beyond > 0.01
    assert softened.loss == pytest.approx(0.15 - 3.2 / 64 - beyond, abs=1e-3)
    assert "simulated vibrations" in softened.reason
    assert simulate_drop(row("bouncy ball"), DRAFT).restitution == pytest.approx(restitution_of_loss(0.15), abs=0.015)


@pytest.mark.parametrize("name", ["ball of plasticine", "tennis ball on carpet", "ball of seat foam"])
def test_what_yields_falls_on_something_soft_or_is_as_stiff_as_in_life_keeps_its_loss(name):
    assert "vibrations" not in prepared(name).particles.treatments[0].reason


def test_harder_impacts_than_were_measured_count_as_the_hardest():
    assert vibration_loss(1000.0, 100.0, 1e6) == VIBRATION_LOSS_COEFFICIENT * MAX_IMPACT_NUMBER


@pytest.mark.parametrize("name", ["squash ball", "racquetball"])
def test_a_thick_wall_is_planned_as_heavy_as_it_is(name):
    """Its inside is smaller than its outside: A t is a third too much of a squash ball's."""
    particles = prepared(name).particles
    density = particles.mass.sum() / particles.volume.sum()
    assert particles.treatments[0].density == pytest.approx(density, rel=0.01)


def test_no_loss_factor_falls_below_zero():
    quick = replace(row("racquetball"), speed=20.0)
    assert co.prepare_scene(drop_scene(quick)).particles.treatments[0].loss == 0.0

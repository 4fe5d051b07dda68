"""Sound in solids: cases 3 and 5 of the validation suite."""

import pytest
from laws import waves

from corporeal.mpm.reference.engine import ReferenceEngine


def test_a_free_bar_rings_with_the_period_of_its_sound(holds):
    holds("3", quick=True)


@pytest.mark.slow
def test_the_reference_rings_alike():
    found = waves.ringing_bar(20, 3, ReferenceEngine)
    assert found.period == pytest.approx(2 / waves.SOUND, rel=0.012)
    assert 0.9 < found.energy <= 1.001


@pytest.mark.slow
def test_a_finer_bar_rings_truer_and_longer(holds):
    holds("3", quick=False)
    coarse, fine = waves.ringing_bar(20, 5), waves.ringing_bar(40, 5)
    dull = waves.ringing_bar(40, 5, transfer="apic")
    assert abs(fine.period * waves.SOUND / 2 - 1) < 0.5 * abs(coarse.period * waves.SOUND / 2 - 1)
    assert dull.energy < fine.energy <= 1.001


def test_equal_bars_exchange_their_velocities_and_one_field_lets_them_stick():
    found = waves.meeting_bars(20, 0.13)
    assert found.restitution > 0.8
    assert found.contact_time == pytest.approx(1 / waves.SOUND, rel=0.1)
    assert waves.meeting_bars(20, 0.13, contact="single").restitution < 0.5


@pytest.mark.slow
def test_equal_bars_rebound_wherever_they_lie_on_the_grid(holds):
    holds("5", quick=False)

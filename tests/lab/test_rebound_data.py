"""Published rebounds: every row can be dropped, and has a source."""

from dataclasses import replace
from math import pi, sqrt

import pytest
from life import contradictory_rebounds

from corporeal.core.errors import BadFileError
from corporeal.lab.evaluation.rebound_data import measured_rebounds, rebound_sources
from corporeal.materials import find_material


def test_every_row_has_a_source_and_every_source_a_row():
    rows = measured_rebounds()
    assert {row.source for row in rows} == set(rebound_sources())
    assert len({row.name for row in rows}) == len(rows) >= 25
    for row in rows:
        assert row.diameter > 0.005
        assert row.speed > 0.0
        for name in (row.material, row.floor, row.on and row.on.material):
            assert name is None or find_material(name)


def test_off_is_the_distance_from_the_range():
    row = replace(measured_rebounds()[0], low=0.7, high=0.8)
    assert [row.off(e) for e in (0.6, 0.7, 0.75, 0.8, 0.85)] == pytest.approx([0.1, 0, 0, 0, 0.05])


def test_rows_that_measured_the_same_and_cannot_both_be_met_are_found():
    """Three groups of one class dropped the same ball on the same cardboard."""
    (rows,) = contradictory_rebounds(measured_rebounds(), 0.03)
    assert len(rows) == 3 and all("cardboard" in row.name for row in rows)
    assert not list(contradictory_rebounds(measured_rebounds(), 0.07)), "a value is within .07 of all three"
    other = replace(rows[0], speed=1.1 * rows[0].speed)
    with pytest.raises(BadFileError, match="its rows differ"):
        list(contradictory_rebounds([other, *rows[1:]], 0.03))


def fallen(height, mass, diameter, sign=1.0):
    """Speed after a fall through air [m/s] (sign -1: with which it rises so high), by steps."""
    share, steps = 0.5 * 1.2 * 0.47 * pi / 4 * diameter**2 / mass, 20_000
    square = 0.0
    for _ in range(steps):
        square += 2 * (9.81 - sign * share * square) * height / steps
    return sqrt(square)


def test_heights_become_speeds_with_the_drag_of_air_on_both_ways():
    """A table tennis ball that comes back to 24 of 30.5 cm has lost some of that to air."""
    (row,) = (r for r in measured_rebounds() if r.name == "table tennis ball")
    assert row.speed == pytest.approx(fallen(0.305, 2.7e-3, 0.04), rel=1e-3)
    assert row.low == pytest.approx(fallen(0.24, 2.7e-3, 0.04, -1.0) / row.speed, rel=1e-3)
    assert row.low > sqrt(0.24 / 0.305) + 0.02


def test_where_no_mass_is_given_air_counts_for_nothing():
    (row,) = (r for r in measured_rebounds() if r.name == "golf ball")
    assert row.speed == pytest.approx(sqrt(2 * 9.81 * 1.0))
    assert (row.low, row.high) == (0.80, 0.87)

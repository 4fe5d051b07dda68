"""Published rebounds: every row can be dropped, and has a source."""

from dataclasses import replace
from math import pi, sqrt

import pytest

from corporeal.evaluation.life import rebounds, sources
from corporeal.materials import find


def test_every_row_has_a_source_and_every_source_a_row():
    rows = rebounds()
    assert {row.source for row in rows} == set(sources())
    assert len({row.name for row in rows}) == len(rows) >= 25
    for row in rows:
        assert row.diameter > 0.005
        assert row.speed > 0.0
        for name in (row.material, row.floor, row.on and row.on.material):
            assert name is None or find(name)


def test_off_is_the_distance_from_the_range():
    row = replace(rebounds()[0], low=0.7, high=0.8)
    assert [row.off(e) for e in (0.6, 0.7, 0.75, 0.8, 0.85)] == pytest.approx([0.1, 0, 0, 0, 0.05])


def fallen(height, mass, diameter, sign=1.0):
    """Speed after a fall through air [m/s] (sign -1: with which it rises so high), by steps."""
    share, steps = 0.5 * 1.2 * 0.47 * pi / 4 * diameter**2 / mass, 20_000
    square = 0.0
    for _ in range(steps):
        square += 2 * (9.81 - sign * share * square) * height / steps
    return sqrt(square)


def test_heights_become_speeds_with_the_drag_of_air_on_both_ways():
    """A table tennis ball that comes back to 24 of 30.5 cm has lost some of that to air."""
    (row,) = (r for r in rebounds() if r.name == "table tennis ball")
    assert row.speed == pytest.approx(fallen(0.305, 2.7e-3, 0.04), rel=1e-3)
    assert row.low == pytest.approx(fallen(0.24, 2.7e-3, 0.04, -1.0) / row.speed, rel=1e-3)
    assert row.low > sqrt(0.24 / 0.305) + 0.02


def test_where_no_mass_is_given_air_counts_for_nothing():
    (row,) = (r for r in rebounds() if r.name == "golf ball")
    assert row.speed == pytest.approx(sqrt(2 * 9.81 * 1.0))
    assert (row.low, row.high) == (0.80, 0.87)

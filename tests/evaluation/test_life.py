"""Published rebounds: every row can be dropped, and has a source."""

from dataclasses import replace

import pytest

from corporeal.evaluation.life import rebounds, sources
from corporeal.materials import find


def test_every_row_has_a_source_and_every_source_a_row():
    rows = rebounds()
    assert {row.source for row in rows} == set(sources())
    assert len({row.name for row in rows}) == len(rows) >= 25
    for row in rows:
        assert row.diameter > 0.005
        assert row.drop > 0.0
        for name in (row.material, row.floor, row.on and row.on.material):
            assert name is None or find(name)


def test_off_is_the_distance_from_the_range():
    row = replace(rebounds()[0], low=0.7, high=0.8)
    assert [row.off(e) for e in (0.6, 0.7, 0.75, 0.8, 0.85)] == pytest.approx([0.1, 0, 0, 0, 0.05])

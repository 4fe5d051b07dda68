"""Outlines of grown masks against drawn ones: which side they lie on, and how far."""

import masks as benchmark
import numpy as np
import pytest


def disc(radius: float) -> np.ndarray:
    v, u = np.indices((80, 96))
    return np.hypot(u - 48, v - 40)[None] <= radius


@pytest.mark.parametrize("off", [-3, 0, 2])
def test_outlines_lie_beyond_drawn_ones_by_so_much(off):
    found = benchmark.beyond(disc(25 + off).astype(np.float32), disc(25))
    assert found == pytest.approx(off, abs=0.3)


def test_no_outline_lies_nowhere():
    assert np.isnan(benchmark.beyond(np.zeros((1, 80, 96), np.float32), disc(25)))


def test_the_table_has_a_cell_for_each_head():
    row = {"set": "a", "views": 3, "seen": (0.9, 0.8), "beyond": 0.25, "doubt": None}
    for rows in ({"point": [], "box": []}, {"point": [(0.9, 0.8)], "box": [(0.7, 0.6)]}):
        heads, _, cells = benchmark.table([row | rows]).splitlines()
        assert heads.count("|") == cells.count("|") and "+0.25" in cells

"""The nearest of points that lie about evenly."""

import numpy as np
import pytest
from scipy.spatial import KDTree

from corporeal.geometry.quadrature import sort_into_cells


@pytest.mark.parametrize("count", [1, 2, 50, 4000])
@pytest.mark.parametrize("shape", [(1, 1, 1), (1, 1, 0.01), (1, 0, 0)])
@pytest.mark.parametrize("coarser", [0.3, 1.0, 5.0])
def test_it_is_the_one_that_a_tree_finds(count, shape, coarser, rng):
    points = rng.uniform(0, 1, (count, 3)) * shape
    places = rng.uniform(-0.4, 1.4, (2000, 3)) * np.maximum(shape, 0.1)
    found = sort_into_cells(points, coarser * count ** (-1 / 3)).nearest(places)
    distance, _ = KDTree(points).query(places)
    assert np.array_equal(np.linalg.norm(points[found] - places, axis=1), distance)


def test_a_stray_point_makes_no_large_table(rng):
    points = np.concatenate([rng.uniform(0, 1, (1000, 3)), [[1e6, -1e6, 1e5]]])
    table = sort_into_cells(points, 0.1)
    assert len(table.first) < 10_000
    assert table.nearest(np.array([[9e5, -9e5, 0.0]]))[0] == 1000

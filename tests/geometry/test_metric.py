"""A scale in metres says where it is from."""

import math

import pytest

from corporeal.errors import UserError
from corporeal.geometry.metric import of_distance, of_extent, of_file


def test_a_scale_states_its_source():
    assert (of_file("GLB").metres_per_unit, of_file("GLB").source) == (1.0, "file")
    far = of_distance((0, 0, 0), (3, 0, 4), 0.5)
    assert (far.metres_per_unit, far.source) == (pytest.approx(0.1), "distance")
    assert far.reason == "Two points 5 units apart are 0.5 m apart."
    large = of_extent((-1, -1, -2), (1, 1, 2), 0.2, "a model")
    assert (large.metres_per_unit, large.source) == (pytest.approx(0.05), "extent")
    assert "4 units" in large.reason and "0.2 m in reality, a model said" in large.reason


@pytest.mark.parametrize("metres", [0.0, -1.0, math.nan, math.inf])
def test_no_scale_comes_of_nonsense(metres):
    with pytest.raises(UserError, match="Both must be positive"):
        of_distance((0, 0, 0), (1, 0, 0), metres)
    with pytest.raises(UserError, match="Both must be positive"):
        of_extent((1, 1, 1), (1, 1, 1), 1.0, "a model")

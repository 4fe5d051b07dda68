"""Sizes in a scene keep the order of the real ones, with the differences compressed."""

import numpy as np
import pytest

from corporeal.core.errors import UserError
from corporeal.discretization.object_scaling import SceneSizing, scene_extents

DUCK, CAN, LAMP, COUCH = 0.12, 0.122, 0.45, 2.1
THINGS = (DUCK, CAN, LAMP, COUCH)


def test_a_range_of_sixteen_becomes_one_of_less_than_three():
    large, small = scene_extents([16.7, 1.0])
    assert large / small == pytest.approx(16.7**0.35, rel=1e-12)
    assert round(large / small, 1) == 2.7


def test_the_largest_takes_up_its_fraction_of_the_working_extent():
    assert scene_extents(THINGS).max() == 0.5
    sizing = SceneSizing(working_extent=3.0, fraction=0.4)
    assert scene_extents(THINGS, sizing).max() == pytest.approx(1.2, rel=1e-15)


def test_true_proportions_are_kept_without_compression():
    extents = scene_extents(THINGS, SceneSizing(gamma=1.0))
    np.testing.assert_allclose(extents / extents.max(), np.array(THINGS) / COUCH, rtol=1e-15)


def test_without_any_exponent_all_are_as_large():
    np.testing.assert_array_equal(scene_extents(THINGS, SceneSizing(gamma=0.0)), 0.5)


def test_metric_means_metres_to_the_last_bit():
    sizing = SceneSizing(gamma=0.2, metric=True, working_extent=7.0)
    np.testing.assert_array_equal(scene_extents(THINGS, sizing), THINGS)


def test_the_order_of_sizes_is_kept_and_the_unit_does_not_matter():
    extents = scene_extents(THINGS)
    assert (np.diff(extents) > 0).all()
    inches = scene_extents([x / 0.0254 for x in THINGS])
    np.testing.assert_allclose(inches, extents, rtol=1e-14)


@pytest.mark.parametrize(
    ("sizing", "words"),
    [
        (SceneSizing(gamma=-0.1), "gamma is -0.1. Give a number from 0 to 1"),
        (SceneSizing(gamma=1.5), "gamma is 1.5"),
        (SceneSizing(gamma=float("nan")), "gamma is nan"),
        (SceneSizing(working_extent=0.0), "working extent is 0.0"),
        (SceneSizing(fraction=1.2), "fraction is 1.2"),
    ],
)
def test_a_rule_that_makes_no_sense_is_refused(sizing, words):
    with pytest.raises(UserError, match=words):
        scene_extents(THINGS, sizing)


@pytest.mark.parametrize("real", [[], [0.1, 0.0], [-1.0], [float("inf")], [float("nan"), 1.0]])
def test_what_is_no_length_is_refused(real):
    with pytest.raises(UserError, match="must be a length"):
        scene_extents(real)

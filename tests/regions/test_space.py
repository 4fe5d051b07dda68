"""Space between things tells them apart, and holes in what was seen do not."""

import numpy as np
import pytest

from corporeal.regions.objects import objects
from corporeal.regions.space import with_space_between
from corporeal.types import Cloud

RNG = np.random.default_rng(5)


def ball(middle, radius=0.1, count=1500):
    x = RNG.normal(size=(count, 3))
    return np.array(middle) + radius * x / np.linalg.norm(x, axis=1, keepdims=True)


def test_things_apart_are_told_apart_whatever_they_look_like():
    points = np.concatenate(
        [ball((0, 0, 0), 0.3, 4000), ball((0.7, 0, 0)), ball((0.7, 0.3, 0), 0.1, 900)]
    )
    truth = np.repeat([0, 1, 2], [4000, 1500, 900])
    np.testing.assert_array_equal(with_space_between(points), truth)
    np.testing.assert_array_equal(with_space_between(points, most=3), truth)
    coarse = with_space_between(points, most=2)
    np.testing.assert_array_equal(coarse, np.minimum(truth, 1))
    assert not with_space_between(points, most=1).any()


def test_things_that_touch_are_one_to_space():
    points = np.concatenate([ball((0, 0, 0)), ball((0.2, 0, 0))])
    assert not with_space_between(points).any()


def test_strays_between_things_build_no_bridge():
    bridge = np.column_stack([np.linspace(0.11, 0.29, 12), np.zeros(12), np.zeros(12)])
    points = np.concatenate([ball((0, 0, 0)), ball((0.4, 0, 0)), bridge])
    label = with_space_between(points)
    np.testing.assert_array_equal(label[:3000], np.repeat([0, 1], 1500) ^ label[0])


def test_a_thing_with_holes_is_one():
    points = ball((0, 0, 0), 0.3, 6000)
    holes = np.abs(np.sin(40 * points[:, 0])) > 0.35
    assert not with_space_between(points[holes]).any()


def test_a_thing_with_a_plain_neck_of_few_large_gaussians_is_one():
    rng = np.random.default_rng(2)

    def tube(count, radius, low, high):
        turn = rng.uniform(0, 2 * np.pi, count)
        height = rng.uniform(low, high, count)
        return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), height])

    plain = tube(60, 0.05, 0.31, 0.53)
    vase = np.concatenate([ball((0, 0, 0), 0.3, 4000), plain, tube(400, 0.05, 0.56, 0.63)])
    assert not with_space_between(vase).any()


@pytest.mark.parametrize("count", [1, 4])
def test_few_points_are_one_thing(count):
    assert not with_space_between(RNG.normal(size=(count, 3))).any()


def test_what_space_tells_is_cut_no_further_than_asked():
    points = np.concatenate([ball((0, 0, 0), 0.3, 4000), ball((0.6, 0, 0), 0.1)])
    colour = np.where(points[:, :1] > 0, (0.8, 0.1, 0.1), (0.1, 0.1, 0.8))  # half a ball is blue
    appearance = np.column_stack([colour, np.full(len(points), 0.3)])
    appearance /= np.linalg.norm(appearance, axis=1, keepdims=True)
    cloud = Cloud(points, colour, appearance, appearance, np.ones(len(points), int))
    split = objects(cloud, 2)
    assert split.found_by == "the space between them"
    np.testing.assert_array_equal(split.object_of_point, np.repeat([0, 1], [4000, 1500]))

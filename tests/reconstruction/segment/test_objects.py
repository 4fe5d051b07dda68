import numpy as np
import pytest

from corporeal.core.errors import UserError
from corporeal.core.types import FeatureCloud
from corporeal.reconstruction.segment.object_segmentation import (
    TOUCHING_IS_ONE_CONFIG,
    nearest_neighbour_components,
    segment_objects,
)


def ball(count, centre, radius, rng):
    normal = rng.normal(size=(count, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return centre + radius * normal, normal


def scene(spheres, looks, count=3000, seed=0):
    """Spheres of points, and what each looks like."""
    rng = np.random.default_rng(seed)
    made = [ball(count, np.array(c), r, rng) for c, r in spheres]
    position, normal = (np.concatenate(part) for part in zip(*made, strict=True))
    owner = np.repeat(np.arange(len(spheres)), count)
    appearance = np.array(looks, float)[owner] + 0.02 * rng.normal(size=(len(owner), len(looks[0])))
    appearance = (appearance / np.linalg.norm(appearance, axis=1, keepdims=True)).astype(np.float16)
    grey = np.full(position.shape, 0.5)
    return (FeatureCloud(position, grey, appearance, appearance, np.ones(len(owner), int)), normal, owner)


def agreement(owner, found):
    """Mean over true things of the best overlap with a found one."""
    overlap = [
        max(np.sum((owner == a) & (found == b)) / np.sum((owner == a) | (found == b)) for b in np.unique(found))
        for a in np.unique(owner)
    ]
    return np.mean(overlap)


TWINS = [((-0.3, 0, 0.3), 0.3), ((0.3, 0, 0.3), 0.3)]


@pytest.mark.parametrize("given", [True, False])
def test_two_like_balls_that_touch_are_distinguished_by_the_notch_between_them(given):
    cloud, normal, owner = scene(TWINS, [[1, 0], [1, 0]])
    split = segment_objects(cloud, 2, normal if given else None)
    assert agreement(owner, split.object_of_point) > 0.97
    assert nearest_neighbour_components(cloud.position).max() == 0


def test_four_objects_in_a_heap_are_four():
    spheres = [*TWINS, ((0, 0.5196, 0.3), 0.3), ((0, 0.1732, 0.79), 0.3)]
    cloud, normal, owner = scene(spheres, [[1, 0, 0]] * 2 + [[0, 1, 0], [0, 0, 1]])
    split = segment_objects(cloud, 4, normal)
    assert split.object_of_point.max() == 3
    assert agreement(owner, split.object_of_point) > 0.97
    assert split.warnings == ()


def test_what_is_one_object_stays_one():
    cloud, normal, _ = scene(TWINS, [[1, 0], [0, 1]])
    split = segment_objects(cloud, 1, normal)
    assert (split.object_of_point == 0).all() and (split.confidence == 1).all()


def test_components_find_objects_that_stand_apart():
    cloud, _, owner = scene([((-1, 0, 0.3), 0.3), ((1, 0, 0.3), 0.2)], [[1, 0], [1, 0]])
    found = nearest_neighbour_components(cloud.position)
    np.testing.assert_array_equal(found, np.where(owner == owner[0], found[0], 1 - found[0]))


def test_a_number_that_was_not_given_is_reported_as_counted():
    cloud, normal, owner = scene(TWINS, [[1, 0], [0, 1]])
    split = segment_objects(cloud, None, normal)
    assert split.object_of_point.max() == 1 and agreement(owner, split.object_of_point) > 0.97
    assert "2 were counted" in split.warnings[0]
    alone, normal, _ = scene(TWINS[:1], [[1, 0]])
    assert "1 was counted" in segment_objects(alone, None, normal, config=TOUCHING_IS_ONE_CONFIG).warnings[0]


@pytest.mark.parametrize("count", [0, -1, 201])
def test_a_number_of_objects_that_cannot_be_is_refused(count):
    cloud, _, _ = scene(TWINS, [[1, 0], [1, 0]], count=150)
    with pytest.raises(UserError, match="Ask for 1 to 200"):
        segment_objects(cloud, count)


def test_no_points_are_refused():
    nothing = np.zeros((0, 3))
    with pytest.raises(UserError, match="no points"):
        segment_objects(FeatureCloud(nothing, nothing, nothing, nothing, np.zeros(0, int)))


@pytest.mark.parametrize("points", [1, 2, 7, 40])
def test_few_points_are_few_objects(points):
    rng = np.random.default_rng(3)
    appearance = np.ones((points, 2)) / np.sqrt(2)
    cloud = FeatureCloud(
        rng.random((points, 3)), appearance[:, :1] * [1, 1, 1], appearance, appearance, np.ones(points, int)
    )
    split = segment_objects(cloud, min(points, 3))
    assert len(split.object_of_point) == points == len(split.confidence)
    assert np.isfinite(split.confidence).all()

import numpy as np
import pytest
from scipy.sparse import csr_array

from corporeal.core.errors import UserError
from corporeal.core.types import FeatureCloud
from corporeal.reconstruction.segment.instance_masks import lift_labels, renumber_labels
from corporeal.reconstruction.segment.object_segmentation import segment_objects


def plate(count=4000, seed=0):
    """Points of one flat plate that looks the same everywhere; its halves are two things."""
    rng = np.random.default_rng(seed)
    position = np.column_stack([2 * rng.random(count), rng.random(count), np.zeros(count)])
    appearance = np.tile([0.6, 0.8], (count, 1))
    cloud = FeatureCloud(position, 0 * position, appearance, appearance, np.ones(count, int))
    return cloud, np.tile([0.0, 0, 1], (count, 1)), (position[:, 0] > 1.6).astype(int)


def overlap(truth, found):
    same = max(np.mean(truth == found), np.mean(truth != found))
    return 2 * same - 1


def test_a_point_is_what_most_of_its_weight_falls_on():
    share = [csr_array([[0.6, 0.5, 0, 0], [0, 0.1, 0, 3.0], [0, 0, 0, 0]])]
    labels = [np.array([[7, 5], [5, -1]])]
    np.testing.assert_array_equal(lift_labels(share.__getitem__, labels, 3), [[7, -1, -1]])


def test_masks_of_another_size_are_refused():
    share = [csr_array(np.ones((2, 4)))]
    with pytest.raises(UserError, match="View 0's mask has 2 x 3 pixels"):
        lift_labels(share.__getitem__, [np.zeros((2, 3), int)], 2)
    with pytest.raises(UserError, match="for 3 points"):
        lift_labels(share.__getitem__, [np.zeros((2, 2), int)], 3)


def test_masks_tell_apart_what_look_and_shape_cannot():
    """Some views take both for one, some cut one in pieces, numbers differ, much is not seen."""
    cloud, normal, truth = plate()
    rng = np.random.default_rng(1)
    views = np.stack([truth] * 10)
    views[:2] = 0
    views[2:5] += 2 * (cloud.position[:, 1] > 0.3)
    views = (views * np.arange(3, 13)[:, None]) % 31
    views[rng.random(views.shape) < 0.3] = -1
    blind = segment_objects(cloud, 2, normal)
    seen = segment_objects(cloud, 2, normal, views)
    assert overlap(truth, seen.object_of_point) > 0.97
    assert overlap(truth, blind.object_of_point) < 0.75
    assert "masks" in seen.found_by and "masks" not in blind.found_by


def test_masks_that_show_nothing_change_nothing():
    cloud, normal, _ = plate()
    nothing = np.full((3, cloud.count), -1)
    a, b = segment_objects(cloud, 2, normal), segment_objects(cloud, 2, normal, nothing)
    np.testing.assert_array_equal(a.object_of_point, b.object_of_point)


def test_masks_that_share_a_rim_join_nothing_that_other_views_tell_apart():
    first, second, rim = slice(0, 100), slice(100, 200), slice(100, 105)
    label = np.full((4, 200), -1)
    label[0, first], label[0, second] = 0, 1
    label[1, first], label[1, second] = 1, 0
    label[2, second] = 0  # these two see nothing in common but the rim of the second
    label[3, first] = label[3, rim] = 0
    number = renumber_labels(label)
    assert len(np.unique(number[number >= 0])) == 2
    np.testing.assert_array_equal(number[0], number[1])
    np.testing.assert_array_equal(number[2, second], number[0, second])
    np.testing.assert_array_equal(number[3, first], number[0, first])

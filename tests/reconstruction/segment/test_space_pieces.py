"""What stands apart is segmented by that, and joined where fewer objects are told."""

import numpy as np
import pytest

from corporeal.core.types import FeatureCloud
from corporeal.reconstruction.segment.object_segmentation import join_nearest_pieces, segment_objects

RNG = np.random.default_rng(5)


def ball(middle, radius=0.1, count=1500):
    x = RNG.normal(size=(count, 3))
    return np.array(middle) + radius * x / np.linalg.norm(x, axis=1, keepdims=True)


@pytest.mark.parametrize(
    ("most", "joined"), [(None, (0, 1, 2)), (4, (0, 1, 2)), (3, (0, 1, 2)), (2, (0, 1, 1)), (1, (0, 0, 0))]
)
def test_what_is_nearest_is_joined_until_it_is_few_enough(most, joined):
    points = np.concatenate([ball((0, 0, 0), 0.3, 4000), ball((0.7, 0, 0)), ball((0.7, 0.3, 0), 0.1, 900)])
    piece = np.repeat([0, 1, 2], [4000, 1500, 900])
    np.testing.assert_array_equal(join_nearest_pieces(piece, points, most), np.array(joined)[piece])


def test_what_space_tells_is_cut_no_further_than_asked():
    points = np.concatenate([ball((0, 0, 0), 0.3, 4000), ball((0.6, 0, 0), 0.1)])
    colour = np.where(points[:, :1] > 0, (0.8, 0.1, 0.1), (0.1, 0.1, 0.8))  # half a ball is blue
    appearance = np.column_stack([colour, np.full(len(points), 0.3)])
    appearance /= np.linalg.norm(appearance, axis=1, keepdims=True)
    cloud = FeatureCloud(points, colour, appearance, appearance, np.ones(len(points), int))
    piece = np.repeat([0, 1], [4000, 1500])
    split = segment_objects(cloud, 2, piece_of_point=piece)
    assert split.found_by == "the space between them"
    np.testing.assert_array_equal(split.object_of_point, piece)
    assert segment_objects(cloud, 3, piece_of_point=piece).object_of_point.max() == 2

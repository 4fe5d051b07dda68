import tracemalloc

import numpy as np
import pytest

from corporeal.reconstruction.segment.optimal_assignment import optimal_assignment
from corporeal.reconstruction.segment.part_clusters import reduce_features
from corporeal.reconstruction.segment.superpoints import superpoints


def plane(count, seed=0):
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.random((count, 2)), np.zeros(count)])


def test_patches_are_about_as_many_as_asked_small_and_not_empty():
    position = plane(20_000)
    for count in (50, 400):
        patch = superpoints(position, None, count)
        size = np.bincount(patch)
        assert 0.75 * count <= len(size) <= count
        assert size.min() >= 1
        middle = np.stack([np.bincount(patch, x) / size for x in position.T], axis=1)
        away = np.linalg.norm(position - middle[patch], axis=1)
        assert away.max() < 1.5 / np.sqrt(count)


def test_patches_keep_to_one_look_where_looks_meet():
    position = plane(20_000)
    side = (position[:, 0] + 0.3 * position[:, 1] > 0.6).astype(int)
    appearance = np.eye(2)[side] + 0.03 * np.random.default_rng(1).normal(size=(20_000, 2))
    patch = superpoints(position, appearance, 100)
    inside = np.bincount(patch, side) / np.bincount(patch)
    mixed = np.minimum(inside, 1 - inside)[patch].mean()
    assert mixed < 0.002
    by_place = superpoints(position, None, 100)
    inside = np.bincount(by_place, side) / np.bincount(by_place)
    assert np.minimum(inside, 1 - inside)[by_place].mean() > 0.02


def test_patches_do_not_depend_on_where_the_scene_stands_or_how_large_it_is():
    position, appearance = plane(3000), np.random.default_rng(2).normal(size=(3000, 4)) * 0.1
    first = superpoints(position, appearance, 60)
    moved = superpoints(position * 1024 + [2048.0, -512.0, 64.0], appearance, 60)
    np.testing.assert_array_equal(first, moved)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_few_points_make_few_patches(count):
    position = np.arange(3.0 * count).reshape(count, 3)
    patch = superpoints(position, None, 2000)
    np.testing.assert_array_equal(np.sort(np.unique(patch)), np.arange(len(np.unique(patch))))
    assert len(patch) == count
    np.testing.assert_array_equal(superpoints(np.zeros((count, 3)), None, 10), 0)


def test_distances_survive_when_few_axes_hold_all_there_is():
    rng = np.random.default_rng(3)
    mixed = rng.normal(size=(500, 5)) @ np.linalg.qr(rng.normal(size=(40, 5)))[0].T
    short = reduce_features(mixed.astype(np.float16), 8)
    assert short.shape == (500, 8) and short.dtype == np.float32
    unit = mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
    expected = 2 - 2 * unit @ unit.T
    found = ((short[:, None] - short[None]) ** 2).sum(2)
    np.testing.assert_allclose(found, expected, atol=4e-3)
    np.testing.assert_allclose(reduce_features(mixed[:, :5]).std(0) > 0, True)


def test_half_precision_features_are_never_widened_all_at_once():
    features = np.ones((60_000, 256), np.float16)
    tracemalloc.start()
    reduce_features(features, 16)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1.5 * (20_000 * 256 * 4) + 60_000 * 16 * 4 + 4 * 8192 * 256 * 4


def test_the_best_pairs_are_not_always_the_best_pair():
    similarity = np.array([[0.9, 0.8], [0.85, 0.1]])
    np.testing.assert_array_equal(optimal_assignment(similarity), [1, 0])
    np.testing.assert_array_equal(optimal_assignment(similarity[:, :1]), [0, -1])
    np.testing.assert_array_equal(optimal_assignment(similarity[:1]), [0])
    np.testing.assert_array_equal(optimal_assignment(np.empty((2, 0))), [-1, -1])


def test_a_forbidden_pair_is_never_made():
    never = -np.inf
    np.testing.assert_array_equal(optimal_assignment(np.array([[never, 1.0], [never, 0.9]])), [1, -1])
    np.testing.assert_array_equal(optimal_assignment(np.array([[5.0, 1.0], [5.0, never]])), [1, 0])

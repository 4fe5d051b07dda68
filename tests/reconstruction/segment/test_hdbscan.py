import numpy as np
import pytest

from corporeal.reconstruction.segment.hdbscan import NOISE_LABEL, hdbscan


def blobs(rng, middles, each=100, wide=0.1):
    made = [m + wide * rng.normal(size=(each, len(m))) for m in np.asarray(middles, float)]
    return np.concatenate(made), np.repeat(np.arange(len(made)), each)


def same_partition(a, b):
    return len(set(zip(a, b, strict=True))) == len(set(a)) == len(set(b))


@pytest.fixture
def four():
    return blobs(np.random.default_rng(0), [(0, 0, 0), (2, 0, 0), (0, 2, 0), (0, 2, 2)])


def test_places_that_are_apart_are_clusters_and_nothing_else_is(four):
    points, truth = four
    found = hdbscan(points, 20, 5, "mass")
    inside = found.cluster_of_point != NOISE_LABEL
    assert same_partition(found.cluster_of_point[inside], truth[inside])
    assert inside.mean() > 0.9


def test_what_lies_between_is_mostly_noise_and_never_strong(four):
    points, _ = four
    between = np.random.default_rng(1).uniform(-2, 4, (40, 3))
    far = np.linalg.norm(between[:, None] - points[None], axis=2).min(axis=1) > 0.5
    found = hdbscan(np.concatenate([points, between[far]]), 20, 5, "mass")
    assert far.sum() > 10
    noise = found.cluster_of_point[400:] == NOISE_LABEL
    assert noise.mean() > 0.7
    assert (found.strength[400:][noise] == 0).all()
    assert found.strength[400:].max() < 0.2 < np.median(found.strength[:400])


def test_the_densest_place_of_a_cluster_is_its_strongest(four):
    points, truth = four
    found = hdbscan(points, 20, 5, "mass")
    for k in range(4):
        own = found.cluster_of_point == found.cluster_of_point[truth == k].max()
        away = np.linalg.norm(points - points[truth == k].mean(axis=0), axis=1)
        assert found.strength[own].max() == 1
        assert np.corrcoef(away[own], found.strength[own])[0, 1] < -0.5


def test_length_is_measured_in_no_unit(four):
    points, _ = four
    a, b = hdbscan(points), hdbscan(1000 * points - 7)
    np.testing.assert_array_equal(a.cluster_of_point, b.cluster_of_point)
    np.testing.assert_allclose(a.strength, b.strength, rtol=1e-9)


def test_the_order_of_points_does_not_matter(four):
    points, _ = four
    order = np.random.default_rng(2).permutation(len(points))
    a, b = hdbscan(points), hdbscan(points[order])
    assert same_partition(a.cluster_of_point[order], b.cluster_of_point)


def test_clusters_of_unlike_density_are_both_found():
    """One radius for all, as in DBSCAN, finds the dense one or joins all."""
    rng = np.random.default_rng(3)
    dense, _ = blobs(rng, [(0, 0)], 200, 0.01)
    sparse, _ = blobs(rng, [(3, 0)], 200, 0.5)
    found = hdbscan(np.concatenate([dense, sparse]), 20, 5, "mass").cluster_of_point
    assert found.max() == 1
    first, second = np.bincount(found[:200] + 1, minlength=3), np.bincount(found[200:] + 1)
    assert first.max() > 150 and second[1:].max() > 150
    assert first[1:].argmax() != second[1:].argmax()


def test_leaves_are_the_finest_clusters_and_mass_prefers_what_lasts():
    """Two pairs of plates: the halves of a pair part late, the pairs early."""
    rng = np.random.default_rng(4)
    grid = 0.03 * np.stack(np.meshgrid(np.arange(14), np.arange(14)), -1).reshape(-1, 2)
    plates = [grid + np.array([x, 0]) + rng.uniform(-3e-3, 3e-3, grid.shape) for x in (0, 0.45, 20, 20.45)]
    points, truth = np.concatenate(plates), np.repeat(np.arange(4), len(grid))
    leaves = hdbscan(points, 50, 5, "leaf").cluster_of_point
    lasting = hdbscan(points, 50, 5, "mass").cluster_of_point
    inside = leaves != NOISE_LABEL
    assert leaves.max() == 3 and same_partition(leaves[inside], truth[inside])
    assert lasting.max() == 1
    assert same_partition(lasting[lasting >= 0], truth[lasting >= 0] // 2)


def test_what_nothing_parts_is_all_noise():
    points = np.random.default_rng(5).normal(size=(30, 3))
    assert (hdbscan(points, 20, 5).cluster_of_point == NOISE_LABEL).all()


@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_a_handful_of_points_is_noise(count):
    found = hdbscan(np.arange(3.0 * count).reshape(count, 3))
    np.testing.assert_array_equal(found.cluster_of_point, np.full(count, NOISE_LABEL))


def test_points_at_one_place_are_a_cluster():
    points = np.repeat([[0.0, 0, 0], [1, 0, 0]], 30, axis=0)
    found = hdbscan(points, 20, 5)
    assert same_partition(found.cluster_of_point, np.repeat([0, 1], 30))

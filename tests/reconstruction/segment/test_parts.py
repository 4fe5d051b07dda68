import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from corporeal.core.types import FeatureCloud, ObjectDescription, PartDescription
from corporeal.reconstruction.features.point_descriptor import point_descriptor
from corporeal.reconstruction.segment.part_clusters import PartClusters, PartsConfig, cluster_parts
from corporeal.reconstruction.segment.part_naming import (
    CLIP_TEMPERATURE,
    _agree_on_appearance,
    name_clusters,
    name_parts,
)

QUICK = PartsConfig(superpoints=600)


def sides(count, rng):
    """Points on the sides of the unit cube, and which way they face."""
    normal = np.eye(3)[rng.integers(0, 3, count)] * rng.choice([-1, 1], count)[:, None]
    points = rng.random((count, 3))
    return np.where(normal > 0, 1.0, np.where(normal < 0, 0.0, points)), normal


def boxes(rng, count=800):
    """Three boxes of one size in a pile, brown, white and green from below."""
    shades = [(0.42, 0.28, 0.17), (0.95, 0.95, 0.95), (0.25, 0.56, 0.2)]
    place, facing, colour, truth = [], [], [], []
    for k, shade in enumerate(shades):
        points, normal = sides(count, rng)
        place.append(points + np.array([0, 0, k]))
        facing.append(normal)
        colour.append(np.clip(shade + 0.02 * rng.normal(size=(count, 3)), 0, 1))
        truth.append(np.full(count, k))
    return tuple(np.concatenate(x) for x in (place, facing, colour, truth))


def thing(*names):
    return ObjectDescription("pile", "pile", tuple(PartDescription(name, None) for name in names))


@pytest.fixture(scope="module")
def pile():
    position, normal, colour, truth = boxes(np.random.default_rng(0))
    appearance = point_descriptor(position, colour, normal)
    nothing = np.zeros((len(position), 0), np.float16)
    return FeatureCloud(position, colour, nothing, appearance, np.ones(len(position), int)), truth


def with_words(truth, rng, noise=0.3, channels=32):
    """Features that a model would have given: a direction per part, and noise."""

    def made():
        way = rng.normal(size=(3, channels))
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        rows = way[truth] + noise * rng.normal(size=(len(truth), channels)) / np.sqrt(channels)
        return way, (rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float16)

    return made(), made()


def purity(cluster, truth):
    counts = np.zeros((cluster.max() + 1, truth.max() + 1))
    np.add.at(counts, (cluster, truth), 1)
    return counts.max(axis=1).sum() / len(truth)


def test_no_cluster_holds_two_parts_of_unlike_colour(pile):
    cloud, truth = pile
    found = cluster_parts(cloud, QUICK)
    assert found.count >= 3
    assert purity(found.cluster_of_point, truth) > 0.995
    assert ((found.confidence >= 0) & (found.confidence <= 1)).all()
    np.testing.assert_array_equal(np.unique(found.cluster_of_point), np.arange(found.count))


def test_where_an_object_stands_and_how_large_it_is_does_not_matter(pile):
    cloud, _ = pile
    moved = replace(cloud, position=32 * cloud.position + 64)
    a, b = cluster_parts(cloud, QUICK), cluster_parts(moved, QUICK)
    pairs = set(zip(a.cluster_of_point, b.cluster_of_point, strict=True))
    assert len(pairs) == a.count == b.count


def test_place_tells_apart_what_looks_the_same():
    """Two plates of one look, a plate's length apart: no look parts them, place does."""
    rng = np.random.default_rng(1)
    points = np.concatenate([rng.random((1000, 3)) * [1, 1, 0] + [2 * k, 0, 0] for k in (0, 1)])
    same = np.tile(np.array([[1.0, 0.0]], np.float16), (2000, 1))
    nothing = np.zeros((2000, 0), np.float16)
    cloud = FeatureCloud(points, np.full((2000, 3), 0.5), nothing, same, np.ones(2000, int))
    apart = cluster_parts(cloud, PartsConfig(selection="mass", smallest=100, superpoints=1000)).cluster_of_point
    assert apart.max() >= 1 and purity(apart, np.repeat([0, 1], 1000)) == 1
    together = cluster_parts(cloud, replace(QUICK, position_weight=0.0)).cluster_of_point
    assert together.max() == 0


@pytest.mark.parametrize("count", [0, 1, 5])
def test_a_handful_of_points_is_one_cluster(count):
    nothing = np.zeros((count, 0), np.float16)
    appearance = np.ones((count, 4), np.float16)
    x = np.arange(3.0 * count).reshape(count, 3)
    found = cluster_parts(FeatureCloud(x, np.zeros((count, 3)), nothing, appearance, np.ones(count, int)))
    np.testing.assert_array_equal(found.cluster_of_point, np.zeros(count))


def test_names_find_their_colours_without_a_model(pile):
    cloud, truth = pile
    found = name_parts(cloud, thing("green lid", "wooden base", "white middle"), config=QUICK)
    assert (found.part_of_point == np.array([1, 2, 0])[truth]).mean() > 0.98
    assert found.found_by == "attributes" and not found.warnings
    assert ((found.confidence > 0) & (found.confidence <= 1)).all()


def test_names_find_their_heights_where_colours_are_not_reported(pile):
    cloud, truth = pile
    grey = replace(cloud, colour=np.full_like(cloud.colour, 0.5))
    found = name_parts(grey, thing("lid", "base"), config=QUICK)
    assert (found.part_of_point[truth == 0] == 1).mean() > 0.98
    assert (found.part_of_point[truth == 2] == 0).mean() > 0.98


def test_the_order_of_names_does_not_matter(pile):
    cloud, _ = pile
    names = ("green lid", "wooden base", "white middle")
    forward, back = (name_parts(cloud, thing(*n), config=QUICK) for n in (names, names[::-1]))
    np.testing.assert_array_equal(forward.part_of_point, 2 - back.part_of_point)


def test_one_part_is_everything_and_sure(pile):
    cloud, _ = pile
    found = name_parts(cloud, thing("pile"))
    assert (found.part_of_point == 0).all() and (found.confidence == 1).all()
    assert found.found_by == "one part"


def test_an_object_without_points_has_no_parts():
    none = np.zeros((0, 3))
    cloud = FeatureCloud(none, none, np.zeros((0, 4)), np.zeros((0, 4)), np.zeros(0, int))
    found = name_parts(cloud, thing("legs", "seat"))
    assert not len(found.part_of_point) and not len(found.confidence)
    assert found.warnings == ("No points were found for 'legs', 'seat'.",)


def test_features_in_half_precision_are_not_widened_all_at_once():
    rng = np.random.default_rng(6)
    rows = rng.normal(size=(60_000, 64)).astype(np.float16)
    cloud = FeatureCloud(rng.random((60_000, 3)), rng.random((60_000, 3)), rows, rows, np.ones(60_000, int))
    clusters = PartClusters(rng.integers(0, 5, 60_000), np.ones(60_000))
    tracemalloc.start()
    name_clusters(clusters, cloud, np.eye(64)[:2], thing("a", "b").parts)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1.5 * rows.nbytes  # in single precision they alone are twice as large


def test_more_names_than_clusters_are_reported():
    one = PartClusters(np.zeros(10, np.int64), np.ones(10))
    x = np.zeros((10, 3))
    brown = np.tile([0.42, 0.28, 0.17], (10, 1))
    nothing = np.zeros((10, 0), np.float16)
    cloud = FeatureCloud(x, brown, nothing, np.ones((10, 4), np.float16), np.ones(10, int))
    found = name_clusters(one, cloud, None, thing("wooden seat", "blue seat").parts)
    assert (found.part_of_point == 0).all()
    assert found.warnings == ("No points were found for 'blue seat'.",)


def test_words_find_what_points_at_them(pile):
    cloud, truth = pile
    rng = np.random.default_rng(3)
    (words, semantic), (_, structural) = with_words(truth, rng)
    seen = replace(cloud, semantic=semantic, structural=structural)
    found = name_parts(seen, thing("a", "b", "c"), words[[2, 0, 1]], QUICK)
    assert (found.part_of_point == np.array([1, 2, 0])[truth]).mean() > 0.99
    assert found.found_by == "words"


def test_one_cluster_from_foot_to_top_is_named_by_layers():
    rng = np.random.default_rng(5)
    place, nothing = rng.random((2000, 3)) * [0.5, 0.5, 1], np.zeros((2000, 0))
    cloud = FeatureCloud(place, np.full((2000, 3), 0.5), nothing, nothing, np.ones(2000, int))
    one = PartClusters(np.zeros(2000, np.int64), np.full(2000, 0.5))
    found = name_clusters(one, cloud, None, thing("grey pedestal", "grey lid").parts)
    high = place[:, 2] > 0.5
    far = abs(place[:, 2] - 0.5) > 0.11  # the middle layer may go either way
    assert (found.part_of_point[far] == high[far]).all() and len(found.confidence) == 2000


def test_what_is_not_typical_of_a_cluster_does_not_decide_its_name():
    """A third of a cluster's points look like something else, and shout another name."""
    rng = np.random.default_rng(4)
    looks, words = np.eye(8)[:2], np.eye(8)[2:4]
    odd = np.arange(90) < 30
    structural = np.where(odd[:, None], -looks[0] + looks[1], looks[0])
    semantic = np.where(odd[:, None], words[1], 0.7 * words[0] + 0.69 * words[1])
    semantic /= np.linalg.norm(semantic, axis=1, keepdims=True)
    cloud = FeatureCloud(rng.random((90, 3)), rng.random((90, 3)), semantic, structural, odd + 1)
    one = PartClusters(np.zeros(90, np.int64), np.ones(90))
    plain = semantic.mean(axis=0) @ words.T
    found = name_clusters(one, cloud, words, thing("first", "second").parts)
    assert plain.argmax() == 1 and set(found.part_of_point) == {0}


def test_a_cluster_that_looks_like_those_of_another_name_goes_over_to_them():
    looks = np.array([[1, 0, 0], [0.98, 0.2, 0], [0, 1, 0], [0, 0.98, 0.2], [0.05, 1, 0.1]])
    doubt = np.log([[9, 1], [9, 1], [1, 9], [1, 9], [6, 4]])
    np.testing.assert_array_equal(_agree_on_appearance(looks, doubt, doubt.argmax(1)), [0, 0, 1, 1, 1])


def test_words_that_are_sure_are_not_overruled_by_looks():
    looks = np.array([[1, 0, 0], [0.98, 0.2, 0], [0, 1, 0], [0, 0.98, 0.2], [0.05, 1, 0.1]])
    sure = np.log([[9, 1], [9, 1], [1, 9], [1, 9], [999, 1]])
    np.testing.assert_array_equal(_agree_on_appearance(looks, sure, sure.argmax(1)), [0, 0, 1, 1, 0])


def test_the_last_cluster_of_a_name_keeps_it():
    looks = np.array([[1.0, 0], [1.0, 0.01], [0.98, 0.2]])
    score = np.log([[9.0, 1], [9, 1], [4, 6]])
    np.testing.assert_array_equal(_agree_on_appearance(looks, score, np.array([0, 0, 1])), [0, 0, 1])


def test_confidence_is_how_probable_a_name_is_by_the_temperature_of_training():
    words = np.eye(4)[:2]
    way = np.array([0.5, 0.5 - 2 * CLIP_TEMPERATURE, 0, 0])
    way[2] = np.sqrt(1 - way @ way)
    cloud = FeatureCloud(
        np.random.default_rng(5).random((6, 3)),
        np.zeros((6, 3)),
        np.tile(way, (6, 1)),
        np.tile(np.eye(4)[:1], (6, 1)),
        np.ones(6, int),
    )
    found = name_clusters(PartClusters(np.zeros(6, np.int64), np.full(6, 0.5)), cloud, words, thing("a", "b").parts)
    np.testing.assert_allclose(found.confidence, 0.5 / (1 + np.exp(-2)), rtol=1e-6)

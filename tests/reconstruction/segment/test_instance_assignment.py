"""Whose each point is, where somebody drew masks, and by the published rule."""

from dataclasses import replace

import numpy as np
import pytest

from corporeal.core.errors import UserError
from corporeal.core.types import FeatureCloud
from corporeal.reconstruction.segment.instance_assignment import assign_instances
from corporeal.reconstruction.segment.object_segmentation import SpacePieces

RNG = np.random.default_rng(0)
EACH = 1500


@pytest.fixture(scope="module")
def pair():
    """Return the points of two balls of one colour that touch, and whose they are."""
    rays = RNG.normal(size=(2, EACH, 3))
    on = rays / np.linalg.norm(rays, axis=-1, keepdims=True) + [[[-1.0, 0, 0]], [[1.0, 0, 0]]]
    position, owner = on.reshape(-1, 3), np.repeat([0, 1], EACH)
    normal = (rays / np.linalg.norm(rays, axis=-1, keepdims=True)).reshape(-1, 3)
    appearance = np.ones((2 * EACH, 1), np.float32)
    seen = np.full(2 * EACH, 4)
    return (FeatureCloud(position, np.full((2 * EACH, 3), 0.5), appearance, appearance, seen), normal, owner)


def views(owner, numbers, hidden=0.5):
    """What views say of points, of which each sees a part; one point in 30 on a wrong thing."""
    said = np.stack([np.asarray(number)[owner] for number in numbers])
    wrong = RNG.random(said.shape) < 1 / 30
    said = np.where(wrong, np.stack([np.asarray(n)[1 - owner] for n in numbers]), said)
    return np.where(RNG.random(said.shape) < hidden, -1, said)


def same(found, owner):
    share = np.mean(found == owner)
    return max(share, 1 - share)


def test_numbers_that_mean_the_same_in_all_views_say_whose_points_are(pair):
    cloud, normal, owner = pair
    split = assign_instances(cloud, "auto", None, normal, views(owner, [(7, 3)] * 12))
    assert same(split.object_of_point, owner) > 0.99
    assert split.warnings == () and "mean the same in all pictures" in split.found_by
    assert split.confidence.min() >= 0 and split.confidence.mean() > 0.93


def test_what_no_view_shows_goes_with_what_is_nearest(pair):
    cloud, normal, owner = pair
    masks = views(owner, [(0, 1)] * 12)
    masks[:, ::5] = -1
    split = assign_instances(cloud, "masks", 2, normal, masks)
    assert same(split.object_of_point, owner) > 0.98


def test_crumbs_of_a_third_number_are_no_object(pair):
    cloud, normal, owner = pair
    masks = views(owner, [(0, 1)] * 12)
    masks[:, :5] = 9
    assert assign_instances(cloud, "masks", None, normal, masks).object_of_point.max() == 1


def test_numbers_that_differ_from_view_to_view_tell_what_belongs_together(pair):
    cloud, normal, owner = pair
    masks = views(owner, [RNG.permutation(2) for _ in range(12)])
    split = assign_instances(cloud, "auto", None, normal, masks)
    assert same(split.object_of_point, owner) > 0.99
    assert split.warnings == () and "matched from picture to picture" in split.found_by


def test_masks_that_cut_objects_elsewhere_in_every_view_count_beside_look(pair):
    """Each view cuts each ball into ten pieces, in another way."""
    cloud, normal, owner = pair
    masks = []
    for _ in range(12):
        seeds = cloud.position[np.r_[RNG.integers(EACH, size=10), EACH + RNG.integers(EACH, size=10)]]
        away = np.linalg.norm(cloud.position[:, None] - seeds, axis=-1)
        away[owner == 0, 10:] = away[owner == 1, :10] = np.inf
        masks.append(away.argmin(axis=1))
    split = assign_instances(cloud, "auto", 2, normal, np.stack(masks))
    assert same(split.object_of_point, owner) > 0.95
    assert "appearance and concavity and instance masks" in split.found_by


def test_masks_are_believed_before_a_count(pair):
    cloud, normal, owner = pair
    split = assign_instances(cloud, "auto", 3, normal, views(owner, [(0, 1)] * 12))
    assert split.object_of_point.max() == 1
    assert split.warnings[0].startswith("3 objects were named or counted, but instance masks show 2")


def test_the_published_rule_takes_what_touches_for_one(pair):
    cloud, normal, owner = pair
    masks = views(owner, [(0, 1)] * 12)
    split = assign_instances(cloud, "components", None, normal, masks)
    assert split.object_of_point.max() == 0 and "as published" in split.found_by


def test_masks_that_are_forgotten_or_missing(pair):
    cloud, normal, owner = pair
    split = assign_instances(cloud, "look", 2, normal, views(owner, [(0, 1)] * 12))
    assert "instance masks" not in split.found_by
    with pytest.raises(UserError, match="There are no instance masks"):
        assign_instances(cloud, "masks", 2, normal)


@pytest.mark.parametrize(
    ("rule", "count", "pieces", "found"),
    [("auto", None, 1, 1), ("look", None, 1, 2), ("auto", 2, 1, 2), ("auto", None, 2, 2)],
    ids=["touching", "asked to look", "told", "space between"],
)
def test_where_one_object_was_photographed_what_touches_is_one(pair, rule, count, pieces, found):
    cloud, normal, owner = pair
    looks = np.eye(2, dtype=np.float32)[owner]
    shifted = cloud.position + np.outer(owner, [1.0 if pieces > 1 else -0.3, 0, 0])
    unlike = replace(cloud, position=shifted, semantic=looks)
    space = SpacePieces(owner * (pieces > 1), alone=True)
    split = assign_instances(unlike, rule, count, normal, None, space)
    assert split.object_of_point.max() + 1 == found
    if found > 1:
        assert same(split.object_of_point, owner) > 0.95
    else:
        assert any("touching objects count as one" in said for said in split.warnings)

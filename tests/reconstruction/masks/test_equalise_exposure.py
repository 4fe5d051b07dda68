"""Exposures that differ from picture to picture are no colours of things."""

from dataclasses import replace

import numpy as np
from painted_scene import FLOOR, agreement, scene

from corporeal.multiview.ground_plane import GroundPlane
from corporeal.multiview.viewed_region import find_viewed_region
from corporeal.reconstruction.masks.equalise_exposure import equalise_exposure
from corporeal.reconstruction.masks.mask_seeds import seeds_from_cameras
from corporeal.reconstruction.masks.region_growing import ROUND_PICTURE_PX, grow_masks

GROUND = GroundPlane(np.array([0.0, 0.0, 1.0]), FLOOR, 0.5, 0.001)
BRICK, OAK = (0.55, 0.36, 0.27), (0.6, 0.45, 0.31)


def exposed(views, spread, seed=0):
    """The same pictures, each with an exposure and a white balance of its own."""
    random = np.random.default_rng(seed)
    gain = spread * random.normal(size=(len(views.rgb), 1, 1, 1))
    gain = gain + 0.2 * spread * random.normal(size=(len(views.rgb), 1, 1, 3))
    return replace(views, rgb=np.clip(np.round(views.rgb * np.exp(gain)), 0, 255).astype(np.uint8))


def off(views, other):
    """By how much each picture and channel differs from another one, in logarithms."""
    ratios = np.log(np.maximum(views.rgb, 1) / np.maximum(other.rgb, 1))
    return np.median(ratios, axis=(1, 2))


def test_pictures_get_one_exposure():
    views, _, _ = scene()
    before = exposed(views, 0.25)
    after = equalise_exposure(before, GROUND, find_viewed_region(views.cameras), ROUND_PICTURE_PX)
    assert off(before, views).std(axis=0).min() > 0.2
    assert off(after, views).std(axis=0).max() < 0.03


def test_without_a_floor_they_stay_as_they_are():
    views, _, _ = scene()
    assert equalise_exposure(views, None, find_viewed_region(views.cameras), ROUND_PICTURE_PX) is views


def test_an_object_is_distinguished_from_a_floor_that_is_as_brown_in_another_picture():
    views, masks, points = scene(ball=BRICK, ground=OAK)
    views = exposed(views, 0.25)
    grown = grow_masks(views, seeds_from_cameras(views, points))
    assert grown is not None
    assert agreement(grown.inside, masks).min() > 0.9

"""Where a pattern on the floor shows is no object, whatever its colours."""

from functools import partial

import numpy as np
import painted_scene
from painted_scene import FLOOR

from corporeal.core.types import Views
from corporeal.multiview.ground_plane import GroundPlane
from corporeal.multiview.viewed_region import find_viewed_region
from corporeal.reconstruction.masks.floor_pattern import shows_floor_pattern

FINER = 3
"""A patch of seven pixels must be smaller than the ball's foot."""
scene = partial(painted_scene.scene, finer=FINER)
GROUND = GroundPlane(np.array([0.0, 0.0, 1.0]), FLOOR, 0.5, 0.001)


def test_a_pattern_of_the_floor_is_distinguished_from_what_stands_on_it():
    """The ball and the floor have one colour: only the plane tells them apart."""
    views, masks, _ = scene(ball=(0.5, 0.5, 0.45), count=24)
    found = shows_floor_pattern(views, GROUND, find_viewed_region(views.cameras))
    assert found[~masks].mean() > 0.1
    assert found[masks].mean() < 0.01


def test_a_shadow_on_the_pattern_changes_nothing():
    views, _, _ = scene(count=24)
    dark = Views((0.5 * views.rgb).astype(np.uint8), views.cameras)
    around = find_viewed_region(views.cameras)
    plain, shaded = (shows_floor_pattern(v, GROUND, around) for v in (views, dark))
    assert (plain & shaded).sum() > 0.7 * plain.sum()


def test_another_plane_has_no_pattern():
    """Half a radius higher nothing lies: views from different sides do not agree about it."""
    views, masks, _ = scene(count=24)
    wrong = GroundPlane(GROUND.normal, FLOOR + 0.25, 0.5, 0.001)
    right, other = (shows_floor_pattern(views, p, find_viewed_region(views.cameras)) for p in (GROUND, wrong))
    assert other[~masks].mean() < 0.2 * right[~masks].mean()


def test_without_a_floor_or_a_pattern_nothing_is_reported():
    views, _, _ = scene()
    plain = Views(np.full_like(views.rgb, 128), views.cameras)
    around = find_viewed_region(views.cameras)
    assert not shows_floor_pattern(views, None, around).any()
    assert not shows_floor_pattern(plain, GROUND, around).any()

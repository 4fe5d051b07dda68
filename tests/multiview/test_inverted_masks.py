"""Masks of which nobody said whether white is the thing or the room."""

import numpy as np
import pytest

from corporeal.multiview.silhouette_outliers import are_masks_inverted
from corporeal.render.camera_placement import camera_from_aim
from patterned_scene import ring

CAMERAS = tuple(camera_from_aim(aim) for aim in ring(np.arange(12) * 30.0, (64, 48)))


def discs(radius, left=0):
    """A thing that takes so many pixels around the middle of each picture."""
    v, u = np.indices((48, 64))
    disc = np.hypot(u - 32 + left, v - 24) < radius
    return np.repeat(disc[None], len(CAMERAS), axis=0)


def cups():
    """Things with a hole in the middle of the pictures."""
    return discs(20) & ~discs(8)


@pytest.mark.parametrize("radius", [5, 12, 22])
def test_what_leaves_out_the_middle_and_fills_the_border_is_inverted(radius):
    assert not are_masks_inverted(discs(radius), CAMERAS)
    assert are_masks_inverted(~discs(radius), CAMERAS)


@pytest.mark.parametrize("masks", [cups(), discs(8, left=20), discs(29), discs(60), discs(30) & ~discs(8)])
def test_rings_objects_aside_and_objects_that_pictures_cut_off_are_not(masks):
    assert not are_masks_inverted(masks, CAMERAS)


def test_a_minority_of_inverted_masks_is_no_reason_to_refuse_the_rest():
    masks = discs(12)
    masks[:5] = ~masks[:5]
    assert not are_masks_inverted(masks, CAMERAS)

"""A thing of the colours of a printed floor is told from it by what the floor has at each place."""

from functools import partial

import numpy as np
import painted_scene
import pytest
from painted_scene import GREY, agreement

from corporeal.core.types import Views
from corporeal.multiview.ground_plane import GroundPlane
from corporeal.multiview.viewed_region import find_viewed_region
from corporeal.reconstruction.masks import grown_masks
from corporeal.reconstruction.masks.floor_texture import FIT_AGREES, FIT_CONTRADICTS, FIT_UNKNOWN, floor_fit
from corporeal.reconstruction.masks.grown_masks import BY_FLOOR_STATEMENT, UNSURE_OVERLAP_FRACTION, _grow_and_describe
from corporeal.reconstruction.masks.mask_quality import MAX_COLOUR_OVERLAP
from corporeal.reconstruction.masks.mask_seeds import seeds_from_cameras
from corporeal.reconstruction.masks.region_growing import grow_masks

LOW = -0.51
"""Height of the floor: not between two cells of the paint."""
scene = partial(painted_scene.scene, finer=2, floor=LOW)
GROUND = GroundPlane(np.array([0.0, 0.0, 1.0]), LOW, 0.5, 0.001)


def printed(count=20):
    """Photographs of a ball with the same dark and light spots as its floor."""
    views, masks, points = scene(ball=GREY, ground=GREY, count=count)
    spots = 120 + 3.0 * (views.rgb.astype(float) - 120)
    return Views(np.clip(spots, 8, 247).astype(np.uint8), views.cameras), masks, points


def levels(views):
    none = np.zeros(views.rgb.shape[:3], np.bool_)
    return floor_fit(views, GROUND, find_viewed_region(views.cameras), none)


def contradicted(level, where):
    return (level[where & (level != FIT_UNKNOWN)] == FIT_CONTRADICTS).mean()


def test_what_stands_on_a_print_of_its_colours_contradicts_it():
    views, masks, _ = printed()
    level = levels(views)
    assert contradicted(level, masks) > 3 * contradicted(level, ~masks)
    assert (level[~masks] == FIT_AGREES).sum() > 5 * (level[~masks] == FIT_CONTRADICTS).sum()


def test_light_that_comes_from_the_camera_is_no_contradiction():
    """A flash, and an exposure of its own: what is far is a third as bright."""
    views, masks, _ = printed()
    down = np.linspace(0.3, 1.0, views.rgb.shape[1])[None, :, None, None]
    own = np.exp(np.random.default_rng(0).normal(scale=0.1, size=(len(views.rgb), 1, 1, 3)))
    lit = np.clip(0.8 * own * down * views.rgb, 0, 255).astype(np.uint8)
    level = levels(Views(lit, views.cameras))
    assert contradicted(level, masks) > 3 * contradicted(level, ~masks)


def test_without_a_floor_nothing_is_known():
    views, _, _ = scene()
    none = np.zeros(views.rgb.shape[:3], np.bool_)
    assert (floor_fit(views, None, find_viewed_region(views.cameras), none) == FIT_UNKNOWN).all()


@pytest.mark.slow
def test_masks_on_a_print_of_their_colours_are_believed(monkeypatch):
    views, masks, points = printed()
    seeds, all_grown = seeds_from_cameras(views, points), []

    def kept(*given, **how):
        all_grown.append(grow_masks(*given, **how))
        return all_grown[-1]

    monkeypatch.setattr(grown_masks, "grow_masks", kept)
    grown, said = _grow_and_describe(views, seeds, False, lambda fraction, words: None)
    before = all_grown[0]  # by colours alone
    assert before is not None and before.alike > UNSURE_OVERLAP_FRACTION * MAX_COLOUR_OVERLAP, "colours hardly tell"
    assert BY_FLOOR_STATEMENT in said
    assert grown is not None
    gained = agreement(grown.inside, masks) - agreement(before.inside, masks)
    assert gained.mean() > 0.05

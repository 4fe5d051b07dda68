"""A thing of the colours of a printed floor is told from it by what the floor has at each place."""

import numpy as np
import painted_scene
import pytest
from painted_scene import GREY, agreement, scene

from corporeal.core.types import Views
from corporeal.multiview.ground_plane import Plane
from corporeal.multiview.region import region
from corporeal.reconstruction.masks.doubt import ALIKE
from corporeal.reconstruction.masks.floor_texture import CONTRADICTS, FITS, UNKNOWN, floor_fit
from corporeal.reconstruction.masks.grow import grow
from corporeal.reconstruction.masks.grown_masks import BY_FLOOR, UNSURE, _grown
from corporeal.reconstruction.masks.seeds import looked_at

LOW = -0.51
"""Height of the floor: not between two cells of the paint."""
GROUND = Plane(np.array([0.0, 0.0, 1.0]), LOW, 0.5, 0.001)


@pytest.fixture(autouse=True)
def finer(monkeypatch):
    monkeypatch.setattr(painted_scene, "WIDE", 2 * painted_scene.WIDE)
    monkeypatch.setattr(painted_scene, "HIGH", 2 * painted_scene.HIGH)
    monkeypatch.setattr(painted_scene, "FLOOR", LOW)


def printed(count=20):
    """Photographs of a ball with the same dark and light spots as its floor."""
    views, masks, points = scene(ball=GREY, ground=GREY, count=count)
    spots = 120 + 3.0 * (views.rgb.astype(float) - 120)
    return Views(np.clip(spots, 8, 247).astype(np.uint8), views.cameras), masks, points


def levels(views):
    none = np.zeros(views.rgb.shape[:3], np.bool_)
    return floor_fit(views, GROUND, region(views.cameras), none)


def contradicted(level, where):
    return (level[where & (level != UNKNOWN)] == CONTRADICTS).mean()


def test_what_stands_on_a_print_of_its_colours_contradicts_it():
    views, masks, _ = printed()
    level = levels(views)
    assert contradicted(level, masks) > 3 * contradicted(level, ~masks)
    assert (level[~masks] == FITS).sum() > 5 * (level[~masks] == CONTRADICTS).sum()


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
    assert (floor_fit(views, None, region(views.cameras), none) == UNKNOWN).all()


def test_masks_on_a_print_of_their_colours_are_believed():
    views, masks, points = printed()
    seeds = looked_at(views, points)
    before = grow(views, seeds)
    assert before is not None and before.alike > UNSURE * ALIKE, "colours hardly tell"
    grown, said = _grown(views, seeds, False, lambda fraction, words: None)
    assert BY_FLOOR in said
    assert grown is not None
    gained = agreement(grown.inside, masks) - agreement(before.inside, masks)
    assert gained.mean() > 0.05

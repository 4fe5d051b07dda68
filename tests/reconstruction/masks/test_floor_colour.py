"""A shadow on a floor that has a colour is floor, not a part of what casts it."""

from functools import partial

import numpy as np
import painted_scene
import pytest
from painted_scene import FLOOR, GREY, RED, agreement

from corporeal.core.types import Views
from corporeal.multiview.ground_plane import GroundPlane
from corporeal.multiview.viewed_region import find_viewed_region
from corporeal.reconstruction.masks.floor_colour import shaded_floor
from corporeal.reconstruction.masks.floor_grid import comparison_partners, floor_intersections
from corporeal.reconstruction.masks.mask_quality import mask_doubt
from corporeal.reconstruction.masks.mask_seeds import seeds_from_cameras
from corporeal.reconstruction.masks.region_growing import grow_masks

scene = partial(painted_scene.scene, finer=2)
GROUND = GroundPlane(np.array([0.0, 0.0, 1.0]), FLOOR, 0.5, 0.001)
OAK, SLATE = (0.62, 0.46, 0.32), (0.12, 0.12, 0.16)
FAINT = 0.25
"""Share of the floor's pattern that is left: in shadow it drowns in noise."""
LEFT = 0.25
"""Share of the light that reaches the floor in the shadow."""


def in_shadow(place):
    """Whether places of the floor are dark."""
    return np.hypot((place[..., 0] - 0.45) / 0.75, place[..., 1] / 0.45) < 1


def shadowed(ball, ground):
    """A ball on a floor that is lit from one side: photographs, the ball, its shadow, points."""
    views, masks, points = scene(ball=ball, ground=ground, count=20)
    rgb, shadows = views.rgb.copy(), np.zeros_like(masks)
    for k, camera in enumerate(views.cameras):
        place = floor_intersections(camera, GROUND).reshape(*masks.shape[1:], 3)
        with np.errstate(invalid="ignore"):
            shadows[k] = in_shadow(place) & ~masks[k]
        bare = rgb[k][~masks[k]]
        rgb[k][~masks[k]] = FAINT * bare + (1 - FAINT) * bare.mean(axis=0)
        rgb[k][shadows[k]] = np.round(LEFT * rgb[k][shadows[k]]).astype(np.uint8)
    clear = (points[:, 2] > FLOOR + 0.01) | ~in_shadow(points)  # dark places give no points
    return Views(rgb, views.cameras), masks, shadows, points[clear]


@pytest.mark.parametrize("ball", [RED, SLATE], ids=["red", "slate"])
def test_a_shadow_is_floor_and_what_casts_it_is_not(ball):
    views, masks, shadows, _ = shadowed(ball, OAK)
    found = shaded_floor(views, GROUND, find_viewed_region(views.cameras))
    assert found[shadows].mean() > 0.6
    assert found[masks].mean() < 0.01


@pytest.mark.slow
def test_masks_that_are_grown_leave_the_shadow_out():
    """The ball is as dark as the shadow: colours alone take both."""
    views, masks, shadows, points = shadowed(SLATE, OAK)
    grown = grow_masks(views, seeds_from_cameras(views, points))
    assert grown is not None and mask_doubt(grown) is None
    assert (grown.inside > 0.5)[shadows].mean() < 0.1
    assert agreement(grown.inside, masks).mean() > 0.9


def test_of_a_grey_floor_nothing_is_reported():
    """Whatever is grey and darker would be a shade of it."""
    views, _, _, _ = shadowed(RED, (0.5, 0.5, 0.5))
    assert not shaded_floor(views, GROUND, find_viewed_region(views.cameras)).any()


def test_without_a_floor_nothing_is_reported():
    views, _, _, _ = shadowed(RED, GREY)
    assert not shaded_floor(views, None, find_viewed_region(views.cameras)).any()


def test_views_from_any_other_side_are_asked_about_shades():
    """Of half a circle the nearest see a shadow hidden behind what casts it."""
    turns = np.linspace(0, np.pi, 30)
    slant = 1.7 * np.stack([np.cos(turns), np.sin(turns)], axis=-1)
    near, wide = comparison_partners(slant, 0), comparison_partners(slant, 0, wide=True)
    assert np.array_equal(wide[: len(near)], near)
    assert near.max() < 15 and wide.max() == 29
    assert len(wide) == 2 * len(near)

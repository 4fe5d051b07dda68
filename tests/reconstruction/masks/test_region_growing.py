"""Masks grown of a painted ball on a floor of another colour."""

from dataclasses import replace

import numpy as np
import pytest
from painted_scene import FLOOR, GREY, agreement, on_discs, scene

from corporeal.core.errors import UserError
from corporeal.core.types import Views
from corporeal.multiview.ground_plane import GroundPlane
from corporeal.reconstruction.masks import region_growing as growing
from corporeal.reconstruction.masks.floor_grid import floor_intersections
from corporeal.reconstruction.masks.mask_prompts import PicturePrompt, cut_at_prompt, seeds_from_prompt
from corporeal.reconstruction.masks.mask_quality import incompleteness_reason, mask_doubt
from corporeal.reconstruction.masks.mask_seeds import seeds_from_cameras
from corporeal.reconstruction.masks.region_growing import grow_masks
from corporeal.reconstruction.masks.total_variation import TotalVariationCutter


@pytest.mark.slow
@pytest.mark.parametrize("known", [True, False], ids=["points", "no points"])
def test_what_all_cameras_look_at_is_found(known):
    views, masks, points = scene()
    grown = grow_masks(views, seeds_from_cameras(views, points if known else None))
    assert grown is not None and mask_doubt(grown) is None and incompleteness_reason(grown) is None
    assert agreement(grown.inside, masks).mean() > 0.93
    assert agreement(grown.inside, masks).min() > 0.85


@pytest.mark.slow
def test_what_looks_like_all_around_it_is_doubted():
    """Without a colour of its own no outline is to be believed."""
    views, _, _ = scene(ball=GREY)
    assert mask_doubt(grow_masks(views, seeds_from_cameras(views, None))) is not None


def test_what_is_far_away_takes_no_part_of_its_colour_from_an_object():
    """A white ring of a red drill was lost to a white wall that never bordered on it."""
    views, masks, points = scene(belt=(0.2, 0.3, 0.8))
    grown = grow_masks(views, seeds_from_cameras(views, points))
    assert grown is not None and mask_doubt(grown) is None
    assert agreement(grown.inside, masks).mean() > 0.9


def test_what_was_moved_between_two_rounds_is_distinguished_from_all_around_it():
    """Its outlines contradict one another, so that some of it is left in what is near."""
    views, _, points = scene()
    shown = views.rgb.copy()
    shown[1::2] = np.roll(shown[1::2], 8, axis=2)
    assert mask_doubt(grow_masks(replace(views, rgb=shown), seeds_from_cameras(views, points))) is None


def test_flat_objects_of_its_colour_beside_it_are_reported():
    """Plates beside a tea pot are a pattern on the floor, as print on paper is: nobody can tell."""
    views, _, points = scene(flat=0.33)
    why = incompleteness_reason(grow_masks(views, seeds_from_cameras(views, points)))
    assert why is not None and "times as much with its colours" in why


def test_what_lies_flat_is_a_pattern_of_the_floor_unless_it_may_be_an_object():
    views, masks, points = scene(flat=0.2)
    plane = GroundPlane(np.array([0.0, 0.0, 1.0]), FLOOR, 1.0, 0.01)
    places = np.stack([floor_intersections(camera, plane).reshape(*masks.shape[1:], 3) for camera in views.cameras])
    discs = on_discs(places, 0.2) & ~masks
    for flat, least, most in ((False, 0.0, 0.1), (True, 0.95, 1.0)):
        seeds = replace(seeds_from_cameras(views, points), piece=0.005)  # a disc is a crumb of a ball
        grown = grow_masks(views, seeds, flat=flat)
        assert grown is not None
        inside = grown.inside > 0.5
        assert least <= inside[discs].mean() <= most
        assert inside[masks].mean() > 0.98
        assert (inside & ~discs & ~masks).sum() < 0.01 * discs.sum()


def test_rounds_go_on_until_masks_settle(monkeypatch):
    """A printed sheet under a pot is lost bit by bit: after four rounds half of it was left."""
    views, masks, points = scene()
    once, rounds = growing._grow_round, []

    def changing(*given):
        made = once(*given)
        assert made is not None
        rounds.append(made)
        early = len(rounds) in (1, 3, 5)
        return replace(made, masks=made.masks ^ masks) if early else made

    monkeypatch.setattr(growing, "_grow_round", changing)
    grown = grow_masks(views, seeds_from_cameras(views, points))
    assert mask_doubt(grown) is None
    assert len(rounds) == 7  # the first after which two are the same


def test_nothing_is_doubted():
    assert mask_doubt(None) is not None and incompleteness_reason(None) is None


@pytest.mark.parametrize("how", ["point", "box"])
def test_what_is_pointed_at_in_one_photograph_is_found_in_all(how):
    views, masks, points = scene()
    rows, columns = np.nonzero(masks[3])
    corners = np.array([[columns.mean(), rows.mean()]])
    if how == "box":
        low, high = (columns.min() - 4, rows.min() - 4), (columns.max() + 5, rows.max() + 5)
        corners = np.array([low, high], float)
    grown = grow_masks(views, seeds_from_prompt(views, points, PicturePrompt(3, corners)))
    assert grown is not None
    assert agreement(grown.inside, masks).mean() > 0.9


def test_a_box_leaves_out_what_is_beside_it():
    """Two balls alike: the box says which one is meant."""
    picture = np.full((60, 90, 3), 120, np.uint8)
    v, u = np.mgrid[:60, :90]
    left, right = np.hypot(u - 25, v - 30) < 12, np.hypot(u - 65, v - 30) < 12
    picture[left | right] = 200, 40, 30
    found = cut_at_prompt(picture, np.array([[10.0, 15.0], [40.0, 45.0]]))
    np.testing.assert_array_equal(found, left)


def test_pointing_at_what_is_everywhere_is_refused():
    views = scene()[0]
    plain = Views(np.full_like(views.rgb, 90), views.cameras)
    with pytest.raises(UserError, match="cannot be separated from its surroundings"):
        seeds_from_prompt(plain, None, PicturePrompt(0, np.array([[40.0, 30.0], [50.0, 40.0]])))


def test_a_cut_is_the_cheapest_of_all():
    """Against every other mask of a small picture: evidence and outline cost least."""
    random = np.random.default_rng(3)
    picture = np.full((1, 3, 4, 3), 100, np.uint8)
    evidence = random.normal(scale=4.0, size=(1, 3, 4)).astype(np.float32)
    cutter = TotalVariationCutter(picture)
    below, beside = cutter.weights[0]

    def cost(mask):
        mask = mask.astype(float)
        outline = (below[:-1] * np.abs(np.diff(mask, axis=0))).sum()
        outline += (beside[:, :-1] * np.abs(np.diff(mask, axis=1))).sum()
        return (evidence[0] * mask).sum() + outline

    every = ((np.arange(4096)[:, None] >> np.arange(12)) & 1).reshape(-1, 3, 4)
    best = min(cost(mask) for mask in every)
    assert cost(cutter.cut(evidence)[0] > 0.5) == pytest.approx(best, abs=1e-3)

"""What masks hold of what stands behind is no part of the thing, since each photograph shows other
things there."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import binary_dilation
from splat_scenes import around, blobs, pictured

from corporeal.core.types import Views
from corporeal.reconstruction.gaussians import mask_contamination as module
from corporeal.reconstruction.gaussians.gaussian_scene import MIN_CONTAMINATION_FRACTION
from corporeal.reconstruction.gaussians.mask_contamination import drop_thin_pieces, mask_contamination

THING = blobs(40)
WIDE = 5
"""Of pieces of what stands behind [px]."""


@pytest.fixture(scope="module")
def scene():
    """Photographs before a room that is of other colours in each, and right masks."""
    views, masks = pictured(THING, around(8, (64, 64), focal=80.0), (0.5, 0.5, 0.5))
    rng = np.random.default_rng(3)
    rooms = np.repeat(np.repeat(rng.integers(0, 256, (8, 8, 8, 3), np.uint8), 8, 1), 8, 2)
    return Views(np.where(masks[..., None], views.rgb, rooms), views.cameras), masks


def found(views, masks):
    return mask_contamination(THING, views, masks, threads=1)


def beside(masks):
    """A piece at the right of the widest row of each mask."""
    pieces = np.zeros_like(masks)
    for piece, mask in zip(pieces, masks, strict=True):
        row = int(mask.sum(axis=1).argmax())
        end = int(np.flatnonzero(mask[row])[-1]) + 1
        piece[row - 3 : row + 3, end : end + WIDE] = True
    return pieces & ~masks


def test_pieces_of_what_stands_behind_are_found_and_little_else(scene):
    views, masks = scene
    pieces = beside(masks)
    odd = found(views, masks | pieces)
    assert np.count_nonzero(drop_thin_pieces(odd, masks | pieces)) > MIN_CONTAMINATION_FRACTION * np.count_nonzero(
        masks
    )
    assert np.count_nonzero(odd & pieces) > 0.8 * np.count_nonzero(pieces)
    assert np.count_nonzero(odd & masks) < 0.1 * np.count_nonzero(pieces)


@pytest.mark.parametrize("exposed", [(1.0, 1.0, 1.0), (0.6, 0.7, 0.5)])
def test_right_masks_stay_and_outlines_that_err_by_a_pixel(scene, exposed):
    views, masks = scene
    gains = np.ones((8, 1, 1, 3))
    gains[::2] = exposed
    shown = Views(np.round(gains * views.rgb).astype(np.uint8), views.cameras)
    wider = np.stack([binary_dilation(mask) for mask in masks])
    for some in (masks, wider):
        assert np.count_nonzero(found(shown, some)) < MIN_CONTAMINATION_FRACTION * np.count_nonzero(some)


def test_what_is_thin_is_not_learned_and_is_no_reason_to_learn_again(scene):
    """Of the legs of a chair Gaussians show nothing: these alone are no reason to learn again."""
    views, masks = scene
    legs = np.zeros_like(masks)
    legs[:, :30, 30:33] = True  # from the top of the picture into the thing
    assert np.count_nonzero(legs & ~masks) > 8 * 3 * 5
    odd = found(views, masks | legs)
    assert (odd & legs)[:, :10].any() and not (drop_thin_pieces(odd, masks | legs) & legs)[:, :10].any()


def test_a_highlight_within_is_the_objects(scene):
    views, masks = scene
    rgb = views.rgb.copy()
    rgb[:, 29:35, 29:35] = 255
    assert masks[:, 27:37, 27:37].all()
    odd = found(Views(rgb, views.cameras), masks)
    assert not odd[:, 27:37, 27:37].any()


@pytest.mark.parametrize(("paint", "strange"), [((75, 75, 75), False), ((-75, -75, -75), False), ((85, -85, 0), True)])
def test_what_is_but_lighter_or_darker_at_the_rim_is_the_objects(paint, strange):
    dull = replace(THING, sh=0.3 * THING.sh)
    views, masks = pictured(dull, around(8, (64, 64), focal=80.0), (0.5, 0.5, 0.5))
    row = int(masks[0].sum(axis=1).argmax())
    end = int(np.flatnonzero(masks[0][row])[-1]) + 1
    place = 0, slice(row - 4, row + 4), slice(end - 8, end)
    rgb = views.rgb.astype(int)
    rgb[place] += np.array(paint)
    assert rgb.min() >= 0 and rgb.max() <= 255
    odd = mask_contamination(dull, Views(rgb.astype(np.uint8), views.cameras), masks, threads=1)
    assert (np.count_nonzero(odd[place]) > 20) == strange


def test_a_view_of_which_much_is_unexplained_says_nothing_of_its_mask(scene):
    views, masks = scene
    rgb, moved = views.rgb.copy(), masks.copy()
    rgb[2], moved[2] = np.roll(rgb[2], 25, axis=1), np.roll(masks[2], 25, axis=1)
    assert not found(Views(rgb, views.cameras), moved)[2].any()


def test_what_shows_nothing_says_nothing(scene, monkeypatch):
    views, masks = scene
    real = module.render_depth

    def empty(*given):
        seen = real(*given)
        seen.depth[:] = np.inf
        return seen

    monkeypatch.setattr(module, "render_depth", empty)
    assert not found(views, masks).any()

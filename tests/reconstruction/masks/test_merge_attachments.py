"""What hangs on a thing in another colour is taken in, and what does not is not."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from painted_scene import agreement, grown_scene, scene

from corporeal.core.errors import BadFileError
from corporeal.io.photos.transforms_json import write_views
from corporeal.reconstruction.gaussian_source import find_or_grow_masks, gaussians_from_source
from corporeal.reconstruction.masks import grown_masks as module
from corporeal.reconstruction.masks.grown_masks import OTHER_COLOURS_STATEMENT
from corporeal.reconstruction.masks.mask_attachments import MaskAttachments
from corporeal.reconstruction.masks.mask_prompts import MaskPrompt
from corporeal.reconstruction.masks.mask_quality import lacking_attachment_reason
from corporeal.reconstruction.masks.merge_attachments import merge_attachments
from corporeal.reconstruction.reconstruct_config import ReconstructConfig


def unheard(fraction, words):
    """Progress that nobody is told of."""


@cache
def before_and_after(other):
    views, masks, seeds, grown = grown_scene(other)
    return masks, grown, merge_attachments(views, seeds, grown, unheard)


@pytest.mark.slow
def test_a_head_of_another_colour_is_taken_in():
    """A hammer in the colours of its handle lost its grey head."""
    masks, before, after = before_and_after("head")
    assert agreement(before.inside, masks).mean() < 0.9, "colours alone do not tell"
    assert agreement(after.inside, masks).mean() > 0.93


@pytest.mark.slow
def test_a_small_object_close_beside_it_is_taken_in():
    """Its hull is a piece of its own, of less than a tenth of the ball's, and no crumb."""
    masks, before, after = before_and_after("close")
    assert agreement(before.inside, masks).mean() < 0.9, "colours alone do not tell"
    assert agreement(after.inside, masks).mean() > 0.93


@pytest.mark.slow
@pytest.mark.parametrize("other", [None, "ball", "disc"])
def test_what_does_not_touch_it_or_lies_there_is_not(other):
    _, before, after = before_and_after(other)
    assert after is before


@pytest.mark.slow
def test_what_is_not_held_in_the_end_is_not_taken():
    """Hanging pixels that have the floor's colours: growing does not believe them."""
    views, _, seeds, grown = grown_scene()
    beside = np.roll(grown.masks, 20, axis=2) & ~grown.masks
    grown = replace(grown, hanging=MaskAttachments(beside, beside))
    assert merge_attachments(views, seeds, grown, unheard) is grown


def test_a_run_says_that_it_was(tmp_path, monkeypatch):
    views, _, _ = scene(other="head")
    _, before, after = before_and_after("head")
    monkeypatch.setattr(module, "grow_masks", lambda *_, **how: before)
    monkeypatch.setattr(module, "merge_attachments", lambda *given: after)
    photos, made = tmp_path / "photos", tmp_path / "made"
    write_views(photos, views)
    found = find_or_grow_masks(ReconstructConfig(), photos, made, unheard)
    assert OTHER_COLOURS_STATEMENT in " ".join(found.warnings)
    assert not any("was left out" in said for said in found.warnings)


@pytest.mark.parametrize("share", [0.3, 0.7])
def test_much_that_borders_on_it_and_was_not_taken_in_ends_the_run(tmp_path, monkeypatch, share):
    views, _, _, grown = grown_scene()
    rows = np.arange(len(grown.masks[0]))[:, None]
    above = np.cumsum(grown.masks.sum(axis=2), axis=1) / grown.masks.sum(axis=(1, 2))[:, None]
    some = np.roll(grown.masks & (above < share)[:, rows], 20, axis=2) & ~grown.masks
    grown = replace(grown, hanging=MaskAttachments(some, some))
    why = lacking_attachment_reason(grown)
    assert (why is not None) == (share > 0.5)
    monkeypatch.setattr(module, "grow_masks", lambda *_, fitting=False: grown)
    monkeypatch.setattr(module, "merge_attachments", lambda *given: given[2])
    write_views(tmp_path / "photos", views)
    if why is not None:
        with pytest.raises(BadFileError, match="borders on it"):
            gaussians_from_source(tmp_path / "photos", ReconstructConfig(), tmp_path, unheard)


def test_who_points_at_a_part_hears_that_something_borders_on_it(tmp_path, monkeypatch):
    """Of a flowerpot that was pointed at masks held the lower half, without a word."""
    views, masks, _, grown = grown_scene()
    write_views(tmp_path / "photos", views)
    more = np.roll(grown.masks, grown.masks.shape[2] // 3, axis=2) & ~grown.masks
    for hangs, told in ((MaskAttachments(more, more), True), (None, False)):
        made = replace(grown, hanging=hangs)
        monkeypatch.setattr(module, "grow_masks", lambda *_, made=made: made)
        row, column = np.argwhere(masks[0] > 0).mean(axis=0)
        at = MaskPrompt("", (float(column), float(row)), None)
        said = module.grown_masks(tmp_path / "photos", tmp_path / f"{told}", at).said
        assert any("It may be a part" in sentence for sentence in said) == told


def test_masks_that_test_poses_do_not_ask_the_floor_that_these_know(monkeypatch):
    """Of an axe head that was turned over, poses of the card under it were believed so."""
    views, _, seeds, grown = grown_scene()
    asked = []

    def again(*_, fitting=False):
        asked.append(fitting)
        return replace(grown, alike=0.15 - 0.1 * fitting, coherence=0.8 + 0.1 * fitting)

    monkeypatch.setattr(module, "grow_masks", again)
    monkeypatch.setattr(module, "merge_attachments", lambda *given: given[2])
    for unsure, found in ((module.UNSURE_OVERLAP_FRACTION, 0.9), (1.0, 0.8)):
        asked.clear()
        masks, _ = module._grow_and_describe(views, seeds, False, unheard, unsure)
        assert masks is not None and masks.coherence == found
        assert any(asked) == (found == 0.9)

"""What outlines are worth: seen, not too thin, and of what stands on the floor."""

from dataclasses import replace

import numpy as np
import pytest
from painted_scene import scene

from corporeal.io.photos.transforms_json import write_views
from corporeal.reconstruction.masks import grown_masks as module
from corporeal.reconstruction.masks.mask_attachments import MaskAttachments
from corporeal.reconstruction.masks.mask_quality import (
    lacking_attachment_reason,
    mask_doubt,
    outlines_contradict,
    thinness_reason,
)
from corporeal.reconstruction.masks.mask_seeds import seeds_from_cameras
from corporeal.reconstruction.masks.outline_quality import faint_outline_fraction, rim_fraction
from corporeal.reconstruction.masks.region_growing import grow_masks

HIGH, WIDE = 60, 80
LOW, LEFT, SIDE = 20, 30, 20


@pytest.fixture(scope="module")
def grown():
    views, _, _ = scene()
    found = grow_masks(views, seeds_from_cameras(views, None))
    assert found is not None
    return found


def on_a_lit_table():
    """A white square before a table whose light falls off to the right."""
    picture = np.linspace(160, 60, WIDE)[None, :, None] * np.array([1.0, 0.8, 0.6])
    picture = np.repeat(picture, HIGH, axis=0)
    inside = np.zeros((1, HIGH, WIDE), np.float32)
    inside[0, LOW : LOW + SIDE, LEFT : LEFT + SIDE] = 1
    picture[inside[0] > 0] = 240
    return np.round(picture)[None].astype(np.uint8), inside


def test_masks_that_hold_a_piece_of_the_table_have_outlines_without_an_edge():
    """A bin by flash had a third of the table behind it in its masks, and they were believed."""
    rgb, inside = on_a_lit_table()
    assert faint_outline_fraction(rgb, inside) == 0
    inside[0, LOW : LOW + SIDE, LEFT : LEFT + 2 * SIDE] = 1
    assert 0.4 < faint_outline_fraction(rgb, inside) < 0.75


def test_an_outline_at_the_border_of_the_picture_needs_no_edge():
    rgb, inside = on_a_lit_table()
    assert faint_outline_fraction(rgb[:, LOW:, LEFT:], inside[:, LOW:, LEFT:]) == 0


def test_how_thin_masks_are():
    _, inside = on_a_lit_table()
    assert rim_fraction(inside) == pytest.approx((4 * SIDE - 4) / SIDE**2)
    assert rim_fraction(np.zeros_like(inside)) == 0


@pytest.mark.slow
def test_right_masks_have_edges_and_stand_on_the_floor(grown):
    assert grown.faint < 0.02 and mask_doubt(grown) is None
    assert lacking_attachment_reason(grown) is None and thinness_reason(grown) is None
    assert "show no edge" in (mask_doubt(replace(grown, faint=0.2)) or "")


@pytest.mark.parametrize(
    ("of", "told"),
    [({}, False), ({"coherence": 0.6}, True), ({"settled": 0.0}, True),
     ({"coherence": 0.6, "alike": 0.5}, False)],
)  # fmt: skip
def test_outlines_that_contradict_each_other_are_distinguished_from_all_else(grown, of, told):
    """By what was found: it went by how the sentence begins."""
    assert outlines_contradict(replace(grown, **of)) == told
    assert (mask_doubt(replace(grown, **of)) is None) == (not of)
    assert not outlines_contradict(None) and mask_doubt(None)


def test_of_what_hovers_less_needs_to_stand_under_it(grown):
    """An armchair lost its legs: masks hovered, and a third as much stood under them."""
    rows = np.cumsum(grown.masks.sum(axis=2), axis=1) / grown.masks.sum(axis=(1, 2))[:, None]
    some = np.roll(grown.masks & (rows < 0.4)[..., None], 20, axis=2) & ~grown.masks
    legs = replace(grown, hanging=MaskAttachments(some, some), lowest=0.0)
    assert lacking_attachment_reason(legs) is None
    assert "hovers above the floor" in (lacking_attachment_reason(replace(legs, lowest=0.1)) or "")
    assert lacking_attachment_reason(replace(grown, hanging=None, lowest=0.1)) is None, "nothing is under it"


def test_masks_of_what_is_too_thin_end_the_run(grown, tmp_path, monkeypatch):
    """Of a chain a pixel along its outline was a quarter; a video of a thicker one came out."""
    write_views(tmp_path / "photos", scene()[0])
    thin = replace(grown, thinness=0.24)
    monkeypatch.setattr(module, "_grow_and_describe", lambda *_: (thin, []))
    found = module.grown_masks(tmp_path / "photos", tmp_path / "made")
    assert "too thin in the photographs" in found.incomplete and "24%" in found.incomplete

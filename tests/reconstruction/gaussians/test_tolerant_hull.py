"""Carving where outlines are off by some pixels, as those drawn by hand are."""

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt, gaussian_filter
from splat_scenes import around
from test_visual_hull import masks_of

from corporeal.core.types import Views
from corporeal.reconstruction.gaussians.hull_config import DEFAULT_HULL, HullConfig
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.gaussians.visual_hull import carve_hull

CENTRES = np.array([[0, 0, 0], [0.5, 0.1, 0.2], [-0.4, 0.3, -0.2], [0.1, -0.45, 0.3]])
RADII = np.array([0.35, 0.2, 0.25, 0.2])
SIDE = 160
STRICT = HullConfig(min_mask_fill_fraction=0.0)
"""Takes masks at their word."""


def wobbly(masks, pixels, seed=0):
    """Outlines moved in and out by up to so many pixels, in every view otherwise."""
    random, made = np.random.default_rng(seed), []
    for mask in masks:
        noise = gaussian_filter(random.normal(size=mask.shape), 6)
        shift = pixels * np.clip(noise / noise.std() / 1.5, -1, 1)
        made.append(distance_transform_edt(mask) - distance_transform_edt(~mask) > shift)
    return np.stack(made)


def kept_and_added(masks, cameras, config=DEFAULT_HULL):
    """Shares of the balls' volume that the hull keeps, and that it has beside them."""
    views = Views(np.zeros((*masks.shape, 3), np.uint8), cameras)
    with ThreadPool(1) as pool:
        made = carve_hull(np.full(3, -0.9), np.full(3, 0.9), views, masks, pool, config)
    true = np.zeros(made.inside.shape, bool)
    for centre, radius in zip(CENTRES, RADII, strict=True):
        true |= np.square(made.cells - centre).sum(axis=-1) < radius**2
    return (made.inside & true).sum() / true.sum(), (made.inside & ~true).sum() / true.sum()


@pytest.mark.slow
@pytest.mark.parametrize("count", [12, 30])
def test_outlines_that_are_off_by_ten_of_640_pixels_eat_little(count):
    cameras = around(count, (SIDE, SIDE), focal=1.3 * SIDE)
    masks = wobbly(masks_of(CENTRES, RADII, cameras), 10 * SIDE / 640)
    kept, added = kept_and_added(masks, cameras)
    strict, _ = kept_and_added(masks, cameras, STRICT)
    assert strict < 0.93, "the control eats"
    assert 1 - kept < 0.6 * (1 - strict)
    assert added < 0.2


def test_exact_outlines_are_taken_at_their_word():
    cameras = around(24, (SIDE, SIDE), focal=1.3 * SIDE)
    masks = masks_of(CENTRES, RADII, cameras)
    found = kept_and_added(masks, cameras)
    assert found == kept_and_added(masks, cameras, STRICT)
    assert found[0] > 0.98

"""Things are told from the floor they stand on without masks, by where Gaussians are."""

from dataclasses import replace

import numpy as np
import pytest
from splat_scenes import around, blobs, pictured

from corporeal.core.types import Gaussians
from corporeal.geometry.gaussian_transforms import gaussian_subset
from corporeal.geometry.spherical_harmonics import SH_DC_COEFFICIENT
from corporeal.reconstruction.gaussians.swept_floor_masks import masks_above_floor

CAMERAS = around(24, (96, 80), focal=100.0, centre=(0, 0, 0.3))[:14]
FLAT = 0.002
FLOOR, POST, SPECK = range(3)


def some(mean, scale, colour):
    """Return opaque Gaussians at some places."""
    base, count = blobs(len(mean)), len(mean)
    size = np.broadcast_to(np.asarray(scale, dtype=float), (count, 3)).copy()
    sh = (np.broadcast_to(colour, (count, 3))[:, None] - 0.5) / SH_DC_COEFFICIENT
    return replace(base, mean=mean, scale=size, opacity=np.full(count, 0.97), sh=sh)


def grid(*axes):
    return np.stack([a.ravel() for a in np.meshgrid(*axes)], axis=1)


@pytest.fixture(scope="module")
def scene():
    """Return a round post on a floor of its own colour, its black shadow, and a speck in the air.

    The post's lowest Gaussians are lost in the floor's layer.
    """
    line = np.arange(-0.9, 0.91, 0.02)
    flat = grid(line, line, [0.0])
    shadow = np.linalg.norm((flat - [0.5, 0, 0]) / [0.4, 0.25, 1], axis=1) < 1
    floor = some(flat, (0.015, 0.015, FLAT), np.where(shadow[:, None], 0.02, 0.6))
    turn, z = grid(np.arange(0, 2 * np.pi, 0.06), np.arange(0.012, 0.61, 0.015)).T
    side = np.stack([0.3 * np.cos(turn), 0.3 * np.sin(turn), z], axis=1)
    lid = grid(np.arange(-0.3, 0.31, 0.02), np.arange(-0.3, 0.31, 0.02), [0.6])
    post = some(np.concatenate([side, lid[np.linalg.norm(lid[:, :2], axis=1) < 0.3]]), 0.012, 0.6)
    speck = some(np.array([[0.5, 0.5, 0.5]]), 0.02, 0.6)
    kinds = floor, post, speck
    whole = Gaussians(*(np.concatenate([getattr(g, f) for g in kinds]) for f in vars(floor) if f != "warnings"))
    return whole, np.repeat(np.arange(3), [g.count for g in kinds])


def test_a_shadow_is_none_of_the_object_that_stands_on_a_floor_of_its_colour(scene):
    whole, kind = scene
    _, true = pictured(gaussian_subset(whole, kind == POST), CAMERAS)
    found = masks_above_floor(whole, CAMERAS, floor=True, threads=1)
    assert not (found & ~true).any()
    assert (found & true).sum() / true.sum() > 0.95


def test_what_is_lost_in_the_floors_layer_goes_on_as_above_it(scene):
    whole, kind = scene
    _, true = pictured(gaussian_subset(whole, kind == POST), CAMERAS)
    found = masks_above_floor(whole, CAMERAS, floor=True, threads=1, layer_radii=0.05)
    low, least = ([np.flatnonzero(m.any(axis=1))[-1] for m in masks] for masks in (found, true))
    assert np.abs(np.subtract(low, least)).max() <= 1


def test_specks_in_the_air_are_no_objects_and_without_objects_nothing_is_left(scene):
    whole, kind = scene
    _, true = pictured(gaussian_subset(whole, kind == SPECK), CAMERAS)
    _, post = pictured(gaussian_subset(whole, kind == POST), CAMERAS)
    assert (true & ~post).any()
    assert not (masks_above_floor(whole, CAMERAS, floor=True, threads=1) & true & ~post).any()
    assert not masks_above_floor(gaussian_subset(whole, kind == FLOOR), CAMERAS, floor=True, threads=1).any()

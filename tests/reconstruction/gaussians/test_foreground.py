"""Things are told from floor, background and haze."""

from dataclasses import replace

import numpy as np
import pytest
from splat_scenes import around, blobs, pictured

from corporeal.core.errors import UserError
from corporeal.core.types import Gaussians
from corporeal.multiview.point_cloud_geometry import nearest_neighbours, point_normals
from corporeal.reconstruction.features.point_descriptor import MAX_SHOWING_THROUGH_FRACTION, mean_view_directions
from corporeal.reconstruction.gaussians.foreground import (
    assign_hidden_gaussians,
    foreground_gaussians,
    gaussian_visibility,
    gaussians_below_floor,
)

CAMERAS = around(24, (64, 64), focal=80.0, centre=(0, 0, 0.4))[:14]


def joined(*some):
    """Return several sets of Gaussians as one, and which set each is of."""
    fields = ("mean", "rotation", "scale", "opacity", "sh")
    whole = Gaussians(*(np.concatenate([getattr(g, f) for g in some]) for f in fields))
    return whole, np.repeat(np.arange(len(some)), [g.count for g in some])


def like(mean, scale, opacity=0.9, seed=1):
    """Return Gaussians at some places."""
    mean = np.asarray(mean, dtype=float)
    count = len(mean)
    base = blobs(count, seed)
    size = np.broadcast_to(np.asarray(scale, dtype=float), (count, 3))
    return replace(base, mean=mean, scale=np.array(size), opacity=np.full(count, opacity))


@pytest.fixture(scope="module")
def scene():
    """Return things on a floor before a wall, with haze; and what is what."""
    rng = np.random.default_rng(0)
    things = like(rng.normal(size=(80, 3)) * 0.1 + [0, 0, 0.4], 0.04)
    x, y = np.meshgrid(np.arange(-1.2, 1.3, 0.1), np.arange(-1.2, 1.3, 0.1))
    floor = like(np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1), (0.06, 0.06, 0.004), 0.95)
    turn = np.linspace(0, 2 * np.pi, 60)
    wall = like(np.stack([4 * np.cos(turn), 4 * np.sin(turn), 0 * turn + 0.5], axis=1), 0.3)
    haze = like(rng.normal(size=(20, 3)) * 0.2 + [0, 0, 0.4], 0.1, 0.02)
    return joined(things, floor, wall, haze)


def test_without_masks_objects_are_above_the_floor_and_in_the_middle(scene):
    gaussians, kind = scene
    found = foreground_gaussians(gaussians, CAMERAS, gaussian_visibility(gaussians, CAMERAS, threads=1))
    assert found[kind == 0].mean() > 0.95
    assert not found[kind == 1].any()
    assert not found[kind == 2].any()
    assert not found[kind == 3].any()


def test_with_masks_what_shows_outside_them_is_not_of_the_objects(scene):
    gaussians, kind = scene
    alone = replace(gaussians, opacity=np.where(kind == 0, gaussians.opacity, 0))
    _, masks = pictured(alone, CAMERAS)
    found = foreground_gaussians(gaussians, CAMERAS, gaussian_visibility(gaussians, CAMERAS, masks, threads=1))
    assert found[kind == 0].mean() > 0.95
    assert found[kind != 0].mean() < 0.02


def test_what_shows_is_summed_over_pictures(scene):
    gaussians, _ = scene
    seen = gaussian_visibility(gaussians, CAMERAS, threads=1)
    _, masks = pictured(gaussians, CAMERAS)
    half = np.zeros_like(masks)
    half[:, :, :32] = True
    left = gaussian_visibility(gaussians, CAMERAS, half, threads=1)
    right = gaussian_visibility(gaussians, CAMERAS, ~half, threads=1)
    np.testing.assert_allclose(left.weight, seen.weight, rtol=1e-5)
    np.testing.assert_allclose(left.inside + right.inside, seen.weight, rtol=1e-5, atol=1e-6)
    assert (seen.views <= len(CAMERAS)).all()
    nothing = gaussian_visibility(replace(gaussians, opacity=0 * gaussians.opacity), CAMERAS, threads=1)
    assert not nothing.weight.any() and not nothing.views.any()


def test_a_mask_is_needed_for_each_camera(scene):
    with pytest.raises(UserError, match="3 masks for"):
        gaussian_visibility(scene[0], CAMERAS, np.ones((3, 64, 64), bool))


def ball(count, scale, opacity=0.9):
    """Return Gaussians on a sphere of radius 0.3 that stands on the floor; and where they face."""
    k = np.arange(count) + 0.5
    z, turn = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    flat = np.sqrt(1 - z * z)
    out = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
    return like(0.3 * out + [0, 0, 0.3], scale, opacity), out


@pytest.mark.parametrize("opacity", [0.8, 0.95])
def test_undersides_face_down_though_light_comes_through_from_above(opacity):
    gaussians, out = ball(800, 0.018, opacity)
    seen = gaussian_visibility(gaussians, CAMERAS, threads=1)
    below = out[:, 2] < -0.8
    assert (seen.share[:, below].max(axis=0) > 0.01).mean() > 0.9
    assert 0.3 < np.median(seen.share[:, out[:, 2] > 0.5].max(axis=0)) < 0.95
    towards = mean_view_directions(gaussians.mean, CAMERAS, list(seen.share), MAX_SHOWING_THROUGH_FRACTION)
    normal = point_normals(gaussians.mean, nearest_neighbours(gaussians.mean, 16), towards)
    assert ((normal * out).sum(axis=1) > 0).mean() > 0.995


def test_gaussians_that_are_more_than_pixels_belong_to_objects_too():
    gaussians, out = ball(20_000, 0.002)
    found = foreground_gaussians(gaussians, CAMERAS, gaussian_visibility(gaussians, CAMERAS, threads=1), floor=False)
    assert found[out[:, 2] > -0.2].mean() > 0.9


def test_what_is_faint_goes_with_the_object_that_it_reaches_and_the_floor_stays():
    rng = np.random.default_rng(0)
    thing = like(rng.normal(size=(200, 3)) * 0.02 + [0, 0, 0.4], 0.01)
    rim = like([[0.3, 0, 0.4], [0.2, 0.2, 0.4]], 0.13, 0.03)
    wall = like([[0.3, 0, 0.4]], 0.13, 0.9)
    haze = like([[0.9, 0, 0.4]], 0.13, 0.03)
    floor = like([[0, 0, 0.0]], 0.3, 0.03)
    whole, kind = joined(thing, rim, wall, haze, floor)
    made = assign_hidden_gaussians(whole, np.where(kind == 0, 7, -1), floor=True)
    assert (made == np.where(kind < 2, 7, -1)).all()
    assert (assign_hidden_gaussians(whole, np.where(kind == 0, 7, -1), floor=False) == 7).all()


def test_what_is_below_the_floor_is_not_drawn_with_an_object_but_for_the_floors_error():
    heights = np.array([0.3, -0.001, -0.05, -0.05])
    gaussians = like(np.stack([0 * heights, 0 * heights, heights], axis=1), 0.02)
    assert gaussians_below_floor(gaussians, np.array([0, 0, 0, -1]), 0.4).tolist() == [False, False, True, False]

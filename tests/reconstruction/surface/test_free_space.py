"""What cameras see between tells things apart, and a lack of Gaussians does not."""

import numpy as np
import pytest
import trimesh
from splat_scenes import clad, eyes, pictured, together

from corporeal.core.types import Gaussians
from corporeal.geometry.gaussian_transforms import gaussian_subset
from corporeal.geometry.spherical_harmonics import SH_DC_COEFFICIENT
from corporeal.reconstruction.surface.free_space import pieces_by_free_space
from corporeal.reconstruction.surface.surface_config import FreeSpaceConfig

SMALL = FreeSpaceConfig(grid_cells=60_000, threads=1)


def ball(middle, radius=0.25, count=1500):
    return clad(trimesh.creation.icosphere(3, radius).apply_translation(middle), count)


def rod(low, high, radius, needles):
    """Standing needles, end to end and side by side, as a plain neck is learned."""
    turn = np.arange(needles) * 2.4
    flat = radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    height = np.linspace(low, high, needles)
    long = (high - low) / 4
    return Gaussians(
        mean=np.column_stack([flat, height]),
        rotation=np.tile([1.0, 0, 0, 0], (needles, 1)),
        scale=np.tile([0.004, 0.004, long], (needles, 1)),
        opacity=np.full(needles, 0.95),
        sh=np.full((needles, 1, 3), 0.3 / SH_DC_COEFFICIENT),
    )


def found(gaussians, of_object=None, masks=None):
    mine = np.ones(gaussians.count, bool) if of_object is None else of_object
    return pieces_by_free_space(gaussians.mean[mine], gaussians, mine, eyes(), masks, SMALL)


def test_objects_apart_are_distinguished_and_most_points_come_first():
    whole, owner = together(ball((0.6, 0, 0.25), count=900), ball((-0.4, 0, 0.4), 0.4, 3000), ball((0.6, 0.7, 0.25)))
    np.testing.assert_array_equal(found(whole), np.array([2, 0, 1])[owner])


def test_objects_that_touch_are_one_to_space():
    whole, _ = together(ball((-0.25, 0, 0.25)), ball((0.25, 0, 0.25)))
    assert not found(whole).any()


def vase():
    return together(ball((0, 0, 0.3), 0.3, 3000), rod(0.55, 0.95, 0.01, 13), ball((0, 0, 1), 0.1, 400))[0]


@pytest.mark.parametrize("draw", [None, 0, 1, 2])
def test_an_object_with_a_plain_neck_of_few_long_gaussians_is_one(draw):
    whole = vase()
    if draw is not None:
        whole = gaussian_subset(whole, np.random.default_rng(draw).random(whole.count) < 0.98)
    assert not found(whole).any()


def test_without_its_neck_it_is_two():
    whole = vase()
    neck = (whole.mean[:, 2] > 0.62) & (whole.mean[:, 2] < 0.88)
    assert found(gaussian_subset(whole, ~neck & (whole.scale.max(axis=1) < 0.09))).max() == 1


def test_a_leg_that_carving_leaves_crumbs_of_breaks_nothing():
    leg = clad(trimesh.creation.cylinder(0.004, 0.8, sections=8).apply_translation((0, 0, 0.5)), 600)
    whole, _ = together(ball((0, 0, 1), 0.2), leg, ball((0, 0, 0.1), 0.1, 600))
    assert not found(whole).any()


def test_haze_between_objects_builds_no_bridge():
    gap = np.column_stack([np.linspace(-0.2, 0.2, 12), np.zeros(12), np.full(12, 0.25)])
    haze = Gaussians(
        gap, np.tile([1.0, 0, 0, 0], (12, 1)), np.full((12, 3), 0.03), np.full(12, 0.08), np.zeros((12, 1, 3))
    )
    whole, owner = together(ball((-0.5, 0, 0.25)), ball((0.5, 0, 0.25)), haze)
    label = found(whole)
    np.testing.assert_array_equal(label[owner < 2], owner[owner < 2] ^ label[0])


def test_a_floor_joins_nothing_that_stands_on_it():
    ground = clad(trimesh.creation.box((4, 4, 0.01)).apply_translation((0, 0, 0.01)), 4000)
    whole, owner = together(ball((-0.5, 0, 0.25)), ball((0.5, 0, 0.25), count=1000), ground)
    np.testing.assert_array_equal(found(whole, owner < 2), owner[owner < 2])


def test_what_masks_have_nothing_of_is_no_bridge():
    bar = clad(trimesh.creation.box((1.0, 0.1, 0.1)).apply_translation((0, 0, 0.25)), 1000)
    balls, _ = together(ball((-0.5, 0, 0.25)), ball((0.5, 0, 0.25), count=1000))
    whole, owner = together(balls, bar)
    assert not found(whole).any()
    label = found(whole, masks=pictured(balls, eyes())[1])
    np.testing.assert_array_equal(label[owner == 0], np.repeat([0, 1], [1500, 1000])[: balls.count])

"""Discs below a closed surface fill what learned Gaussians leave thin, and close no mouth."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from splat_scenes import around

from corporeal.core.types import Gaussians
from corporeal.geometry.gaussian_transforms import gaussian_subset
from corporeal.geometry.spherical_harmonics import SH_DC_COEFFICIENT
from corporeal.reconstruction.gaussians.depth_rendering import render_depth
from corporeal.reconstruction.gaussians.rasteriser_numba import render
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.surface.backing_surfels import add_backing_surfels
from corporeal.reconstruction.surface.closed_surface import ClosedSurface

CELL = 0.02
RED, BLUE = (0.8, 0.2, 0.1), (0.1, 0.2, 0.8)
SIDES = around(12, (96, 96), 3.0, 100.0)
ABOVE = tuple(c for c in SIDES if c.world_from_camera[2, 3] > 0.5)
BELOW = tuple(c for c in SIDES if c.world_from_camera[2, 3] < -0.9)


def solid(mesh):
    return ClosedSurface(
        vertices=np.asarray(mesh.vertices),
        triangles=np.asarray(mesh.faces),
        colours=np.tile(RED, (len(mesh.vertices), 1)),
        gaussian_of_vertex=np.zeros(len(mesh.vertices), int),
        cell=CELL,
    )


def ball(radius=0.5, fine=5):
    return trimesh.creation.icosphere(fine, radius)


def round_ones(places, opacity, colour=RED, wide=0.03):
    count = len(places)
    return Gaussians(
        mean=np.asarray(places, np.float32),
        rotation=np.tile(np.float32([1, 0, 0, 0]), (count, 1)),
        scale=np.full((count, 3), wide, np.float32),
        opacity=np.full(count, opacity, np.float32),
        sh=np.tile((np.float32(colour) - 0.5) / SH_DC_COEFFICIENT, (count, 1, 1)).astype(np.float32),
    )


def seen_by(gaussians, cameras):
    with ThreadPool(1) as pool:
        return render_depth(gaussians, cameras, pool)


def middle(gaussians, camera):
    """What is seen of the middle of the picture: colour and what is covered."""
    picture = render(gaussians, camera, threads=1)
    return picture.rgb[46:50, 46:50].mean(axis=(0, 1)), picture.alpha[46:50, 46:50].mean()


def test_an_unphotographed_place_is_no_hole_into_a_shell():
    whole = round_ones(ball(fine=4).vertices, 0.9, BLUE)
    upper = gaussian_subset(whole, whole.mean[:, 2] > 0.0)
    owner = np.zeros(upper.count, int)
    shown, of = add_backing_surfels(upper, owner, [solid(ball())], seen_by(upper, ABOVE))
    assert (of == 0).all() and len(of) == shown.count
    np.testing.assert_array_equal(shown.mean[: upper.count], upper.mean)
    for camera in BELOW:
        colour, _ = middle(upper, camera)
        assert colour[2] > 2 * colour[0], "the far side, from within"
        colour, covered = middle(shown, camera)
        assert covered > 0.95
        np.testing.assert_allclose(colour / covered, RED, atol=0.05)


def test_where_gaussians_are_full_nothing_changes_and_where_thin_the_surface_shows():
    for opacity, share in ((0.95, 0.0), (0.02, 1.0)):
        learned = round_ones(ball(fine=4).vertices, opacity, BLUE)
        owner = np.zeros(learned.count, int)
        full = replace(learned, opacity=np.full_like(learned.opacity, 0.95))
        shown, _ = add_backing_surfels(learned, owner, [solid(ball())], seen_by(full, ABOVE))
        colour, covered = middle(shown, ABOVE[0])
        assert covered > 0.95
        expected = np.add(np.multiply(share, RED), np.multiply(1 - share, BLUE))
        np.testing.assert_allclose(colour / covered, expected, atol=0.25 if share else 0.02)


def test_a_mouth_that_photographs_look_into_is_not_closed():
    """The surface is a ball, of which they see the upper half to be empty down to its middle."""
    lower = ball(fine=4).vertices[ball(fine=4).vertices[:, 2] < 0]
    floor = ball(0.45, 4).vertices * [1, 1, 0]
    learned = round_ones(np.concatenate([lower, floor]), 0.9, BLUE)
    owner = np.zeros(learned.count, int)
    shown, _ = add_backing_surfels(learned, owner, [solid(ball())], seen_by(learned, ABOVE))
    added = shown.mean[learned.count :]
    assert len(added) > 200
    assert added[:, 2].max() < 0.15
    over = gaussian_subset(shown, np.arange(shown.count) >= learned.count)
    assert middle(over, max(ABOVE, key=lambda c: c.world_from_camera[2, 3]))[0][0] == pytest.approx(RED[0], abs=0.1), (
        "what lies below still does"
    )


def test_discs_lie_within_their_own_thin_wall():
    wall = trimesh.creation.box((1.0, 1.0, 1.6 * CELL)).subdivide_to_size(0.04)
    learned = round_ones(wall.vertices, 0.9)
    shown, of = add_backing_surfels(learned, np.full(learned.count, -1), [solid(wall)], seen_by(learned, SIDES))
    added = shown.mean[of == 0]
    assert len(added) == shown.count - learned.count > 0
    inside = np.abs(added[:, :2]).max(axis=1) < 0.4
    assert np.ptp(np.sign(added[inside, 2])) == 2, "both faces have some"
    assert np.abs(added[inside, 2]).min() > 0, "none has crossed to the other side"
    assert np.abs(added[inside, 2]).max() < 0.8 * CELL

"""Lower outlines in masks say how low things reach."""

import numpy as np
import pytest
from splat_scenes import around

from corporeal.core.types import Views
from corporeal.geometry.rotation import matrix_from_quaternion
from corporeal.multiview.similarity_transform import apply_similarity_to_cameras, similarity_matrix
from corporeal.reconstruction.gaussians.floor_from_outlines import (
    LOWEST_PERCENTILE,
    _foot_height,
    floor_height_from_outlines,
)
from corporeal.reconstruction.gaussians.hull_config import HullConfig

CAMERAS = around(30, (96, 80), focal=100.0, centre=(0, 0, 0.3))[:16]
LOW, HIGH = np.array([-0.3, -0.2, 0.0]), np.array([0.3, 0.2, 0.6])
DIAMETER = 2.2
PIXEL = float(np.linalg.norm(CAMERAS[0].world_from_camera[:3, 3] - [0, 0, 0.3])) / 100
"""At the box [m]."""


def masks_of_a_box(cameras):
    """Return where a box is seen."""
    made = []
    for camera in cameras:
        v, u = np.mgrid[: camera.height, : camera.width] + 0.5
        local = np.linalg.solve(camera.K, np.stack([u.ravel(), v.ravel(), np.ones(u.size)]))
        rays = local.T @ camera.world_from_camera[:3, :3].T
        ends = np.stack([LOW, HIGH])[:, None] - camera.world_from_camera[:3, 3]
        near, far = np.sort(ends / rays, axis=0)
        made.append((near.max(axis=1) < far.min(axis=1)).reshape(v.shape))
    return np.stack(made)


def floor_height(cameras, masks):
    views = Views(np.zeros((len(cameras), 80, 96, 3), np.uint8), cameras)
    return floor_height_from_outlines(views, masks, 1, HullConfig(grid_cells=200_000))


@pytest.mark.parametrize("turn", [0.0, 0.6])
def test_a_box_stands_where_its_outlines_meet_however_cameras_are_held(turn):
    roll = similarity_matrix(matrix_from_quaternion(np.array([np.cos(turn), 0, 0, np.sin(turn)])))
    held = apply_similarity_to_cameras(CAMERAS, similarity_matrix(shift=np.array([0.4, -0.2, 1.5])))
    held = tuple(type(c)(c.K, c.world_from_camera @ roll, c.width, c.height) for c in held)
    back = apply_similarity_to_cameras(held, similarity_matrix(shift=np.array([-0.4, 0.2, -1.5])))
    found = floor_height(held, masks_of_a_box(back))
    assert found is not None
    assert abs(found - 1.5) < 0.01 * DIAMETER


def test_a_floor_is_where_most_outlines_meet_not_where_the_lowest_do():
    """Pixels are square, so that heights scatter: the lowest are wrong by twice as much."""
    every = around(48, (96, 80), focal=100.0, centre=(0, 0, 0.3))
    cameras = tuple(c for c in every if c.world_from_camera[2, 3] > 0.5)
    found = floor_height(cameras, masks_of_a_box(cameras))
    assert found is not None
    assert abs(found) < 0.3 * PIXEL


def test_where_outlines_meet_at_many_heights_nothing_is_below_the_lowest():
    many = np.random.default_rng(0).uniform(0, 1, 400)
    one = 0.2 + 0.01 * np.random.default_rng(1).normal(size=400)
    assert _foot_height(many, 0.01) == pytest.approx(np.percentile(many, LOWEST_PERCENTILE))
    assert _foot_height(one, 0.01) == pytest.approx(0.2, abs=0.004)
    assert np.percentile(one, LOWEST_PERCENTILE) < 0.186


def test_views_from_straight_above_do_not_tell():
    pose = np.diag([1.0, -1.0, -1.0, 1.0])
    above = []
    for k in range(3):
        pose = pose.copy()
        pose[:3, 3] = 0.2 * k - 0.2, 0, 3.0
        above.append(type(CAMERAS[0])(CAMERAS[0].K, pose, 96, 80))
    assert floor_height(tuple(above), masks_of_a_box(above)) is None

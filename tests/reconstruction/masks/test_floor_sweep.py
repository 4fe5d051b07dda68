"""Where no points show the floor, the level plane on which views see one pattern is it."""

from functools import partial

import numpy as np
import painted_scene
import pytest
from painted_scene import FLOOR

from corporeal.core.types import Camera, Views
from corporeal.multiview.viewed_region import find_viewed_region
from corporeal.reconstruction.masks.floor_sweep import (
    FloorSweepConfig,
    _pattern_fraction,
    level_plane,
    sweep_floor_plane,
)
from corporeal.reconstruction.masks.mask_seeds import seeds_from_cameras

UP = np.array([0.0, 0.0, 1.0])
scene = partial(painted_scene.scene, finer=2)


@pytest.mark.slow
def test_growing_begins_with_a_floor_that_no_points_show():
    views, _, points = scene(count=20)
    seeds = seeds_from_cameras(views, points[points[:, 2] > FLOOR + 0.1])
    assert seeds.floor is not None
    assert seeds.floor.normal @ [0, 0, 1] > np.cos(np.radians(1))
    assert seeds.floor.offset == pytest.approx(FLOOR, abs=0.02 * seeds.around.radius)


@pytest.mark.slow
def test_views_of_other_floors_show_none():
    views, _, _ = scene(count=8)
    each = np.stack([scene(seed=k, count=8)[0].rgb[k] for k in range(8)])
    assert sweep_floor_plane(Views(each, views.cameras), find_viewed_region(views.cameras)) is None


def test_cameras_that_lean_anyhow_know_no_level_plane():
    views, _, _ = scene()
    random, leaning = np.random.default_rng(0), []
    for camera in views.cameras:
        turn = random.uniform(0, 2 * np.pi)
        roll = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
        pose = camera.world_from_camera.copy()
        pose[:3, :3] = pose[:3, :3] @ roll
        leaning.append(Camera(camera.K, pose, camera.width, camera.height))
    assert sweep_floor_plane(Views(views.rgb, tuple(leaning)), find_viewed_region(tuple(leaning))) is None


@pytest.mark.slow
def test_a_floor_between_two_heights_that_are_tried_is_found():
    """Under a flash the share of the nearest of them was below what a floor needs."""
    views, _, _ = scene(count=20)
    around = find_viewed_region(views.cameras)
    off = 0.012
    true = (FLOOR - around.centre[2]) / around.radius
    shares = [_pattern_fraction(views, level_plane(UP, h, around), around) for h in (true, true + off)]
    config = FloorSweepConfig(true + off - 0.4, true + off + 0.4, 9, sum(shares) / 2)
    found = sweep_floor_plane(views, around, config)
    assert found is not None
    assert found.offset == pytest.approx(FLOOR, abs=0.005 * around.radius)

"""Things are told from the floor they stand on without masks."""

import numpy as np
import pytest
from splat_scenes import around

from corporeal.geometry.rotation import matrix
from corporeal.geometry.similarity import moved_cameras, moved_points, similarity
from corporeal.splats.cutout import cut_out
from corporeal.types import Views

RADIUS = 0.35
MIDDLE = np.array([0.1, 0.0, RADIUS])
CAMERAS = around(30, (72, 60), focal=75.0, centre=(0, 0, 0.3))[:20]


def floor_colour(x, y):
    """Return a patterned floor with a soft shadow beside the ball."""
    pattern = 150 + 6 * np.sin(9 * x) * np.sin(7 * y)
    shadow = 1 - 0.4 * np.exp(-((x + 0.25) ** 2 + y**2) / 0.05)
    return (pattern * shadow)[:, None] * [1.0, 0.97, 0.9]


def pictured(ball, rng):
    """Return views of the floor, and masks of a red ball on it."""
    rgb, masks = [], []
    for camera in CAMERAS:
        v, u = np.mgrid[: camera.height, : camera.width] + 0.5
        local = np.linalg.solve(camera.K, np.stack([u.ravel(), v.ravel(), np.ones(u.size)]))
        rays = local.T @ camera.world_from_camera[:3, :3].T
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        eye = camera.world_from_camera[:3, 3]
        with np.errstate(divide="ignore"):
            far = -eye[2] / rays[:, 2]
        colour = np.full((len(rays), 3), 200.0)
        down = (far > 0) & (far < 8)
        colour[down] = floor_colour(*(eye + far[down, None] * rays[down])[:, :2].T)
        along = rays @ (MIDDLE - eye)
        miss = np.sum((MIDDLE - eye) ** 2) - along**2
        hit = (miss < RADIUS**2) & ball
        light = 0.6 + 0.4 * (1 - np.maximum(miss, 0) / RADIUS**2)
        colour[hit] = light[hit, None] * [200, 60, 40]
        colour += rng.normal(size=colour.shape) * 2
        rgb.append(np.clip(colour, 0, 255).astype(np.uint8).reshape(*v.shape, 3))
        masks.append(hit.reshape(v.shape))
    return np.stack(rgb), np.stack(masks)


@pytest.fixture(scope="module")
def scene():
    """Return pictures, masks, and points on the floor and on the upper half of the ball."""
    rng = np.random.default_rng(0)
    rgb, masks = pictured(True, rng)
    floor = np.append(rng.uniform(-1.2, 1.2, (1500, 2)), np.zeros((1500, 1)), axis=1)
    ball = rng.normal(size=(500, 3))
    ball[:, 2] = np.abs(ball[:, 2])
    ball = MIDDLE + RADIUS * ball / np.linalg.norm(ball, axis=1, keepdims=True)
    return rgb, masks, np.concatenate([floor, ball])


def test_a_ball_is_cut_out_of_a_floor_with_its_shadow_in_any_frame(scene):
    rgb, masks, points = scene
    made = similarity(matrix(np.array([0.3, 0.5, -0.2, 0.9])), 1.7, (3, 1, -2))
    views = Views(rgb, moved_cameras(CAMERAS, made))
    found = cut_out(views, moved_points(points, made), threads=1)
    both, either = (found & masks).sum(), (found | masks).sum()
    assert both / either > 0.9
    assert both / masks.sum() > 0.97


def test_nothing_is_cut_out_of_a_bare_floor_or_of_none(scene):
    rgb, _, points = scene
    bare, _ = pictured(False, np.random.default_rng(1))
    assert cut_out(Views(bare, CAMERAS), points, threads=1) is None
    astray = np.random.default_rng(2).normal(size=(2000, 3))
    assert cut_out(Views(rgb, CAMERAS), astray, threads=1) is None

"""What masks need stays, however deep photographs see; what they do not need may go."""

import numpy as np
import pytest
from splat_scenes import around

from corporeal.reconstruction.gaussians.space_carving import grid_over_box
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.surface.silhouette_guard import restore_silhouettes

RADIUS = 0.5
"""Of the ball that is pictured [m]."""
GRID = grid_over_box(np.full(3, -0.6), np.full(3, 0.6), 60_000, -1.0)
PLACES = GRID.points(np.ones(GRID.shape, bool))
BALL = (np.linalg.norm(PLACES, axis=1) - RADIUS).reshape(GRID.shape)
CAMERAS = around(24, (96, 96), 3.5, 250.0, np.zeros(3))


def rows():
    out = []
    for c in CAMERAS:
        pose = np.linalg.inv(c.world_from_camera)[:3]
        lens = c.K[0, 0], c.K[1, 1], c.K[0, 2], c.K[1, 2], c.width, c.height
        out.append([*pose.ravel(), *lens])
    return np.array(out)


def masks(top=np.inf):
    """Pixels whose rays meet the ball below a height."""
    out = []
    for c in CAMERAS:
        y, x = np.mgrid[: c.height, : c.width] + 0.5
        ray = np.stack([x, y, np.ones_like(x)], axis=-1) @ np.linalg.inv(c.K).T
        ray = ray @ c.world_from_camera[:3, :3].T
        eye = c.world_from_camera[:3, 3]
        ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
        half = RADIUS**2 - (eye @ eye - (ray @ eye) ** 2)
        ends = (-(ray @ eye) + side * np.sqrt(np.maximum(half, 0)) for side in (-1, 1))
        low = np.minimum(*(eye[2] + end * ray[..., 2] for end in ends))
        out.append((half > 0) & (low < top))
    return np.stack(out)


def filled(before, after, mine, threads=1):
    with ThreadPool(threads) as pool:
        return restore_silhouettes(before, after, GRID, mine, rows(), pool)


def volume(field):
    return (field < 0).sum() / (BALL < 0).sum()


@pytest.fixture
def dented():
    """The ball as a mirror image lies in it: what is above is a sixth of the diameter deeper."""
    upper = PLACES[:, 2].reshape(GRID.shape) > 0
    image = np.linalg.norm(PLACES / [1, 1, 2 / 3], axis=1).reshape(GRID.shape) - RADIUS
    return np.where(upper, np.maximum(BALL, image), BALL)


def test_a_dent_that_outlines_deny_is_filled(dented):
    assert volume(dented) < 0.85
    assert volume(filled(BALL, dented, masks())) > 0.95


def test_a_bowl_that_all_look_into_stays_open():
    height, away = PLACES[:, 2].reshape(GRID.shape), BALL + RADIUS
    full = np.maximum(BALL, height)
    bowl = np.maximum(full, 0.7 * RADIUS - away)
    np.testing.assert_array_equal(filled(full, bowl, masks(top=0.0)), bowl)


def test_one_view_of_many_gives_nothing_back(dented):
    mine = masks()
    mine[1:] = False
    np.testing.assert_array_equal(filled(BALL, dented, mine), dented)


def test_the_number_of_threads_changes_nothing(dented):
    one, three = (filled(BALL, dented, masks(), n) for n in (1, 3))
    np.testing.assert_array_equal(one, three)

"""A thin thing under nearly right poses is no thing that was turned over."""

import numpy as np
import pytest
from scipy.ndimage import binary_dilation
from scipy.spatial.transform import Rotation

from corporeal.core.types import Camera
from corporeal.multiview.silhouette_coherence import silhouette_coherence
from corporeal.multiview.silhouette_outliers import median_fill_by_others
from corporeal.render.camera_placement import CameraAim, camera_from_aim

COUNT = 20


def rod(rng):
    """A cross of two rods, 1 m high."""
    upright = rng.uniform([-0.03, -0.03, 0], [0.03, 0.03, 1], (6000, 3))
    across = rng.uniform([-0.3, -0.03, 0.7], [0.3, 0.03, 0.76], (3000, 3))
    return np.concatenate([upright, across])


def seen(points, camera):
    local = (points - camera.world_from_camera[:3, 3]) @ camera.world_from_camera[:3, :3]
    pixel = local @ camera.K.T
    column, row = np.floor(pixel[:, :2] / pixel[:, 2:]).astype(int).T
    mask = np.zeros((camera.height, camera.width), bool)
    mask[row, column] = True
    return np.uint8(255) * binary_dilation(mask, iterations=2)


def around():
    turn = 2 * np.pi * np.arange(COUNT) / COUNT
    eyes = np.stack([2.2 * np.cos(turn), 2.2 * np.sin(turn), np.full(COUNT, 1.4)], axis=1)
    return [camera_from_aim(CameraAim(tuple(e), (0.0, 0.0, 0.5), 48.0, 320, 240)) for e in eyes.tolist()]


def shaken(camera, rng):
    """A camera whose pose is .9° off."""
    pose = camera.world_from_camera.copy()
    way = rng.normal(size=3)
    turn = Rotation.from_rotvec(np.radians(0.9) * way / np.linalg.norm(way)).as_matrix()
    pose[:3, :3] = turn @ pose[:3, :3]
    return Camera(camera.K, pose, camera.width, camera.height)


@pytest.mark.parametrize("turned", [False, True])
def test_a_thin_object_is_filled_unless_it_was_turned(turned):
    rng = np.random.default_rng(0)
    points = rod(rng)
    other = points @ np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]]) * [1, 1, -1] + [0, 0, 1]
    cameras = around()
    shown = [other if turned and k % 2 else points for k in range(COUNT)]
    masks = np.stack([seen(p, c) for p, c in zip(shown, cameras, strict=True)])
    found = tuple(shaken(c, rng) for c in cameras)
    filled = silhouette_coherence(masks, found), median_fill_by_others(masks, found)
    assert (max(filled) < 0.9) == turned, filled

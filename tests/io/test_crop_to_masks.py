"""Photographs are cut out about what masks show, with their cameras, before they are reduced."""

import numpy as np
import pytest
from colmap_writer import write_colmap
from PIL import Image
from scipy.ndimage import binary_erosion

from corporeal.core.types import Camera
from corporeal.io.photos.crop_to_masks import CropWindow, plan_crop
from corporeal.io.photos.posed_photos import read_posed_photos
from corporeal.multiview.viewed_region import find_viewed_region

WIDE, HIGH = 320, 240
K = np.array([[300.0, 0, 160], [0, 300, 120], [0, 0, 1]])
BOXES = ((30, 50, 90, 80), (180, 120, 230, 200), (100, 90, 140, 110), (250, 160, 310, 238))
"""Left, top, right and bottom of what the masks of four photographs show [px]."""


def shade(x, y):
    """A smooth picture of directions x, y."""
    return np.stack([128 + 90 * np.sin(3 * x), 128 + 90 * np.cos(4 * y), 128 + 60 * x * y], axis=-1)


def directions(K, width, height):
    v, u = np.mgrid[:height, :width] + 0.5
    return np.moveaxis(np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(K).T, -1, 0)[:2]


@pytest.fixture
def photos(tmp_path):
    cameras = tuple(Camera(K, np.eye(4), WIDE, HIGH) for _ in BOXES)
    names = tuple(f"{k}.png" for k in range(len(BOXES)))
    write_colmap(tmp_path / "sparse" / "0", cameras, names)
    for folder in ("images", "masks"):
        (tmp_path / folder).mkdir()
    for name, (left, top, right, bottom) in zip(names, BOXES, strict=True):
        picture = shade(*directions(K, WIDE, HIGH)).round().astype(np.uint8)
        Image.fromarray(picture).save(tmp_path / "images" / name)
        mask = np.zeros((HIGH, WIDE), np.uint8)
        mask[top:bottom, left:right] = 255
        Image.fromarray(mask).save(tmp_path / "masks" / name)
    return tmp_path


def test_what_masks_show_fills_the_pictures_and_cameras_follow(photos):
    read = read_posed_photos(photos, longest=80, close=True)
    assert read.views.rgb.shape == (4, 80, 80, 3)
    assert read.masks is not None
    largest = max(max(r - b, d - t) for b, t, r, d in BOXES)
    for k, (left, top, right, bottom) in enumerate(BOXES):
        mask, camera = read.masks[k] > 127, read.views.cameras[k]
        # All of what the mask shows is there, as large as one scale makes the largest fit.
        zoom = camera.K[0, 0] / K[0, 0]
        assert mask.sum() == pytest.approx(zoom**2 * (right - left) * (bottom - top), rel=0.06)
        assert 0.7 * 80 < zoom * largest < 80
        deep = binary_erosion(mask, iterations=3)  # at its edge it is mixed with white
        error = np.abs(read.views.rgb[k] - shade(*directions(camera.K, 80, 80)))
        assert error[deep].max() < 3, "the camera shows what it showed before"
    assert "80 × 80 pixels about what its mask shows" in " ".join(read.warnings)


def test_pictures_are_left_whole_where_that_gains_nothing(photos):
    whole = read_posed_photos(photos, longest=80)
    assert whole.views.rgb.shape == (4, 60, 80, 3)
    large = read_posed_photos(photos, longest=WIDE, close=True)
    assert large.views.rgb.shape == (4, HIGH, WIDE, 3), "they are not reduced at all"
    bare = read_posed_photos(photos, longest=80, bare=True, close=True)
    assert bare.views.rgb.shape == (4, 60, 80, 3), "nobody knows what they show"
    filled = plan_crop(np.array([[0.9, 0.95]]), (80, 60), (WIDE, HIGH))
    assert filled == CropWindow((80, 60), (80, 60))


def test_a_window_stays_within_the_picture():
    frame = plan_crop(np.array([[0.25, 0.2]]), (80, 60), (WIDE, HIGH))
    wide, high = frame.window
    mask = np.zeros((frame.whole[1], frame.whole[0]), bool)
    mask[-3:, :5] = True
    assert frame.corner(mask) == (0, frame.whole[1] - high)
    assert frame.corner(~mask & mask) == pytest.approx(
        ((frame.whole[0] - wide) / 2, (frame.whole[1] - high) / 2), abs=1
    )


def test_cameras_of_pieces_of_pictures_look_at_the_same_place():
    """Each of a ring looks past a thing, and shows it in a window beside its optical axis."""
    cameras = []
    for turn in np.linspace(0, 2 * np.pi, 12, endpoint=False):
        ahead = np.array([-np.cos(turn), -np.sin(turn), 0.0])
        aside = np.cross(ahead, [0, 0, 1.0])
        away = ahead + 0.2 * aside
        away /= np.linalg.norm(away)
        right = np.cross(away, [0, 0, 1.0])
        pose = np.eye(4)
        pose[:3, :3] = np.stack([right, np.cross(away, right), away], axis=1)
        pose[:3, 3] = -2 * ahead
        x, y, z = (-pose[:3, 3]) @ pose[:3, :3]
        at = 300 * np.array([x, y]) / z + 200
        # A window of 100 px about where the origin appears.
        own = np.array([[300.0, 0, 250 - at[0]], [0, 300, 250 - at[1]], [0, 0, 1]])
        own[:2, 2] = 200 - (at - 50)
        cameras.append(Camera(own, pose, 100, 100))
    found = find_viewed_region(tuple(cameras))
    np.testing.assert_allclose(found.centre, 0, atol=1e-9)
    assert found.radius == pytest.approx(2 * 50 / 300, rel=0.06)

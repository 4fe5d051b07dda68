"""Holes in masks are closed where pictures from the other side meet the object."""

import numpy as np
from scipy.ndimage import binary_fill_holes

from corporeal.multiview.viewed_region import ViewedRegion
from corporeal.reconstruction.masks.mask_holes import close_mask_holes
from corporeal.reconstruction.masks.voxel_volume import pixels_of, voxel_volume
from corporeal.render.camera_placement import CameraAim, camera_from_aim

WIDE, HIGH, COUNT = 128, 96, 16
TURNS = np.arange(COUNT) * 2 * np.pi / COUNT
CAMERAS = tuple(
    camera_from_aim(CameraAim((2.6 * np.cos(t), 2.6 * np.sin(t), 0.6), (0.0, 0.0, 0.0), 40.0, WIDE, HIGH))
    for t in TURNS
)
ROOM = voxel_volume(CAMERAS, ViewedRegion((0.0, 0.0, 0.0), 0.9), None)


def pictured(points, radius=1):
    """Masks of a cloud of points, each a few pixels wide."""
    made = np.zeros((COUNT, HIGH, WIDE), np.float32)
    for mask, camera in zip(made, CAMERAS, strict=True):
        row, column = np.divmod(pixels_of(points, camera), WIDE)
        for i in range(-radius, radius + 1):
            for j in range(-radius, radius + 1):
                mask[np.clip(row + i, 0, HIGH - 1), np.clip(column + j, 0, WIDE - 1)] = 1.0
    return made


def full_ball():
    dice = np.random.default_rng(0).normal(size=(60_000, 3))
    return 0.5 * dice / np.linalg.norm(dice, axis=1, keepdims=True)


def labelled(mask, camera, spot=(0.5, 0.0, 0.0), size=0.12):
    """Cut a label out of the mask of a picture that sees its side of the ball."""
    eye = camera.world_from_camera[:3, 3]
    if (eye - spot) @ np.array(spot) <= 0:
        return mask
    dice = np.random.default_rng(1).uniform(-size, size, (4000, 2))
    patch = np.column_stack([np.full(4000, spot[0]), dice])
    row, column = np.divmod(pixels_of(patch, camera), WIDE)
    out = mask.copy()
    out[row, column] = 0.0
    return out


def test_a_label_in_the_floors_colour_is_no_hole():
    whole = pictured(full_ball())
    given = np.stack([labelled(m, c) for m, c in zip(whole, CAMERAS, strict=True)])
    made = close_mask_holes(given, CAMERAS, ROOM)
    assert np.array_equal(made > 0, np.stack([np.asarray(binary_fill_holes(g)) for g in given]))
    # Where the label meets the outline it is no hole.
    assert (made != whole).sum() < 0.3 * (given != whole).sum()


def test_the_hole_of_a_ring_stays_open():
    angle, tube = np.random.default_rng(2).uniform(0, 2 * np.pi, (2, 60_000))
    across = 0.45 + 0.1 * np.cos(tube)
    ring = np.column_stack([0.1 * np.sin(tube), across * np.cos(angle), across * np.sin(angle)])
    masks = pictured(ring)
    facing = [k for k, t in enumerate(TURNS) if abs(np.cos(t)) > 0.9]
    after = close_mask_holes(masks, CAMERAS, ROOM)
    for k in facing:
        assert np.array_equal(after[k], masks[k])
        assert masks[k][HIGH // 2 - 3 : HIGH // 2 + 3, WIDE // 2 - 3 : WIDE // 2 + 3].sum() == 0


def test_masks_may_be_finer_than_the_cells_are_seen():
    whole = pictured(full_ball())
    given = np.stack([labelled(m, c) for m, c in zip(whole, CAMERAS, strict=True)])
    made = close_mask_holes(given.repeat(2, axis=1).repeat(2, axis=2), CAMERAS, ROOM)
    assert np.array_equal(made[:, ::2, ::2], close_mask_holes(given, CAMERAS, ROOM))


def test_seen_from_one_side_alone_holes_stay():
    given = pictured(full_ball())[:2]
    given[:, HIGH // 2 - 6 : HIGH // 2 + 6, WIDE // 2 - 6 : WIDE // 2 + 6] = 0.0
    room = voxel_volume(CAMERAS[:2], ViewedRegion((0.0, 0.0, 0.0), 0.9), None)
    assert np.array_equal(close_mask_holes(given, CAMERAS[:2], room), given)

"""A video of the room is refused, a thing among its cameras is not."""

import numpy as np
import pytest

from corporeal.geometry.mesh import Mesh
from corporeal.reconstruction.gaussians.heldout_quality import HeldOutQuality
from corporeal.reconstruction.surface.reconstruction_acceptance import (
    GREY_PICTURE_PSNR_DB,
    boxes_rejection_reason,
    colour_rejection_reason,
    cropping_rejection_reason,
    overlap_rejection_reason,
    pieces_rejection_reason,
)
from corporeal.render.camera_placement import CameraAim, camera_from_aim
from corporeal.render.embree import identify_triangles
from corporeal.render.ray_scene import RayScene
from patterned_scene import OF_SLAB, patterned, ring
from patterned_scene import box as made_box

CAMERAS = [camera_from_aim(aim) for aim in ring(np.arange(20) * 18, away=0.5, height=0.35)]


def box(side, height, at=(0.0, 0.0)):
    low = np.array([at[0] - side / 2, at[1] - side / 2, 0.0])
    return np.array([low, low + np.array([side, side, height])])


def refused(*boxes, masked=False, **more):
    return boxes_rejection_reason(np.array(boxes), CAMERAS, masked, **more)


@pytest.mark.parametrize("masked", [False, True])
def test_an_object_that_cameras_stand_around_is_fine(masked):
    assert refused(box(0.1, 0.12), box(0.05, 0.2, (0.1, 0.1)), masked=masked) is None


@pytest.mark.parametrize("masked", [False, True])
def test_an_object_that_holds_cameras_is_the_room(masked):
    why = refused(box(0.1, 0.12), box(1.2, 0.5), masked=masked)
    assert why is not None and "its box holds 20 of 20 cameras" in why and "--force" in why
    # A few that bend over it are no reason, a tenth is.
    assert refused(box(0.3, 0.5, (0.5, 0.0)), masked=True) is None
    assert "holds 3 of 20" in str(refused(box(0.4, 0.5, (0.5, 0.0)), masked=masked))


def test_without_masks_an_object_that_fills_the_pictures_is_all_there_is():
    why = refused(box(0.6, 0.2))
    assert why is not None and "as long as the ball" in why and "--floor-at" in why
    assert refused(box(0.6, 0.2), masked=True) is None, "somebody said that it is the thing"


def test_what_falls_apart_and_was_seen_from_one_side_is_refused():
    half = CAMERAS[:10]  # of 20 all around: 198 degrees are left
    why = pieces_rejection_reason(2, half)
    assert why is not None and "in 2 pieces, and from 198°" in why and "--force" in why
    assert pieces_rejection_reason(1, half) is None, "one thing in one piece"
    assert pieces_rejection_reason(2, CAMERAS) is None, "a warning says it where all sides were seen"
    assert pieces_rejection_reason(2, []) is None, "a splat without cameras"


def test_what_pictures_cut_off_is_the_room():
    masks = np.zeros((20, 60, 80), bool)
    masks[:, 20:40, 30:50] = True
    assert cropping_rejection_reason(masks) is None
    masks[:10, 20:40] = True
    assert cropping_rejection_reason(masks) is None, "many photographs may be from near"
    masks[10, 20:40] = True
    why = cropping_rejection_reason(masks)
    assert why is not None and "corporeal masks" in why, "it grows them from a point"
    assert why is not None and "11 of 20 photographs show but a part" in why and "--force" in why


def test_what_colours_tell_otherwise_is_refused():
    cut, coloured = np.zeros((2, 20, 60, 80), bool)
    cut[:, 20:40, 30:50] = True
    coloured[:, 22:40, 32:50] = True
    assert colour_rejection_reason(cut, coloured) is None, "outlines by colours are off"
    coloured[9:, 20:40, 30:80] = True
    why = colour_rejection_reason(cut, coloured)
    assert why is not None and "overlaps by 40% only" in why and "--force" in why
    assert colour_rejection_reason(cut, None) is None
    assert colour_rejection_reason(cut, np.zeros_like(cut)) is None, "colours tell nothing"


def test_pictures_no_better_than_grey_are_no_shape():
    def told(psnr):
        return refused(box(0.1, 0.1), quality=HeldOutQuality(psnr, None, 0.5, (0,)))

    assert told(GREY_PICTURE_PSNR_DB + 1) is None
    assert "12.0 dB, as a plain grey picture has" in str(told(12.0))


def test_of_a_splat_without_cameras_nothing_is_reported():
    assert boxes_rejection_reason(np.array([box(9.0, 9.0)]), (), masked=False) is None


def test_a_surface_that_is_not_what_masks_show_is_refused():
    aims = ring(np.arange(20) * 18, (160, 120))
    stage, cameras = RayScene(patterned()), [camera_from_aim(aim) for aim in aims]
    masks = np.stack([identify_triangles(stage, aim)[0] >= OF_SLAB for aim in aims])
    vertices, triangles, _ = made_box((-0.05, -0.04, 0), (0.05, 0.04, 0.12))
    assert overlap_rejection_reason([Mesh(vertices, triangles)], cameras, masks) is None
    eaten = Mesh(vertices * (0.6, 0.6, 0.2), triangles)
    why = overlap_rejection_reason([eaten], cameras, masks)
    assert why is not None and "overlap by" in why and "--force" in why
    assert overlap_rejection_reason([eaten], cameras, np.zeros_like(masks)) is None, "nobody said anything"


def test_masks_that_no_surface_can_fill_are_of_something_else_too():
    """Masks of a helmet held pieces of the wall behind it, each in some of the photographs."""
    aims = ring(np.arange(20) * 18, (160, 120))
    stage, cameras = RayScene(patterned()), [camera_from_aim(aim) for aim in aims]
    masks = np.stack([identify_triangles(stage, aim)[0] >= OF_SLAB for aim in aims])
    block = [Mesh(*made_box((-0.05, -0.04, 0), (0.05, 0.04, 0.12))[:2])]
    assert overlap_rejection_reason(block, cameras, masks, given=False) is None
    # A quarter as much as the block is seen above it.
    wall = np.zeros_like(masks)
    for one, mask in zip(wall, masks, strict=True):
        rows, columns = np.nonzero(mask)
        high = (rows.max() - rows.min()) // 4
        one[rows.min() - high : rows.min(), columns.min() : columns.max()] = True
    few = np.where(np.arange(20)[:, None, None] % 5 == 0, wall, False)
    assert overlap_rejection_reason(block, cameras, masks | few, given=False) is None, "few photographs err"
    why = overlap_rejection_reason(block, cameras, masks | wall, given=False)
    assert why is not None and "The shape contradicts the photographs" in why and "--force" in why
    assert overlap_rejection_reason(block, cameras, masks | wall) is None, "somebody said that it is the thing"


def test_what_was_seen_from_one_side_only_is_refused():
    """A television from a fifth of the circle became a block, and was rendered."""
    turns = np.radians(np.linspace(0, 60, 12))
    eyes = np.stack([3 * np.cos(turns), 3 * np.sin(turns), np.full(12, 0.8)], axis=-1)
    few = tuple(camera_from_aim(CameraAim(tuple(e), (0.0, 0.0, 0.0), 40.0, 64, 48)) for e in eyes)
    why = boxes_rejection_reason(np.array([box(0.1, 0.1)]), few, masked=True)
    assert why is not None and "its depth is unknown" in why and "--force" in why

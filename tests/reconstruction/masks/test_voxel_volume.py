"""What masks carve is what stands there, without a wall that has their colours."""

import numpy as np
import pytest
from painted_scene import FLOOR, RADIUS

from corporeal.multiview.ground_plane import GroundPlane
from corporeal.multiview.viewed_region import ViewedRegion
from corporeal.reconstruction.masks.voxel_volume import VOXELS_ACROSS, voxel_volume
from corporeal.render.camera_placement import CameraAim, camera_from_aim

GROUND = GroundPlane(np.array([0.0, 0.0, 1.0]), FLOOR, 1.0, 0.01)
AROUND = ViewedRegion((0.0, 0.0, 0.0), 1.0)


@pytest.fixture
def seen():
    """Cells, of the ball in the middle and of a cap at the upper edge of what is looked at."""
    turns = 2.4 * np.arange(14)
    eyes = np.stack([4 * np.cos(turns), 4 * np.sin(turns), np.linspace(0.5, 2.0, 14)], axis=-1)
    cameras = tuple(camera_from_aim(CameraAim(tuple(e), (0.0, 0.0, 0.0), 48.0, 96, 72)) for e in eyes)
    room = voxel_volume(cameras, AROUND, GROUND)
    place = (np.stack(np.unravel_index(room.index, (VOXELS_ACROSS,) * 3)) + 0.5) / VOXELS_ACROSS * 2 - 1
    ball = np.linalg.norm(place, axis=0) < RADIUS
    return room, ball, room.outer & (place[2] > 0.85)


def test_what_hovers_at_the_edge_is_a_wall(seen):
    room, ball, cap = seen
    made = room.carved(room.silhouettes(ball | cap))
    assert made[ball].all() and not made[cap].any()


def test_alone_it_is_what_is_looked_at(seen):
    room, _, cap = seen
    assert room.carved(room.silhouettes(cap))[cap].any()


def test_what_hovers_in_the_middle_stays(seen):
    """A lamp's shade, whose pole is too thin to be seen."""
    room, ball, _ = seen
    high = room.height - room.height[ball].mean()
    halves = ball & (np.abs(high) > 0.15)
    made = room.carved(room.silhouettes(halves))
    assert made[halves].mean() > 0.95

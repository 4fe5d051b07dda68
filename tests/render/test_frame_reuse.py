"""When a video's picture is the one before."""

import numpy as np
import pytest

from corporeal.render.camera_placement import CameraAim
from corporeal.render.frame_reuse import MAX_CORNER_SHIFT_PX, MAX_NORMAL_CHANGE, LastRenderedPose

AIM = CameraAim((0.0, -4.0, 0.0), (0.0, 0.0, 0.0), 30.0, 160, 120)
PIXEL = 2 * np.tan(np.radians(15)) / 120 * 3.0
"""At the nearest vertex [m]."""


def pose():
    rng = np.random.default_rng(3)
    place = rng.uniform(-0.8, 0.8, (50, 3))
    place[0] = 0.0, -1.0, 0.0
    normal = rng.normal(size=(50, 3))
    return place, normal / np.linalg.norm(normal, axis=1)[:, None]


@pytest.mark.parametrize(("share", "moved"), [(0.9, False), (1.1, True)])
def test_one_vertex_that_moves_by_what_could_be_seen_is_enough(share, moved):
    place, normal = pose()
    held = LastRenderedPose(lambda time: AIM)
    assert held.moved(place, normal, 0.0)
    there = place.copy()
    there[7, 2] += share * MAX_CORNER_SHIFT_PX * PIXEL
    assert held.moved(there, normal, 0.1) is moved


def test_slow_motion_adds_up_until_it_is_seen():
    place, normal = pose()
    held = LastRenderedPose(lambda time: AIM)
    step = np.array([0.3 * MAX_CORNER_SHIFT_PX * PIXEL, 0.0, 0.0])
    told = [held.moved(place + k * step, normal, 0.1 * k) for k in range(9)]
    assert told == [True, False, False, False, True, False, False, False, True]


def test_light_on_what_turns_in_place_is_seen():
    place, normal = pose()
    held = LastRenderedPose(lambda time: AIM)
    held.moved(place, normal, 0.0)
    turned = normal + np.array([0.0, 1.5 * MAX_NORMAL_CHANGE, 0.0])
    assert held.moved(place, turned, 0.1)


def test_what_is_lost_is_not_taken_for_still():
    place, normal = pose()
    held = LastRenderedPose(lambda time: AIM)
    held.moved(place, normal, 0.0)
    lost = place.copy()
    lost[3] = np.nan
    assert held.moved(lost, normal, 0.1)

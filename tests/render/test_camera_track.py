"""Where a video's camera stands, and when it is slow."""

import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from corporeal.core.types import Frame
from corporeal.render.camera_placement import camera_axes
from corporeal.render.camera_track import FirstContact, MotionBounds, camera_track, first_contact
from corporeal.render.time_remap import frame_positions, interpolate_frames
from sample_ledger import ledger

SIZE = (320, 240)
TIME = np.linspace(0, 1, 31)


def box(centre, half):
    return np.stack([np.asarray(centre) - half, np.asarray(centre) + half])


def falling():
    """A small thing falls beside a wall of 2 m onto a smaller one, which is pushed away."""
    boxes = np.zeros((31, 3, 2, 3))
    for f, t in enumerate(TIME):
        boxes[f, 0] = box((0, 0, max(1.0 - 2 * t, 0.15)), 0.05)
        boxes[f, 1] = box((max(0, t - 0.45), 0, 0.05), 0.05)
        boxes[f, 2] = box((0, 2.5, 1.0), 1.0)
    return MotionBounds(TIME, boxes, FirstContact(0.45, (0, 1)))


def seen(aim, box_):
    """Share of the picture's height that a box takes, and whether all of it is in the picture."""
    pick = box_[(np.arange(8)[:, None] >> np.arange(3)) & 1, np.arange(3)]
    local = (pick - np.array(aim.eye)) @ camera_axes(np.subtract(aim.eye, aim.target)).T
    tangent = np.tan(np.radians(aim.field_of_view / 2))
    flat = local[:, :2] / -local[:, 2:] / tangent
    inside = np.abs(flat[:, 1]).max() <= 1 and np.abs(flat[:, 0]).max() <= SIZE[0] / SIZE[1]
    return np.ptp(flat[:, 1]) / 2, inside and (local[:, 2] < 0).all()


def test_close_keeps_what_is_struck_large_and_in_the_picture_all_the_time():
    reel = falling()
    wide, close = (camera_track(shot, reel, SIZE, None) for shot in ("wide", "close"))
    for f, t in enumerate(TIME):
        share, inside = seen(close.at(t), reel.boxes[f, 1])
        assert inside and share > 0.4
        assert share > 5 * seen(wide.at(t), reel.boxes[f, 1])[0]
        assert close.at(t).eye[2] > 0


def test_follow_goes_along_with_what_moves_and_forgets_what_stands():
    reel = falling()
    follow = camera_track("follow", reel, SIZE, None)
    for f, t in enumerate(TIME):
        for b in (0, 1):
            assert seen(follow.at(t), reel.boxes[f, b])[1], (f, b)
    assert follow.aim.eye != follow.at(1.0).eye
    assert seen(follow.at(0.0), reel.boxes[0, 2])[0] > 1 or not seen(follow.at(0.0), reel.boxes[0, 2])[1]


def test_wide_stands_still():
    wide = camera_track("wide", falling(), SIZE, (1, 0, 0.3))
    assert wide.at(0.0) == wide.at(0.7) == wide.aim


def test_without_a_contact_close_is_close_to_what_moves():
    reel = falling()
    alone = camera_track("close", MotionBounds(TIME, reel.boxes[:, [0, 2]], None), SIZE, None)
    assert seen(alone.at(0.0), reel.boxes[0, 0])[0] > 0.3


def test_pieces_that_are_not_there_before_something_breaks_are_waited_for():
    reel = falling()
    reel.boxes[:10, 1] = np.nan
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for shot in ("wide", "close", "follow"):
            aims = [camera_track(shot, reel, SIZE, None).at(t) for t in TIME]
            assert np.isfinite([[*aim.eye, *aim.target] for aim in aims]).all(), shot


def test_the_first_contact_is_that_of_two_objects_or_else_with_the_floor():
    told = ledger(np.array([0.0, 1.0]), 2)
    when = np.full((2, 3, 3), np.nan)
    when[1, 0, 2] = when[1, 2, 0] = 0.2
    when[1, 1, 2] = when[1, 2, 1] = 0.0  # it stood there from the start
    floor = first_contact(type(told)(**{**vars(told), "first_contact": when}), 2)
    assert floor == FirstContact(0.2, (0,))
    when[1, 0, 1] = when[1, 1, 0] = 0.3
    assert first_contact(type(told)(**{**vars(told), "first_contact": when}), 2) == FirstContact(0.3, (0, 1))
    nothing = np.full_like(when, np.nan)
    assert first_contact(type(told)(**{**vars(told), "first_contact": nothing}), 2) is None


def test_a_video_in_real_time_has_every_frame_once():
    np.testing.assert_array_equal(frame_positions(TIME, 1.0, 0.4), np.arange(31))


def test_slow_motion_is_slow_about_the_contact_alone():
    places = frame_positions(TIME, 4.0, 0.4)
    shown = np.interp(places, np.arange(31), TIME)
    steps = np.diff(shown)
    slow = (shown[:-1] >= 0.35) & (shown[:-1] <= 0.63)
    np.testing.assert_allclose(steps[slow][:-1], 1 / 120, rtol=1e-9)
    np.testing.assert_allclose(steps[shown[:-1] < 0.3], 1 / 30, rtol=1e-9)
    assert places[0] == 0 and places[-1] == 30
    assert len(frame_positions(TIME, 4.0, None)) == pytest.approx(121, abs=1)


def test_an_instant_between_two_frames_lies_between():
    points = np.random.default_rng(3).normal(size=(20, 3))
    turn = Rotation.from_rotvec([0, 0, 0.1]).as_matrix()
    still = np.broadcast_to(np.eye(3), (20, 3, 3))
    a = Frame(0.0, points, still)
    b = Frame(0.1, points @ turn.T, np.broadcast_to(turn, (20, 3, 3)))
    half = interpolate_frames(a, b, 0.5)
    exact = points @ Rotation.from_rotvec([0, 0, 0.05]).as_matrix().T
    assert half.time == pytest.approx(0.05)
    np.testing.assert_allclose(half.position, exact, atol=2 * (1 - np.cos(0.05)) * 4)
    assert interpolate_frames(a, b, 0.0) is a

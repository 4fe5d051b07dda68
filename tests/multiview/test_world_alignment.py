"""Up is found again, however the file's frame is turned, and the floor under the things."""

from dataclasses import replace

import numpy as np
import pytest

from corporeal.core.types import Camera
from corporeal.geometry.rotation import matrix_from_quaternion
from corporeal.multiview.similarity_transform import (
    apply_similarity_to_cameras,
    apply_similarity_to_points,
    similarity_matrix,
)
from corporeal.multiview.up_direction import estimate_up_direction
from corporeal.multiview.world_alignment import StatedFrame, align_world, rotation_to_z


def cameras_at(eyes, target=(0.0, 0.0, 0.2), roll=0.0, rng=None):
    """Return cameras held level but for a random roll [deg], looking at a place."""
    made = []
    for eye in np.asarray(eyes, dtype=float):
        back = (eye - target) / np.linalg.norm(eye - target)
        right = np.cross([0, 0, 1.0], back)
        right = right / np.linalg.norm(right) if np.linalg.norm(right) > 1e-9 else np.eye(3)[0]
        axes = np.stack([right, np.cross(right, back), -back], axis=1)
        turn = np.radians(roll) * (rng.normal() if rng is not None else 0.0)
        c, s = np.cos(turn), np.sin(turn)
        pose = np.eye(4)
        pose[:3, :3] = axes @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
        pose[:3, 3] = eye
        K = np.array([[200.0, 0, 100], [0, 200, 100], [0, 0, 1]])
        made.append(Camera(K, pose, 200, 200))
    return tuple(made)


def ring(count=24, distance=2.0, low=15, high=60):
    """Return places around a thing, from low to high [deg]."""
    turn = 2.4 * np.arange(count)
    rise = np.radians(np.linspace(low, high, count))
    flat = np.cos(rise)
    return distance * np.stack([flat * np.cos(turn), flat * np.sin(turn), np.sin(rise)], axis=1)


def room(rng, floor=2000, things=1500, anywhere=0, noise=0.004):
    """Return points on a floor and on a box that stands on it, and points anywhere."""
    on_floor = np.concatenate([rng.uniform(-0.9, 0.9, (floor, 2)), noise * rng.normal(size=(floor, 1))], axis=1)
    middle = np.array([0, 0, 0.2])
    box = rng.uniform(-0.2, 0.2, (things, 3)) + middle
    side = rng.integers(3, size=things)
    # Its top and two sides: nobody sees the underside.
    box[np.arange(things), side] = np.array([0.2, 0.2, 0.4])[side]
    return np.concatenate([on_floor, box, rng.uniform(-1, 1, (anywhere, 3)) + middle]), box


def somewhere(rng):
    """Return a similarity that a structure from motion might choose."""
    return similarity_matrix(
        matrix_from_quaternion(rng.normal(size=4)), float(np.exp(rng.normal())), rng.normal(size=3)
    )


def off(found, file_from_world):
    """Return the angle between true and found up [deg] and the height of the true floor [m]."""
    whole = found.world_from_file @ file_from_world
    scale = np.cbrt(np.linalg.det(whole[:3, :3]))
    up = whole[:3, 2] / scale
    return np.degrees(np.arccos(np.clip(up[2], -1, 1))), whole[2, 3] / scale


@pytest.mark.parametrize("anywhere", [0, 3500])
def test_up_and_floor_are_found_in_any_frame(rng, anywhere):
    for _ in range(3):
        points, _ = room(rng, anywhere=anywhere)
        made = somewhere(rng)
        cameras = apply_similarity_to_cameras(cameras_at(ring(), roll=3, rng=rng), made)
        found = align_world(cameras, apply_similarity_to_points(points, made))
        angle, floor = off(found, made)
        assert angle < 0.5
        assert abs(floor) < 0.004
        assert (found.found_by, found.floor_by) == ("cameras", "plane")
        assert found.warnings == ()
        assert found.confidence > 0.8


def test_objects_without_a_floor_stand_on_their_lowest_points(rng):
    _, box = room(rng)
    made = somewhere(rng)
    cameras = apply_similarity_to_cameras(cameras_at(ring()), made)
    things = apply_similarity_to_points(box, made)
    found = align_world(cameras, things, of_objects=things)
    angle, floor = off(found, made)
    assert angle < 1e-6
    assert abs(floor) < 0.01
    assert found.floor_by == "objects"
    assert "below the lowest points" in found.warnings[0]
    middle = apply_similarity_to_points(np.zeros((1, 3)), found.world_from_file @ made)[0]
    np.testing.assert_allclose(middle[:2], 0, atol=0.01 * found.radius)


def test_a_file_with_z_up_is_believed(rng):
    points, _ = room(rng)
    found = align_world(cameras_at(ring(), roll=3, rng=rng), points, z_up=True)
    np.testing.assert_allclose(found.world_from_file[:3, :3], np.eye(3), atol=1e-12)
    assert abs(found.world_from_file[2, 3]) < 0.003
    assert found.found_by == "file"


def test_a_file_with_y_up_that_should_have_z_up_is_noticed(rng):
    points, _ = room(rng)
    made = similarity_matrix(np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]))
    found = align_world(
        apply_similarity_to_cameras(cameras_at(ring()), made), apply_similarity_to_points(points, made), z_up=True
    )
    assert off(found, made)[0] < 0.1
    assert any("90° from it. The cameras were used" in w for w in found.warnings)


def test_cameras_that_were_held_upright_do_not_count(rng):
    points, _ = room(rng, floor=0)
    cameras = list(cameras_at(ring(), roll=2, rng=rng))
    quarter = np.array([[0.0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    for k in range(0, 24, 4):
        cameras[k] = replace(cameras[k], world_from_camera=cameras[k].world_from_camera @ quarter)
    found = align_world(tuple(cameras), points, of_objects=points)
    assert off(found, np.eye(4))[0] < 2


def test_cameras_that_look_straight_down_are_above(rng):
    points, _ = room(rng)
    eyes = [(x, y, 2.5) for x in (-0.5, 0, 0.5) for y in (-0.5, 0, 0.5)]
    cameras = tuple(c for x, y, z in eyes for c in cameras_at([(x, y, z)], target=(x, y, 0.0)))
    made = somewhere(rng)
    found = align_world(apply_similarity_to_cameras(cameras, made), apply_similarity_to_points(points, made))
    angle, floor = off(found, made)
    assert angle < 0.5
    assert abs(floor) < 0.004
    assert found.found_by == "floor"
    assert found.warnings


def test_one_camera_finds_the_floor_and_says_how_little_it_knows(rng):
    points, _ = room(rng)
    found = align_world(cameras_at([(2.0, 0, 1.0)]), points)
    assert off(found, np.eye(4))[0] < 0.5
    assert found.warnings


def test_without_cameras_what_is_usual_is_corrected_by_a_floor(rng):
    points, _ = room(rng)
    tilted = similarity_matrix(matrix_from_quaternion(np.array([1, 0.1, 0.05, 0])), 2.0, (1, 2, 3))
    found = align_world((), apply_similarity_to_points(points, tilted), usual=(0, 0, 1))
    angle, floor = off(found, tilted)
    assert angle < 0.5
    assert abs(floor) < 0.004
    assert "check the result" in found.warnings[0]


def stool(rng):
    """Return points on a ball on four splayed legs: it rolls off all its sides but one."""
    ball = rng.normal(size=(2000, 3))
    ball = 0.15 * ball / np.linalg.norm(ball, axis=1, keepdims=True) + [0, 0, 1]
    along = rng.random((300, 1))
    legs = [(1 - along) * [0, 0, 1] + along * [x, y, 0] for x in (-0.6, 0.6) for y in (-0.6, 0.6)]
    return np.concatenate([ball, *legs])


@pytest.mark.parametrize("usual", [(0, 0, 1), (0, 0, -1), (0, 1, 0), (1, 0, 0)])
def test_without_cameras_and_floor_objects_are_put_as_they_would_rest(rng, usual):
    tilted = similarity_matrix(matrix_from_quaternion(np.array([1, 0.03, -0.05, 0.02])))
    found = align_world((), apply_similarity_to_points(stool(rng), tilted), usual=usual)
    angle, floor = off(found, tilted)
    assert angle < 0.5
    assert abs(floor) < 0.02
    assert found.found_by == "rest"
    assert found.confidence <= 0.5
    assert ("would fall over" in found.reason) is (usual != (0, 0, 1))


def test_the_top_of_a_table_is_no_floor(rng):
    board = rng.uniform(-1, 1, (4000, 3)) * [0.5, 0.3, 0.02] + [0, 0, 1]
    legs = rng.uniform(size=(4, 300, 3)) * [0.02, 0.02, 1]
    legs += np.array([[[x, y, 0]] for x in (-0.45, 0.45) for y in (-0.25, 0.25)])
    found = align_world((), np.concatenate([board, *legs]), usual=(0, 0, 1))
    assert off(found, np.eye(4))[0] < 0.5
    assert abs(off(found, np.eye(4))[1]) < 0.03
    assert found.floor_by == "objects"


def test_astray_points_do_not_change_how_objects_rest(rng):
    points = np.concatenate([stool(rng), rng.uniform(-3, 3, (60, 3))])
    found = align_world((), points, usual=(0, 0, 1))
    assert off(found, np.eye(4))[0] < 0.5


def test_a_stated_axis_goes_before_cameras_and_file(rng):
    points, box = room(rng)
    cameras = cameras_at(ring())
    found = align_world(cameras, box, z_up=True, of_objects=box, stated=StatedFrame((0.0, -2.0, 0.0)))
    np.testing.assert_allclose(found.world_from_file[2, :3], [0, -1, 0], atol=1e-12)
    assert (found.found_by, found.confidence) == ("person", 1.0)
    made = similarity_matrix(matrix_from_quaternion(np.array([1, 0.03, -0.05, 0.02])))
    found = align_world((), apply_similarity_to_points(points, made), stated=StatedFrame((0, 0, 1)))
    assert off(found, made)[0] < 0.5
    found = align_world(cameras, box, z_up=True, of_objects=box, stated=StatedFrame(floor=-0.3))
    assert found.world_from_file[2, 3] == pytest.approx(0.3)
    assert (found.floor_by, found.warnings) == ("person", ())


def test_any_direction_can_be_turned_up(rng):
    for up in [*rng.normal(size=(20, 3)), (0, 0, 1), (0, 0, -1), (1e-9, 0, -1)]:
        turn = rotation_to_z(np.asarray(up, dtype=float))
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-6)
        assert np.linalg.det(turn) == pytest.approx(1)
        np.testing.assert_allclose(turn @ up / np.linalg.norm(up), [0, 0, 1], atol=1e-6)


# ---------------------------------------------------------------- cameras on their sides

QUARTER = np.array([[0.0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def some_on_their_sides(cameras, share, rng):
    """Turn a share of the cameras by a quarter about their axis, to one side or the other."""
    made = list(cameras)
    for k in rng.permutation(len(made))[: round(share * len(made))]:
        quarter = QUARTER if rng.random() < 0.5 else QUARTER.T
        made[k] = replace(made[k], world_from_camera=made[k].world_from_camera @ quarter)
    return tuple(made)


def angle_from_z(found):
    return np.degrees(np.arccos(np.clip(found.up[2], -1, 1)))


@pytest.mark.parametrize("heights", [(0, 0), (0, 20), (15, 60), (50, 70), (75, 80)])
@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 0.75, 1.0])
def test_up_is_known_however_many_cameras_were_held_upright(rng, heights, share):
    exact = estimate_up_direction(some_on_their_sides(cameras_at(ring(24, 2.0, *heights)), share, rng))
    held = cameras_at(ring(24, 2.0, *heights), roll=3, rng=rng)
    by_hand = estimate_up_direction(some_on_their_sides(held, share, rng))
    if share == 1.0 and heights == (0, 0):
        assert exact.sure <= 0.5, "nobody stands above, and no picture shows up"
        assert min(angle_from_z(exact), 180 - angle_from_z(exact)) < 0.1
        return
    assert angle_from_z(exact) < 0.1
    assert angle_from_z(by_hand) < 5
    assert (by_hand.sure > 0.8) == (share < 1.0)
    assert any("held upright" in w for w in by_hand.warnings) == (share == 1.0)


def test_how_far_up_is_known_is_true(rng):
    """The stated standard error is what up is off by, over many folders of photographs."""
    off_by, stated = [], []
    for _ in range(60):
        count = int(rng.integers(12, 48))
        held = cameras_at(ring(count), roll=3, rng=rng)
        found = estimate_up_direction(some_on_their_sides(held, 0.5, rng))
        off_by.append(angle_from_z(found))
        stated.append(np.degrees(found.error))
    ratio = np.sqrt(np.mean(np.square(off_by)) / np.mean(np.square(stated)))
    assert 0.7 < ratio < 1.4


def test_cameras_that_agree_on_nothing_are_not_sure(rng):
    for _ in range(5):
        made = cameras_at(ring(24), roll=40, rng=rng)
        assert estimate_up_direction(made).sure < 0.5


def test_an_arm_that_swings_up_does_not_know_its_side(rng):
    rise = np.radians(np.linspace(10, 70, 12))
    eyes = 2.0 * np.stack([np.cos(rise), 0 * rise, np.sin(rise)], axis=1)
    found = estimate_up_direction(cameras_at(eyes))
    assert found.sure <= 0.2 and "side by side" in found.warnings[0]

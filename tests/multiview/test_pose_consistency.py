"""Poses that agree with the pictures are let pass; others are doubted, and it is said why."""

import re
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image, ImageDraw
from scipy.ndimage import gaussian_filter

from corporeal.core.types import Camera, Views
from corporeal.io.photos.posed_photos import read_posed_photos
from corporeal.multiview.epipolar import (
    consensus_fraction,
    depths_of_match,
    fundamental_matrix,
    projection_matrix,
    sampson_distance,
)
from corporeal.multiview.pose_consistency import (
    INCOHERENT_HULL_FRACTION,
    OPENGL_FROM_OPENCV_AXES,
    _MatchedPair,
    check_pose_consistency,
)
from corporeal.multiview.silhouette_coherence import silhouette_coherence

WIDTH, HEIGHT = 160, 120
LOW, HIGH = np.array([-0.5, -0.4, 0.0]), np.array([0.5, 0.4, 0.7])


def looking(eye, target=(0, 0, 0.3), focal=150.0):
    ahead = np.array(target) - eye
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [0, 0, 1])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :4] = np.stack([right, np.cross(ahead, right), ahead, eye], axis=1)
    K = np.array([[focal, 0, WIDTH / 2 + 2], [0, focal, HEIGHT / 2 - 1], [0, 0, 1]])
    return Camera(K, pose, WIDTH, HEIGHT)


def entered(origin, ray):
    """Return where rays enter the box, in ray lengths; inf: nowhere."""
    with np.errstate(divide="ignore"):
        t = np.sort(np.stack([(LOW - origin) / ray, (HIGH - origin) / ray]), axis=0)
    near, far = t[0].max(axis=-1), t[1].min(axis=-1)
    return np.where((near < far) & (near > 0), near, np.inf)


def pictured(camera, textured=True, floor=True):
    """Return a picture of a box on a floor, both strewn with patches, and the box's mask."""
    v, u = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    ray = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(camera.K).T
    ray = ray @ camera.world_from_camera[:3, :3].T
    eye = camera.world_from_camera[:3, 3]
    box, ground = entered(eye, ray), np.where(ray[..., 2] < 0, -eye[2] / ray[..., 2], np.inf)
    t = np.minimum(box, ground if floor else np.inf)
    seen = np.isfinite(t)
    place = eye + np.where(seen, t, 0)[..., None] * ray
    cell = np.floor(place * 14 + 0.01).astype(np.int64) % 64
    patch = np.random.default_rng(5).integers(40, 220, (64, 64, 64))
    grey = patch[tuple(np.moveaxis(cell, -1, 0))] if textured else np.where(np.isfinite(box), 120, 160)
    grey = np.where(seen, grey, 250).astype(float)
    return np.repeat(gaussian_filter(grey, 0.6)[..., None], 3, axis=2).round().astype(np.uint8), np.isfinite(box)


def pictures(step=0.2, count=5, **more):
    eyes = [(2.2 * np.cos(k * step), 2.2 * np.sin(k * step), 1.2 + 0.1 * (k % 2)) for k in range(count)]
    cameras = tuple(looking(np.array(eye)) for eye in eyes)
    made = [pictured(c, **more) for c in cameras]
    return Views(np.stack([m[0] for m in made]), cameras), np.stack([m[1] for m in made]).astype(np.uint8) * 255


@pytest.fixture(scope="module")
def near():
    return pictures()[0]


def posed(views, change):
    return replace(
        views, cameras=tuple(replace(c, world_from_camera=change(c.world_from_camera)) for c in views.cameras)
    )


def test_right_poses_are_let_pass(near):
    found = check_pose_consistency(near)
    assert (found.by, found.doubt) == ("matches", None)
    assert found.matches > 100 and found.share > 0.6 and found.error < 1


def test_blurred_and_noisy_pictures_are_let_pass(near):
    noise = np.random.default_rng(0).normal(0, 4, near.rgb.shape)
    rgb = np.stack([gaussian_filter(p.astype(float), (1, 1, 0)) * 0.7 for p in near.rgb]) + noise
    assert check_pose_consistency(replace(near, rgb=rgb.clip(0, 255).astype(np.uint8))).doubt is None


def test_matrices_for_larger_pictures_are_reported_at_which_scale_they_would_agree(near):
    larger = [replace(c, K=np.diag([4.0, 4.0, 1.0]) @ c.K) for c in near.cameras]
    found = check_pose_consistency(replace(near, cameras=tuple(larger)))
    assert found.hopeless
    assert found.doubt is not None
    assert "principal point (328, 236) lies outside pictures of 160 x 120" in found.doubt
    scale = float(re.search(r"at a scale of ([\d.]+):", found.doubt)[1])
    assert scale == pytest.approx(0.25, rel=0.03)
    scaled = [replace(c, K=np.diag([scale, scale, 1.0]) @ c.K) for c in larger]
    assert check_pose_consistency(replace(near, cameras=tuple(scaled))).doubt is None


def test_opposite_axes_are_named(near):
    doubt = check_pose_consistency(posed(near, lambda W: W @ OPENGL_FROM_OPENCV_AXES)).doubt
    assert re.match(r"The poses do not agree .* only \d+% of \d+ points .*px\)\. They would if", doubt)
    assert "y and z axes were opposite (OpenGL's convention" in doubt


def test_a_wrong_convention_is_hopeless_though_a_third_of_the_points_agree(near):
    """Nothing lies between two conventions; a focal length may be a little off."""
    found = check_pose_consistency(posed(near, lambda W: W @ OPENGL_FROM_OPENCV_AXES))
    assert found.share > 0.3 and found.hopeless


@pytest.fixture
def shared_points(monkeypatch):
    """Return views all around, and let pictures share points without looking at them."""
    rng = np.random.default_rng(8)
    turns = np.arange(8) * 0.7
    eyes = np.stack([2.2 * np.cos(turns), 2.2 * np.sin(turns), rng.uniform(0.5, 2, 8)], axis=1)
    cameras = tuple(looking(eye, rng.uniform(-0.5, 0.5, 3)) for eye in eyes)
    points = np.c_[rng.uniform(-0.5, 0.5, (60, 3)), np.ones(60)]

    def seen(camera):
        u, v, depth = projection_matrix(camera) @ points.T
        places = np.stack([u / depth, v / depth], axis=1) + rng.normal(0, 0.3, (60, 2))
        places[:20] = rng.uniform(0, 120, (20, 2))  # a third of all matches is wrong
        return places

    pairs = [_MatchedPair(k, (k + 1) % 8, *(seen(cameras[j % 8]) for j in (k, k + 1))) for k in range(8)]
    monkeypatch.setattr("corporeal.multiview.pose_consistency._pairs", lambda views: pairs)
    return Views(np.zeros((8, HEIGHT, WIDTH, 3), np.uint8), cameras)


WRONG = {
    "OpenGL's": (lambda W: W @ OPENGL_FROM_OPENCV_AXES, "y and z axes were opposite .OpenGL's"),
    "inverted": (np.linalg.inv, "if the matrices were inverted .*, the cameras' axes OpenCV's:"),
    "both": (lambda W: np.linalg.inv(W @ OPENGL_FROM_OPENCV_AXES), "inverted .*, the cameras' axes OpenGL's:"),
    "negated": (lambda W: np.block([[W[:3, :3], -W[:3, 3:]], [W[3:]]]), "behind the cameras"),
}


def test_a_third_of_wrong_matches_does_no_harm(shared_points):
    found = check_pose_consistency(shared_points)
    assert (found.by, found.doubt, found.matches) == ("matches", None, 480)
    assert 0.6 < found.share < 0.72


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_convention_is_named(shared_points, case):
    change, words = WRONG[case]
    assert re.search(words, check_pose_consistency(posed(shared_points, change)).doubt)


@pytest.mark.parametrize(("factor", "named"), [(0.5, "2"), (2.0, "0.5"), (0.667, "1.5")])
def test_a_wrong_focal_length_is_named(shared_points, factor, named):
    """It shows where the cameras do not all look at one point."""
    scale = np.array([[factor, factor, 1], [1, factor, 1], [1, 1, 1]])
    wrong = tuple(replace(c, K=c.K * scale) for c in shared_points.cameras)
    doubt = check_pose_consistency(replace(shared_points, cameras=wrong)).doubt
    assert f"if the focal lengths were {named} times as long" in doubt


@pytest.fixture(scope="module")
def centred():
    """Return views of one point in the middle: whatever the focal length, most matches agree."""
    rng = np.random.default_rng(4)
    turns = np.arange(8) * 0.7
    eyes = np.stack([2.2 * np.cos(turns), 2.2 * np.sin(turns), rng.uniform(0.2, 2.5, 8)], axis=1)
    cameras = tuple(replace(looking(eye), K=looking(eye).K - MIDDLE) for eye in eyes)
    points = np.c_[rng.uniform(-0.6, 0.6, (60, 3)) + np.array([0, 0, 0.3]), np.ones(60)]
    seen = [(points @ projection_matrix(c).T) for c in cameras]
    places = [s[:, :2] / s[:, 2:] + rng.normal(0, 0.2, (60, 2)) for s in seen]
    pairs = [_MatchedPair(k, k + 1, places[k], places[k + 1]) for k in range(7)]
    return Views(np.zeros((8, HEIGHT, WIDTH, 3), np.uint8), cameras), pairs


MIDDLE = np.array([[0, 0, 2.0], [0, 0, -1], [0, 0, 0]])
"""What puts the principal point into the very middle."""


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda K: K * [[0.7, 0.7, 1], [1, 0.7, 1], [1, 1, 1]], "about 1.5 times as long"),
        (lambda K: K * [[1.5, 1.5, 1], [1, 1.5, 1], [1, 1, 1]], "about 0.67 times as long"),
        (lambda K: K + np.array([[0, 0, 16], [0, 0, -12], [0, 0, 0]]), "lay about -16 and +12 pixels"),
        (lambda K: K, None),
    ],
)
def test_a_lens_under_which_matches_meet_less_closely_is_reported(centred, change, said, monkeypatch):
    views, pairs = centred
    monkeypatch.setattr("corporeal.multiview.pose_consistency._pairs", lambda _: pairs)
    cameras = tuple(replace(c, K=change(c.K)) for c in views.cameras)
    found = check_pose_consistency(replace(views, cameras=cameras))
    assert not found.hopeless
    assert found.doubt is None if said is None else said in found.doubt


def test_masks_that_belong_to_other_pictures_are_reported(near):
    _, masks = pictures()
    assert check_pose_consistency(near, masks).doubt is None
    elsewhere = np.stack([np.roll(m, 40 * (-1) ** k, axis=1) for k, m in enumerate(masks)])
    assert "of the masks fit together" in check_pose_consistency(near, elsewhere).doubt


def test_poses_that_good_matches_contradict_are_hopeless(centred, monkeypatch):
    views, pairs = centred
    monkeypatch.setattr("corporeal.multiview.pose_consistency._pairs", lambda _: pairs)
    assert not check_pose_consistency(views).hopeless
    assert check_pose_consistency(posed(views, lambda W: W @ OPENGL_FROM_OPENCV_AXES)).hopeless


def test_shuffled_poses_are_doubted(shared_points):
    cameras = tuple(shared_points.cameras[k] for k in (2, 4, 1, 0, 3, 7, 5, 6))
    doubt = check_pose_consistency(replace(shared_points, cameras=cameras)).doubt
    assert "do not agree" in doubt and "Check the order of the pictures" in doubt


def test_a_handful_of_matches_does_not_doubt_the_poses(shared_points, monkeypatch):
    """Of 41 matches of a smooth vase 6 agree, and 9 would under another convention: chance."""
    rng = np.random.default_rng(0)
    x, y = rng.uniform(0, 120, (2, 41, 2))
    turned = tuple(posed(shared_points, np.linalg.inv).cameras)
    for these, cameras in ((slice(0, 6), shared_points.cameras), (slice(6, 15), turned)):
        lines = np.c_[x[these], np.ones(len(x[these]))] @ fundamental_matrix(*cameras[:2]).T
        normal = lines[:, :2] / np.linalg.norm(lines[:, :2], axis=1, keepdims=True)
        off = lines[:, 2] / np.linalg.norm(lines[:, :2], axis=1)
        y[these] -= (np.einsum("ni,ni->n", y[these], normal) + off)[:, None] * normal
    pairs = [_MatchedPair(0, 1, x, y)]
    monkeypatch.setattr("corporeal.multiview.pose_consistency._pairs", lambda _: pairs)
    assert check_pose_consistency(shared_points).doubt is None


def test_smooth_objects_have_no_result():
    views, _ = pictures(textured=False, floor=False)
    found = check_pose_consistency(posed(views, lambda W: W @ OPENGL_FROM_OPENCV_AXES))
    assert (found.by, found.doubt) == ("nothing", None)


def test_silhouettes_tell_where_smooth_objects_are_seen_from_afar():
    views, masks = pictures(step=1.25, textured=False, floor=False)
    right = check_pose_consistency(views, masks)
    assert (right.by, right.doubt) == ("silhouettes", None)
    assert right.share > 0.9
    assert (
        "y and z axes were opposite"
        in check_pose_consistency(posed(views, lambda W: W @ OPENGL_FROM_OPENCV_AXES), masks).doubt
    )


def test_thin_legs_are_no_reason_for_doubt():
    """A ball beside a stool whose legs are four pixels wide, from twenty sides."""
    angles = np.linspace(0, 2 * np.pi, 20, endpoint=False)
    cameras = [looking((3 * np.cos(a), 3 * np.sin(a), 1.2 + np.sin(a))) for a in angles]
    legs = [np.array([[x, y, 0], [x, y, 0.6]]) for x in (-0.5, 0.1) for y in (-0.3, 0.3)]
    masks = []
    for camera in cameras:
        P = projection_matrix(camera)
        seen = [line @ P[:, :3].T + P[:, 3] for line in (*legs, np.array([[0.6, 0, 0.2]]))]
        seen = [line[:, :2] / line[:, 2:] for line in seen]
        picture = Image.new("L", (camera.width, camera.height))
        draw = ImageDraw.Draw(picture)
        for line in seen[:-1]:
            draw.line([tuple(end) for end in line], fill=255, width=4)
        draw.circle(tuple(seen[-1][0]), 9, fill=255)
        masks.append(np.asarray(picture))
    assert silhouette_coherence(np.stack(masks), tuple(cameras)) > 0.9
    assert silhouette_coherence(np.stack(masks[5:] + masks[:5]), tuple(cameras)) < INCOHERENT_HULL_FRACTION


def test_cameras_that_only_turn_are_doubted(near):
    still = posed(near, lambda W: np.block([[W[:3, :3], np.zeros((3, 1))], [W[3:]]]))
    assert "at one place" in check_pose_consistency(still).doubt


# ---------------------------------------------------------------- the mathematics


def two_views(rng, count=50):
    a, b = looking(np.array([2.0, 0.2, 1.0])), looking(np.array([1.5, 1.4, 1.3]), focal=180.0)
    points = np.c_[rng.uniform(-0.5, 0.5, (count, 3)), np.ones(count)]
    seen = [points @ projection_matrix(c).T for c in (a, b)]
    return a, b, *(s[:, :2] / s[:, 2:] for s in seen), [s[:, 2] for s in seen]


def test_pictures_of_one_point_agree_to_rounding_and_shifted_ones_err_by_their_shift():
    a, b, x, y, depth = two_views(np.random.default_rng(0))
    F = fundamental_matrix(a, b)
    assert sampson_distance(F, x, y).max() < 1e-9
    np.testing.assert_allclose(depths_of_match(a, b, x, y).T, depth, rtol=1e-7)
    # Half the shift is the least that both points must move where lines have one slope.
    lines = np.c_[x, np.ones(len(x))] @ F.T
    normal = lines[:, :2] / np.linalg.norm(lines[:, :2], axis=1)[:, None]
    error = sampson_distance(F, x, y + 0.1 * normal)
    assert (error < 0.1).all() and (error > 0.02).all()


def test_points_behind_the_cameras_are_reported():
    a, b, x, y, _ = two_views(np.random.default_rng(1))
    turn = np.diag([1.0, 1, 1, 1])
    turn[:3, :3] = -np.eye(3)  # all places on the other side: the same epipolar lines
    mirrored = [
        replace(
            c,
            world_from_camera=np.block(
                [[c.world_from_camera[:3, :3], -c.world_from_camera[:3, 3:]], [c.world_from_camera[3:]]]
            ),
        )
        for c in (a, b)
    ]
    assert sampson_distance(fundamental_matrix(*mirrored), x, y).max() < 1e-9
    assert (depths_of_match(*mirrored, x, y) < 0).all()


def test_good_matches_are_distinguished_from_random_ones_without_poses():
    rng = np.random.default_rng(2)
    a, _, x, y, _ = two_views(rng, 80)
    assert consensus_fraction(x, y, 2.0, rng) > 0.5
    assert consensus_fraction(x, y[rng.permutation(80)], 2.0, rng) < 0.35
    assert consensus_fraction(x[:7], y[:7], 2.0, rng) == 0
    assert np.isinf(sampson_distance(fundamental_matrix(a, replace(a)), x, y)).all()


@pytest.mark.slow
def test_poses_of_other_programs_are_let_pass_and_their_opposites_named(shared_assets):
    read = read_posed_photos(shared_assets / "posed" / "trivial", longest=160)
    assert check_pose_consistency(read.views, read.masks).doubt is None
    wrong = check_pose_consistency(posed(read.views, lambda W: W @ OPENGL_FROM_OPENCV_AXES), read.masks).doubt
    assert "y and z axes were opposite" in wrong

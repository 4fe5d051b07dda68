"""Gaussians that move with matter look as matter would."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from splat_scenes import around, blobs

from corporeal.geometry.gaussian_transforms import transform_gaussians
from corporeal.geometry.rotation import matrix_from_quaternion
from corporeal.geometry.spherical_harmonics import rotate_sh
from corporeal.reconstruction.gaussians.gaussian_deformation import (
    deform_gaussians,
    nearest_rotations,
    rotate_harmonics,
)
from corporeal.reconstruction.gaussians.rasteriser_numba import render

RNG = np.random.default_rng
TURN = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()


def painted(count=80, degree=3):
    """Blobs that look different from every side."""
    made = blobs(count, degree=degree)
    made.sh[:, 1:] = 0.3 * RNG(5).normal(size=made.sh[:, 1:].shape)
    q = RNG(6).normal(size=(count, 4))
    return replace(made, rotation=q / np.linalg.norm(q, axis=1, keepdims=True))


def covariance(gaussians):
    axes = np.stack([matrix_from_quaternion(q) for q in gaussians.rotation])
    return np.einsum("nij,nj,nkj->nik", axes, gaussians.scale**2, axes)


@pytest.mark.parametrize("degree", [0, 1, 2, 3])
def test_turning_everything_and_the_camera_alike_changes_no_picture(degree):
    before, camera = painted(degree=degree), around(1, (64, 60), focal=90.0)[0]
    shift = np.array([0.3, -0.2, 0.5])
    after = deform_gaussians(before, np.tile(TURN, (80, 1, 1)), before.mean @ TURN.T + shift)
    moved = np.eye(4)
    moved[:3, :3], moved[:3, 3] = TURN, shift
    there = replace(camera, world_from_camera=moved @ camera.world_from_camera)
    one, two = render(before, camera), render(after, there)
    assert one.alpha.mean() > 0.1
    np.testing.assert_allclose(two.rgb, one.rgb, atol=5e-6)
    np.testing.assert_allclose(two.alpha, one.alpha, atol=5e-6)
    if degree:
        grey = replace(after, sh=before.sh)
        assert np.abs(render(grey, there).rgb - one.rgb).max() > 0.05, "colours need not turn"


def test_a_rotation_is_the_same_as_placing():
    before = painted()
    one = deform_gaussians(before, np.tile(TURN, (80, 1, 1)), before.mean @ TURN.T)
    two = transform_gaussians(before, TURN)
    np.testing.assert_allclose(covariance(one), covariance(two), atol=1e-12)
    np.testing.assert_allclose(one.sh, two.sh, atol=1e-12)
    np.testing.assert_allclose(one.mean, two.mean, atol=1e-12)


def test_covariances_follow_the_matter():
    before = painted()
    F = np.eye(3) + 0.4 * RNG(1).normal(size=(80, 3, 3))
    after = deform_gaussians(before, F, before.mean + 1)
    np.testing.assert_allclose(covariance(after), F @ covariance(before) @ F.transpose(0, 2, 1), atol=1e-12)
    np.testing.assert_array_equal(after.opacity, before.opacity)
    np.testing.assert_array_equal(after.mean, before.mean + 1)


def test_a_stretch_turns_no_colour():
    before = painted()
    A = RNG(2).normal(size=(80, 3, 3))
    stretch = np.eye(3) + 0.5 * A @ A.transpose(0, 2, 1)
    np.testing.assert_allclose(deform_gaussians(before, stretch, before.mean).sh, before.sh, atol=1e-12)
    F = TURN @ stretch
    np.testing.assert_allclose(nearest_rotations(F), np.tile(TURN, (80, 1, 1)), atol=1e-12)
    np.testing.assert_allclose(deform_gaussians(before, F, before.mean).sh, rotate_sh(before.sh, TURN), atol=1e-12)


def test_each_turns_by_its_own_rotation():
    sh = RNG(0).normal(size=(5, 16, 3))
    turns = Rotation.random(5, random_state=0).as_matrix()
    own = rotate_harmonics(sh, turns)
    for k in range(5):
        np.testing.assert_allclose(own[k], rotate_sh(sh[k : k + 1], turns[k])[0], atol=1e-12)


@pytest.mark.parametrize("F", [np.zeros((3, 3)), np.diag([1.0, 1.0, -1.0]), np.diag([1.0, 0, 0])])
def test_crushed_and_inverted_matter_gives_sound_gaussians(F):
    before = painted(4)
    after = deform_gaussians(before, np.tile(F, (4, 1, 1)), before.mean)
    for values in (after.rotation, after.scale, after.sh):
        assert np.isfinite(values).all()
    np.testing.assert_allclose(np.linalg.norm(after.rotation, axis=1), 1)
    np.testing.assert_allclose(np.linalg.det(nearest_rotations(np.tile(F, (4, 1, 1)))), 1)
    picture = render(after, around(1)[0])
    assert np.isfinite(picture.rgb).all()


def test_single_precision_stays_single():
    before = painted(4)
    kinds = {n: getattr(before, n).astype(np.float32) for n in ("mean", "rotation", "scale", "sh")}
    after = deform_gaussians(replace(before, **kinds), np.tile(TURN, (4, 1, 1)), before.mean)
    assert {getattr(after, n).dtype for n in kinds} == {np.dtype(np.float32)}

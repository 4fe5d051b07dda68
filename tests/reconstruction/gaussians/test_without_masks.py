"""Without masks: what encloses a scene, who judges haze, and exposures that differ."""

import numpy as np
import pytest
from splat_scenes import around, blobs, pictured

from corporeal.core.types import Gaussians, Views
from corporeal.multiview.ground_plane import GroundPlane
from corporeal.reconstruction.gaussians import densification, exposure_gains
from corporeal.reconstruction.gaussians.background_model import (
    BackgroundModel,
    background_model,
    cover_background,
    fibonacci_directions,
)
from corporeal.reconstruction.gaussians.gaussian_initialisation import (
    StartPoints,
    choose_points,
    initial_gaussians,
    join_points,
)
from corporeal.reconstruction.gaussians.gaussian_parameters import parameters_of_gaussians
from corporeal.reconstruction.gaussians.heldout_quality import heldout_quality
from corporeal.reconstruction.gaussians.kernels_training import adam_rows
from corporeal.reconstruction.gaussians.plane_sweep import PlaneSweepConfig, sweep_planes
from corporeal.reconstruction.gaussians.rasteriser_numba import draw, pinhole_of_camera
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.gaussians.train_gaussians import train_gaussians
from corporeal.reconstruction.gaussians.training_schedule import TrainConfig
from corporeal.reconstruction.gaussians.view_depths import ViewDepths
from corporeal.reconstruction.gaussians.visual_hull import camera_rows

RNG = np.random.default_rng
FLOOR = GroundPlane(np.array([0.0, 0.0, 1.0]), -0.5, 0.5, 0.001)
ROOM = BackgroundModel(np.zeros(3), 10.0, FLOOR, 0.02)


def above(count=12, **lens):
    """Cameras that look down at the origin."""
    return tuple(c for c in around(2 * count, **lens) if c.world_from_camera[2, 3] > 0.3)


def test_rays_end_on_the_floor_or_on_the_dome():
    eye = np.tile([0.0, 0.0, 1.0], (3, 1))
    ray = np.array([[0, 0, -2.0], [0, 0, 3.0], [1.0, 0, -0.001]])
    far = ROOM.reach(eye, ray)
    np.testing.assert_allclose(far[:2], [0.75, 3.0])
    assert np.linalg.norm(eye[2] + far[2] * ray[2]) == pytest.approx(10)
    np.testing.assert_allclose(ROOM.normals(np.array([[3.0, 0, -0.5], [0, 0, 10.0]])), [[0, 0, 1], [0, 0, -1]])


def test_the_floor_is_found_whichever_way_is_up():
    rng = RNG(0)
    flat = np.concatenate([rng.uniform(-1, 1, (800, 2)), np.full((800, 1), -0.5)], axis=1)
    points = np.concatenate([flat, rng.normal(size=(400, 3)) * [0.2, 0.2, 0.1]])
    cameras = above()
    found = background_model(points, cameras, rng).ground
    assert found is not None
    np.testing.assert_allclose(found.normal, [0, 0, 1], atol=0.01)
    assert found.offset == pytest.approx(-0.5, abs=0.005)
    assert background_model(rng.normal(size=(500, 3)), cameras, rng).ground is None


def test_a_cover_leaves_no_gap():
    """From anywhere within, whichever way one looks."""
    white = np.ones((50, 3))
    points = cover_background(ROOM, above(), 1500, 9 * fibonacci_directions(50), white)
    np.testing.assert_allclose(points.colour, 1)
    made = initial_gaussians(points, 2000, 0, RNG(0))
    low = around(24, centre=(0.0, 0.0, 0.7), distance=2.0)
    with ThreadPool(1) as pool:
        through = [draw(made, pinhole_of_camera(c), np.zeros(3), pool).planes[3].max() for c in low]
    assert max(through) < 0.3 and np.mean(through) < 0.1


def test_gaussians_begin_flat_on_known_surfaces_and_as_wide_as_stated():
    normal = np.array([[0, 0, 1.0], [0, 0, -1.0], [0.6, 0, 0.8], [0, 0, 0]])
    points = StartPoints(np.eye(4, 3), np.ones((4, 3)), 0.5, normal, np.full(4, 0.2))
    theta = initial_gaussians(points, 9, 0, RNG(0))
    np.testing.assert_allclose(np.exp(theta[:, 7:10]), [[0.2, 0.2, 0.02]] * 3 + [[0.2] * 3], rtol=1e-5)
    w, x, y, z = theta[:3, 3:7].T
    axis = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)
    np.testing.assert_allclose(axis, normal[:3], atol=1e-6)


def test_points_are_joined_with_what_is_known_of_each():
    plain = StartPoints(np.zeros((2, 3)), np.zeros((2, 3)))
    flat = StartPoints(np.ones((1, 3)), np.ones((1, 3)), 0.9, np.array([[0, 1.0, 0]]), np.ones(1))
    both = join_points(plain, flat)
    np.testing.assert_allclose(both.opacity, [0.5, 0.5, 0.9])
    np.testing.assert_allclose(both.normal, [[0, 0, 0], [0, 0, 0], [0, 1, 0]])
    np.testing.assert_allclose(both.width, [np.nan, np.nan, 1])
    last = choose_points(both, np.array([2]))
    assert last.position.tolist() == [[1, 1, 1]] and last.opacity.tolist() == [0.9]


@pytest.fixture
def wall():
    """What twelve cameras say who see, in all directions, a surface 3 m away."""
    cameras = around(12)
    shape = 12, 10, 12
    return cameras, ViewDepths(camera_rows(cameras), 4.0, np.full(12, 0.9), np.full(shape, 3.0), np.full(shape, 30.0))


def test_what_views_see_past_is_haze_if_it_is_wide(wall):
    cameras, surfaces = wall
    eye = cameras[0].world_from_camera[:3, 3]
    position = np.stack([np.zeros(3), 0.6 * eye, 0.6 * eye])
    with ThreadPool(1) as pool:
        said = surfaces.judge(position, np.array([0.5, 0.5, 0.001]), pool)
    assert said.haze.tolist() == [False, True, False]
    assert said.few.tolist() == [False, True, True]
    assert said.nearest[0] == pytest.approx(3) and said.nearest[1] == pytest.approx(1.2, rel=1e-6)


def test_what_is_wide_is_flat_and_what_few_see_has_one_colour(wall):
    cameras, surfaces = wall
    theta = parameters_of_gaussians(blobs(2, degree=1))
    theta[:, :3] = [[0, 0, 0], 0.6 * cameras[0].world_from_camera[:3, 3]]
    theta[:, 7:10] = np.log([0.5, 0.4, 0.2])
    with ThreadPool(1) as pool:
        bounds, _ = densification.scale_limits_from_views(theta, 1.0, surfaces, pool)
    before, zeros = theta.copy(), np.zeros_like(theta)
    spans, rates = np.array([[0, 1], [0, 1]]), np.full(theta.shape[1], 0.01, np.float32)
    adam_rows(theta, zeros + 1, zeros, zeros + 1, rates, 1, (0, 0), bounds, spans, 0, 2)
    np.testing.assert_allclose(np.exp(theta[0, 7:10]), [0.3, 0.3, 0.03], rtol=1e-5)
    np.testing.assert_allclose(np.exp(theta[1, 7:10]), [0.12, 0.12, 0.012], rtol=1e-5)
    assert (theta[0, 14:] != before[0, 14:]).all()
    np.testing.assert_array_equal(theta[1, 14:], before[1, 14:])


def test_what_is_out_of_the_picture_stays_or_fades():
    theta = parameters_of_gaussians(blobs(2))
    zeros, rates = np.zeros_like(theta), np.full(theta.shape[1], 0.1, np.float32)
    bounds = densification.equal_scale_limits(theta, 10.0)
    bounds[0, 3] = 1
    before, spans = theta[:, 10].copy(), np.zeros((2, 2), int)
    pull = np.float32(0.1), np.float32(0)
    adam_rows(theta, zeros.copy(), zeros.copy(), zeros.copy(), rates, 1, pull, bounds, spans, 0, 2)
    assert theta[0, 10] == before[0] and theta[1, 10] < before[1] - 0.05


def test_smooth_pictures_are_laid_on_the_floor():
    """Of a floor only a spot about a ball has texture; all of it is found."""
    rng, count = RNG(1), 12_000
    flat = rng.uniform(-3, 3, (count, 3)) * [1, 1, 0] - [0, 0, 0.5]
    near = np.linalg.norm(flat[:, :2], axis=1) < 0.5
    flat[:2000] = 0.25 * fibonacci_directions(2000) - [0, 0, 0.25]
    near[:2000] = True
    sh = np.zeros((count, 1, 3))
    sh[near, 0] = 2 * np.sin(12 * flat[near] + [0, 1, 2])
    made = Gaussians(
        flat, np.tile([1.0, 0, 0, 0], (count, 1)), np.tile([0.06, 0.06, 0.002], (count, 1)), np.full(count, 0.99), sh
    )
    views, _ = pictured(made, above(16, size=(96, 96), focal=120.0), (0.5, 0.5, 0.5))
    with ThreadPool(1) as pool:
        points = sweep_planes(views, 3000, RNG(0), pool, PlaneSweepConfig(6_000)).points
    on = np.abs(points.position[:, 2] + 0.49) < 0.04
    wide = np.linalg.norm(points.position[:, :2], axis=1)
    around_it = (wide > 0.7) & (wide < 2) & (points.position[:, 2] < 1)
    assert on[around_it].mean() > 0.8 and around_it.sum() > 150


@pytest.mark.slow
def test_exposures_are_learned_and_not_counted_as_errors():
    views, _ = pictured(blobs(40), around(16, (64, 64), focal=80.0), (0.5, 0.5, 0.5))
    gains = np.exp(0.15 * RNG(0).normal(size=(16, 3)))
    rgb = np.clip(views.rgb * gains[:, None, None], 0, 255).astype(np.uint8)
    coarse = PlaneSweepConfig(max_depths=4_000)
    config = TrainConfig(preset="draft", gaussians=400, steps=300, threads=1, sweep=coarse)
    out = train_gaussians(Views(rgb, views.cameras), config=config)
    learned = [k for k in range(16) if k % 8 != 4]
    true = np.log(gains[learned] / np.exp(np.log(gains[learned]).mean(axis=0)))
    np.testing.assert_allclose(np.log(out.exposures[learned]), true, atol=0.06)
    np.testing.assert_allclose(out.exposures[[4, 12]], 1)
    assert exposure_gains.exposures_differ(out.exposures)
    plain = heldout_quality(out.gaussians, Views(rgb, views.cameras), [4, 12])
    assert out.quality.psnr > 24 and out.quality.psnr > plain.psnr + 2


def test_a_gain_is_distinguished_from_what_is_covered_alone():
    truth, cameras = blobs(), around(1)
    views, masks = pictured(truth, cameras)
    darker = (0.5 * views.rgb[0]).astype(np.uint8)
    with ThreadPool(1) as pool:
        drawing = draw(parameters_of_gaussians(truth), pinhole_of_camera(cameras[0]), np.ones(3), pool)
    found = exposure_gains.exposure_gain(drawing, darker, np.where(masks[0], 255, 0).astype(np.uint8))
    np.testing.assert_allclose(found, 0.5, rtol=0.02)
    assert np.isnan(exposure_gains.exposure_gain(drawing, darker, np.zeros(masks[0].shape, np.uint8))).all()


def test_exposure_changes_objects_and_not_the_grey_behind_them():
    grey = (0.5, 0.5, 0.5)
    views, masks = pictured(blobs(), around(6), grey)
    dark = Views((0.6 * views.rgb).astype(np.uint8), views.cameras)
    found = heldout_quality(blobs(), dark, [0, 1], masks, grey, apart=True)
    even = heldout_quality(blobs(), views, [0, 1], masks, grey)
    assert found.psnr > even.psnr - 2.5
    assert heldout_quality(blobs(), dark, [0, 1], masks, grey).psnr < found.psnr - 3

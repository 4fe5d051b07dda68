"""What training is made of: the loss and its slope, Adam, growth, where Gaussians start."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import correlate1d
from skimage.metrics import structural_similarity
from splat_scenes import around, blobs, pictured

from corporeal.core.errors import UserError
from corporeal.core.types import Views
from corporeal.geometry.rotation import matrix_from_quaternion
from corporeal.multiview.viewed_region import find_viewed_region
from corporeal.reconstruction.gaussians import densification, gaussian_initialisation
from corporeal.reconstruction.gaussians.carved_volume import carve_volume
from corporeal.reconstruction.gaussians.densification import (
    MAX_COPIES,
    densify,
    random_steps,
    rotate_by_quaternions,
    split_opacity_and_scale,
)
from corporeal.reconstruction.gaussians.gaussian_initialisation import (
    StartPoints,
    free_depths,
    initial_gaussians,
    points_on_hull,
)
from corporeal.reconstruction.gaussians.gaussian_parameters import (
    gaussians_of_parameters,
    opacities,
    parameters_of_gaussians,
)
from corporeal.reconstruction.gaussians.heldout_quality import heldout_quality, psnr, ssim
from corporeal.reconstruction.gaussians.hull_config import HullConfig
from corporeal.reconstruction.gaussians.image_loss import TargetImage, image_loss, target_image
from corporeal.reconstruction.gaussians.kernels_plane_sweep import count_support
from corporeal.reconstruction.gaussians.kernels_training import SSIM_WINDOW, adam_rows
from corporeal.reconstruction.gaussians.plane_sweep import PlaneSweepConfig, neighbouring_views, sweep_planes
from corporeal.reconstruction.gaussians.rasteriser_numba import draw, pinhole_of_camera
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.gaussians.visual_hull import camera_rows

RNG = np.random.default_rng


def test_ssim_is_that_of_skimage():
    """The rim, where the two differ in what lies outside, is black in both pictures."""
    a, b = np.zeros((2, 60, 50, 3), np.float32)
    a[12:-12, 12:-12] = RNG(0).random((36, 26, 3))
    b[12:-12, 12:-12] = np.clip(a[12:-12, 12:-12] + 0.2 * RNG(1).normal(size=(36, 26, 3)), 0, 1)
    options = {"gaussian_weights": True, "sigma": 1.5, "use_sample_covariance": False}
    _, full = structural_similarity(a, b, channel_axis=2, data_range=1, full=True, **options)
    assert 0.3 < full.mean() < 0.95
    assert ssim(a, b) == pytest.approx(full.mean(), abs=2e-6)
    assert ssim(a, a) == pytest.approx(1, abs=1e-6)


def test_psnr_of_a_tenth_is_twenty():
    a = np.full((4, 4, 3), 0.5)
    assert psnr(a, a + 0.1) == pytest.approx(20)
    assert np.isnan(psnr(a[:0], a[:0]))


def true_loss(planes, target, mask):
    """Say the loss plainly; planes may be complex."""
    delta = planes[:3] - target
    value = 0.8 * (delta * np.sign(delta.real)).mean()
    cover = 1 - planes[3] - mask
    value += 0.1 * (cover * np.sign(cover.real)).mean()

    def blur(p):
        for axis in (1, 2):
            p = correlate1d(p, SSIM_WINDOW.astype(float), axis=axis, mode="constant")
        return p

    x, y = planes[:3], target
    mx, my = blur(x), blur(y)
    vx, vy, vxy = blur(x * x) - mx * mx, blur(y * y) - my * my, blur(x * y) - mx * my
    top = (2 * mx * my + 1e-4) * (2 * vxy + 9e-4)
    return value + 0.2 * (1 - (top / ((mx * mx + my * my + 1e-4) * (vx + vy + 9e-4))).mean())


def test_the_loss_and_its_slope():
    camera = around(1, (17, 15))[0]
    rng = RNG(0)
    aim = TargetImage(rng.random((3, 15, 17), np.float32), rng.random((15, 17), np.float32))
    drawings = {}
    for threads in (1, 3):
        with ThreadPool(threads) as pool:
            drawing = draw(parameters_of_gaussians(blobs()), pinhole_of_camera(camera), np.full(3, 0.3), pool)
            drawings[threads] = drawing, image_loss(drawing, aim, pool)
    drawing, off = drawings[1]
    planes, target = drawing.planes[:4].astype(complex), aim.planes.astype(float)
    assert off.value == pytest.approx(true_loss(planes, target, aim.mask).real, rel=1e-5)
    assert off.error == pytest.approx(np.mean((planes[:3].real - target) ** 2), rel=1e-5)
    exact = np.empty(off.slope.shape)
    for index in np.ndindex(exact.shape):
        planes[index] += 1e-30j
        exact[index] = true_loss(planes, target, aim.mask).imag / 1e-30
        planes[index] = planes[index].real
    np.testing.assert_allclose(off.slope, exact, atol=2e-5 * np.abs(exact).max())
    np.testing.assert_array_equal(drawings[3][1].slope, off.slope)


def test_a_goal_lies_on_the_background_beside_its_mask():
    rgb = np.full((2, 3, 3), 255, np.uint8)
    mask = np.array([[0, 255, 0], [255, 255, 51]], np.uint8)
    aim = target_image(rgb, mask, np.array([0.5, 0, 1], np.float32))
    np.testing.assert_allclose(aim.planes[:, 0, 0], [0.5, 0, 1])
    np.testing.assert_allclose(aim.planes[:, 1, 0], 1)
    np.testing.assert_allclose(aim.planes[:, 1, 2], [0.6, 0.2, 1], atol=1e-6)
    assert target_image(rgb, None, np.zeros(3, np.float32)).mask.shape == (0, 0)


def test_adam_takes_the_published_steps_and_survives_nan():
    theta = parameters_of_gaussians(blobs(5))
    before = theta.copy()
    rng, rates = RNG(0), np.linspace(0.01, 0.1, theta.shape[1]).astype(np.float32)
    first, second = np.zeros_like(theta), np.zeros_like(theta)
    bounds = densification.equal_scale_limits(theta, 10.0), np.array([[0, 1]] * len(theta))
    m, v, plain = 0.0, 0.0, before.astype(float)
    for step in range(1, 5):
        g = rng.normal(size=theta.shape).astype(np.float32)
        m, v = 0.9 * m + 0.1 * g, 0.999 * v + 0.001 * g.astype(float) ** 2
        plain -= rates * (m / (1 - 0.9**step)) / np.sqrt(v / (1 - 0.999**step))
        pull = np.float32(0), np.float32(0)
        adam_rows(theta, g, first, second, rates, step, pull, *bounds, 0, len(theta))
    np.testing.assert_allclose(theta, plain, atol=1e-5)
    bad = np.full_like(theta, np.nan)
    bad[:, ::2] = np.inf
    adam_rows(theta, bad, first, second, rates, 5, pull, *bounds, 0, len(theta))
    assert np.isfinite(theta).all()


@pytest.mark.parametrize("crowd", [1, 2, 7, MAX_COPIES])
def test_a_crowd_covers_what_one_covered(crowd):
    """Copies in one place hide 1 - (1 - o' g)^C; its integral along a line is that of one."""
    o = np.array([0.4, 0.6, 0.9])
    new, shrink = split_opacity_and_scale(o, np.full(3, crowd))
    np.testing.assert_allclose(1 - (1 - new) ** crowd, o, rtol=1e-9)
    x = np.linspace(-12, 12, 200_001)
    for before, after, factor in zip(o, new, shrink, strict=True):
        one = before * np.exp(-x * x / 2)
        many = 1 - (1 - after * np.exp(-((x / factor) ** 2) / 2)) ** crowd
        assert many.sum() == pytest.approx(one.sum(), rel=1e-6)


def test_the_dead_move_to_the_living_and_others_join():
    theta = parameters_of_gaussians(blobs(100))
    theta[:20, 10] = -8
    moments = [np.ones_like(theta), np.ones_like(theta)]
    grown, fresh = densify(theta, moments, 103, RNG(0))
    assert len(grown) == len(fresh[0]) == len(fresh[1]) == 103
    assert opacities(grown).min() > 0.005
    living = {tuple(p) for p in theta[20:, :3]}
    assert {tuple(p) for p in grown[:, :3]} == living, "somebody stands where nobody was"
    touched = (fresh[0] == 0).all(axis=1)
    assert touched[:20].all() and touched[100:].all() and not touched.all()
    assert (opacities(grown) <= 0.9951).all() and np.isfinite(grown).all()


def test_faint_ones_wander_within_their_shape_and_opaque_ones_stay():
    theta = np.repeat(parameters_of_gaussians(blobs(1)), 4000, axis=0)
    theta[:, 3:7] = [0.9, 0.3, -0.2, 0.1]
    theta[:, 7:10] = np.log([0.2, 0.1, 1e-6])
    theta[:, 10] = -12
    steps = random_steps(theta, 1 + np.exp(-0.5), RNG(0))
    inward = steps @ matrix_from_quaternion(theta[0, 3:7])
    np.testing.assert_allclose(inward.std(axis=0)[:2], [0.2, 0.1], rtol=0.05)
    assert np.abs(inward[:, 2]).max() < 1e-5
    theta[:, 10] = 0
    assert np.abs(random_steps(theta, 2.0, RNG(0))).max() < 1e-12


def test_turning_vectors_is_the_rotation_of_the_quaternion():
    q, x = RNG(0).normal(size=4), RNG(1).normal(size=(5, 3))
    q /= np.linalg.norm(q)
    np.testing.assert_allclose(
        rotate_by_quaternions(np.tile(q, (5, 1)), x), x @ matrix_from_quaternion(q).T, atol=1e-12
    )


def test_the_region_is_what_the_cameras_look_at():
    found = find_viewed_region(around(12, centre=(1.0, -2.0, 0.5)))
    np.testing.assert_allclose(found.centre, (1, -2, 0.5), atol=0.01)
    assert found.radius == pytest.approx(3 * np.sin(np.arctan(20 / 50)), rel=0.01)


def test_cameras_have_free_space_before_them():
    np.testing.assert_allclose(free_depths(around(12, centre=(1.0, -2.0, 0.5))), 0.9, atol=0.01)


def test_parallel_cameras_have_a_region():
    assert np.isfinite(find_viewed_region(around(1) * 3).centre).all()


def test_the_hull_of_a_ball_is_a_ball():
    coarse = HullConfig(grid_cells=50_000)
    cameras = around(40, (64, 64), focal=80.0)
    u, v = np.meshgrid(np.arange(64) + 0.5, np.arange(64) + 0.5)
    disc = np.hypot(u - 32, v - 32) < 80 * 0.5 / np.sqrt(9 - 0.25)
    masks = np.stack([disc] * 40)
    views = Views(np.zeros((*masks.shape, 3), np.uint8), cameras)  # plain: stereo sees nothing
    with ThreadPool(1) as pool:
        carved = carve_volume(views, masks, None, pool, coarse)
        points = points_on_hull(carved, 3000, RNG(0), pool, 0.2)
        distance, faint = (
            np.linalg.norm(points.position, axis=1),
            points.opacity < gaussian_initialisation.INITIAL_HULL_OPACITY,
        )
        assert len(distance) == 3000 and faint.sum() == 600
        on, within = distance[~faint], distance[faint]
        np.testing.assert_allclose(np.quantile(on, [0.1, 0.5, 0.9]), 0.5, atol=0.04)
        # Evenly: the share within a radius grows as its cube.
        np.testing.assert_allclose(np.median(within), 0.5 * 0.5 ** (1 / 3), atol=0.02)
        with pytest.raises(UserError, match="inside all masks"):
            carve_volume(views, np.zeros_like(masks), None, pool, coarse)


@pytest.fixture(scope="module")
def ball():
    """A blotched ball of radius 0.6 before grey, its centre half a metre to one side.

    It is of blobs, so that seen from outside it bulges by about a standard deviation.
    """
    unit = RNG(3).normal(size=(4000, 3))
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    made = blobs(4000)
    made.mean[:] = 0.6 * unit + [0.5, 0, 0]
    made.scale[:] = 0.02
    made.opacity[:] = 0.99
    made.sh[:, 0] = np.sin(9 * unit + [0, 1, 2])
    cameras = around(40, (64, 64), focal=80.0, centre=(0.5, 0, 0))
    return pictured(made, cameras, (0.5, 0.5, 0.5))[0]


def test_a_sweep_finds_the_surface(ball):
    with ThreadPool(1) as pool:
        points = sweep_planes(ball, 20_000, RNG(0), pool, PlaneSweepConfig(8_000)).points
    distance = np.linalg.norm(points.position - [0.5, 0, 0], axis=1)
    near = distance < 1
    assert near.sum() > 200
    np.testing.assert_allclose(np.median(distance[near]), 0.62, atol=0.015)
    assert np.mean(np.abs(distance[near] - 0.62) < 0.06) > 0.8
    assert np.mean((distance > 0.8) & (distance < 2)) < 0.1, "something floats before the cameras"
    assert points.colour[near].std() > 0.1


def test_a_view_that_knows_no_depth_neither_confirms_nor_denies():
    cameras = around(6, (8, 8), focal=8.0)
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras])
    middle = np.linalg.norm(eyes, axis=1)  # all look at the origin
    depths = np.full((6, 8, 8), np.inf)
    depths[1], depths[2], depths[3] = middle[1], 2 * middle[2], 0.5 * middle[3]
    votes = np.empty((1, 2))
    owner = np.zeros(1, int)
    count_support(np.zeros((1, 3)), owner, 0, 1, camera_rows(cameras), depths, 1.0, 0.04, votes)
    # One sees the point where it is, one sees past it, before one something else stands.
    np.testing.assert_array_equal(votes, [[1, 1]])


def test_the_number_of_threads_changes_no_sweep(ball):
    config, found = PlaneSweepConfig(max_depths=3_000), []
    for threads in (1, 3):
        with ThreadPool(threads) as pool:
            found.append(sweep_planes(ball, 500, RNG(0), pool, config).points.position)
    np.testing.assert_array_equal(*found)


def test_cameras_that_look_past_each_other_agree_nowhere(ball):
    away = []
    for k, camera in enumerate(ball.cameras[:6]):
        pose = camera.world_from_camera.copy()
        pose[:3, 3] += [100 * k, 0, 0]
        away.append(replace(camera, world_from_camera=pose))
    with ThreadPool(1) as pool, pytest.raises(UserError, match="agree on no place"):
        views = Views(ball.rgb[:6], tuple(away))
        sweep_planes(views, 500, RNG(0), pool, PlaneSweepConfig(max_depths=1_000))


def test_neighbours_are_beside_but_not_on_the_spot():
    cameras = around(24)
    cameras = (*cameras, cameras[3])
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras])
    mates = neighbouring_views(cameras, 3)
    assert len(mates) == 4 and 3 not in mates and 24 not in mates
    apart = np.linalg.norm(eyes - eyes[3], axis=1)
    assert set(mates) == set(np.argsort(apart)[2:6])
    assert list(neighbouring_views(cameras[:2], 0)) == [1]


def test_gaussians_begin_as_wide_as_they_are_apart():
    grid = np.stack(np.meshgrid(*[np.arange(8.0)] * 3), axis=-1).reshape(-1, 3)
    theta = initial_gaussians(StartPoints(0.1 * grid, np.full((512, 3), 0.8)), 1000, 1, RNG(0))
    made = gaussians_of_parameters(theta)
    np.testing.assert_allclose(made.scale, 0.1, rtol=1e-5)
    np.testing.assert_allclose(made.opacity, 0.5, rtol=1e-5)
    np.testing.assert_allclose(0.5 + 0.28209479 * made.sh[:, 0], 0.8, atol=1e-6)
    assert not made.sh[:, 1:].any()
    assert len(initial_gaussians(StartPoints(grid, grid / 8), 100, 0, RNG(0))) == 100
    assert len(initial_gaussians(StartPoints(grid[:1], grid[:1]), 100, 0, RNG(0))) == 1


def test_the_quality_of_the_truth_is_that_of_rounding():
    truth, cameras = blobs(), around(6)
    views, masks = pictured(truth, cameras, (0.5, 0.5, 0.5))
    same = heldout_quality(truth, views, range(6), background=(0.5, 0.5, 0.5))
    assert same.psnr > 55 and same.ssim > 0.999 and same.psnr_on_objects is None
    assert heldout_quality(truth, views, [1, 3], masks, (0.5, 0.5, 0.5)).psnr_on_objects > 50

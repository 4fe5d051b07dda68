"""A radiance field: gradients, light through matter, points on surfaces, features in space."""

from dataclasses import replace

import numpy as np
import pytest
from splat_scenes import around

from corporeal.core.errors import UserError
from corporeal.core.types import Views
from corporeal.reconstruction.gaussians import kernels_radiance, radiance_field
from corporeal.reconstruction.gaussians.feature_distillation import distil_features
from corporeal.reconstruction.gaussians.hull_config import HullConfig
from corporeal.reconstruction.gaussians.radiance_field import (
    RadianceFieldConfig,
    field_arrays,
    field_camera_rows,
    field_surface_points,
    haze_field,
    render_field,
    train_field,
)

SIDE = 24
"""Of pictures [px]."""


@pytest.fixture
def haze():
    """A small field of random numbers with a hole, and what two cameras saw of something else."""
    rng = np.random.default_rng(0)
    filled = np.ones((5, 6, 4), bool)
    filled[2, :3] = False
    made = haze_field(np.array([-0.5, -0.6, -0.4]), 0.2, filled)
    made.values[:] = rng.normal(0, 1.5, made.values.shape)
    pictures = rng.integers(0, 256, (2, SIDE * SIDE, 3)).astype(np.uint8)
    masks = rng.integers(0, 256, (2, SIDE * SIDE)).astype(np.uint8)
    rays = np.stack([rng.integers(0, 2, 24), rng.integers(0, SIDE * SIDE, 24)], axis=1)
    jitter, behind = rng.random(24, np.float32), rng.random(3, np.float32)
    return (made, around(2, (SIDE, SIDE), focal=60.0), pictures, masks, rays.astype(np.int32), jitter, behind)


def plain(values, made, cameras, pictures, masks, rays, jitter, behind):
    """The loss, said plainly: every sample of every ray, nothing skipped; values may be complex."""
    total = 0
    size = np.array(made.open.shape)
    for (view, pixel), shift in zip(rays, jitter, strict=True):
        camera = cameras[view]
        u, v = pixel % camera.width + 0.5, pixel // camera.width + 0.5
        way = camera.world_from_camera[:3, :3] @ np.linalg.solve(camera.K, [u, v, 1])
        eye = camera.world_from_camera[:3, 3]
        sides = np.array([made.grid.low, np.add(made.grid.low, size * made.grid.cell)])
        cross = (sides - eye) / way
        enter, leave = max(cross.min(axis=0).max(), 0), cross.max(axis=0).min()
        step = made.grid.cell / np.linalg.norm(way)
        light, colour = 1, np.zeros(3)
        for t in np.arange(enter + shift * step, leave, step):
            place = (eye + t * way - made.grid.low) / made.grid.cell
            cube = np.clip(place.astype(int), 0, size - 1)
            if not made.open[tuple(cube)]:
                continue
            number = 0
            for corner in np.ndindex(2, 2, 2):
                share = np.prod(np.where(corner, place - cube, 1 - (place - cube)))
                number = number + share * values[made.row[tuple(cube + corner)]]
            after = light * np.exp(-np.log(1 + np.exp(number[0])))
            colour = colour + (light - after) / (1 + np.exp(-number[1:]))
            light = after
        cover = masks[view, pixel] / 255
        real = cover * pictures[view, pixel] / 255 + (1 - cover) * behind
        total = total + ((colour + light * behind - real) ** 2).sum()
        total = total + 0.1 * (1 - light - cover) ** 2
    return total


def test_gradients_are_those_of_the_loss_written_plainly(haze):
    made, cameras, pictures, masks, rays, jitter, behind = haze
    gradient, sums = np.zeros_like(made.values), np.zeros(3)
    rows = field_camera_rows(made.grid, cameras)
    shown = SIDE, rows, pictures, masks, field_arrays(made)
    kernels_radiance.ray_loss_gradient(rays, jitter, behind, *shown, gradient, sums)
    exact = made.values.astype(float)
    assert sums[0] == pytest.approx(plain(exact, *haze), rel=1e-5)
    assert sums[2] > 50, "samples"
    for node, column in [(n, c) for n in range(0, len(exact), 20) for c in range(4)]:
        turned = exact.astype(complex)
        turned[node, column] += 1e-20j
        slope = plain(turned, *haze).imag / 1e-20
        assert gradient[node, column] == pytest.approx(slope, rel=2e-4, abs=2e-5)


def ball(radius=0.3, cell=0.01, matter=2.0):
    """A field that is 0 but in a ball, where its density is matter [1/m]."""
    n = int(2.4 * radius / cell)
    low = np.full(3, -n * cell / 2)
    made = haze_field(low, cell, np.ones((n, n, n), bool))
    x = np.stack(np.meshgrid(*[low[0] + cell * np.arange(n + 1)] * 3, indexing="ij"), axis=-1)
    inside = np.linalg.norm(x, axis=-1) < radius
    made.values[made.row.ravel()] = np.where(
        inside.ravel()[:, None], [np.log(np.expm1(matter * cell)), 3.0, -3.0, 0.0], -30.0
    )
    return made


def test_light_through_a_ball_falls_exponentially_with_the_way_through():
    """Transmittance is exp(-σ l), l the chord; half of it is lost ln 2 / σ behind the surface."""
    radius, cell = 0.3, 0.01
    camera = around(1, (64, 64), focal=200.0)[0]
    eye = camera.world_from_camera[:3, 3]
    v, u = np.mgrid[:64, :64].reshape(2, -1) + 0.5
    way = (camera.world_from_camera[:3, :3] @ np.linalg.solve(camera.K, [u, v, 1 + 0 * u])).T
    length = np.linalg.norm(way, axis=1)
    closest = -(way @ eye) / length
    off = np.sqrt(eye @ eye - closest**2)
    half = np.sqrt(np.maximum((radius - cell / 2) ** 2 - off**2, 0))
    through = off < 0.8 * radius
    assert through.sum() > 700
    for sigma in (0.5, 4.0, 20.0):
        seen = render_field(ball(radius, cell, sigma), camera)
        light = 1 - seen.alpha.ravel().astype(float)
        assert (light[off > radius + 2 * cell] == 1).all()
        if sigma < 10:
            chord = -np.log(light[through]) / sigma
            error = chord - 2 * half[through]
            assert np.abs(error).max() < 2 * cell and np.abs(error.mean()) < 0.25 * cell
        if sigma > 2:
            depth = seen.depth.ravel() * length
            error = (depth - (closest - half + np.log(2) / sigma))[through]
            assert np.abs(error).max() < 1.2 * cell and np.abs(error.mean()) < 0.25 * cell


def test_colour_is_weighted_as_light_is(haze):
    made = ball()
    camera = around(1, (32, 32), focal=100.0)[0]
    seen = render_field(made, camera)
    thick = seen.alpha > 0.1
    share = seen.rgb[thick] / seen.alpha[thick, None]
    np.testing.assert_allclose(share[:, 0], 1 / (1 + np.exp(-3)), atol=0.02)
    np.testing.assert_allclose(share[:, 1], 1 / (1 + np.exp(3)), atol=0.02)


def painted(cameras, radius=0.3):
    """Pictures of a ball whose colour changes all over, and masks."""
    rgb, masks = [], []
    for camera in cameras:
        v, u = np.mgrid[: camera.height, : camera.width] + 0.5
        flat = np.stack([u.ravel(), v.ravel(), np.ones(u.size)])
        way = (camera.world_from_camera[:3, :3] @ np.linalg.solve(camera.K, flat)).T
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        eye = camera.world_from_camera[:3, 3]
        closest = -(way @ eye)
        inside = radius**2 - (eye @ eye - closest**2)
        hit = eye + (closest - np.sqrt(np.maximum(inside, 0)))[:, None] * way
        colour = 0.5 + 0.4 * np.sin(25 * hit + [0, 1, 2])
        colour[inside <= 0] = 0.9
        rgb.append(np.round(255 * colour).astype(np.uint8).reshape(*v.shape, 3))
        masks.append((inside > 0).reshape(v.shape))
    return Views(np.stack(rgb), tuple(cameras)), np.stack(masks)


SMALL = RadianceFieldConfig("draft", rays_per_step=2048, hull=HullConfig(grid_cells=60_000))


@pytest.fixture(scope="module")
def learned():
    views, masks = painted(around(12, (64, 64), focal=200.0))
    return views, masks, train_field(views, masks, replace(SMALL, steps=60))


@pytest.mark.slow
def test_points_of_a_learned_field_lie_on_the_surface(learned):
    views, _, made = learned
    assert made.quality.psnr > 22
    found = field_surface_points(made.field, views.cameras, 10_000)
    assert len(found.position) > 1000
    off = np.abs(np.linalg.norm(found.position, axis=1) - 0.3) / made.field.grid.cell
    assert np.median(off) < 0.6 and np.quantile(off, 0.95) < 2
    expected = 0.5 + 0.4 * np.sin(25 * found.position + [0, 1, 2])
    assert np.median(np.abs(found.colour - expected)) < 0.08
    few = field_surface_points(made.field, views.cameras, 100)
    assert len(few.position) == 100
    upper = field_surface_points(made.field, views.cameras, 10_000, allowed=lambda at: at[:, 2] > 0)
    assert 500 < len(upper.position) < len(found.position)
    assert (upper.position[:, 2] > 0).all()
    with pytest.raises(UserError, match="what one picture shows, no other does"):
        field_surface_points(made.field, views.cameras, 10, allowed=lambda at: at[:, 2] > 9)
    with pytest.raises(UserError, match="what one picture shows, no other does"):
        field_surface_points(haze_field(np.zeros(3), 0.1, np.ones((4, 4, 4), bool)), views.cameras, 10)
    every_third, _ = radiance_field._ray_ends(views.cameras, found.depth, found.depth.size // 5)
    off = np.abs(np.linalg.norm(every_third, axis=1) - 0.3) / made.field.grid.cell
    ends = np.count_nonzero(np.isfinite(found.depth))
    assert len(every_third) == pytest.approx(ends / 9, rel=0.1) and np.quantile(off, 0.95) < 2
    assert "nodes" in made.statements[0] and "dB on objects" in made.statements[1]


def test_what_was_learned_is_kept_and_threads_change_nothing(tmp_path, monkeypatch):
    views, masks = painted(around(8, (48, 48), focal=150.0))
    config = replace(SMALL, steps=3, threads=1)
    first = train_field(views, masks, config, tmp_path / "field.npz").field
    other = train_field(views, masks, replace(config, threads=3)).field
    np.testing.assert_array_equal(first.values, other.values)
    monkeypatch.setattr(radiance_field, "_optimise_field", lambda *_: pytest.fail("learned twice"))
    again = train_field(views, masks, config, tmp_path / "field.npz").field
    np.testing.assert_array_equal(first.values, again.values)
    np.testing.assert_array_equal(first.row, again.row)


def test_the_channel_tells_two_halves_apart(learned):
    """Above the equator pictures show one thing, below it another, beside the ball a third."""
    views, masks, made = learned
    upper = np.array([1.0, 0.0, 0.0, 0.5])
    lower = np.array([0.0, 1.0, 0.0, -0.5])
    maps = []
    for camera, mask in zip(views.cameras, masks, strict=True):
        depth = render_field(made.field, camera).depth
        v, u = np.mgrid[: camera.height, : camera.width] + 0.5
        z = np.where(np.isfinite(depth), depth, 1)
        flat = np.stack([u, v, np.ones_like(u)]) * z
        way = np.tensordot(camera.world_from_camera[:3, :3] @ np.linalg.inv(camera.K), flat, 1)
        up = way[2] + camera.world_from_camera[2, 3] > 0
        pixels = np.where(up[..., None], upper, lower)
        pixels = np.where(mask[..., None], pixels, [0, 0, 1, 0])
        maps.append(pixels.reshape(16, 4, 16, 4, 4).mean(axis=(1, 3)).astype(np.float16))
    found = field_surface_points(made.field, views.cameras, 10_000)
    clear = np.abs(found.position[:, 2]) > 0.04
    up = found.position[clear, 2] > 0
    channel = distil_features(made.field, views.cameras, maps)
    assert channel.values.dtype == np.float16
    features = channel.at(found.position[clear])
    assert np.mean((features[:, 0] > features[:, 1]) == up) > 0.995
    right = np.where(up[:, None], upper, lower)
    assert np.abs(features - right).mean() < 0.07


def test_a_second_round_brings_features_nearer_to_sharp_maps(learned):
    """Features that change all over, as the colours do, with a pixel for each."""
    views, _, made = learned
    maps = [picture / 255 for picture in views.rgb]
    found = field_surface_points(made.field, views.cameras, 10_000).position
    expected = 0.5 + 0.4 * np.sin(25 * found + [0, 1, 2])
    once, twice = (
        np.abs(distil_features(made.field, views.cameras, maps, rounds).at(found) - expected).mean()
        for rounds in (1, 2)
    )
    assert twice < 0.9 * once


def test_rays_take_from_nodes_what_the_first_round_gives_back(learned):
    """One map of one feature everywhere is that feature everywhere, after any number of rounds."""
    views, _, made = learned
    maps = [np.full((3, 3, 70), 0.25, np.float16)] * 3
    for rounds in (1, 4):
        values = distil_features(made.field, views.cameras[:3], maps, rounds).values
        np.testing.assert_allclose(values.astype(float), 0.25, atol=2e-3)


@pytest.mark.parametrize(
    ("spoil", "told"),
    [
        (lambda v, m: (v, m[:, 1:]), "Masks are"),
        (lambda v, m: (Views(v.rgb[:1], v.cameras[:1]), m[:1]), "One picture shows no depth"),
        (lambda v, m: (v, np.zeros_like(m)), "inside all masks"),
    ],
)
def test_what_cannot_be_learned_from_is_refused(spoil, told):
    with pytest.raises(UserError, match=told):
        train_field(*spoil(*painted(around(4, (32, 32), focal=100.0))), replace(SMALL, steps=1))


def test_maps_that_do_not_fit_are_refused(learned):
    views, _, made = learned
    one = np.zeros((2, 2, 4), np.float16)
    with pytest.raises(UserError, match="1 maps for 12 cameras"):
        distil_features(made.field, views.cameras, [one])
    with pytest.raises(UserError, match="4 and 5 channels"):
        distil_features(made.field, views.cameras[:2], [one, np.zeros((2, 2, 5), np.float16)])

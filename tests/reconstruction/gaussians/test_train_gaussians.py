"""Gaussians are learned from pictures, and a training that was cut off goes on."""

from dataclasses import replace

import numpy as np
import pytest
from splat_scenes import around, blobs, pictured

from corporeal.core.errors import UserError
from corporeal.core.types import Finish, Scene, SceneObject, Surface, Views
from corporeal.pipeline.stages.capture import CaptureConfig, capture
from corporeal.reconstruction.gaussians import carved_volume, densification
from corporeal.reconstruction.gaussians import train_gaussians as module
from corporeal.reconstruction.gaussians.densification import equal_scale_limits
from corporeal.reconstruction.gaussians.depth_rendering import render_depth
from corporeal.reconstruction.gaussians.gaussian_initialisation import StartPoints, points_on_hull
from corporeal.reconstruction.gaussians.hull_config import HullConfig
from corporeal.reconstruction.gaussians.plane_sweep import PlaneSweepConfig
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.gaussians.train_gaussians import train_gaussians
from corporeal.reconstruction.gaussians.training_schedule import DensificationConfig, TrainConfig, shrink_picture
from glb_maker import CUBE, CUBE_TRIANGLES

COARSE = TrainConfig("draft", threads=1, hull=HullConfig(grid_cells=30_000), sweep=PlaneSweepConfig(max_depths=4_000))
"""Begins from coarse hulls and few depths."""
SMALL = replace(COARSE, gaussians=400, steps=160)


@pytest.fixture(scope="module")
def scene():
    """Pictures before grey, and where the things are."""
    return pictured(blobs(40), around(16, (64, 64), focal=80.0), (0.5, 0.5, 0.5))


def test_objects_are_learned_from_pictures_and_masks(scene):
    views, masks = scene
    told = []
    out = train_gaussians(views, masks, config=SMALL, progress=lambda f, w: told.append((f, w)))
    assert out.quality.views == (4, 12)
    assert out.quality.psnr > 24 and out.quality.psnr_on_objects > 22
    fractions = [f for f, _ in told]
    assert len(told) == 160 and fractions == sorted(fractions) and fractions[-1] == 1
    assert "dB" in told[80][1] and "s left" in told[80][1]
    assert np.linalg.norm(out.gaussians.mean, axis=1).max() < 3


BENCH = (
    ((-0.6, -0.4, 0.0), (1.2, 0.8, 0.2)),
    ((-0.8, 0.4, 0.0), (1.6, 0.15, 0.7)),
    ((-0.8, -0.4, 0.0), (0.2, 0.8, 0.6)),
    ((0.6, -0.4, 0.0), (0.2, 0.8, 0.6)),
)
"""Seat, back and arms: low corners and sides [m]."""


def plain(boxes):
    """A plain thing made of boxes, from all sides."""
    faces = CUBE_TRIANGLES.astype(np.int64)
    surfaces = tuple(Surface("wood", 0, 0, np.add(a, CUBE * e), faces) for a, e in boxes)
    thing, beige = SceneObject("bench", "bench", 1.6), Finish("beige", (0.4, 0.38, 0.33, 1.0))
    scene = Scene("bench", "by hand", (thing,), surfaces, (beige,))
    views = capture(scene, CaptureConfig(20, (64, 64), threads=1))
    assert views.object_of_pixel is not None
    return views, views.object_of_pixel >= 0


LEARNING = replace(COARSE, preset="normal", gaussians=2000, steps=400)
FINE = replace(LEARNING, hull=HullConfig(grid_cells=300_000))


@pytest.mark.slow
def test_the_plain_seat_of_a_bench_is_found_below_the_hull(monkeypatch):
    """Gaussians that all begin on the hull, above the seat, do not get there unless it is opened.

    A small training finds the seat where stereo says nothing, and stereo opens the hull.
    """
    views, masks = plain(BENCH)
    on_it = replace(FINE, begin="hull")
    opened = train_gaussians(views, masks, config=on_it).quality.psnr_on_objects
    monkeypatch.setattr(carved_volume, "hull_cells_seen_past", lambda v, m, closed, p: closed.inside & False)
    made = train_gaussians(views, masks, config=FINE).quality.psnr_on_objects
    control = train_gaussians(views, masks, config=on_it).quality.psnr_on_objects
    assert made > control + 2 and made > 25
    assert opened > control + 2 and opened > 25


@pytest.mark.slow
def test_nothing_begins_inside_a_box():
    views, masks = plain([((-0.4, -0.3, 0.0), (0.8, 0.6, 0.5))])
    one, other = (train_gaussians(views, masks, config=replace(LEARNING, begin=b)) for b in ("auto", "hull"))
    np.testing.assert_array_equal(one.gaussians.mean, other.gaussians.mean)
    assert one.ahead < module.MIN_TRIAL_GAIN_DB and np.isnan(other.ahead)


@pytest.mark.slow
def test_plain_faces_are_seen_where_they_are_and_wide_gaussians_inside_show_through(monkeypatch):
    views, masks = plain(BENCH)

    def deep() -> float:
        """Return how far below the faces what is seen lies, in the mean [m]."""
        made = train_gaussians(views, masks, config=replace(FINE, begin="inside")).gaussians
        with ThreadPool(1) as pool:
            seen = render_depth(made, views.cameras, pool).depth
        shown = masks & np.isfinite(seen)
        return float((seen[shown] - views.depth[shown]).clip(0).mean())

    small = deep()
    monkeypatch.setattr(densification, "equal_scale_limits", lambda theta, widest: equal_scale_limits(theta, 10.0))
    monkeypatch.setattr(module, "points_on_hull", lambda *what: replace(points_on_hull(*what), width=None))
    assert small < deep() / 1.2


@pytest.mark.slow
def test_a_scene_without_masks_starts_from_a_sweep(scene):
    views, _ = scene
    out = train_gaussians(views, config=SMALL)
    assert out.quality.psnr > 20 and out.quality.psnr_on_objects is None


def test_given_points_are_where_it_starts(scene):
    views, masks = scene
    truth = blobs(40)
    points = StartPoints(truth.mean, 0.5 + 0.2821 * truth.sh[:, 0])
    out = train_gaussians(views, masks, points, SMALL)
    assert out.quality.psnr > 24
    # 40 points at first; none of them was dead, so that they grew by a twentieth at a time.
    assert 40 <= out.gaussians.count < 60


def test_held_out_views_are_not_trained_on(scene):
    views, masks = scene
    spoilt = views.rgb.copy()
    spoilt[[4, 12]] = 0
    config = replace(COARSE, gaussians=200, steps=20)
    honest = train_gaussians(views, masks, config=config).gaussians
    blind = train_gaussians(Views(spoilt, views.cameras), masks, config=config).gaussians
    np.testing.assert_array_equal(honest.mean, blind.mean)
    all_of_them = replace(config, held_out=0)
    assert train_gaussians(views, masks, config=all_of_them).quality is None


class KilledError(Exception):
    pass


@pytest.mark.slow
def test_a_training_that_was_cut_off_goes_on_as_if_it_had_not_been(scene, tmp_path):
    views, masks = scene
    path = tmp_path / "training.npz"
    often = DensificationConfig(interval_steps=7, begin_step=10)
    few = replace(SMALL, steps=60, densification=often, checkpoint_interval_s=0.0)
    whole = train_gaussians(views, masks, config=few).gaussians

    def kill(fraction, words):
        if words.startswith("step 40 "):
            raise KilledError

    steps = []
    with pytest.raises(KilledError):
        train_gaussians(views, masks, config=few, checkpoint=path, progress=kill)
    two = replace(few, threads=2)
    again = train_gaussians(views, masks, config=two, checkpoint=path, progress=lambda f, w: steps.append(w)).gaussians
    assert steps[0].startswith("step 40 ")
    for name in ("mean", "rotation", "scale", "opacity", "sh"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(again, name))
    steps.clear()
    last = train_gaussians(views, masks, config=few, checkpoint=path, progress=lambda f, w: steps.append(w))
    assert not steps, "what was finished is not done again"
    np.testing.assert_array_equal(last.gaussians.mean, whole.mean)


@pytest.mark.slow
@pytest.mark.parametrize("spoil", ["seed", "hull", "torn"])
def test_a_checkpoint_of_something_else_is_not_gone_on_from(scene, tmp_path, spoil):
    views, masks = scene
    path, steps = tmp_path / "training.npz", []
    config = replace(COARSE, gaussians=200, steps=6, checkpoint_interval_s=0.0)

    def kill(fraction, words):
        if words.startswith("step 4 "):
            raise KilledError

    with pytest.raises(KilledError):
        train_gaussians(views, masks, config=config, checkpoint=path, progress=kill)
    if spoil == "torn":
        path.write_bytes(path.read_bytes()[:1000])
    elif spoil == "seed":
        config = replace(config, seed=1)
    else:
        config = replace(config, hull=HullConfig(grid_cells=40_000))
    train_gaussians(views, masks, config=config, checkpoint=path, progress=lambda f, w: steps.append(w))
    assert steps[0].startswith("step 1 ")


@pytest.mark.parametrize("shade", [0, 255])
def test_pictures_of_nothing_are_refused_and_with_masks_give_no_nan(shade):
    cameras = around(4)
    views = Views(np.full((4, 40, 48, 3), shade, np.uint8), cameras)
    config = replace(COARSE, gaussians=100, steps=30, sweep=PlaneSweepConfig(max_depths=500))
    with pytest.raises(UserError, match="agree on no place"):
        train_gaussians(views, config=config)
    masks = np.zeros((4, 40, 48), bool)
    masks[:, 10:30, 14:34] = True
    out = train_gaussians(views, masks, config=config)
    for name in ("mean", "rotation", "scale", "opacity", "sh"):
        assert np.isfinite(getattr(out.gaussians, name)).all()


def test_shrinking_takes_means_and_cuts_the_rim():
    picture = np.arange(5 * 7 * 1, dtype=np.uint8).reshape(5, 7, 1)
    small = shrink_picture(picture, 2)
    assert small.shape == (2, 3, 1)
    assert small[0, 0, 0] == round((0 + 1 + 7 + 8) / 4)


def test_one_picture_is_refused(scene):
    views, _ = scene
    with pytest.raises(UserError, match="at least two"):
        train_gaussians(Views(views.rgb[:1], views.cameras[:1]))


def test_masks_of_another_size_are_refused(scene):
    views, masks = scene
    with pytest.raises(UserError, match="Masks are"):
        train_gaussians(views, masks[:, :10])

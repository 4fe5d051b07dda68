"""What is taken in from photographs, before anything is learned and after."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from corporeal.core.errors import UserError
from corporeal.core.types import Camera, Gaussians, Views
from corporeal.io.photos.posed_photos import PosedPhotos
from corporeal.multiview.pose_consistency import PoseConsistency
from corporeal.reconstruction.gaussians import gaussian_scene
from corporeal.reconstruction.gaussians.gaussian_scene import MaskSource, load_or_train_gaussians
from corporeal.reconstruction.gaussians.heldout_quality import HeldOutQuality
from corporeal.reconstruction.gaussians.train_gaussians import TrainedGaussians
from corporeal.reconstruction.gaussians.training_schedule import TrainConfig
from corporeal.render.camera_placement import camera_from_aim
from corporeal.render.embree import identify_triangles
from corporeal.render.ray_scene import RayScene
from patterned_scene import OF_SLAB, patterned, ring

DOUBT = "The poses do not agree with the pictures."
ONE = Gaussians(
    np.zeros((1, 3), np.float32),
    np.float32([[1, 0, 0, 0]]),
    np.ones((1, 3), np.float32),
    np.ones(1, np.float32),
    np.zeros((1, 1, 3), np.float32),
)
GOOD = HeldOutQuality(31.0, 28.0, 0.9, (1,))


@pytest.fixture
def taken(monkeypatch, tmp_path):
    """Take three masked photographs in, of which this is thought and this is learned."""
    camera = Camera(np.eye(3), np.eye(4), 4, 4)
    views = Views(np.zeros((3, 4, 4, 3), np.uint8), (camera,) * 3)
    whole, sparse = np.full((3, 4, 4), 255, np.uint8), np.zeros((5, 3))
    shown = PosedPhotos(views, ("a", "b", "c"), True, whole, sparse, sparse.astype(np.uint8))
    monkeypatch.setattr(gaussian_scene, "read_posed_photos", lambda *_, **__: shown)
    monkeypatch.setattr(gaussian_scene, "input_kind", lambda _: "photographs")

    def take(said: PoseConsistency, learned: TrainedGaussians | UserError, instances: bool = False):
        def train(views, masks, points, *_):
            assert points is None, "sparse points are no start where masks carve a better one"
            if isinstance(learned, UserError):
                raise learned
            return learned

        monkeypatch.setattr(gaussian_scene, "check_pose_consistency", lambda *_: said)
        monkeypatch.setattr(gaussian_scene, "train_gaussians", train)
        return load_or_train_gaussians(Path("photos"), TrainConfig("draft"), instances=instances)

    return take


def learned(quality: HeldOutQuality | None) -> TrainedGaussians:
    return TrainedGaussians(ONE, quality, 1.0, np.ones((3, 3), np.float32))


FINE = PoseConsistency("matches", 500, 0.7, 0.5, None)


def test_nothing_is_learned_under_poses_that_are_certainly_wrong(taken):
    hopeless = replace(FINE, doubt=DOUBT, hopeless=True)
    with pytest.raises(UserError, match=f"photos: {DOUBT}"):
        taken(hopeless, UserError("It was learned all the same."))


def test_nothing_is_learned_of_the_room_where_masks_are_inverted(taken, monkeypatch):
    monkeypatch.setattr(gaussian_scene, "are_masks_inverted", lambda masks, cameras: bool(masks.all()))
    with pytest.raises(UserError, match=r"photos: The masks are black in the middle .*: invert"):
        taken(FINE, UserError("It was learned all the same."))


@pytest.mark.parametrize("longest", [128, 512])
def test_poses_are_checked_in_pictures_of_the_size_that_the_check_was_measured_on(longest, monkeypatch):
    """In draft's pictures of 128 pixels, .45 of what wrong focal lengths contradict still met."""
    camera, looked, asked = Camera(np.eye(3), np.eye(4), 4, 4), [], []

    def pictured(source, size, *_, **__):
        asked.append(size)
        views = Views(np.zeros((3, size // 2, size, 3), np.uint8), (camera,) * 3)
        return PosedPhotos(views, ("a", "b", "c"), True)

    def said(views, masks):
        looked.append(views.rgb.shape[:3])
        return replace(FINE, doubt=DOUBT, hopeless=True)

    monkeypatch.setattr(gaussian_scene, "read_posed_photos", pictured)
    monkeypatch.setattr(gaussian_scene, "check_pose_consistency", said)
    shown = pictured(Path("photos"), longest).only([0, 2])
    with pytest.raises(UserError, match=DOUBT):
        gaussian_scene.pose_warnings(Path("photos"), shown=shown)
    size = max(longest, 320)
    assert looked == [(2, size // 2, size)] and asked == ([128, 320] if longest == 128 else [512])


def test_nothing_is_learned_where_instance_masks_are_wanted_and_there_are_none(taken):
    with pytest.raises(UserError, match="photos: There are no instance masks"):
        taken(FINE, UserError("It was learned all the same."), instances=True)


@pytest.mark.parametrize(("ahead", "where"), [(2.3, "and inside of it"), (-0.6, "alone")])
def test_it_is_reported_where_gaussians_began(taken, ahead, where):
    said = " ".join(taken(FINE, replace(learned(GOOD), ahead=ahead)).statements)
    assert f"hull of the masks {where}: to begin inside, too, made {ahead:+} dB on objects" in said
    assert "visual hull" not in " ".join(taken(FINE, learned(GOOD)).statements)


def test_doubts_stay_with_what_is_learned_and_with_why_nothing_can_be(taken):
    doubtful = replace(FINE, doubt=DOUBT)
    assert taken(doubtful, learned(GOOD)).warnings == (DOUBT,)
    with pytest.raises(UserError, match=f"No place in space. {DOUBT}"):
        taken(doubtful, UserError("No place in space."))


@pytest.mark.parametrize(
    ("quality", "said"),
    [
        (GOOD, ()),
        (None, ("3 photographs are too few for a validation set",)),
        (replace(GOOD, psnr=14.0), ("differ from their rendering (14.0 dB)",)),
    ],
)
def test_what_was_badly_learned_or_not_checked_is_reported(taken, quality, said):
    made = taken(FINE, learned(quality))
    told = made.warnings
    assert len(told) == len(said)
    assert set(told) <= set(made.doubts), "it is read first"
    assert all(words in warning for words, warning in zip(said, told, strict=True))


def test_a_photograph_that_contradicts_the_masks_of_all_others_is_left_out(monkeypatch):
    stage, aims = RayScene(patterned()), ring(np.arange(12) * 30, (160, 120))
    masks = np.stack([np.uint8(255) * (identify_triangles(stage, aim)[0] >= OF_SLAB) for aim in aims])
    masks[7] = masks[7][::-1, ::-1]  # its picture was turned by half, and its pose was not
    cameras = tuple(camera_from_aim(aim) for aim in aims)
    rgb = np.arange(12, dtype=np.uint8)[:, None, None, None] * np.ones((1, 120, 160, 3), np.uint8)
    names = tuple(f"{k:02d}.jpg" for k in range(12))
    shown = PosedPhotos(Views(rgb, cameras), names, True, masks, warnings=("before",))
    monkeypatch.setattr(gaussian_scene, "read_posed_photos", lambda *_, **__: shown)
    monkeypatch.setattr(gaussian_scene, "input_kind", lambda _: "photographs")
    monkeypatch.setattr(gaussian_scene, "check_pose_consistency", lambda *_: FINE)
    monkeypatch.setattr(gaussian_scene, "train_gaussians", lambda *_: learned(GOOD))
    taken = load_or_train_gaussians(Path("photos"), TrainConfig("draft"))
    assert taken.views is not None and len(taken.cameras) == 11
    assert 7 not in taken.views.rgb[:, 0, 0, 0] and taken.masks is not None
    assert len(taken.masks) == 11
    before, said = taken.warnings
    assert before == "before" and "1 of 12 photographs were left out" in said and "07.jpg" in said


@pytest.mark.parametrize(("odd", "times"), [(0, 1), (1, 1), (6, 2)])
def test_grown_masks_are_learned_from_again_without_what_no_other_photograph_shows(monkeypatch, tmp_path, odd, times):
    camera, given, told = Camera(np.eye(3), np.eye(4), 16, 16), [], []
    views = Views(np.zeros((3, 16, 16, 3), np.uint8), (camera,) * 3)
    shown = PosedPhotos(views, ("a", "b", "c"), True, np.full((3, 16, 16), 255, np.uint8))
    strange = np.zeros((3, 16, 16), bool)
    strange[1, 0, :odd] = strange[2, 0, :odd] = True  # 12 of 768 are more than a hundredth

    def train(views, masks, points, config, checkpoint, progress):
        given.append((masks.copy(), checkpoint.name))
        progress(1.0, "learned")
        return learned(GOOD)

    monkeypatch.setattr(gaussian_scene, "read_posed_photos", lambda *_, **__: shown)
    monkeypatch.setattr(gaussian_scene, "input_kind", lambda _: "photographs")
    monkeypatch.setattr(gaussian_scene, "check_pose_consistency", lambda *_: FINE)
    monkeypatch.setattr(gaussian_scene, "train_gaussians", train)
    monkeypatch.setattr(gaussian_scene, "mask_contamination", lambda *_: strange)

    def take(grown):
        given.clear()
        kept, tell = tmp_path / "training.npz", lambda f, w: told.append(f)
        return load_or_train_gaussians(Path("photos"), TrainConfig("draft"), kept, tell, masked=MaskSource(None, grown))

    made = take(grown=True)
    assert len(given) == times and given[0][0].all() and told == sorted(told)
    assert len({name for _, name in given}) == times, "neither is learned anew when run again"
    assert np.array_equal(given[-1][0], ~strange if times == 2 else np.ones_like(strange))
    assert np.array_equal(made.masks, given[-1][0])
    said = any("1.6% of what masks hold is in 2 of 3 photographs" in s for s in made.statements)
    assert said == (times == 2)
    made = take(grown=False)
    assert np.all(made.masks) and len(given) == 1, "masks that somebody gave are right"


def test_with_masks_no_floor_is_among_what_is_learned_though_sparse_points_show_one():
    """Faint Gaussians on it would stay behind in the video when the object leaves."""
    rng, aims = np.random.default_rng(0), ring(np.arange(12) * 30, (64, 48))
    cameras = tuple(camera_from_aim(aim) for aim in aims)
    plane = np.concatenate([rng.uniform(-1, 1, (400, 2)), rng.normal(0, 1e-4, (400, 1))], axis=1)
    thing = np.concatenate([rng.uniform(-0.2, 0.2, (100, 2)), rng.uniform(0, 0.4, (100, 1))], axis=1)
    gaussians = Gaussians(
        thing.astype(np.float32),
        np.tile(np.float32([1, 0, 0, 0]), (100, 1)),
        np.full((100, 3), 0.02, np.float32),
        np.ones(100, np.float32),
        np.zeros((100, 1, 3), np.float32),
    )
    views = Views(np.zeros((12, 48, 64, 3), np.uint8), cameras)
    masks = np.ones((12, 48, 64), bool)
    taken = gaussian_scene.GaussianScene(gaussians, cameras, views, masks, seen=np.concatenate([plane, thing]))
    made = gaussian_scene.turn_upright(taken)
    assert "plane" in made.statements[-1], "the floor is found"
    assert not made.floor, "and yet is not among the Gaussians"

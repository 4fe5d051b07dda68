"""Pictures from one place are told from a walk around a thing by what they share."""

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from corporeal.core.errors import BadFileError
from corporeal.reconstruction.sfm.find_poses import find_poses
from corporeal.reconstruction.sfm.one_viewpoint import describe_one_viewpoint, is_same_viewpoint, pairs_of_rotation

LONGEST = 480


def seen(points, turn_deg, above_deg):
    """Points (N, 3) as a camera sees them that looks at the origin from four away [px]."""
    turn = Rotation.from_euler("ZY", [turn_deg, above_deg], degrees=True)
    local = points @ turn.as_matrix()
    return LONGEST * np.stack([local[:, 1], local[:, 2]], axis=1) / (4 - local[:, :1])


@pytest.fixture
def rng():
    return np.random.default_rng(0)


@pytest.fixture
def floor(rng):
    return np.concatenate([rng.uniform(-1, 1, (60, 2)), np.zeros((60, 1))], axis=1)


def test_a_walk_of_five_degrees_is_no_similarity_even_of_a_flat_floor(floor):
    here = seen(floor, 0, 40)
    for there in (seen(floor, 5, 40), seen(floor, 0, 45)):
        assert not is_same_viewpoint(here, there, LONGEST)


def test_pieces_of_one_picture_are_of_one_viewpoint(floor, rng):
    here = seen(floor, 0, 40)
    turn, noise = Rotation.from_euler("Z", 12, degrees=True), rng.normal(0, 0.5, here.shape)
    there = 1.4 * here @ turn.as_matrix()[:2, :2] + [30, -12] + noise
    assert is_same_viewpoint(here, there, LONGEST)
    there[::5] += rng.normal(0, 40, there[::5].shape)
    assert is_same_viewpoint(here, there, LONGEST), "some points are matched wrongly"
    assert not is_same_viewpoint(np.ones((20, 2)), there[:20], LONGEST), "points of one place"


def pairs_of(pictures):
    return [(a / LONGEST, b / LONGEST) for k, a in enumerate(pictures) for b in pictures[k + 1 :]]


def test_a_camera_that_turns_on_the_spot_is_reported_although_its_lens_is_not_known(rng):
    room = rng.uniform((-6, -6, 2), (6, 6, 9), (400, 3))
    turns = Rotation.from_euler("YX", [[8 * k, 3 * (k % 3)] for k in range(6)], degrees=True)
    local = [room @ turn.as_matrix() for turn in turns]
    pictures = [1.15 * LONGEST * p[:, :2] / p[:, 2:] + rng.normal(0, 0.4, (400, 2)) for p in local]
    pairs = pairs_of(pictures)
    seen_by_both = [np.abs(np.c_[a, b]).max(axis=1) < 0.5 for a, b in pairs]
    assert pairs_of_rotation([(a[s], b[s]) for (a, b), s in zip(pairs, seen_by_both, strict=True)]).all()
    moved = [(a, 1.02 * b + 0.02 * rng.normal(size=b.shape)) for a, b in pairs]
    assert not pairs_of_rotation(moved).any()
    assert pairs_of_rotation([]).shape == (0,)


@pytest.mark.parametrize("step", [5, 15])
def test_a_walk_is_no_turn_on_the_spot_even_around_a_flat_floor(floor, step):
    walk = [seen(floor, step * k, 40) for k in range(8)]
    assert not pairs_of_rotation(pairs_of(walk)).any()


def test_bursts_on_a_way_around_an_object_are_no_standstill():
    """Ten places with four pictures each, joined with those of both neighbours."""
    place = np.arange(40) // 4
    apart = np.abs(np.subtract.outer(place, place))
    joined, same = np.minimum(apart, 10 - apart) <= 1, apart == 0
    assert describe_one_viewpoint(joined, same) is None
    assert describe_one_viewpoint(same, same) is None, "each place by itself is no half of all"
    told = describe_one_viewpoint(joined, np.ones_like(joined))
    assert told is not None and told.startswith("40 of 40 were taken from one place")
    assert describe_one_viewpoint(joined[:3, :3], joined[:3, :3]) is None, "too few to tell"


def test_five_photographs_are_too_few(tmp_path, rng):
    pytest.importorskip("pycolmap")
    for k in range(5):
        noise = Image.fromarray(rng.integers(0, 255, (12, 16, 3), dtype=np.uint8))
        noise.resize((64, 48)).save(tmp_path / f"{k}.jpg")
    with pytest.raises(BadFileError, match=r"5 photographs are too few .* Take 40 to 80"):
        find_poses(tmp_path, tmp_path / "poses", lambda *_: None)


def test_a_camera_on_a_tripod_is_refused_before_the_long_search(tmp_path, rng):
    pytest.importorskip("pycolmap")
    photos = tmp_path / "photos"
    photos.mkdir()
    pattern = Image.fromarray(rng.integers(0, 255, (30, 40, 3), dtype=np.uint8))
    whole = np.asarray(pattern.resize((320, 240), Image.Resampling.BICUBIC), float)
    for k in range(8):
        taken = (0.7 + 0.04 * k) * whole + rng.normal(0, 3, whole.shape)
        Image.fromarray(np.uint8(np.clip(taken, 0, 255))).save(photos / f"{k}.jpg", quality=90)
    with pytest.raises(BadFileError, match="8 of 8 were taken from one place") as error:
        find_poses(photos, tmp_path / "poses", lambda *_: None)
    assert "Walk around" in str(error.value) and "\n" not in str(error.value)
    assert not (tmp_path / "poses" / "plain").exists(), "before the long search"

"""Photographs that somebody cropped, each in another way, before poses were found."""

import numpy as np
import pytest

from corporeal.reconstruction.sfm import find_poses as posing
from corporeal.reconstruction.sfm.model_refinement import adjust_bundle
from corporeal.reconstruction.sfm.prepare_images import PreparedImages
from corporeal.reconstruction.sfm.principal_points import (
    CROPPED_SPREAD_FRACTION,
    UNCROPPED_HINT,
    principal_point_spread,
)
from corporeal.reconstruction.sfm.sfm_run import SfmRun

pycolmap = pytest.importorskip("pycolmap")
COUNT, POINTS, WIDE, HIGH, FOCAL = 12, 200, 640, 480, 560.0


def looked_at(eye):
    """COLMAP's camera from world, looking at the middle of what stands there."""
    ahead = -eye / np.linalg.norm(eye)
    right = np.cross(ahead, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    turn = np.stack([right, np.cross(ahead, right), ahead])
    return np.c_[turn, -turn @ eye]


def model(folder, middles, rng):
    """A heap on a floor from all around, as it is adjusted where all lenses look at the middle.

    Args:
        folder: Gets the model.
        middles: How far each lens looks past the middle of its picture [px].
        rng: Where points are, and how well they are seen.

    """
    made = pycolmap.Reconstruction()
    points = rng.uniform((-1.0, -1.0, -0.2), (1.0, 1.0, 0.6), (POINTS, 3))
    tracks = [pycolmap.Track() for _ in points]
    for k in range(COUNT):
        angle = 2 * np.pi * k / COUNT
        pose = looked_at(np.array([3 * np.cos(angle), 3 * np.sin(angle), 1.5 + 0.5 * (k % 3)]))
        seen = points @ pose[:, :3].T + pose[:, 3]
        pixel = FOCAL * seen[:, :2] / seen[:, 2:] + (WIDE / 2, HIGH / 2) + middles[k]
        pixel += rng.normal(0, 0.3, pixel.shape)
        own = pycolmap.Camera(
            model="SIMPLE_RADIAL", width=WIDE, height=HIGH, params=[FOCAL, WIDE / 2, HIGH / 2, 0.0], camera_id=k + 1
        )
        made.add_camera_with_trivial_rig(own)
        image = pycolmap.Image(name=f"{k}.jpg", keypoints=pixel, camera_id=k + 1, image_id=k + 1)
        made.add_image_with_trivial_frame(image, pycolmap.Rigid3d(pose))
        for n, track in enumerate(tracks):
            track.add_element(k + 1, n)
    for point, track in zip(points, tracks, strict=True):
        made.add_point3D(point, track)
    adjust_bundle(pycolmap, made)
    folder.mkdir(parents=True, exist_ok=True)
    made.write_text(str(folder))
    return folder


def test_lenses_that_look_past_the_middle_each_by_another_way_are_of_cropped_pictures(tmp_path):
    rng = np.random.default_rng(0)
    middles = rng.uniform(-0.12, 0.12, (COUNT, 2)) * WIDE
    assert principal_point_spread(model(tmp_path / "0", middles, rng)) > CROPPED_SPREAD_FRACTION


@pytest.mark.parametrize("past", [0.0, 30.0])
def test_of_whole_pictures_and_of_those_cropped_alike_nothing_is_reported(past, tmp_path):
    rng = np.random.default_rng(0)
    assert principal_point_spread(model(tmp_path / "0", np.full((COUNT, 2), past), rng)) < 0.01


@pytest.mark.parametrize(("spread", "refused"), [(0.1, True), (0.03, False), (0.01, False)])
def test_poses_of_cropped_pictures_are_refused_or_a_warning(spread, refused, tmp_path, monkeypatch):
    names = tuple(f"{k}.jpg" for k in range(COUNT))
    gathered = PreparedImages(names, ((WIDE, HIGH),) * COUNT, ())
    told = SfmRun("plain", COUNT, COUNT, 2000, 0.5, focal=0.9)
    monkeypatch.setattr(posing, "_prepare_source", lambda *_: ([], gathered))
    monkeypatch.setattr(posing, "_find_places", lambda *_: (gathered, 0))
    monkeypatch.setattr(posing, "_try_strategies", lambda *_: ([told], ()))
    monkeypatch.setattr(posing, "read_colmap", lambda _: None)
    monkeypatch.setattr(posing, "describe_mirrored", lambda _: None)
    monkeypatch.setattr(posing, "principal_point_spread", lambda _: spread)
    monkeypatch.setattr(
        posing, "_record_of_runs", lambda folder, own, *_: posing._PosesRecord((), own.said, "", (told,))
    )
    kept = posing._find_or_load_poses(tmp_path, tmp_path, lambda share, words: None)
    said = "the photographs were cropped, each in another way"
    assert (said in kept.refused) == refused
    assert (kept.what_to_do == UNCROPPED_HINT) == refused
    assert any(said in one for one in kept.warnings) == (spread == 0.03)


def test_a_folder_of_which_most_was_left_out_is_refused(tmp_path, monkeypatch):
    """8 of 18 photographs of a television, 7 of which had been left out before the search."""
    names = tuple(f"{k}.jpg" for k in range(11))
    gathered = PreparedImages(names, ((640, 480),) * 11, ())
    told = SfmRun("plain", 11, 8, 2000, 0.5, focal=0.9)
    monkeypatch.setattr(posing, "_prepare_source", lambda *_: ([], gathered))
    monkeypatch.setattr(posing, "_find_places", lambda *_: (gathered, 7))
    monkeypatch.setattr(posing, "_try_strategies", lambda *_: ([told], ()))
    kept = posing._find_or_load_poses(tmp_path, tmp_path, lambda share, words: None)
    assert "only 8 of 18 pictures fit together" in kept.refused
    assert "newspaper" in kept.what_to_do

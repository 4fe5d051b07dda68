"""Mirrored photographs of a sheet fit others of it, from below: nobody sees it from both sides."""

from pathlib import Path

import numpy as np
import pytest

from corporeal.io.photos.colmap import ColmapImage, ColmapModel
from corporeal.reconstruction.sfm import find_poses as posing
from corporeal.reconstruction.sfm.mirrored_pictures import ONE_CAMERA_HINT, describe_mirrored
from corporeal.reconstruction.sfm.prepare_images import PreparedImages
from corporeal.reconstruction.sfm.sfm_run import SfmRun

COUNT = 16


def model(below, seen_through):
    """Cameras around a sheet with something on it, every k-th of them below; who sees what."""
    rng = np.random.default_rng(0)
    sheet = np.c_[rng.uniform(-1, 1, (300, 2)), 0.001 * rng.normal(size=300)]
    thing = rng.uniform((-0.3, -0.3, 0.1), (0.3, 0.3, 0.7), (120, 3))
    under = np.array([bool(below) and k % below == 0 for k in range(COUNT)])
    images = []
    for k in range(COUNT):
        pose = np.eye(4)
        angle = 2 * np.pi * k / COUNT
        pose[:3, 3] = 3 * np.cos(angle), 3 * np.sin(angle), -2 if under[k] else 2
        images.append(ColmapImage(f"{k}.jpg", 1, pose))
    points = np.concatenate([sheet, thing])
    number = np.arange(len(points))
    shown = [(k, n) for k in range(COUNT) for n in number if seen_through or n % 2 == under[k]]
    colours = np.zeros(points.shape, np.uint8)
    return ColmapModel(Path("sparse"), {}, tuple(images), points, colours, np.array(shown))


@pytest.mark.parametrize("below", [2, 4])
def test_a_sheet_that_is_seen_from_both_sides_is_seen_in_a_mirror(below):
    why = describe_mirrored(model(below, seen_through=True))
    assert why is not None and f"{COUNT - COUNT // below} pictures" in why


def test_two_sides_of_a_plate_are_two_sides():
    assert describe_mirrored(model(2, seen_through=False)) is None


def test_who_walks_around_a_sheet_sees_one_side_of_it():
    assert describe_mirrored(model(0, seen_through=True)) is None


def test_mirrored_photographs_are_refused_in_one_sentence(tmp_path, monkeypatch):
    names = tuple(f"{k}.jpg" for k in range(COUNT))
    gathered = PreparedImages(names, ((640, 480),) * COUNT, ())
    told = SfmRun("plain", COUNT, COUNT, 2000, 0.5, focal=0.9)
    monkeypatch.setattr(posing, "_prepare_source", lambda *_: ([], gathered))
    monkeypatch.setattr(posing, "_find_places", lambda *_: (gathered, 0))
    monkeypatch.setattr(posing, "_try_strategies", lambda *_: ([told], ()))
    monkeypatch.setattr(posing, "read_colmap", lambda _: model(2, seen_through=True))
    kept = posing._find_or_load_poses(tmp_path, tmp_path, lambda share, words: None)
    assert kept.refused.endswith("some of the pictures are mirrored.")
    assert kept.what_to_do == ONE_CAMERA_HINT

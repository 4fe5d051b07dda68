"""A date, or the name of who made them, on all photographs of a folder."""

from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image, ImageDraw

from corporeal.reconstruction.sfm.place_groups import MIN_SHARED_POINTS, match_small_copies
from corporeal.reconstruction.sfm.prepare_images import prepare_images
from corporeal.reconstruction.sfm.watermarks import WatermarkDetector

WIDE, HIGH, COUNT = 480, 360, 8
DATE = (300, 300, 470, 350)


@pytest.fixture
def rng():
    return np.random.default_rng(0)


@pytest.fixture
def stamped(tmp_path, rng):
    """Pictures that have nothing in common but their date."""
    (tmp_path / "photos").mkdir()
    paper = np.kron(rng.integers(0, 2, (10, 34)) * 255, np.ones((5, 5))).astype(np.uint8)
    for k in range(COUNT):
        blots = rng.integers(0, 255, (36, 48, 3)).astype(np.uint8)
        picture = Image.fromarray(blots).resize((WIDE, HIGH), Image.Resampling.BICUBIC)
        picture.paste(Image.fromarray(paper), DATE)
        ImageDraw.Draw(picture).text((310, 310), "27.11.2026", fill=(255, 160, 0), font_size=24)
        picture.save(tmp_path / "photos" / f"{k}.jpg")
    gathered = prepare_images(tmp_path / "photos", tmp_path / "poses", lambda fraction, words: None)
    return SimpleNamespace(folder=tmp_path / "poses", gathered=gathered)


@pytest.mark.slow
def test_what_is_stamped_on_pictures_joins_none(stamped):
    looked = match_small_copies(stamped.folder, stamped.gathered, lambda fraction: None)
    assert not (looked.shared >= MIN_SHARED_POINTS).any() and looked.stood_still is None
    assert f"{COUNT} photographs have a watermark" in looked.said


@pytest.mark.slow
def test_no_points_are_looked_for_on_it_and_all_others_are(stamped):
    match_small_copies(stamped.folder, stamped.gathered, lambda fraction: None)
    with Image.open(stamped.folder / "stamps" / "3.jpg.png") as mask:
        allowed = np.asarray(mask)
    left, top, right, bottom = DATE
    assert allowed.shape == (HIGH, WIDE) and not allowed[top:bottom, left:right].any()
    assert (allowed > 0).mean() > 0.7


def pairs_of(points):
    told = WatermarkDetector([(WIDE, HIGH)] * len(points), points)
    for a in range(len(points)):
        for b in range(a + 1, len(points)):
            told.look(a, b, points[a], points[b])
    return told.found()


def test_a_camera_that_stands_stamps_nothing(rng):
    there = rng.uniform(0, 1, (300, 2)) * (WIDE, HIGH)
    assert not pairs_of([there + rng.normal(0, 0.3, there.shape) for _ in range(COUNT)])


def test_who_walks_sees_no_place_of_the_picture_hold_still(rng):
    there = rng.uniform(0, 1, (300, 2)) * (WIDE, HIGH)
    middle = np.array([WIDE, HIGH]) / 2
    turns = np.radians(15 * np.arange(COUNT))
    around = [(there - middle) @ [[np.cos(t), np.sin(t)], [-np.sin(t), np.cos(t)]] for t in turns]
    assert not pairs_of([turned + middle for turned in around])


def test_pictures_of_another_size_are_stamped_elsewhere(rng):
    there = rng.uniform(0, 1, (60, 2)) * (WIDE, HIGH)
    date = np.array([440.0, 340.0]) + rng.uniform(-5, 5, (9, 2))
    own = [np.concatenate([rng.permutation(there), date]) for _ in range(COUNT)]
    sizes = [(WIDE, HIGH)] * COUNT + [(HIGH, WIDE)]
    told = WatermarkDetector(sizes, [*own, own[0][:, ::-1]])
    for a in range(COUNT):
        for b in range(a + 1, COUNT):
            told.look(a, b, own[a], own[b])
        told.look(a, COUNT, own[a], own[a])
    found = told.found()
    assert list(found) == [(WIDE, HIGH)] and found[WIDE, HIGH][-1, -3]
    assert found[WIDE, HIGH].mean() < 0.1

"""Pictures of another side that looks alike are told by the floor that they do not share."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from corporeal.io.photos.colmap import ColmapCamera, ColmapImage, ColmapModel
from corporeal.reconstruction.sfm import doppelgangers as check
from corporeal.reconstruction.sfm import find_poses as posing
from corporeal.reconstruction.sfm.doppelgangers import (
    agreeing_groups,
    doppelganger_groups,
    neighbours_support_model,
    remove_doppelgangers,
)
from corporeal.reconstruction.sfm.pose_acceptance import model_doubts, neighbour_doubt
from corporeal.reconstruction.sfm.prepare_images import PreparedImages
from corporeal.reconstruction.sfm.sfm_run import SfmRun, match_pairs
from corporeal.render.camera_placement import camera_from_aim
from patterned_scene import ring

COUNT, STEP = 24, 15
SEEN = 0.7
"""Share of the points in a picture that are found in it."""
NAMES = tuple(f"{k:02d}.jpg" for k in range(COUNT))
ALBUM = PreparedImages(NAMES, ((400, 300),) * COUNT, ())
ALL = [(NAMES[a], NAMES[b]) for a, b in match_pairs(COUNT)]


def model_of(angles, floor_of):
    """A thing on a floor; pictures see the points of the floor with their own number alone."""
    rng = np.random.default_rng(0)
    thing = rng.uniform(-0.05, 0.05, (120, 3)) + np.array([0, 0, 0.05])
    floor = np.concatenate([rng.uniform(-0.4, 0.4, (1200, 2)), np.zeros((1200, 1))], axis=1)
    points, whose = np.concatenate([thing, floor]), np.repeat([-1, 0, 1], [120, 600, 600])
    cameras = [camera_from_aim(aim) for aim in ring(angles)]
    images = [ColmapImage(n, 1, c.world_from_camera) for n, c in zip(NAMES, cameras, strict=True)]
    sightings = []
    for k, camera in enumerate(cameras):
        local = (points - camera.world_from_camera[:3, 3]) @ camera.world_from_camera[:3, :3]
        pixel = local @ camera.K.T
        pixel = pixel[:, :2] / pixel[:, 2:]
        inside = ((pixel > 0) & (pixel < [camera.width, camera.height])).all(axis=1)
        mine = inside & np.isin(whose, (-1, floor_of[k])) & (rng.random(len(points)) < SEEN)
        sightings += [(k, int(p)) for p in np.flatnonzero(mine)]
    lens = ColmapCamera("PINHOLE", 400, 300, (cameras[0].K[0, 0], cameras[0].K[1, 1], 200.0, 150.0))
    shades = np.zeros((len(points), 3), np.uint8)
    return ColmapModel(Path("model"), {1: lens}, tuple(images), points, shades, np.array(sightings))


AROUND = np.arange(COUNT) * STEP
FOLDED = np.where((np.arange(COUNT) >= 15) & (np.arange(COUNT) < 20), AROUND - 180, AROUND)
"""Five pictures are put among those of the other side."""


def test_a_walk_around_is_one_place():
    assert doppelganger_groups(model_of(AROUND, np.zeros(COUNT)), ALL) == (NAMES,)


def test_pictures_that_share_the_object_alone_with_their_neighbours_are_reported():
    found = doppelganger_groups(model_of(FOLDED, FOLDED != AROUND), ALL)
    assert len(found) == 2 and found[1] == NAMES[15:20]


def test_pictures_from_there_that_were_not_matched_say_nothing():
    beside = [(NAMES[a], NAMES[b]) for a, b in match_pairs(COUNT) if b - a <= 2]
    assert doppelganger_groups(model_of(FOLDED, FOLDED != AROUND), beside) == (NAMES,)


def test_a_model_without_tracks_says_nothing():
    bare = model_of(AROUND, np.zeros(COUNT))
    bare = ColmapModel(bare.folder, bare.cameras, bare.images, bare.points, bare.colours, np.zeros((0, 2), int))
    assert doppelganger_groups(bare, ALL) == (NAMES,)


def test_one_smeared_picture_is_not_two_places():
    agreed = np.full((6, 6), 0.3)
    agreed[5], agreed[:, 5] = 0, 0
    agreed[5, 4] = agreed[4, 5] = -0.2
    assert agreeing_groups(agreed) == [[0, 1, 2, 3, 4, 5]]
    agreed[5, :4] = agreed[:4, 5] = -0.2
    assert agreeing_groups(agreed) == [[0, 1, 2, 3, 4], [5]]


def test_a_picture_that_is_like_one_of_the_others_goes_with_its_own():
    """The strongest pair alone would join the groups that it is between."""
    agreed = np.full((6, 6), 0.3)
    agreed[:3, 3:] = agreed[3:, :3] = -0.3
    agreed[0, 3] = agreed[3, 0] = 0.45
    assert sorted(agreeing_groups(agreed)) == [[0, 1, 2], [3, 4, 5]]


@pytest.mark.parametrize(("pictures", "doubted"), [(24, False), (40, True)])
def test_what_is_left_must_be_most_of_the_pictures(pictures, doubted):
    told = SfmRun("plain", pictures, 19, 3000, 0.6, focal=0.8, misplaced=NAMES[15:20])
    said = model_doubts(told)
    assert bool(said) == doubted
    if doubted:
        assert said == ["only 19 of 40 pictures fit together (5 more only where another side looks alike)"]


def test_two_halves_are_left_for_masks_to_judge():
    told = SfmRun("plain", 48, 48, 3000, 0.6, focal=0.8, parted=(28, 20))
    assert model_doubts(told) == []
    assert "in groups of 28 and 20, share too little" in neighbour_doubt(told)
    assert neighbour_doubt(SfmRun("plain", 48, 48)) == ""


@pytest.mark.parametrize("half", [False, True])
def test_few_that_are_misplaced_are_taken_out_and_many_are_not(half, tmp_path, monkeypatch):
    model = model_of(FOLDED, FOLDED != AROUND)
    groups = (NAMES[:12], NAMES[12:]) if half else (NAMES[:19], NAMES[19:])
    monkeypatch.setattr(check, "read_colmap", lambda place: model)
    monkeypatch.setattr(check, "doppelganger_groups", lambda model, compared: groups)
    monkeypatch.setattr(check, "remove_pictures", lambda place, names: (24 - len(names), 900))
    told = remove_doppelgangers(SfmRun("plain", 24, 24, 1000, focal=0.8), tmp_path, ALBUM)
    if half:
        assert told.parted == (12, 12) and told.registered == 24 and told.misplaced == ()
    else:
        assert told.misplaced == NAMES[19:] and told.registered == 19 and told.points == 900


def test_nothing_is_looked_for_where_nothing_was_found():
    told = SfmRun("plain", 24)
    assert remove_doppelgangers(told, Path("nowhere"), ALBUM) is told


SPARSE = SfmRun("plain", COUNT, COUNT, 500, 0.9, focal=0.8)
"""What is told of few points, where each picture sees some hundreds."""


def test_few_points_are_enough_where_neighbours_agree(tmp_path, monkeypatch):
    monkeypatch.setattr(check, "read_colmap", lambda place: model_of(AROUND, np.zeros(COUNT)))
    assert model_doubts(SPARSE) != []
    assert neighbours_support_model(SPARSE, tmp_path, ALBUM)
    also = replace(SPARSE, focal=4.0)
    assert not neighbours_support_model(also, tmp_path, ALBUM), "no lens is like that"
    assert not neighbours_support_model(replace(SPARSE, points=900), tmp_path, ALBUM), "it is believed anyway"


@pytest.mark.parametrize("why", ["folded", "apart", "few"])
def test_few_points_are_not_where_nothing_speaks_for_them(why, tmp_path, monkeypatch):
    model = model_of(AROUND * (1 + (why == "apart")), np.zeros(COUNT))
    if why == "folded":
        model = model_of(FOLDED, FOLDED != AROUND)
    if why == "few":
        model = replace(model, sightings=model.sightings[::40])
    monkeypatch.setattr(check, "read_colmap", lambda place: model)
    album = replace(ALBUM, pairs=()) if why == "apart" else ALBUM  # none was compared
    assert not neighbours_support_model(SPARSE, tmp_path, album)


@pytest.mark.parametrize("sure", [True, False])
def test_a_search_for_more_points_is_left_where_its_neighbours_contradict(sure, tmp_path, monkeypatch):
    around, folded = model_of(AROUND, np.zeros(COUNT)), model_of(FOLDED, FOLDED != AROUND)
    more = SfmRun("thorough", COUNT, COUNT, 5000, 1.2, focal=0.6, parted=(12, 12))
    monkeypatch.setattr(check, "read_colmap", lambda place: around if sure else folded)
    monkeypatch.setattr(posing, "_prepare_source", lambda *_: ([], ALBUM))
    monkeypatch.setattr(posing, "_find_places", lambda *_: (ALBUM, 0))
    monkeypatch.setattr(posing, "_try_strategies", lambda *_: ([SPARSE, more], ()))
    monkeypatch.setattr(posing, "read_colmap", lambda place: around)
    monkeypatch.setattr(posing, "describe_mirrored", lambda model: None)
    monkeypatch.setattr(posing, "principal_point_spread", lambda place: 0.0)
    taken: list[SfmRun] = []
    monkeypatch.setattr(posing, "_record_of_runs", lambda *what: taken.append(what[-1]))
    posing._find_or_load_poses(tmp_path, tmp_path, lambda share, words: None)
    (best,) = taken
    assert best == (SPARSE if sure else more)
    assert (neighbour_doubt(best) == "") == sure

"""Sets of made photographs: what they say of themselves is true."""

from argparse import Namespace
from pathlib import Path

import numpy as np
import pytest
import real_measures as measure
from as_photographed import Look, Room, backdrop, degraded, photographed
from grounds import GROUNDS
from made_sets import sides_of, way_around, write_set

from corporeal.io.photos.colmap import read_colmap
from corporeal.pipeline.stages.capture import render_views
from patterned_scene import patterned

SIDES = np.array([0.6, 0.6, 0.14])
"""Of a block on a slab [m]."""
SIZE = 2.0
"""Distance of the farthest camera from its middle, about [m]."""


@pytest.fixture(scope="module")
def walked():
    plain = {"wall": False, "video": False, "zoomed": 1.0}
    asked = Namespace(pictures=8, rounds=[20.0, 45.0], size=[160, 120], **plain)
    low, high = np.array([-0.3, -0.3, -0.02]), np.array([0.3, 0.3, 0.12])
    return render_views(patterned(), way_around(low, high, asked, np.random.default_rng(0)))


def test_what_is_seen_is_as_large_as_the_object(walked):
    off = sides_of(walked) - SIDES
    assert (off < 1e-3).all() and (off > [-0.02, -0.02, -0.03]).all(), off


def test_the_camera_moves_around_at_two_heights(walked):
    eyes = np.stack([c.world_from_camera[:3, 3] for c in walked.cameras])
    slant = np.degrees(np.arctan2(eyes[:, 2], np.linalg.norm(eyes[:, :2], axis=1)))
    assert slant[:4].max() < slant[4:].min()
    turn = np.sort(np.degrees(np.arctan2(eyes[:, 1], eyes[:, 0])))
    assert np.ptp(turn) > 250
    seen = walked.object_of_pixel >= 0
    assert (seen.mean(axis=(1, 2)) > 0.03).all(), "a flat thing, seen from 20° and 45°"
    assert not seen[:, [0, -1]].any() and not seen[:, :, [0, -1]].any(), "whole"


LOOKS = [
    Look(grid=1),
    Look(grid=1, plain=True, flash=True, clutter=True),
    Look(grid=1, stop=True, turned=True, on="newspaper"),
]


@pytest.mark.parametrize("look", LOOKS)
def test_a_set_is_read_as_it_was_written(walked, look, tmp_path):
    pictured, sides = degraded(walked, look), np.stack([SIDES, SIDES + 0.01])
    write_set(tmp_path / "block", pictured, sides, "a block", video=False, zoomed=False)
    facts = measure.known(tmp_path / "block")
    assert facts.note == "a block" and facts.unit == 1 and facts.up == (0, 0, 1)
    np.testing.assert_allclose(facts.sides, SIDES, atol=1e-4)
    np.testing.assert_allclose(facts.all_sides, SIDES + 0.01, atol=1e-4)
    given = read_colmap(tmp_path / "block" / "sparse" / "0")
    names = [image.name for image in given.images]
    assert names == sorted(p.name for p in (tmp_path / "block" / "images").iterdir())
    assert len(list((tmp_path / "block" / "masks").iterdir())) == len(names) == 8
    errors = measure.pose_errors(given, given)
    assert errors.right == 8


def test_an_undescribed_object_is_not_known():
    assert measure.known(Path("nobody-knows-this")) == measure.Known()


def seen_by(camera, **where):
    """Return colours and places that a camera sees around no things [m]."""
    colours, far = backdrop(camera, Room(SIZE, False, np.zeros((0, 4)), grid=1, **where))
    v, u = np.indices(far.shape) + 0.5
    ray = np.stack([u, v, np.ones_like(u)], axis=-1) @ np.linalg.inv(camera.K).T
    pose = camera.world_from_camera
    return colours, pose[:3, 3] + far[..., None] * (ray @ pose[:3, :3].T)


@pytest.mark.parametrize("name", GROUNDS)
def test_beside_a_ground_the_floor_is_seen_and_nothing_beyond_walls(walked, name):
    ground = GROUNDS[name]
    colours, there = seen_by(walked.cameras[0], ground=ground)
    high = there[..., 2] / SIZE
    on = (np.abs(high) < 1e-9) & ground.covers(there.reshape(-1, 3) / SIZE).reshape(high.shape)
    end = np.abs(there[..., :2]).max(axis=-1) > SIZE * ground.room - 1e-9
    assert on.mean() > 0.1 and (colours >= 0).all()
    np.testing.assert_allclose(high[~on & ~end], -ground.drop, atol=1e-9)
    assert np.abs(there[..., :2]).max() < SIZE * ground.room + 1e-9


def test_what_is_turned_keeps_its_ground_before_a_room_that_stands_still(walked):
    ground = GROUNDS["table"]
    still, there = seen_by(walked.cameras[0], ground=ground)
    turned, _ = seen_by(walked.cameras[0], ground=ground, turn=1.0)
    on = np.abs(there[..., 2]) < 1e-9
    assert np.array_equal(still[on], turned[on])
    assert (np.abs(still - turned)[~on].max(axis=-1) > 0.01).mean() > 0.5


def test_exposures_are_up_to_a_stop_apart():
    rng, grey = np.random.default_rng(0), np.full((40, 40, 3), 0.35)
    plain = [photographed(grey, 0, rng).mean() for _ in range(60)]
    apart = [photographed(grey, 0, rng, 1.0).mean() for _ in range(60)]
    assert np.std(np.log2(apart)) > 1.5 * np.std(np.log2(plain))

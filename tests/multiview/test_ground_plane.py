"""The ground that a thing stands on, with a wall close behind it."""

from dataclasses import replace

import numpy as np
import pytest

from corporeal.multiview.ground_plane import GroundSearch, find_ground_plane


@pytest.fixture
def rng():
    return np.random.default_rng(0)


def room(rng):
    """A patch of floor with a thing on it, and a wall that begins beyond the patch."""
    floor = rng.uniform([-1.5, -1.5, -0.005], [1.5, 0.6, 0.005], (700, 3))
    thing = rng.uniform([-0.3, -0.3, 0.05], [0.3, 0.3, 0.8], (400, 3))
    wall = rng.uniform([-2, 0.8, 0.1], [2, 0.82, 1.8], (700, 3))
    return np.concatenate([floor, thing, wall])


def looked_at(rng):
    eyes = rng.uniform([-2, -2.5, 1], [2, -2, 1.5], (20, 3))
    return GroundSearch(np.array([0, 0, 1.0]), np.radians(60), 0.75, eyes, np.array([0, 0, 0.4]))


def test_a_wall_beside_the_floor_does_not_hide_it(rng):
    points, search = room(rng), looked_at(rng)
    found = find_ground_plane(points, search, np.random.default_rng(0))
    assert found is not None
    assert abs(found.offset) < 0.01 and found.normal[2] > np.cos(np.radians(1))
    anywhere = find_ground_plane(points, replace(search, middle=None), np.random.default_rng(0))
    assert anywhere is None, "nobody knows what objects are about"


def test_a_patch_beside_the_object_is_no_ground(rng):
    points, search = room(rng), looked_at(rng)
    beside = replace(search, middle=np.array([0, 0.9, 0.9]), radius=0.5)
    assert find_ground_plane(points, beside, np.random.default_rng(0)) is None

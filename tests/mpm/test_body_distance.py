"""Distances between bodies are those that a ruler would find."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from corporeal.mpm.physics.body_distance import pair_gaps, plane_depth
from corporeal.mpm.problem import FLOOR

CELL = 0.01


def pair_gap(a, c, squeezed=None):
    """Gap and depth of two bodies [m]."""
    gap, depth = pair_gaps([a, c], CELL, squeezed)
    return gap[0, 1], depth[0, 1]


def block(size, at=(0.0, 0.0, 0.0), seed=0):
    """A box of particles, two per cell and axis, slightly jittered; ``at`` is its lowest corner."""
    axes = [np.arange(CELL / 4, s, CELL / 2) for s in size]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    jitter = np.random.default_rng(seed).uniform(-0.2, 0.2, points.shape)
    return points + 0.25 * CELL * jitter + np.array(at)


@pytest.mark.parametrize("overlap", [-3.0, -1.0, 0.0, 0.3, 0.6, 1.0])
@pytest.mark.parametrize("turn", [0.0, 33.0])
def test_two_blocks_are_as_far_apart_or_as_deep_as_they_were_put(overlap, turn):
    low = block((0.1, 0.1, 0.06))
    high = block((0.1, 0.1, 0.06), at=(0.003, 0.001, 0.06 - overlap * CELL), seed=1)
    R = Rotation.from_euler("xyz", [turn, turn / 2, 10], degrees=True).as_matrix()
    gap, depth = pair_gap(low @ R.T, high @ R.T)
    assert depth == pytest.approx(max(0.0, overlap) * CELL, abs=0.3 * CELL)
    if overlap < 0:
        assert gap == pytest.approx(-overlap * CELL, abs=0.3 * CELL)
    else:
        assert gap < 0.2 * CELL


def test_squeezed_foam_is_no_deeper_than_it_is():
    """A block that is pressed to half its height has twice as many particles about a point."""
    foam = block((0.1, 0.1, 0.12)) * [1, 1, 0.5]
    steel = block((0.1, 0.1, 0.06), at=(0.003, 0.001, 0.06 - 0.6 * CELL), seed=1)
    shares = [np.full(len(foam), 0.5), np.ones(len(steel))]
    assert pair_gap(foam, steel, shares)[1] == pytest.approx(0.6 * CELL, abs=0.3 * CELL)
    assert pair_gap(foam, steel)[1] > 1.2 * CELL, "counted, it would be twice as deep"


def test_bodies_that_touch_do_not_penetrate():
    ball = block((0.1, 0.1, 0.1)) - 0.05
    ball = ball[np.linalg.norm(ball, axis=1) < 0.05 - 0.002]
    _, depth = pair_gap(ball, block((0.1, 0.1, 0.05), at=(-0.05, -0.05, -0.1)))
    assert depth < 0.2 * CELL


def test_far_bodies_are_measured_between_their_boxes():
    a, c = block((0.02, 0.02, 0.02)), block((0.02, 0.02, 0.02), at=(0.5, 0.0, 0.0))
    gap, depth = pair_gaps([a, c], CELL)
    assert gap[0, 1] == pytest.approx(0.48, abs=0.3 * CELL)
    assert depth[0, 1] == 0.0
    assert np.isinf(gap[0, 0])


def test_a_body_on_the_floor_is_not_in_it():
    body = block((0.05, 0.05, 0.05))
    still = np.broadcast_to(np.eye(3), (len(body), 3, 3))
    assert plane_depth(body, FLOOR, still, CELL) < 0.1 * CELL
    assert plane_depth(body - [0, 0, 0.5 * CELL], FLOOR, still, CELL) == pytest.approx(0.5 * CELL, abs=0.1 * CELL)


def test_a_grain_that_has_flowed_does_not_reach_through_the_floor():
    grain = np.array([[0.0, 0.0, CELL]])
    assert plane_depth(grain, FLOOR, 100 * np.eye(3)[None], CELL) == 0


def test_a_flattened_particle_reaches_less_far():
    body = np.array([[0.0, 0.0, 0.1 * CELL]])
    flat = np.diag([1.0, 1.0, 0.4])[None]
    assert plane_depth(body, FLOOR, np.eye(3)[None], CELL) > 0
    assert plane_depth(body, FLOOR, flat, CELL) == 0

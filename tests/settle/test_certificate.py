"""The certificate refuses what is not at rest, whatever the engine says."""

import numpy as np
import pytest
from bodies import ball, box

from corporeal.settle.body import Pose
from corporeal.settle.certificate import drift, examine

FLAT = Pose((0.0, 0.0, 0.1))


def turned(angle, height, axis=0):
    half = [0.0, 0.0, 0.0]
    half[axis] = float(np.sin(angle / 2))
    return Pose((0.0, 0.0, height), (float(np.cos(angle / 2)), *half))


def test_a_box_on_the_floor_is_at_rest():
    evidence = examine([box(0.4, 0.4, 0.2)], [FLAT], 1e-4)
    assert evidence.objections == ()
    assert evidence.penetration < 1e-12
    assert evidence.hover < 1e-12
    assert evidence.drift < 1e-5


def test_overlapping_meshes_are_seen_to_their_depth():
    things = [box(0.4, 0.4, 0.2), box(0.2, 0.2, 0.2)]
    evidence = examine(things, [FLAT, Pose((0.0, 0.0, 0.297))], 1e-3)
    assert evidence.penetration == pytest.approx(0.003, rel=1e-6)
    assert "overlap" in evidence.objections[0]


def test_a_small_thing_wholly_inside_a_large_one_is_seen():
    things = [box(0.4, 0.4, 0.2), ball(0.02)]
    evidence = examine(things, [FLAT, Pose((0.0, 0.0, 0.1))], 1e-3)
    assert evidence.penetration > 0.07


def test_sinking_into_the_floor_is_seen():
    evidence = examine([box(0.4, 0.4, 0.2)], [Pose((0.0, 0.0, 0.098))], 1e-3)
    assert evidence.penetration == pytest.approx(0.002, rel=1e-6)
    assert evidence.objections


def test_what_hovers_is_refused():
    evidence = examine([box(0.4, 0.4, 0.2)], [Pose((0.0, 0.0, 0.12))], 1e-3)
    assert evidence.objections == ("something hovers",)


def test_what_hovers_above_another_is_refused():
    things = [box(0.4, 0.4, 0.2), box(0.2, 0.2, 0.2)]
    near, far = Pose((0.0, 0.0, 0.3001)), Pose((0.0, 0.0, 0.32))
    assert examine(things, [FLAT, near], 1e-3).lifted == 1
    assert examine(things, [FLAT, near], 1e-3).hover == pytest.approx(1e-4, rel=1e-6)
    assert examine(things, [FLAT, far], 1e-3).objections == ("something hovers",)


@pytest.mark.parametrize("axis", [0, 1])
def test_what_is_balanced_on_an_edge_is_refused(axis):
    """The engine would leave it there for ever: nothing pushes it to either side."""
    pose = turned(np.pi / 4, 0.1 * np.sqrt(2), axis)
    evidence = examine([box(0.2, 0.2, 0.2)], [pose], 1e-3)
    assert "moves" in evidence.objections[0]


def test_what_slides_or_falls_is_refused():
    steep = turned(np.radians(5), 0.16)
    assert drift([box(0.4, 0.4, 0.2)], [steep]) > 5e-3


@pytest.mark.parametrize("size", [0.02, 10.0])
def test_rest_is_the_same_at_any_size(size):
    thing = box(size, size, size)
    assert examine([thing], [Pose((0.0, 0.0, size / 2))], 1e-3 * size).objections == ()
    balanced = turned(np.pi / 4, size / np.sqrt(2))
    assert examine([thing], [balanced], 1e-3 * size).objections

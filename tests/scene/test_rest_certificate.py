"""The certificate refuses what is not at rest, whatever the engine says."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from bodies import ball, box, convex

from corporeal.scene.rest_certificate import measure_drift, measure_rest
from corporeal.scene.settle_mujoco import HARD_CONTACT_STEP_S, MujocoScene
from corporeal.scene.settling_body import BodyPose, MassProperties

FLAT = BodyPose((0.0, 0.0, 0.1))


def turned(angle, height, axis=0):
    half = [0.0, 0.0, 0.0]
    half[axis] = float(np.sin(angle / 2))
    return BodyPose((0.0, 0.0, height), (float(np.cos(angle / 2)), *half))


def test_a_box_on_the_floor_is_at_rest():
    evidence = measure_rest([box(0.4, 0.4, 0.2)], [FLAT], 1e-4)
    assert evidence.objections == ()
    assert evidence.penetration < 1e-12
    assert evidence.hover < 1e-12
    assert evidence.drift < 1e-5


def test_overlapping_meshes_are_seen_to_their_depth():
    things = [box(0.4, 0.4, 0.2), box(0.2, 0.2, 0.2)]
    evidence = measure_rest(things, [FLAT, BodyPose((0.0, 0.0, 0.297))], 1e-3)
    assert evidence.penetration == pytest.approx(0.003, rel=1e-6)
    assert "overlap" in evidence.objections[0]


def test_a_small_object_wholly_inside_a_large_one_is_seen():
    things = [box(0.4, 0.4, 0.2), ball(0.02)]
    evidence = measure_rest(things, [FLAT, BodyPose((0.0, 0.0, 0.1))], 1e-3)
    assert evidence.penetration > 0.07


def test_sinking_into_the_floor_is_seen():
    evidence = measure_rest([box(0.4, 0.4, 0.2)], [BodyPose((0.0, 0.0, 0.098))], 1e-3)
    assert evidence.penetration == pytest.approx(0.002, rel=1e-6)
    assert evidence.objections


def test_what_hovers_is_refused():
    evidence = measure_rest([box(0.4, 0.4, 0.2)], [BodyPose((0.0, 0.0, 0.12))], 1e-3)
    assert evidence.objections == ("something hovers",)


def test_what_hovers_above_another_is_refused():
    things = [box(0.4, 0.4, 0.2), box(0.2, 0.2, 0.2)]
    near, far = BodyPose((0.0, 0.0, 0.3001)), BodyPose((0.0, 0.0, 0.32))
    assert measure_rest(things, [FLAT, near], 1e-3).lifted == 1
    assert measure_rest(things, [FLAT, near], 1e-3).hover == pytest.approx(1e-4, rel=1e-6)
    assert measure_rest(things, [FLAT, far], 1e-3).objections == ("something hovers",)


@pytest.mark.parametrize("axis", [0, 1])
def test_what_is_balanced_on_an_edge_is_refused(axis):
    """The engine would leave it there for ever: nothing pushes it to either side."""
    pose = turned(np.pi / 4, 0.1 * np.sqrt(2), axis)
    evidence = measure_rest([box(0.2, 0.2, 0.2)], [pose], 1e-3)
    assert "moves" in evidence.objections[0]


def test_what_slides_or_falls_is_refused():
    steep = turned(np.radians(5), 0.16)
    assert measure_drift([box(0.4, 0.4, 0.2)], [steep]) > 5e-3


@pytest.mark.parametrize("size", [0.02, 10.0])
def test_rest_is_the_same_at_any_size(size):
    thing = box(size, size, size)
    assert measure_rest([thing], [BodyPose((0.0, 0.0, size / 2))], 1e-3 * size).objections == ()
    balanced = turned(np.pi / 4, size / np.sqrt(2))
    assert measure_rest([thing], [balanced], 1e-3 * size).objections


SLOPE = np.radians(24)
"""tan 24° = 0.445: above the friction of some pairs, below that of others."""


def on_a_wedge(grip):
    """A slab that lies on the slope of a wedge, and the friction between the two."""
    corners = [(x, y, z) for y in (-0.3, 0.3) for x, z in ((-0.4, 0), (0.4, 0), (0.4, 0.356))]
    wedge = replace(convex(trimesh.Trimesh(corners).convex_hull, "wedge"), density=5000.0)
    slab = box(0.2, 0.2, 0.04, name="slab")
    wedge, slab = replace(wedge, grips={"slab": grip}), replace(slab, grips={"wedge": grip})
    up = np.array([-np.sin(SLOPE), 0.0, np.cos(SLOPE)])
    half = SLOPE / 2
    lying = BodyPose(tuple(np.array([0.0, 0.0, 0.178]) + 0.02001 * up), (np.cos(half), 0.0, -np.sin(half), 0.0))
    return [wedge, slab], [BodyPose((0.0, 0.0, 0.0)), lying]


@pytest.mark.parametrize(("grip", "rests"), [(0.54, True), (0.37, False)])
def test_what_holds_is_the_friction_of_the_pair_that_touches(grip, rests):
    """Coulomb: it stays where tan α ≤ μ of slab on wedge, however rough both are elsewhere."""
    evidence = measure_rest(*on_a_wedge(grip), 1e-3)
    assert (evidence.objections == ()) is rests
    if not rests:
        assert "moves" in evidence.objections[0]


def test_a_smooth_foot_does_not_hold_on_the_floor():
    """The least friction of any part counts: which part it stands on is not known."""
    ramp = [BodyPose((0.0, 0.0, 0.1), (1.0, 0.0, 0.0, 0.0))]
    matter = MassProperties(2.0, np.zeros(3), 0.02 * np.eye(3), 0.6, 0.1)
    (body,) = [replace(box(0.2, 0.2, 0.2), inertial=matter)]
    assert body.grip_on(None) == 0.1 and body.friction == 0.6
    engine = MujocoScene([body], ramp, HARD_CONTACT_STEP_S)
    engine.let_roll()
    engine.harden()
    engine.send(0, np.array([1.0, 0.0]))
    start, times = (engine.poses()[0].position[0], round(0.2 / engine.unit**0.5 / HARD_CONTACT_STEP_S))
    for _ in range(times):
        engine.step()
    gone = engine.poses()[0].position[0] - start
    seconds = times * HARD_CONTACT_STEP_S * engine.unit**0.5
    assert gone == pytest.approx(seconds - 0.5 * 0.1 * 9.81 * seconds**2, rel=0.02)

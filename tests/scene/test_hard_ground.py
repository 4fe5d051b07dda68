"""Settled things rest where hard things rest that nothing keeps from rolling."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from bodies import ball, box

from corporeal.core.errors import UserError
from corporeal.geometry.convex_hull import convex_hull_of
from corporeal.scene import settle_mujoco
from corporeal.scene.settle_bodies import settle_bodies
from corporeal.scene.settle_mujoco import DropConfig, drop_in_mujoco
from corporeal.scene.settling_body import BodyPose, SettlingBody


@pytest.mark.parametrize("seed", [0, 1])
def test_what_is_round_rests_flat_on_a_face(seed):
    thing = ball(0.2)
    (pose,), certificate = settle_bodies([thing], "scatter", seed, 1e-3)
    height = np.sort(pose.world(thing.vertices)[:, 2])
    assert abs(height[0]) < 1e-5
    assert height[2] - height[0] < 1e-5
    assert height[3] > 1e-3
    assert certificate.drift_m < 1e-4


def test_what_is_stacked_hardly_sinks():
    things = [box(0.5, 0.4, 0.2), box(0.3, 0.3, 0.2)]
    _, certificate = settle_bodies(things, "stack", 0, 1e-5)
    assert certificate.penetration_m < 5e-6


def test_what_chatters_when_time_is_up_is_left_to_the_certificate():
    """Some things never lie quite still on hard ground; what moves for good is no such thing."""
    thing = box(0.3, 0.2, 0.1)
    start = [BodyPose((0.0, 0.0, 0.06))]
    never = DropConfig(shift=0.0, longest=1.0, roll=0.3, firm=0.3)
    assert drop_in_mujoco([thing], start, never).quiet
    assert not drop_in_mujoco([thing], start, replace(never, chatter=0.0)).quiet


def test_an_object_of_many_pieces_has_room_for_all_its_contacts(monkeypatch):
    """By itself the engine leaves all of them out and things fall through each other."""
    side, plate = 0.05, box(0.6, 0.6, 0.1)
    middle = (np.arange(9) - 4) * 0.06
    studs = [
        trimesh.creation.box([side] * 3, trimesh.transformations.translation_matrix((x, y, 0)))
        for x in middle
        for y in middle
    ]
    whole = trimesh.util.concatenate(studs)
    pieces = tuple(convex_hull_of(np.asarray(stud.vertices), 0.0) for stud in studs)
    brush = SettlingBody("brush", np.asarray(whole.vertices), np.asarray(whole.faces), pieces)
    poses = [BodyPose((0.0, 0.0, 0.05)), BodyPose((0.0, 0.0, 0.1249))]
    engine = settle_mujoco.MujocoScene([plate, brush], poses, DropConfig.step)
    for _ in range(3):
        engine.step()
    assert engine.data.ncon > 300 and engine.data.nefc == 6 * engine.data.ncon
    cramped = settle_mujoco.MujocoScene([plate, brush], poses, DropConfig.step, 1 << 22)
    with pytest.raises(UserError, match="more places"):
        cramped.step()

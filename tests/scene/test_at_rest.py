"""Bodies come to rest where statics says they must."""

import hashlib
import subprocess
import sys

import numpy as np
import pytest
import trimesh
from bodies import ball, body, bowl, box, table

from corporeal.core.errors import UserError
from corporeal.scene.settle_bodies import SettleConfig, settle_bodies
from corporeal.scene.settle_mujoco import drop_in_mujoco
from corporeal.scene.settling_body import BodyPose


def lowest(thing, pose):
    return pose.world(thing.vertices)[:, 2].min()


@pytest.mark.parametrize("size", [0.02, 0.3, 10.0])
def test_a_box_of_any_size_rests_at_half_its_height(size):
    (pose,), certificate = settle_bodies([box(size, 0.8 * size, 0.6 * size)], "scatter", 1, 1e-3 * size)
    assert pose.position[2] == pytest.approx(0.3 * size, abs=2e-6 * size)
    assert certificate.drift_m < 1e-5 * size
    assert certificate.attempts == 1
    assert certificate.extent_m > size


def test_a_ball_rests_a_radius_above_the_floor():
    (pose,), _ = settle_bodies([ball(0.2)], "scatter", 3, 1e-3)
    # The ball has faces: its middle is between the inner and the outer radius.
    assert 0.97 * 0.2 < pose.position[2] <= 0.2 + 1e-6


def test_a_stack_of_boxes_stands():
    things = [box(0.4, 0.4, 0.1), box(0.3, 0.3, 0.1), box(0.2, 0.2, 0.1)]
    poses, certificate = settle_bodies(things, "stack", 0, 1e-4)
    heights = sorted(p.position[2] for p in poses)
    assert heights == pytest.approx([0.05, 0.15, 0.25], abs=5e-5)
    assert certificate.lifted == 2


def test_a_tilted_box_falls_flat():
    tilt = np.radians(25) / 2
    start = BodyPose((0.0, 0.0, 0.4), (np.cos(tilt), np.sin(tilt), 0.0, 0.0))
    dropped = drop_in_mujoco([box(0.4, 0.4, 0.2)], [start])
    assert dropped.quiet
    assert abs(dropped.poses[0].rotation[2, 2]) == pytest.approx(1, abs=1e-6)
    assert dropped.poses[0].position[2] == pytest.approx(0.1, abs=1e-5)


@pytest.mark.slow
def test_a_bowl_holds_a_ball():
    things = [bowl(), ball(0.08)]
    poses, certificate = settle_bodies(things, "stack", 0, 1e-4)
    assert certificate.lifted == 1
    # In the hollow, on the inside of a wall one centimetre thick: far below the rim at 25 cm.
    assert 0.005 < lowest(things[1], poses[1]) < 0.03


def test_there_is_room_under_a_table():
    things = [table(), box(0.2, 0.2, 0.2)]
    dropped = drop_in_mujoco(things, [BodyPose((0.0, 0.0, 0.001)), BodyPose((0.0, 0.0, 0.101))])
    assert dropped.quiet
    assert dropped.poses[1].position == pytest.approx((0, 0, 0.1), abs=1e-4)
    assert dropped.poses[0].position[2] == pytest.approx(0, abs=1e-5)


def test_what_can_stand_starts_and_ends_upright():
    (pose,), _ = settle_bodies([table()], "scatter", 5, 1e-4)
    assert pose.rotation[2, 2] == pytest.approx(1, abs=1e-6)


def test_a_row_stands_in_a_line_with_gaps():
    things = [box(0.1, 0.1, 0.4), box(0.3, 0.3, 0.3), ball(0.1)]
    poses, _ = settle_bodies(things, "row", 2, 1e-4)
    order = np.argsort([p.position[0] for p in poses])
    assert [things[k].name for k in order] == ["box", "ball", "box"]
    assert np.ptp([p.position[1] for p in poses]) < 0.02
    spans = [poses[k].world(things[k].vertices)[:, 0] for k in order]
    for ahead, behind in zip(spans[1:], spans, strict=False):
        assert 0.005 < ahead.min() - behind.max() < 0.1


def test_nothing_to_settle_is_reported():
    with pytest.raises(UserError, match="nothing to settle"):
        settle_bodies([], "scatter", 1, 1e-3)


def test_the_last_reason_is_reported():
    things = [box(0.3, 0.3, 0.3, name="crate"), box(0.2, 0.2, 0.2, name="dice")]
    with pytest.raises(UserError, match=r"crate, dice: no rest found .* in 2 attempts.*overlap"):
        settle_bodies(things, "scatter", 0, 0.0, SettleConfig(attempts=2))


def test_flat_and_tiny_objects_settle_too():
    sheet = trimesh.Trimesh([[0, 0, 0], [0.4, 0, 0], [0.4, 0.3, 0], [0, 0.3, 0]], [[0, 1, 2], [0, 2, 3]])
    things = [body(sheet, "sheet"), box(0.004, 0.004, 0.004)]
    poses, certificate = settle_bodies(things, "scatter", 0, 1e-4)
    assert certificate.objects == 2
    assert abs(lowest(things[0], poses[0])) < 1e-4
    assert abs(poses[1].rotation[2]).max() == pytest.approx(1, abs=1e-4)
    assert -1e-5 < lowest(things[1], poses[1]) < 1e-3


SCENE = """
import sys; sys.path.insert(0, {folder!r})
from bodies import ball, box, table
from corporeal.scene.settle_bodies import settle_bodies
poses, _ = settle_bodies([table(), ball(0.1), box(0.2, 0.1, 0.1)], {arrangement!r}, 7, 1e-3)
print(repr(poses))
"""


@pytest.mark.slow
@pytest.mark.parametrize("arrangement", ["scatter", "onto"])
def test_another_process_finds_the_same_bits(arrangement, request):
    code = SCENE.format(folder=str(request.path.parent), arrangement=arrangement)
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    poses, _ = settle_bodies([table(), ball(0.1), box(0.2, 0.1, 0.1)], arrangement, 7, 1e-3)
    told = [hashlib.sha256(text.encode()).hexdigest() for text in (run.stdout.strip(), repr(poses))]
    assert told[0] == told[1]


@pytest.mark.slow
def test_many_scenes_do_not_pile_up_in_memory():
    """Memory and file handles stay flat over scenes: what a scene took is given back."""
    import os

    def taken():
        pages = int(open("/proc/self/statm").read().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 2**20, len(os.listdir("/proc/self/fd"))

    if not os.path.exists("/proc/self/statm"):
        pytest.skip("this system does not tell how much memory a process takes")
    at = {}
    for number in range(24):
        settle_bodies([box(0.3, 0.2, 0.1), ball(0.1), bowl()], ("scatter", "onto")[number % 2], number, 1e-2)
        at[number] = taken()
    assert at[23][0] - at[11][0] < 8
    assert at[23][1] == at[11][1]

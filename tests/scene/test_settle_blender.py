"""Blender settles in its own process; what it says is checked, and then certified like any rest."""

import ast
import json
import os
import py_compile
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bodies import box

from corporeal.cli.parse import parse
from corporeal.core.errors import UnknownChoiceError, UserError
from corporeal.pipeline.stages.compose import ComposeConfig, compose
from corporeal.pool.asset_pool import AssetPool, PoolAsset
from corporeal.scene.settle_blender import (
    BLENDER_SCENE_SIZE,
    BLENDER_SCRIPT,
    BlenderConfig,
    BlenderError,
    drop_in_blender,
)
from corporeal.scene.settle_bodies import SettleConfig, settle_bodies
from corporeal.scene.settling_body import BodyPose, MassProperties
from glb_maker import CUBE, CUBE_TRIANGLES, Maker

TURN = (0.5**0.5, 0.0, 0.0, 0.5**0.5)
PARTS = {"name": "0", "position": [0, 0, 0], "quaternion": [1, 0, 0, 0]}


@pytest.fixture
def fake(tmp_path, monkeypatch):
    """Put the stand-in on the PATH, and let a test say how it behaves."""
    program = tmp_path / "bin" / "blenderproc"
    program.parent.mkdir()
    text = Path(__file__).with_name("fake_blenderproc.py").read_text()
    program.write_text(f"#!{sys.executable} -SE\n{text}")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(program.parent), prepend=os.pathsep)
    return lambda how: monkeypatch.setenv("FAKE", how)


@pytest.mark.parametrize("size", [0.02, 10.0])
def test_poses_come_back_in_metres_and_in_the_bodies_own_frames(fake, size):
    heavy_top = MassProperties(3.0, np.array([0.1, 0.0, 0.2]) * size, 0.01 * np.eye(3) * size**2)
    thing = replace(box(size, 0.5 * size, 0.8 * size), inertial=heavy_top)
    other = box(0.3 * size, 0.3 * size, 0.2 * size)
    starts = [BodyPose((size, -size, 3 * size), TURN), BodyPose((-size, 0.0, size))]
    dropped = drop_in_blender([thing, other], starts)
    assert dropped.quiet and dropped.seconds == pytest.approx(1)
    assert dropped.poses[0].position == pytest.approx((size, -size, 0.4 * size), abs=1e-6 * size)
    assert dropped.poses[0].quaternion == pytest.approx(TURN)
    assert dropped.poses[1].position == pytest.approx((-size, 0, 0.1 * size), abs=1e-6 * size)


def test_the_job_says_what_falls_in_lengths_and_masses_that_suit_bullet(fake, tmp_path):
    fake(f"keep {tmp_path / 'kept.json'}")
    things = [replace(box(0.4, 0.2, 0.2), density=1000.0), box(0.2, 0.2, 0.2)]
    drop_in_blender(things, [BodyPose((0.0, 0.0, 0.3)), BodyPose((1.0, 0.0, 0.3), TURN)])
    job = json.loads((tmp_path / "kept.json").read_text())
    assert [b["name"] for b in job["bodies"]] == ["0", "1"]
    assert [b["mass"] for b in job["bodies"]] == pytest.approx([4, 1], rel=1e-4)
    assert job["bodies"][1]["quaternion"] == pytest.approx(TURN)
    unit = 2 * 0.4
    assert job["bodies"][1]["position"] == pytest.approx(np.array([1, 0, 0.3]) / unit * BLENDER_SCENE_SIZE)
    (piece,) = job["bodies"][0]["pieces"]
    assert np.ptp(piece["vertices"], axis=0) == pytest.approx(np.array([0.4, 0.2, 0.2]) * 12.5)
    assert np.sum(job["friction"] ** 2) == pytest.approx(0.6)
    assert job["longest"] == pytest.approx(BlenderConfig().longest * BLENDER_SCENE_SIZE**0.5)


def test_what_blender_settled_is_certified_like_any_other(fake):
    thing = box(0.4, 0.3, 0.2)
    config = SettleConfig(attempts=2, engine="blenderproc")
    (pose,), certificate = settle_bodies([thing], "scatter", 1, 1e-3, config)
    assert pose.position[2] == pytest.approx(0.1, abs=1e-6)
    assert certificate.drift_m < 1e-5 and certificate.attempts == 1
    fake("hover")
    with pytest.raises(UserError, match=r"in 2 attempts.*something hovers"):
        settle_bodies([thing], "scatter", 1, 1e-3, config)


def test_a_crash_after_the_whole_result_harms_nothing(fake):
    fake("crash")
    dropped = drop_in_blender([box(0.4, 0.3, 0.2)], [BodyPose((0.0, 0.0, 1.0))])
    assert dropped.poses[0].position[2] == pytest.approx(0.1, abs=1e-6)


def refusal(config=BlenderConfig()):  # noqa: B008
    with pytest.raises(BlenderError) as caught:
        drop_in_blender([box(0.4, 0.3, 0.2)], [BodyPose((0.0, 0.0, 1.0))], config)
    return str(caught.value)


def test_a_program_that_is_not_there_is_reported_with_how_to_install_it(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    words = refusal()
    assert words.startswith("blenderproc: cannot be started (No such file")
    assert "pip install blenderproc" in words and "bpy 4.2" in words and "mujoco" in words
    assert refusal(BlenderConfig(program="/else/bproc")).startswith("/else/bproc: cannot")


def test_a_failure_is_reported_in_its_own_last_words(fake):
    fake("fail")
    words = refusal()
    assert "failed with code 2" in words
    assert "Traceback: | RuntimeError: no licence to fall." in words
    fake("nothing")
    assert "wrote no result. Its last output: Blender 4.2.1 (a stand-in)." in refusal()


def test_what_takes_too_long_is_ended_with_all_that_it_started(fake, tmp_path):
    fake(f"hang {tmp_path / 'child'}")
    begun = time.perf_counter()
    assert "no rest within 0.7 s" in refusal(BlenderConfig(patience=0.7))
    assert time.perf_counter() - begun < 300, "it would have gone on for ten minutes"
    child = int((tmp_path / "child").read_text())
    for _ in range(100):
        if not alive(child):
            break
        time.sleep(0.05)
    assert not alive(child)


def alive(number):
    """Whether a process still does anything; a dead one may wait for its parent to notice."""
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    status = Path(f"/proc/{number}/stat")
    return not status.exists() or status.read_text().rsplit(")", 1)[1].split()[0] != "Z"


def said(*bodies, seconds=1.0, quiet=True):
    return json.dumps({"seconds": seconds, "quiet": quiet, "bodies": list(bodies)})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("half a fi", "no JSON"),
        ("[1, 2]", "no bodies"),
        (said(), r"bodies \[\] in place of"),
        (said(PARTS, PARTS), r"\['0', '0'\] in place of \['0'\]"),
        (said(PARTS | {"name": "1"}), r"\['1'\] in place of"),
        (said(7), r"\[None\] in place of"),
        (said(PARTS, seconds=-1), "seconds = -1"),
        (said(PARTS, seconds="long"), "seconds = long"),
        (said(PARTS, quiet=1), "quiet = 1"),
        (said(PARTS | {"position": [0, float("nan"), 0]}), "box is at .*nan"),
        (said(PARTS | {"position": [0, 0]}), "box is at"),
        (said(PARTS | {"quaternion": [1, 0, 0, True]}), "box is at .*True"),
        (said(PARTS | {"quaternion": [1, 1, 0, 0]}), "which is no rotation"),
    ],
)
def test_a_result_that_makes_no_sense_is_refused(fake, text, words):
    fake(f"say {text}")
    with pytest.raises(BlenderError, match=f"its result is invalid: .*{words}"):
        drop_in_blender([box(0.4, 0.3, 0.2)], [BodyPose((0.0, 0.0, 1.0))])


def test_an_engine_that_is_not_on_the_menu_is_refused():
    with pytest.raises(UnknownChoiceError, match="settling engine 'bullet'"):
        settle_bodies([box(0.4, 0.3, 0.2)], "scatter", 1, 1e-3, SettleConfig(engine="bullet"))


def test_the_script_compiles_and_begins_as_blenderproc_demands(tmp_path):
    py_compile.compile(str(BLENDER_SCRIPT), cfile=str(tmp_path / "script.pyc"), doraise=True)
    lines = [line.strip() for line in BLENDER_SCRIPT.read_text().splitlines()]
    first = next(line for line in lines if line and not line.startswith("#"))
    assert first == "import blenderproc as bproc"


def test_the_script_uses_what_blenderproc_documents_and_reads_what_the_job_says(fake, tmp_path):
    tree = ast.parse(BLENDER_SCRIPT.read_text())
    called = {ast.unparse(n) for n in ast.walk(tree) if isinstance(n, ast.Attribute)}
    ours = {c for c in called if c.startswith("bproc.") and c != "bproc.object"}
    assert ours == {"bproc.clean_up", "bproc.object.create_from_blender_mesh"}
    methods = {c.split(".")[-1] for c in called if c.split(".")[0] in ("body", "part", "floor")}
    assert methods == {
        *("enable_rigidbody", "get_rigidbody", "set_parent", "set_location"),
        *("set_local2world_mat", "blender_obj", "matrix_world", "decompose"),
    }
    read = [n for n in ast.walk(tree) if isinstance(n, ast.Subscript)]
    names = ("job", "entry")
    keys = {k: {n.slice.value for n in read if ast.unparse(n.value) == k} for k in names}
    fake(f"keep {tmp_path / 'kept.json'}")
    drop_in_blender([box(0.4, 0.3, 0.2)], [BodyPose((0.0, 0.0, 1.0))])
    job = json.loads((tmp_path / "kept.json").read_text())
    assert keys["job"] == set(job)
    assert keys["entry"] == set(job["bodies"][0])


@pytest.fixture
def pool(tmp_path):
    maker = Maker()
    maker.node(mesh=maker.mesh(CUBE, CUBE_TRIANGLES))
    file = maker.save(tmp_path / "box.glb")
    known = {"source": "box.glb", "sha256": "0" * 64, "licence": "CC0", "attribution": "us"}
    measured = {"extent": 1.0, "metric": True, "triangles": 12, "open_edges": 0.0, "texture": 0}
    return AssetPool(tmp_path, (PoolAsset("box_a", "box", file, **known, **measured),))


def test_a_scene_is_composed_with_blender_and_not_tried_again_where_that_does_not_work(
    fake, pool, tmp_path, monkeypatch
):
    typed = ("--settle-with", "blenderproc", "--interaction", "none", "--count", "1")
    monkeypatch.setattr(sys, "argv", ["corporeal", "assemble", *typed])
    config = parse(ComposeConfig, "assemble", "", first=("count", "settle-with"))
    made = compose(pool, tmp_path / "scene", config)
    said = json.loads((tmp_path / "scene" / "composition.json").read_text())
    assert said["settled_with"] == "blenderproc"
    assert made.certificate.attempts == 1
    fake("fail")
    with pytest.raises(BlenderError, match="no licence to fall"):
        compose(pool, tmp_path / "scene", config)

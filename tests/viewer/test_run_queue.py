"""Runs that the page asked for: one after the other, stopped, resumed, and over a killed server."""

import subprocess
import sys
import time
from dataclasses import replace

import pytest

import corporeal as co
from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.io.gltf.glb_writer import write_glb
from corporeal.pipeline.run_pipeline import Settings, stage_states
from corporeal.pipeline.stages.assemble import AssembleConfig
from corporeal.viewer.run_edits import free_run_name, prepare_changed_run
from corporeal.viewer.run_queue import QUEUE_FILE, QueuedRun, RunQueue

SERVER = """
import sys, time
from pathlib import Path
from corporeal.viewer.run_queue import RunQueue
queue = RunQueue(Path(sys.argv[1]))
print("up", flush=True)
while True:
    time.sleep(1)
"""


@pytest.fixture
def scene_file(tmp_path):
    path = tmp_path / "ball.glb"
    write_glb(path, co.build_scene(co.ball("seat_foam", radius=0.05, at=(0, 0, 0.1)), duration=0.2))
    return path


def asked(name, path, until="simulate"):
    return QueuedRun(f"{name:0>16}", name, (str(path),), until)


def until(queue, done, patience=120):
    end = time.monotonic() + patience
    while time.monotonic() < end:
        if done({row["name"]: row for row in queue.listed()}):
            return
        time.sleep(0.1)
    raise AssertionError(queue.listed())


def finished(run):
    return {row.verb for row in stage_states(run) if row.state == "finished"}


@pytest.mark.slow
def test_jobs_run_one_after_the_other_and_a_stopped_one_goes_on(scene_file, tmp_path):
    runs = tmp_path / "runs"
    runs.mkdir()
    long = replace(Settings(), assemble=AssembleConfig(duration=30.0))
    queue = RunQueue(runs)
    try:
        queue.add(asked("a", scene_file, "fill"), Settings())
        queue.add(asked("b", scene_file), long)
        queue.add(asked("c", scene_file, "fill"), Settings())
        with pytest.raises(UserError, match="already"):
            queue.add(asked("b", scene_file), Settings())
        until(queue, lambda now: now["b"]["verbs"].get("simulate", 0) > 0)
        assert queue.listed()[2]["state"] == "finished" and queue.listed()[0]["state"] == "waiting"
        queue.stop("b".rjust(16, "0"))
        until(queue, lambda now: now["b"]["state"] == "stopped" and now["c"]["state"] == "finished")
        assert "simulate" not in finished(runs / "b") and "fill" in finished(runs / "b")
        with pytest.raises(UserError, match="over"):
            queue.stop("c".rjust(16, "0"))
    finally:
        queue.close()


@pytest.mark.slow
def test_what_a_killed_server_left_is_done_by_the_next(scene_file, tmp_path):
    runs = tmp_path / "runs"
    runs.mkdir()
    rows = [
        {"asked": asked("a", scene_file, "fill"), "settings": Settings()},
        {"asked": replace(asked("b", scene_file, "fill"), state="stopped"), "settings": Settings()},
        {"asked": asked("c", scene_file, "fill"), "settings": Settings()},
    ]
    store.write_json(runs / QUEUE_FILE, rows)
    server = subprocess.Popen([sys.executable, "-c", SERVER, str(runs)], stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None and server.stdout.readline() == "up\n"
    end = time.monotonic() + 60
    while '"running"' not in (runs / QUEUE_FILE).read_text() and time.monotonic() < end:
        time.sleep(0.02)
    server.kill()
    server.wait()
    queue = RunQueue(runs)
    try:
        until(queue, lambda now: now["a"]["state"] == now["c"]["state"] == "finished")
        assert queue.listed()[1]["state"] == "stopped"
        queue.go_on("b".rjust(16, "0"))
        queue.stop("b".rjust(16, "0"))
    finally:
        queue.close()
    assert "fill" in finished(runs / "a") and "fill" in finished(runs / "c")


def test_a_new_run_has_a_name_that_is_free(tmp_path):
    assert free_run_name(tmp_path, "duck") == "duck"
    (tmp_path / "duck").mkdir()
    assert free_run_name(tmp_path, "duck") == "duck-2"
    (tmp_path / "duck-2").mkdir()
    assert free_run_name(tmp_path, "duck-2") == "duck-3"
    for wanted in ("../../etc", "/", "..", "a/b", "\0"):
        name = free_run_name(tmp_path, wanted)
        assert "/" not in name and not name.startswith(".") and (tmp_path / name).parent == tmp_path


def test_a_change_is_another_run_with_annotations(small_run):
    from corporeal.pipeline.run_pipeline import read_run

    made = read_run(small_run)
    before = sorted(p.name for p in small_run.rglob("*"))
    change = {"0": {"material": "steel"}, "1": {"values": {"density": 2650.0}}}
    job, settings = prepare_changed_run(small_run, made, {"parts": change, "detail": "normal", "drop": 0.5})
    assert job.name == "drop-2" and job.inputs[0].endswith("drop.glb")
    assert (settings.fill.detail, settings.assemble.drop) == ("normal", 0.5)
    assert settings.describe.annotations is not None
    text = settings.describe.annotations.read_text()
    assert "material: steel" in text and "density_kg_m3: 2650.0" in text
    assert sorted(p.name for p in small_run.rglob("*")) == before


@pytest.mark.parametrize(
    ("asked_for", "why"),
    [
        ({"parts": {"9": {}}}, "no part"),
        ({"parts": {"0": {"material": "unobtainium"}}}, "Unknown material"),
        ({"parts": {"0": {"values": {"density": 1e6}}}}, "outside"),
        ({"parts": {"0": {"values": {"density": float("nan")}}}}, "outside"),
        ({"parts": {"0": {"values": {"density": "1"}}}}, "no number"),
        ({"parts": {"0": {"values": {"shell_thickness": 1e-3}}}}, "cannot be changed"),
        ({"parts": []}, "table"),
        ({"detail": "superb"}, "detail"),
        ({"drop": -1}, "drop"),
        ({"drop": "1"}, "drop"),
    ],
)
def test_a_change_that_cannot_be_is_refused_and_makes_no_run(small_run, asked_for, why):
    from corporeal.pipeline.run_pipeline import read_run

    made = read_run(small_run)
    runs = sorted(p.name for p in small_run.parent.iterdir())
    with pytest.raises(UserError, match=f"(?i){why}"):
        prepare_changed_run(small_run, made, asked_for)
    assert sorted(p.name for p in small_run.parent.iterdir()) == runs

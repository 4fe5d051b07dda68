"""Runs of an evaluation are done by processes of their own, resumed, and compared when done."""

import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

import corporeal as co
from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.jobs.local_workers import local_executor
from corporeal.lab.evaluation.dynamics import dynamics_evaluation
from corporeal.lab.evaluation.dynamics.dynamics_evaluation import DynamicsConfig, evaluate_dynamics
from corporeal.lab.evaluation.dynamics.dynamics_jobs import EvaluatedScene, run_and_measure
from corporeal.lab.evaluation.dynamics.run_measures import read_run_measures
from corporeal.pipeline import run_pipeline
from corporeal.pipeline.run_pipeline import Settings
from corporeal.simulation.trajectory_files import frame_path

RUN = """
import sys
from functools import partial
from pathlib import Path
from corporeal.lab.evaluation.dynamics.dynamics_jobs import run_and_measure
from corporeal.pipeline.run_pipeline import Settings
from corporeal.pipeline.stages import simulate
from corporeal.simulation.checkpoint import CheckpointConfig, Checkpoints
often = CheckpointConfig(min_interval_s=0.05, max_write_time_fraction=1.0)
simulate.Checkpoints = partial(Checkpoints, config=often)
run_and_measure(Path(sys.argv[2]), lambda f, w: None, Path(sys.argv[1]), Settings())
"""
PATIENCE = 600.0
"""Longest that a run may take on a busy machine [s]."""


def scene_of_a_fall(folder: Path, duration: float = 0.1) -> Path:
    """A steel ball that falls on a block of rubber, slowly enough for a frame to see it low."""
    ball = co.ball("steel", 0.03, (0.0, 0.0, 0.14), (0.0, 0.0, -0.5), "ball")
    block = co.box("rubber", (0.1, 0.1, 0.1), name="block")
    path = folder / "fall.glb"
    co.write_glb(path, co.build_scene(ball, block, name="fall", duration=duration))
    return path


def test_a_run_keeps_what_is_compared(tmp_path):
    folder = tmp_path / "out" / "fall" / "ours"
    run_and_measure(folder, lambda f, w: None, scene_of_a_fall(tmp_path), Settings())
    numbers = read_run_measures(folder)
    assert [b.name for b in numbers.bodies] == ["ball", "block"]
    ball, block = numbers.bodies
    assert ball.places[:, 2].min() < ball.places[0, 2] - 0.005
    assert ball.young_pa > 1e11 > 1e8 > block.young_pa
    assert ball.groups == ("metal",) and ball.laws == ("rigid body",)
    assert numbers.outcome.pair("ball", "block").first_contact_s is not None
    assert not numbers.faults and numbers.steps > 10
    assert numbers.source == store.source_digest() != ""
    assert run_pipeline.stage_states(folder)[-1].state == "not yet"  # the report, as of the video


@pytest.mark.slow
def test_a_run_that_was_killed_goes_on(tmp_path):
    scene, folder = scene_of_a_fall(tmp_path, 0.4), tmp_path / "out" / "fall" / "ours"
    process = subprocess.Popen([sys.executable, "-c", RUN, str(scene), str(folder)])
    simulated = folder / run_pipeline.STAGE_FOLDERS["simulate"]
    deadline = time.monotonic() + PATIENCE
    while not frame_path(simulated, 8).exists():
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()
    early = frame_path(simulated, 2).stat().st_mtime_ns
    run_and_measure(folder, lambda f, w: None, scene, Settings())
    assert frame_path(simulated, 2).stat().st_mtime_ns == early
    assert len(read_run_measures(folder).time) == 25


@pytest.mark.slow
def test_an_evaluation_runs_all_once_and_a_failure_is_a_row(tmp_path, monkeypatch):
    scene = EvaluatedScene("fall", scene_of_a_fall(tmp_path))
    (tmp_path / "broken.glb").write_bytes(b"no model")
    broken = EvaluatedScene("broken", tmp_path / "broken.glb")
    monkeypatch.setattr(dynamics_evaluation, "scenes_of", lambda target, out: [scene, broken])
    out, said = tmp_path / "out", []
    config = DynamicsConfig(against=("single", "one"), life=False)
    hands = local_executor(out, slots=1, say=said.append)
    found = evaluate_dynamics("showcase", out, config, Settings(), hands)
    assert found.row("fall", "ours").against is not None
    assert found.row("fall", "one").against is not None
    assert found.row("broken", "ours").error.startswith("failed: ")
    assert "Traceback" not in found.row("broken", "ours").error
    one = run_pipeline.read_run(out / "fall" / "one").field
    assert {m.young_pa for m in one.materials} == {2e6}
    before = {p: p.stat().st_mtime_ns for p in (out / "fall").rglob("frames/*.npz")}
    said.clear()
    again = evaluate_dynamics("showcase", out, config, Settings(), hands)
    assert "4 of 8 are done already." in said
    assert {p: p.stat().st_mtime_ns for p in (out / "fall").rglob("frames/*.npz")} == before
    assert again.row("fall", "single") == found.row("fall", "single")


def test_a_baseline_of_a_kind_comes_once(tmp_path):
    hands = local_executor(tmp_path, slots=1)
    for against in (("single", "single"), ("one", "one:E=1e5")):
        config = replace(DynamicsConfig(), against=against)
        with pytest.raises(UserError, match="--against"):
            evaluate_dynamics("showcase", tmp_path, config, Settings(), hands)

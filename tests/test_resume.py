"""A run that is killed goes on as if nothing had happened, and two runs leave each other alone."""

import os
import random
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from corporeal.core import store
from corporeal.core.errors import UserError
from corporeal.core.types import Finish, Scene, SceneObject, Surface
from corporeal.io.gltf.glb_writer import write_glb
from corporeal.pipeline import run_pipeline
from corporeal.pipeline.run_pipeline import Settings

CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
QUADS = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
FACES = np.array([t for a, b, c, d in QUADS for t in ([a, b, c], [a, c, d])])
SIMULATE = """
import sys
from functools import partial
from pathlib import Path
from corporeal.core.progress import no_progress
from corporeal.pipeline.stages import simulate
from corporeal.pipeline.run_pipeline import Settings, run
from corporeal.simulation.checkpoint import CheckpointConfig, Checkpoints
often = CheckpointConfig(min_interval_s=0.05, max_write_time_fraction=1.0)
simulate.Checkpoints = partial(Checkpoints, config=often)
silent = no_progress
run([Path(sys.argv[1])], Path(sys.argv[2]), Settings(), lambda verb: silent, until="simulate")
slow_to_import = {"trimesh", "networkx", "matplotlib", "scipy.cluster", "torch", "pydantic_ai"}
assert not slow_to_import & set(sys.modules), slow_to_import & set(sys.modules)
"""
PATIENCE = 600.0
"""Longest that a run may take on a busy machine [s]."""


def a_scene(path: Path, duration: float) -> Path:
    """Write a steel cube that falls on a rubber one; return its path."""
    surfaces = tuple(
        Surface(name, k, 0, CORNERS * size + place, FACES, extras={"substance": name})
        for k, (name, size, place) in enumerate([("rubber", 0.1, [0, 0, 0.001]), ("steel", 0.06, [0.02, 0.02, 0.13])])
    )
    objects = tuple(SceneObject(f"{s.name}_0", "box", 0.1) for s in surfaces)
    scene = Scene("two", "", objects, surfaces, (Finish("red"),), duration=duration, fps=60)
    write_glb(path, scene)
    return path


def start(scene: Path, folder: Path, **environment: str) -> subprocess.Popen:
    """Begin a run in a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-c", SIMULATE, str(scene), str(folder)],
        env=os.environ | environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def ended(process: subprocess.Popen) -> None:
    """Wait for a run to end well."""
    err = process.communicate(timeout=PATIENCE)[1]
    assert process.returncode == 0, err


def wait_for(process: subprocess.Popen, folder: Path, frame: int) -> None:
    """Wait until a frame is written; fails when the process ends first."""
    file = folder / run_pipeline.STAGE_FOLDERS["simulate"] / "frames" / f"{frame:05d}.npz"
    patience = time.monotonic() + PATIENCE
    while not file.exists():
        assert process.poll() is None, process.communicate()[1]
        assert time.monotonic() < patience
        time.sleep(0.002)


def kill(process: subprocess.Popen) -> None:
    """Kill -9."""
    assert process.poll() is None, "it was too quick to be killed"
    process.kill()
    process.communicate()


def told(folder: Path) -> dict[str, bytes]:
    """Every file of a simulation that follows from its inputs."""
    simulated = folder / run_pipeline.STAGE_FOLDERS["simulate"]
    names = [*sorted(simulated.glob("frames/*")), simulated / "ledger.npz", simulated / "audit.json"]
    return {str(path.relative_to(simulated)): path.read_bytes() for path in names}


def assert_same(one: Path, other: Path) -> None:
    a, b = told(one), told(other)
    assert list(a) == list(b)
    assert not [name for name in a if a[name] != b[name]]
    left = [p.name for p in other.rglob("*") if ".part" in p.name or "checkpoint" in p.name]
    assert not left


def test_a_killed_run_ends_exactly_like_one_that_was_not_and_no_other_run_starts_in_it(tmp_path):
    scene = a_scene(tmp_path / "two.glb", duration=0.15)
    words = []

    def here(folder):
        told = lambda verb: lambda fraction, said: words.append(said)  # noqa: E731
        run_pipeline.run([scene], folder, Settings(), told, until="simulate")

    broken = tmp_path / "broken"
    process = start(scene, broken)
    try:
        wait_for(process, broken, frame=3)
        with pytest.raises(UserError, match=rf"process {process.pid}\) works in"):
            here(broken)
    finally:
        kill(process)
    here(broken)
    assert len([said for said in words if "steps" in said]) < 9, "it should not begin again"
    here(tmp_path / "whole")
    assert_same(tmp_path / "whole", broken)


@pytest.mark.slow
def test_three_kills_at_random_moments_change_nothing(tmp_path):
    scene, chance = a_scene(tmp_path / "two.glb", duration=0.3), random.Random(7)
    run_pipeline.run([scene], tmp_path / "whole", until="simulate")
    broken = tmp_path / "broken"
    for number in sorted(chance.sample(range(1, 16), 3)):
        process = start(scene, broken)
        wait_for(process, broken, number)
        time.sleep(chance.uniform(0.0, 0.1))
        kill(process)
    ended(start(scene, broken))
    assert_same(tmp_path / "whole", broken)


def test_a_run_is_let_go_of_when_it_ends(tmp_path):
    for _ in range(2):
        with store.lock_folder(tmp_path), pytest.raises(UserError, match="works in"):
            with store.lock_folder(tmp_path):
                pass


@pytest.mark.slow
def test_runs_that_start_at_once_on_an_empty_kernel_cache_leave_each_other_alone(tmp_path):
    scene = a_scene(tmp_path / "two.glb", duration=0.05)
    # What is simulated is the same for all; what they compile is the engine and all about it.
    run_pipeline.run([scene], tmp_path / "killed", until="fill")
    for name in ("one", "two"):
        shutil.copytree(tmp_path / "killed", tmp_path / name)
    kernels = tmp_path / "kernels"
    caches = {"WARP_CACHE_PATH": str(kernels), "NUMBA_CACHE_DIR": str(tmp_path / "numba")}
    compiling = start(scene, tmp_path / "killed", **caches)
    while not list(kernels.rglob("*.cpp")):
        assert compiling.poll() is None, compiling.communicate()[1]
        time.sleep(0.002)
    kill(compiling)
    together = [start(scene, tmp_path / name, **caches) for name in ("one", "two")]
    for process in together:
        ended(process)
    assert_same(tmp_path / "one", tmp_path / "two")

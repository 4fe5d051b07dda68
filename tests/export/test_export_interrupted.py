"""Killed, out of room, or not allowed: nothing is half-written, and it is one sentence."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import corporeal
from corporeal.core import store
from corporeal.export import export_scene as verb

SOURCE = str(Path(corporeal.__file__).parents[1])
ORDERS = (("usd", "mjcf"), ("mjcf", "usd"))
"""USD takes long enough to be killed in it: first, and when another target is whole."""
NAME = "выставка № 1 – 展示"
"""Of the folder that is written: spaces, and letters of three alphabets."""


def typed(*words):
    """What a person types, for a process of its own."""
    return [sys.executable, "-m", "corporeal.cli", *map(str, words)]


def started(*words):
    return subprocess.Popen(
        typed(*words), env=os.environ | {"PYTHONPATH": SOURCE}, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    )


def files(folder):
    return {
        str(p.relative_to(folder)): p.read_bytes()
        for p in sorted(folder.rglob("*"))
        if p.is_file() and p.name != store.LOCK_FILE
    }


def killed_while(process, place, longest=120.0):
    """Kill a process, as nothing can be caught, as soon as a file lies in a folder."""
    until = time.monotonic() + longest
    while time.monotonic() < until and process.poll() is None:
        if place.is_dir() and any(place.iterdir()):
            process.send_signal(signal.SIGKILL)
            break
        time.sleep(1e-3)
    process.wait()
    process.stderr.close()
    return process.returncode == -signal.SIGKILL


@pytest.fixture(scope="module")
def complete(run_folder, tmp_path_factory):
    """What an export holds that nobody disturbed."""
    out = tmp_path_factory.mktemp("whole") / NAME
    verb.export_scene(run_folder, ORDERS[0], out)
    return {k: v for k, v in files(out).items() if k != "export.json"}


@pytest.mark.slow
@pytest.mark.parametrize("targets", ORDERS, ids=["in the first", "in the second"])
def test_killed_at_any_time_leaves_whole_targets_or_none(run_folder, tmp_path, complete, targets):
    """SIGKILL while one target is written: those before are whole, that one is not there."""
    out = tmp_path / NAME
    words = ("export", run_folder, "--to", *targets, "--out", out)
    assert killed_while(started(*words), out / ".usd.part")
    before = targets[: targets.index("usd")]
    assert {p.name for p in out.iterdir() if not p.name.startswith(".")} == set(before)
    for target in before:
        mine = {k: v for k, v in complete.items() if k.startswith(f"{target}/")}
        assert {f"{target}/{k}": v for k, v in files(out / target).items()} == mine
    # The same command again needs no cleaning, and what it writes is what it always writes.
    verb.export_scene(run_folder, targets, out)
    assert {k: v for k, v in files(out).items() if k != "export.json"} == complete
    assert [p.name for p in out.iterdir() if p.name.startswith(".") and p.name != store.LOCK_FILE] == []


@pytest.mark.slow
def test_killed_over_an_older_export_leaves_the_older_one(run_folder, tmp_path):
    out = tmp_path / NAME
    verb.export_scene(run_folder, ["usd"], out)
    before = files(out)
    words = ("export", run_folder, "--to", "usd", "--at", "end", "--out", out)
    assert killed_while(started(*words), out / ".usd.part")
    kept = {k: v for k, v in files(out).items() if not k.startswith(".usd.part/")}
    assert kept == before
    assert json.loads((out / "export.json").read_text())["targets"]["usd"]["at_s"] == 0.0


# ---------------------------------------------------------------- disks that refuse


def mounted(options, place, *words):
    """Run what a person types where a file system of its own is mounted, as nobody's root."""
    if shutil.which("unshare") is None:
        pytest.skip("no unshare here, to mount a small disk with")
    command = f'mount -t tmpfs -o {options} tmpfs "$0" && exec "$@"; exit 77'
    shell = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c", command, str(place)]
    done = subprocess.run(
        [*shell, *typed(*words)], env=os.environ | {"PYTHONPATH": SOURCE}, capture_output=True, text=True, timeout=300
    )
    if done.returncode in (1, 77) and ("unshare" in done.stderr or "mount" in done.stderr):
        pytest.skip(f"no disk can be mounted here: {done.stderr.strip()[:100]}")
    return done.returncode, done.stderr


def sentences(said):
    return [line for line in said.splitlines() if line.startswith("corporeal: ")]


@pytest.mark.slow
@pytest.mark.parametrize("target", ["usd", "h5", "abc"])
def test_a_full_disk_is_one_sentence(run_folder, tmp_path, target):
    """A real one, of 64 kB."""
    if target in ("h5", "abc"):
        pytest.importorskip("h5py" if target == "h5" else "alembic3d")
    place = tmp_path / "диск"
    place.mkdir()
    words = ("export", run_folder, "--to", target, "--out", place / NAME)
    code, said = mounted("size=64k", place, *words)
    assert code == 2, said
    (sentence,) = sentences(said)
    assert "Free some space" in sentence
    assert "Traceback" not in said


@pytest.mark.slow
def test_a_read_only_disk_is_one_sentence(run_folder, tmp_path):
    place = tmp_path / "диск"
    place.mkdir()
    words = ("export", run_folder, "--to", "glb", "--out", place / NAME)
    code, said = mounted("ro", place, *words)
    assert code == 2, said
    (sentence,) = sentences(said)
    assert "Choose another folder with --out" in sentence or "Choose another one" in sentence


def test_a_folder_that_is_not_ours_is_one_sentence(command, run_folder, tmp_path):
    if os.geteuid() == 0:
        pytest.skip("whoever is root may write anywhere")
    place = tmp_path / "not ours"
    place.mkdir()
    place.chmod(0o555)
    code, said = command("export", run_folder, "--to", "glb", "--out", place / NAME)
    place.chmod(0o755)
    assert code == 2 and "permission denied. Choose another folder with --out" in said.err

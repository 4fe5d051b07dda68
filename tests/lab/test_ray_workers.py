"""The same jobs on Ray: a dead worker is replaced, and nothing of Ray is left behind."""

import os
import subprocess
import sys
import time
from dataclasses import replace

import fake_jobs
import pytest
from fake_jobs import counting, silent

from corporeal.core.errors import UserError
from corporeal.jobs.executor import Executor, execute_jobs
from corporeal.jobs.job import Job
from corporeal.jobs.ray_workers import ray_worker_pool


def rays():
    """Command lines of Ray's processes."""
    told = subprocess.run(["ps", "-eo", "args"], capture_output=True, text=True).stdout
    return [line for line in told.splitlines() if "raylet" in line or line.startswith("ray::")]


def test_without_ray_it_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(UserError, match=r"pip install .*corporeal\[cluster\]"):
        with ray_worker_pool(1, 1, 0.0, ""):
            pass


@pytest.mark.slow
def test_a_killed_worker_is_replaced_and_the_manifest_is_the_same_as_here(tmp_path):
    pytest.importorskip("ray")
    before = rays()
    jobs = [
        *counting(tmp_path, ["a", "b"]),
        Job("unlucky", fake_jobs.die, tmp_path / "runs" / "unlucky", "k", {"times": 1}, True),
        Job("hopeless", fake_jobs.die, tmp_path / "runs" / "hopeless", "k", {"times": 9}, True),
        Job("refused", fake_jobs.refuse, tmp_path / "runs" / "refused", "k", {"words": "no"}, True),
    ]
    hands = Executor(lambda: ray_worker_pool(2, 1, 0.0, ""), silent, silent)
    rows = execute_jobs(tmp_path, "run", jobs, hands)
    assert {name: (r.status, r.attempts) for name, r in rows.items()} == {
        "a": ("finished", 1),
        "b": ("finished", 1),
        "unlucky": ("finished", 2),
        "hopeless": ("failed", 2),
        "refused": ("failed", 1),
    }
    assert rows["refused"].error == "no" and "process died" in rows["hopeless"].error
    pids = {(tmp_path / "runs" / name / "pid").read_text() for name in "ab"}
    assert len(pids) == 2 and str(os.getpid()) not in pids
    assert (tmp_path / "runs" / "a" / "threads").read_text() == "1"
    heard = []
    execute_jobs(tmp_path, "run", jobs[:3], replace(hands, say=heard.append))
    assert heard == ["3 of 3 are done already."]
    for _ in range(600):
        if len(rays()) <= len(before):
            break
        time.sleep(0.1)
    assert len(rays()) <= len(before), "Ray is still there"


@pytest.mark.slow
def test_an_address_without_a_cluster_is_reported_to_be_one(tmp_path):
    pytest.importorskip("ray")
    with pytest.raises(UserError, match=r"Cannot use Ray at 127\.0\.0\.1:1"):
        with ray_worker_pool(1, 1, 0.0, "127.0.0.1:1"):
            pass

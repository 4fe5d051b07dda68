"""Whatever is killed, what is finished stays, nothing is done twice and nobody else suffers."""

import os
import random
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import fake_jobs
import pytest
from fake_jobs import STEPS, counting, do, silent

from corporeal.core import store
from corporeal.jobs.job import Job, JobManifest, perform_job, read_manifest_rows, remove_partial_results
from corporeal.jobs.local_workers import local_worker_pool

NAMES = ("a", "b", "c", "d", "e", "f")
PATIENCE = 120.0
"""Longest that a process may take to end on a busy machine [s]."""


def job(folder, name, function, **arguments):
    return Job(name, function, folder / "runs" / name, f"key of {name}", arguments, resumable=True)


def finished(folder):
    """Who finished, and when; a second time would be later."""
    return {p.parent.name: p.stat().st_mtime_ns for p in folder.glob("runs/*/meta.json")}


def steps(folder):
    """When each step of each job was done."""
    return {p: p.stat().st_mtime_ns for p in folder.glob("runs/*/step-*")}


def start(folder, *names):
    """Carry six jobs, or those named, out in a process of its own."""
    return subprocess.Popen(
        [sys.executable, fake_jobs.__file__, str(folder), *(names or NAMES)], stderr=subprocess.DEVNULL
    )


def workers_of(process):
    """Process numbers of its workers."""
    told = subprocess.run(["ps", "-o", "pid=", "--ppid", str(process.pid)], capture_output=True, text=True)
    return [int(pid) for pid in told.stdout.split()]


def gone(pid):
    """Whether a process ends before patience does."""
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until:
        status = Path(f"/proc/{pid}/status")
        if not status.exists() or "\nState:\tZ" in status.read_text():
            return True
        time.sleep(0.01)
    return False


def test_every_job_is_done_once_in_a_process_of_its_own(tmp_path):
    heard = []
    rows = do(tmp_path, counting(tmp_path, NAMES[:3]), say=heard.append)
    assert {name: (r.status, r.attempts) for name, r in rows.items()} == {name: ("finished", 1) for name in NAMES[:3]}
    pids = {(tmp_path / "runs" / name / "pid").read_text() for name in NAMES[:3]}
    assert len(pids) == 3 and str(os.getpid()) not in pids
    assert heard[-1].startswith("[3/3]")
    assert (tmp_path / "runs" / "a" / "threads").read_text() == "1"
    assert read_manifest_rows(tmp_path, "run") == rows
    log = (tmp_path / "corpus.log").read_text().splitlines()
    assert len(log) == 6 and all(line[4] == "-" and " run " in line for line in log)


def test_what_is_done_is_not_done_again_until_its_key_changes(tmp_path):
    jobs = counting(tmp_path, NAMES[:2])
    for j in jobs:
        perform_job(j, silent)
    before, heard = finished(tmp_path), []
    rows = do(tmp_path, jobs, say=heard.append)
    assert heard == ["2 of 2 are done already."] and finished(tmp_path) == before
    assert {r.status for r in rows.values()} == {"finished"} and rows["a"].seconds is not None
    other = replace(jobs[0], key="another")
    assert not other.done
    rows = do(tmp_path, [other, jobs[1]])
    assert [n for n, when in finished(tmp_path).items() if before[n] != when] == ["a"]
    assert rows["a"].attempts == 1, "attempts count from the change of the key"


@pytest.mark.slow
def test_failures_say_why_leave_the_others_alone_and_are_tried_again_by_the_next_call(tmp_path):
    jobs = [
        job(tmp_path, "refused", fake_jobs.refuse, words="the shape is no shape"),
        job(tmp_path, "broken", fake_jobs.blunder),
        job(tmp_path, "killed", fake_jobs.die, times=3),
        job(tmp_path, "unlucky", fake_jobs.die, times=1),
        *counting(tmp_path, ["well"]),
    ]
    heard = []
    rows = do(tmp_path, jobs, say=heard.append)
    assert {name: (r.status, r.attempts) for name, r in rows.items()} == {
        "refused": ("failed", 1),
        "broken": ("failed", 1),
        "killed": ("failed", 2),
        "unlucky": ("finished", 2),
        "well": ("finished", 1),
    }
    assert rows["refused"].error == "the shape is no shape"
    assert "ZeroDivisionError: by nothing" in rows["broken"].error
    assert "SIGKILL" in rows["killed"].error and "--workers" in rows["killed"].error
    assert "ZeroDivisionError" in (tmp_path / "logs" / "broken.log").read_text()
    assert sum("failed" in line for line in heard) == 3
    assert sorted(finished(tmp_path)) == ["unlucky", "well"]
    rows = do(tmp_path, [jobs[2]])
    assert (rows["killed"].status, rows["killed"].attempts) == ("finished", 4)


def test_a_folder_that_cannot_be_resumed_appears_whole_or_not_at_all(tmp_path):
    whole, broken = counting(tmp_path, ["a", "b"], resumable=False)
    whole.folder.mkdir(parents=True)
    (whole.folder / "old").touch()
    perform_job(whole, silent)
    assert len(list(whole.folder.glob("step-*"))) == STEPS
    assert whole.done and not (whole.folder / "old").exists()
    with pytest.raises(ZeroDivisionError):
        perform_job(replace(broken, function=fake_jobs.blunder), silent)
    assert not broken.folder.exists()
    remove_partial_results(tmp_path / "runs")
    assert [p.name for p in (tmp_path / "runs").iterdir()] == ["a"]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, *(pytest.param(k, marks=pytest.mark.slow) for k in (2, 3))])
def test_killed_at_random_moments_it_loses_nothing_and_does_nothing_twice(tmp_path, seed):
    chance = random.Random(seed)
    for _ in range(1 if seed == 1 else 4):
        process = start(tmp_path)
        while not list(tmp_path.glob("runs/*/step-*")):
            assert process.poll() is None
            time.sleep(0.01)
        time.sleep(chance.uniform(0.1, 0.9))
        workers = workers_of(process)
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
        assert all(gone(pid) for pid in workers), "a worker outlives the one who waits for it"
    before, known = steps(tmp_path), finished(tmp_path)
    assert start(tmp_path).wait() == 0
    assert steps(tmp_path).items() >= before.items(), "a step was done again"
    assert finished(tmp_path).items() >= known.items(), "a job was done again"
    assert sorted(finished(tmp_path)) == sorted(NAMES)
    assert len(steps(tmp_path)) == len(NAMES) * STEPS
    assert {r.status for r in read_manifest_rows(tmp_path, "run").values()} == {"finished"}


def test_a_finished_folder_outranks_a_manifest_that_was_not_written_any_more(tmp_path):
    jobs = counting(tmp_path, ["a", "b"])
    for j in jobs:
        perform_job(j, silent)
    JobManifest(tmp_path, "run", jobs)
    path = tmp_path / "manifest.json"
    said = store.read_json(path)
    said["run"]["a"]["status"], said["run"]["b"]["status"] = "running", "running"
    store.write_json(path, said)
    (jobs[1].folder / store.META_FILE).unlink()
    rows = JobManifest(tmp_path, "run", jobs).rows
    assert (rows["a"].status, rows["b"].status) == ("finished", "interrupted")


def test_an_interrupt_lets_jobs_keep_what_they_have(tmp_path):
    process = start(tmp_path, "wait")
    while not (tmp_path / "runs" / "wait" / "began").exists():
        assert process.poll() is None
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    assert process.wait(PATIENCE) != 0
    assert (tmp_path / "runs" / "wait" / "kept").exists()
    assert read_manifest_rows(tmp_path, "run")["wait"].status == "interrupted"


def test_a_job_is_stopped_gently_by_one_who_ignores_interrupts(tmp_path):
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with local_worker_pool(1, 1, tmp_path / "logs") as workers:
            workers.start(counting(tmp_path, ["wait"])[0])
            while not (tmp_path / "runs" / "wait" / "began").exists():
                assert workers.process["wait"].poll() is None
                time.sleep(0.01)
    finally:
        signal.signal(signal.SIGINT, before)
    assert (tmp_path / "runs" / "wait" / "kept").exists()


@pytest.mark.parametrize("verb", ["assemble", "run"])
def test_the_manifest_keeps_scenes_that_a_call_left_out(tmp_path, verb):
    JobManifest(tmp_path, verb, counting(tmp_path, ["a", "b"]))
    JobManifest(tmp_path, verb, counting(tmp_path, ["b"]))
    assert sorted(read_manifest_rows(tmp_path, verb)) == ["a", "b"]

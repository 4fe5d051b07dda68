"""Jobs that take a moment, fail, die or wait, for tests that run them in real processes."""

import os
import signal
import sys
import time
from pathlib import Path

import fake_jobs  # itself: what runs as a program has no name that a worker could import

from corporeal.core.errors import UserError
from corporeal.jobs.executor import Executor, execute_jobs
from corporeal.jobs.job import Job
from corporeal.jobs.local_workers import local_worker_pool

STEPS = 10


def count(folder, progress, pause=0.03):
    """Write one number after the other, going on where an earlier attempt stopped."""
    done = len(list(folder.glob("step-*")))
    for number in range(done, STEPS):
        time.sleep(pause)
        (folder / f"step-{number}").touch()
        progress((number + 1) / STEPS, f"step {number}")
    (folder / "threads").write_text(os.environ.get("OMP_NUM_THREADS", ""))
    (folder / "pid").write_text(str(os.getpid()))


def refuse(folder, progress, words):
    """Say that something the user can put right is wrong."""
    raise UserError(words)


def blunder(folder, progress):
    """Raise an internal error."""
    raise ZeroDivisionError("by nothing")


def die(folder, progress, times):
    """Be killed a number of times, then finish."""
    tally = folder.parent / f"{folder.name}.deaths"
    deaths = int(tally.read_text()) if tally.exists() else 0
    if deaths < times:
        tally.write_text(str(deaths + 1))
        os.kill(os.getpid(), signal.SIGKILL)


def wait(folder, progress):
    """Wait; note an interrupt."""
    try:
        (folder / "began").touch()
        time.sleep(60)
    except KeyboardInterrupt:
        (folder / "kept").touch()
        raise


def counting(folder, names, resumable=True):
    """Jobs that count, one for each name; one called "wait" waits for ever."""
    return [
        Job(
            n,
            fake_jobs.wait if n == "wait" else fake_jobs.count,
            folder / "runs" / n,
            f"key of {n}",
            resumable=resumable,
        )
        for n in names
    ]


def silent(*words):
    """Hear nothing."""


def do(folder, jobs, slots=2, say=silent):
    """Carry jobs out on this machine."""
    hands = Executor(lambda: local_worker_pool(slots, 1, folder / "logs"), silent, say)
    return execute_jobs(folder, "run", jobs, hands)


if __name__ == "__main__":
    # It may have been started by what ignores interrupts, such as tests in the background.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    do(Path(sys.argv[1]), counting(Path(sys.argv[1]), sys.argv[2:]))

"""The process of one job: ``python -m corporeal.jobs.worker_process``, started by ``local``.

The job comes pickled on the standard input, which stays open as long as the one who started it lives: when it closes,
the parent is gone, and the process ends at once. What there is to tell goes out as lines of JSON. A first interrupt
lets the job keep what it has.
"""

import json
import os
import pickle
import signal
import sys
import threading
import time
import traceback
from dataclasses import asdict, dataclass
from typing import Literal

from corporeal.core.errors import UserError
from corporeal.core.progress import Progress
from corporeal.jobs.job import Job, perform_job

EXIT_ABANDONED, EXIT_STOPPED = 3, 130
"""Exit codes."""
MIN_PROGRESS_INTERVAL_S = 0.2
"""Least time between two words about progress [s]."""


def main() -> int:
    """Do one job; return the exit code."""
    # What a script starts in the background ignores interrupts, and so would what that starts.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # prints go to the log, not into the protocol of JSON

    def send(message: WorkerMessage) -> None:
        out.write(json.dumps(asdict(message)) + "\n")
        out.flush()

    try:
        packed = pickle.load(sys.stdin.buffer)
        threading.Thread(target=_watch_parent, daemon=True).start()
        error = attempt_job(packed, _throttle(lambda done, words: send(WorkerMessage("progress", done, words))))
    except KeyboardInterrupt:
        return EXIT_STOPPED
    send(WorkerMessage("finished", 1.0) if error is None else WorkerMessage("failed", words=error))
    return 0


@dataclass(frozen=True)
class WorkerMessage:
    """What a worker tells whoever started it: one line of JSON."""

    kind: Literal["progress", "finished", "failed"]
    fraction: float = 0.0
    words: str = ""
    """What is being done, or why it failed."""


@dataclass(frozen=True)
class PackedJob:
    """A job ready to travel to another process."""

    path: list[str]
    """Where modules are found."""
    job: bytes
    """Pickled: it can be read once ``path`` is set."""


def pack_job(job: Job) -> PackedJob:
    """Make a job ready to travel."""
    return PackedJob(sys.path, pickle.dumps(job))


def attempt_job(packed: PackedJob, progress: Progress) -> str | None:
    """Do a packed job; return what went wrong in a sentence, None when nothing did."""
    try:
        sys.path[:] = packed.path
        perform_job(pickle.loads(packed.job), progress)
    except UserError as error:
        return str(error)
    except MemoryError:
        return "Out of memory. Use fewer --workers, or --detail draft."
    except Exception as error:
        traceback.print_exc()
        return f"Internal error ({type(error).__name__}: {error})."
    return None


def _throttle(say: Progress) -> Progress:
    """Pass on progress a few times a second at most."""
    last = 0.0

    def tell(done: float, words: str) -> None:
        nonlocal last
        if time.monotonic() - last >= MIN_PROGRESS_INTERVAL_S:
            last = time.monotonic()
            say(done, words)

    return tell


def _watch_parent() -> None:
    while os.read(0, 1):
        pass
    os._exit(EXIT_ABANDONED)


if __name__ == "__main__":
    sys.exit(main())

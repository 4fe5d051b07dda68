"""Jobs on this machine: one process each, started afresh, so that no scene inherits memory.

A killed process does not affect others, and a killed parent leaves no processes behind.
"""

import json
import os
import pickle
import selectors
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from corporeal.core.deserialize import from_plain
from corporeal.core.process_resources import usable_cores
from corporeal.core.progress import Progress, no_progress
from corporeal.core.store import disk_errors
from corporeal.jobs.executor import EventCallback, Executor
from corporeal.jobs.job import Job, JobEvent
from corporeal.jobs.worker_process import WorkerMessage, pack_job

LOG_FOLDER = "logs"
"""Folder of a corpus for what its processes print."""
STOP_TIMEOUT_S = 30.0
"""How long a job may take to keep what it has when it is stopped [s]."""


class LocalWorkerPool:
    """Up to ``slots`` processes, each with so many threads."""

    def __init__(self, slots: int, threads: int, logs: Path) -> None:
        self.slots, self.threads, self.logs = slots, threads, logs
        self.ready = selectors.DefaultSelector()
        self.process: dict[str, subprocess.Popen[bytes]] = {}
        self.buffer: dict[str, bytes] = {}
        self.job: dict[str, Job] = {}
        self.last: dict[str, JobEvent] = {}

    def start(self, job: Job) -> None:
        """Begin a job in a new process."""
        with disk_errors(self.logs):
            self.logs.mkdir(parents=True, exist_ok=True)
            log = (self.logs / f"{job.name}.log").open("ab")
        with log:
            process = subprocess.Popen(
                [sys.executable, "-m", "corporeal.jobs.worker_process"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                env=os.environ | {"OMP_NUM_THREADS": str(self.threads)},
                start_new_session=True,  # Ctrl-C reaches us alone, and we pass it on once
            )
        assert process.stdin and process.stdout
        self.process[job.name], self.job[job.name] = process, job
        self.buffer[job.name] = b""
        self.ready.register(process.stdout, selectors.EVENT_READ, job.name)
        with suppress(BrokenPipeError):  # it died at once: ``wait`` will say so
            process.stdin.write(pickle.dumps(pack_job(job)))
            process.stdin.flush()

    def wait(self, seconds: float) -> list[JobEvent]:
        """Read what the processes say; a closed pipe is the end of one."""
        events: list[JobEvent] = []
        for key, _ in self.ready.select(seconds):
            name: str = key.data
            block = os.read(key.fd, 1 << 16)
            if block:
                events += self._hear(name, block)
            else:
                events.append(self._end(name))
        return events

    def _hear(self, name: str, block: bytes) -> list[JobEvent]:
        *lines, self.buffer[name] = (self.buffer[name] + block).split(b"\n")
        heard = []
        for line in lines:
            message = from_plain(WorkerMessage, json.loads(line))
            event = JobEvent(self.job[name], message.kind, message.fraction, message.words)
            if message.kind == "progress":
                heard.append(event)
            else:
                self.last[name] = event
        return heard

    def _end(self, name: str) -> JobEvent:
        process, job = self.process.pop(name), self.job.pop(name)
        assert process.stdin and process.stdout
        self.ready.unregister(process.stdout)
        code = process.wait()
        process.stdout.close()
        with suppress(BrokenPipeError):
            process.stdin.close()
        died = JobEvent(job, "died", words=f"{exit_reason(code)} Its log is in {LOG_FOLDER}/{name}.log.")
        return self.last.pop(name, died)

    def stop(self) -> None:
        """Interrupt every process once, wait a while, and kill those that go on."""
        for process in self.process.values():
            process.send_signal(signal.SIGINT)
        patience = time.monotonic() + STOP_TIMEOUT_S
        for name in list(self.process):
            with suppress(subprocess.TimeoutExpired):
                self.process[name].wait(max(0.0, patience - time.monotonic()))
            self.process[name].kill()
            self._end(name)


def exit_reason(code: int) -> str:
    """Return how a process ended that gave no reason itself."""
    if code >= 0:
        return f"Its process ended with code {code} without output."
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = f"signal {-code}"
    short = " If memory was short, use fewer --workers." if name == "SIGKILL" else ""
    return f"Its process was killed ({name}).{short}"


@contextmanager
def local_worker_pool(slots: int, threads: int, logs: Path) -> Iterator[LocalWorkerPool]:
    """Hire processes of this machine."""
    workers = LocalWorkerPool(slots, threads, logs)
    try:
        yield workers
    finally:
        workers.stop()
        workers.ready.close()


def local_executor(
    folder: str | Path,
    slots: int = 0,
    threads: int = 1,
    progress: Progress = no_progress,
    say: EventCallback = lambda words: None,
) -> Executor:
    """Let processes of this machine do the jobs of a corpus.

    Args:
        folder: The corpus's; what the processes print goes to ``logs`` in it.
        slots: Scenes at the same time; 0: one per core and ``threads``.
        threads: Of each scene.
        progress: Called with the fraction done.
        say: Told each event in a sentence.
    """
    slots = slots or max(1, usable_cores() // threads)
    return Executor(lambda: local_worker_pool(slots, threads, Path(folder) / LOG_FOLDER), progress, say)

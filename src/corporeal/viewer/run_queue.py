"""Queue of runs started from the page, each in its own process.

Requests are kept in ``.queue.json``. A job that is stopped, or whose server is killed, goes on in the same folder
from where it was.
"""

import signal
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from corporeal.core import store
from corporeal.core.deserialize import from_plain
from corporeal.core.errors import UserError
from corporeal.core.process_resources import usable_cores
from corporeal.core.progress import Progress
from corporeal.jobs.job import Job, JobEvent
from corporeal.jobs.local_workers import LocalWorkerPool
from corporeal.pipeline.run_pipeline import Settings, run, stages_for

QUEUE_FILE = ".queue.json"
JOBS_FOLDER = ".jobs"
"""Folder of what processes say and of their results' keys, among the runs."""
MAX_FINISHED_ENTRIES = 50
"""Finished entries that the list remembers."""
POLL_INTERVAL_S = 0.2
"""[s]"""
QueueState = Literal["waiting", "running", "finished", "failed", "stopped"]


@dataclass(frozen=True)
class QueuedRun:
    """One run that was asked for."""

    id: str
    name: str
    """Of the run's folder."""
    inputs: tuple[str, ...]
    until: str = "report"
    state: QueueState = "waiting"
    error: str = ""


@dataclass
class JobProgress:
    """How far the running job is."""

    verbs: dict[str, float] = field(default_factory=dict)
    words: str = ""


def run_in_process(
    place: Path, progress: Progress, inputs: list[Path], folder: Path, settings: Settings, until: str
) -> None:
    """Do one run, in a process of its own; every word about progress begins with its stage."""

    def tell(verb: str) -> Progress:
        return lambda fraction, words: progress(fraction, f"{verb}: {words}")

    run(inputs, folder, settings, tell, until)


class RunQueue:
    """The runs of one server. ``close`` ends what runs, and keeps what it has."""

    def __init__(self, runs: Path) -> None:
        """Read what is still to do; what ran when the server ended waits again."""
        self.runs, self.lock = runs, threading.RLock()
        self.workers = LocalWorkerPool(1, min(4, usable_cores()), runs / JOBS_FOLDER)
        self.settings: dict[str, Settings] = {}
        self.progress: dict[str, JobProgress] = {}
        self.stopping: set[str] = set()
        self.entries: list[QueuedRun] = []
        self._read()
        self.closed = False
        self.thread = threading.Thread(target=self._run, name="queue", daemon=True)
        self.thread.start()

    def add(self, asked: QueuedRun, settings: Settings) -> QueuedRun:
        """Put a run at the end of the queue.

        Raises:
            UserError: A run of that name is waiting or running.
        """
        with self.lock:
            busy = [e for e in self.entries if e.state in ("waiting", "running")]
            if any(e.name == asked.name for e in busy):
                raise UserError(f"{asked.name} is in the queue already.")
            # The state of the new run replaces that of the previous one.
            self.entries = [e for e in self.entries if e.name != asked.name]
            self.settings[asked.id] = settings
            self.entries.append(asked)
            self._write()
        return asked

    def stop(self, job: str) -> None:
        """Take a run out of the queue, or stop it; it can go on later.

        Raises:
            UserError: There is none, or it is over.
        """
        with self.lock:
            entry = self._entry(job)
            if entry.state == "waiting":
                self._set(replace(entry, state="stopped"))
            elif entry.state == "running":
                self.stopping.add(job)
                process = self.workers.process.get(job)
                if process is not None:
                    process.send_signal(signal.SIGINT)
            else:
                raise UserError(f"{entry.name} is over.")

    def go_on(self, job: str) -> None:
        """Let a run that stopped or failed wait again, to its end.

        Raises:
            UserError: There is none, or it has not ended.
        """
        with self.lock:
            entry = self._entry(job)
            if entry.state in ("waiting", "running"):
                raise UserError(f"{entry.name} has not ended.")
            self._set(replace(entry, state="waiting", error="", until="report"))

    def listed(self) -> list[dict[str, Any]]:
        """Say of every run how far it is, the newest first."""
        with self.lock:
            return [self._row(entry) for entry in reversed(self.entries)]

    def close(self) -> None:
        """End what runs; it waits for the next server."""
        self.closed = True
        self.thread.join(60.0)
        self.workers.stop()
        self.workers.ready.close()

    def _run(self) -> None:
        while not self.closed:
            with self.lock:
                if not self.workers.process:
                    self._begin()
            events = self.workers.wait(POLL_INTERVAL_S)
            with self.lock:
                for event in events:
                    self._hear(event)

    def _begin(self) -> None:
        entry = next((e for e in self.entries if e.state == "waiting"), None)
        if entry is None:
            return
        folder = self.runs / entry.name
        given = {
            "inputs": [Path(path) for path in entry.inputs],
            "folder": folder,
            "settings": self.settings[entry.id],
            "until": entry.until,
        }
        job = Job(entry.id, run_in_process, self.runs / JOBS_FOLDER / entry.id, entry.id, given, resumable=True)
        self.progress[entry.id] = JobProgress()
        self._set(replace(entry, state="running"))
        self.workers.start(job)

    def _hear(self, event: JobEvent) -> None:
        entry = self._entry(event.job.name)
        if event.kind == "progress":
            verb, _, words = event.words.partition(": ")
            progress = self.progress[entry.id]
            progress.verbs = {v: 1.0 for v in progress.verbs} | {verb: event.fraction}
            progress.words = words
            return
        if entry.id in self.stopping and event.kind != "finished":
            self._set(replace(entry, state="stopped"))
        elif event.kind == "finished":
            self._set(replace(entry, state="finished"))
        else:
            self._set(replace(entry, state="failed", error=event.words))
        self.stopping.discard(entry.id)

    def _entry(self, job: str) -> QueuedRun:
        found = next((e for e in self.entries if e.id == job), None)
        if found is None:
            raise UserError("There is no such job.")
        return found

    def _set(self, entry: QueuedRun) -> None:
        self.entries = [entry if e.id == entry.id else e for e in self.entries]
        self._write()

    def _row(self, entry: QueuedRun) -> dict[str, Any]:
        progress = self.progress.get(entry.id, JobProgress())
        row = {"id": entry.id, "name": entry.name, "state": entry.state, "error": entry.error}
        running = entry.state == "running"
        bars = _stage_fractions(self._verbs(entry), progress.verbs) if running else {}
        return row | {"until": entry.until, "verbs": bars, "words": progress.words if running else ""}

    def _verbs(self, entry: QueuedRun) -> Sequence[str]:
        every = stages_for([Path(path) for path in entry.inputs])
        return every[: every.index(entry.until) + 1]

    def _read(self) -> None:
        path = self.runs / QUEUE_FILE
        if not path.exists():
            return
        for row in store.read_json(path):
            entry = from_plain(QueuedRun, row["asked"])
            self.settings[entry.id] = from_plain(Settings, row["settings"])
            again = replace(entry, state="waiting") if entry.state == "running" else entry
            self.entries.append(again)

    def _write(self) -> None:
        over = [e for e in self.entries if e.state in ("finished", "failed", "stopped")]
        old = {e.id for e in over[:-MAX_FINISHED_ENTRIES]}
        self.entries = [e for e in self.entries if e.id not in old]
        rows = [{"asked": e, "settings": self.settings[e.id]} for e in self.entries]
        store.write_json(self.runs / QUEUE_FILE, rows)


def _stage_fractions(every: Sequence[str], fractions: Mapping[str, float]) -> dict[str, float]:
    """Return how far every stage is; before one that is reported, all are done."""
    last = max((every.index(verb) for verb in fractions if verb in every), default=0)
    return {v: 1.0 if k < last else fractions.get(v, 0.0) for k, v in enumerate(every)}

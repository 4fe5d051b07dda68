"""A job: work on one scene in its own process, here or on another machine.

A job's folder is finished when it holds ``meta.json`` with the job's key, written last. A job that can be resumed works
in its folder; any other works beside it and the finished folder is put in place by one rename. So whatever is killed at
whatever moment, what is finished is whole, is recognised, and is not done again.

State of all jobs: ``manifest.json``, and ``corpus.log`` with events.

The manifest says nothing that the folders do not: which results are finished is read from them, so that a process
killed between the two loses nothing.
"""

import os
import shutil
import time
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, Protocol

from corporeal.core import store
from corporeal.core.progress import Progress
from corporeal.core.store import disk_errors

PARTIAL_FOLDER_SUFFIX = ".part"


@dataclass(frozen=True)
class Job:
    """Something to do for one scene."""

    name: str
    """Of the scene."""
    function: Callable[..., None]
    """At the top of a module: called with the folder to write to, whom to tell, the arguments."""
    folder: Path
    """What it makes."""
    key: str
    """Names the result by all it depends on."""
    arguments: dict[str, Any] = field(default_factory=dict)
    resumable: bool = False
    """Goes on with what an interrupted attempt left in its folder."""

    @property
    def done(self) -> bool:
        """Whether its result is there."""
        return store.is_fresh(self.folder, self.key)

    @property
    def seconds(self) -> float:
        """What the result took [s]."""
        return store.read_meta(self.folder).seconds


def perform_job(job: Job, progress: Progress) -> None:
    """Do a job in this process."""
    start = time.perf_counter()
    place = job.folder
    if not job.resumable:
        place = job.folder.with_name(f".{job.folder.name}.{os.getpid()}{PARTIAL_FOLDER_SUFFIX}")
        shutil.rmtree(place, ignore_errors=True)
    store.begin_result(place)
    job.function(place, progress, **job.arguments)
    store.finish_result(place, job.key, {"name": job.name}, time.perf_counter() - start)
    if place != job.folder:
        shutil.rmtree(job.folder, ignore_errors=True)
        place.rename(job.folder)


def remove_partial_results(folder: Path) -> None:
    """Remove what killed jobs left half done beside the finished folders."""
    for left in folder.glob(f".*{PARTIAL_FOLDER_SUFFIX}"):
        shutil.rmtree(left, ignore_errors=True)


@dataclass(frozen=True)
class JobEvent:
    """What became of a job, or how far it came."""

    job: Job
    kind: Literal["progress", "finished", "failed", "died"]
    """failed: it gave a reason. died: its process ended without one."""
    fraction: float = 0.0
    words: str = ""


class WorkerPool(Protocol):
    """Processes that do jobs, one job each."""

    slots: int
    """How many at the same time."""

    def start(self, job: Job) -> None:
        """Begin a job."""
        ...

    def wait(self, seconds: float) -> list[JobEvent]:
        """Return what happened, after so long at the latest [s]."""
        ...

    def stop(self) -> None:
        """Let jobs that run keep what they have, and end them."""
        ...


WorkerPoolFactory = Callable[[], AbstractContextManager[WorkerPool]]
"""Opens workers; none of their processes is left when they are closed."""


CORPUS_MANIFEST_FILE, CORPUS_LOG_FILE = "manifest.json", "corpus.log"
CorpusVerb = Literal["assemble", "run", "evaluate"]
JobStatus = Literal["waiting", "running", "finished", "failed", "interrupted"]


@dataclass(frozen=True)
class ManifestRow:
    """One scene under one stage."""

    status: JobStatus
    seconds: float | None = None
    """Of the attempt that finished it [s]."""
    error: str = ""
    attempts: int = 0
    """Processes that were started for it, over all calls, since its settings last changed."""
    key: str = ""
    """Scene id: names the result by all it depends on."""


class JobManifest:
    """The rows of one stage; every change is on the disk before the next."""

    def __init__(self, folder: Path, verb: CorpusVerb, jobs: Sequence[Job]) -> None:
        """Take up what folders and an earlier manifest say of these jobs."""
        self.folder, self.verb = folder, verb
        before = read_manifest_rows(folder, verb)
        self.rows: dict[str, ManifestRow] = {}
        for job in jobs:
            known = before.get(job.name)
            known = known if known and known.key == job.key else ManifestRow("waiting", key=job.key)
            self.rows[job.name] = _current_row(job, known)
        self.others = {name: row for name, row in before.items() if name not in self.rows}
        self._write()

    def set(self, job: Job, status: JobStatus, error: str = "", seconds: float | None = None) -> None:
        """Note what became of a job, in the manifest and in the log."""
        row = replace(self.rows[job.name], status=status, error=error, seconds=seconds)
        row = replace(row, attempts=row.attempts + (status == "running"))
        self.rows[job.name] = row
        self._write()
        took = "" if seconds is None else f" in {seconds:.1f} s"
        self.log(f"{job.name} {status}{took}{': ' if error else ''}{error}")

    def log(self, words: str) -> None:
        """Append a line to ``corpus.log``."""
        stamp = time.strftime("%Y-%m-%dT%H:%M:%S")
        with disk_errors(self.folder), (self.folder / CORPUS_LOG_FILE).open("a", encoding="utf-8") as file:
            file.write(f"{stamp} {self.verb} {' '.join(words.split())}\n")

    def count(self, status: JobStatus) -> int:
        """How many of this call's jobs are in a state."""
        return Counter(row.status for row in self.rows.values())[status]

    def _write(self) -> None:
        path = self.folder / CORPUS_MANIFEST_FILE
        whole = store.read_json(path) if path.exists() else {}
        rows = self.others | self.rows
        whole[self.verb] = {name: asdict(rows[name]) for name in sorted(rows)}
        store.write_json(path, whole)


def read_manifest_rows(folder: Path, verb: CorpusVerb) -> dict[str, ManifestRow]:
    """Read what became of every scene under a stage; empty where nothing was begun."""
    path = folder / CORPUS_MANIFEST_FILE
    if not path.exists():
        return {}
    return {name: ManifestRow(**row) for name, row in store.read_json(path).get(verb, {}).items()}


def _current_row(job: Job, known: ManifestRow) -> ManifestRow:
    """Describe what holds: a finished folder outranks the manifest."""
    if job.done:
        return replace(known, status="finished", seconds=job.seconds, error="")
    if known.status in ("running", "finished"):
        return replace(known, status="interrupted", seconds=None)
    return replace(known, seconds=None)

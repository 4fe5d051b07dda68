"""A job: work on one scene in its own process, here or on another machine.

A job's folder is finished when it holds ``meta.json`` with the job's key, written last. A job that
can be resumed works in its folder; any other works beside it and the finished folder is put in
place by one rename. So whatever is killed at whatever moment, what is finished is whole, is
recognised, and is not done again.
"""

import os
import shutil
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, Protocol

from corporeal.core import store

ProgressCallback = Callable[[float, str], None]
"""Called with the fraction done and a description."""
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


def perform_job(job: Job, progress: ProgressCallback) -> None:
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


# ---------------------------------------------------------------- who does them


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

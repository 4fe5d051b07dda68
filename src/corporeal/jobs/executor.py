"""Execution of jobs on workers; failures don't stop other jobs."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from corporeal.core.progress import Progress
from corporeal.jobs.job import (
    CorpusVerb,
    Job,
    JobEvent,
    JobManifest,
    ManifestRow,
    WorkerPool,
    WorkerPoolFactory,
    remove_partial_results,
)

MAX_JOB_PROCESSES = 2
"""Processes that may die over one job in one call."""
PROGRESS_REDRAW_S = 1.0
"""Longest wait before the bar is drawn again [s]."""

EventCallback = Callable[[str], None]
"""Told each event in a sentence."""


@dataclass(frozen=True)
class Executor:
    """Who does the jobs, and who is informed of their progress."""

    hire: WorkerPoolFactory
    """Opens the workers."""
    progress: Progress
    """Called with the fraction done."""
    say: EventCallback
    """Told what happens."""


def execute_jobs(folder: Path, verb: CorpusVerb, jobs: Sequence[Job], hands: Executor) -> dict[str, ManifestRow]:
    """Do all jobs that are not done; return what became of each.

    A job that fails is noted and left; one whose process dies is tried once more. An interrupt
    lets running jobs keep what they have.
    """
    for place in {job.folder.parent for job in jobs}:
        remove_partial_results(place)
    shift = _Execution(JobManifest(folder, verb, jobs), jobs, hands)
    if shift.waiting:
        try:
            with hands.hire() as workers:
                shift.work(workers)
        finally:
            shift.close()
    return dict(shift.manifest.rows)


class _Execution:
    """One call's work: what waits, what runs, and how far each came."""

    def __init__(self, manifest: JobManifest, jobs: Sequence[Job], hands: Executor) -> None:
        self.manifest, self.jobs = manifest, jobs
        self.progress, self.say = hands.progress, hands.say
        self.waiting = deque(job for job in jobs if not job.done)
        self.running: dict[str, float] = {}
        self.words = ""
        self.died: dict[str, int] = {}
        self.finished = self.failed = 0
        """In this call."""
        self.already = len(jobs) - len(self.waiting)
        if self.already:
            self.say(f"{self.already} of {len(jobs)} are done already.")

    def work(self, workers: WorkerPool) -> None:
        """Keep the workers busy until nothing waits and nothing runs."""
        while self.waiting or self.running:
            while self.waiting and len(self.running) < workers.slots:
                job = self.waiting.popleft()
                workers.start(job)
                self.running[job.name] = 0.0
                self.manifest.set(job, "running")
            for event in workers.wait(PROGRESS_REDRAW_S):
                self._hear(event)
            self._draw()

    def _hear(self, event: JobEvent) -> None:
        job = event.job
        if event.kind == "progress":
            self.running[job.name] = event.fraction
            self.words = f"{job.name}: {event.words}"
            return
        del self.running[job.name]
        if job.done:
            self.finished += 1
            self.manifest.set(job, "finished", seconds=job.seconds)
            self._announce(job, f"finished in {job.seconds:.1f} s")
            return
        self.died[job.name] = self.died.get(job.name, 0) + (event.kind == "died")
        if event.kind == "died" and self.died[job.name] < MAX_JOB_PROCESSES:
            self.manifest.log(f"{job.name} died: {event.words}")
            self._announce(job, f"is tried again. {event.words}")
            self.waiting.appendleft(job)
            return
        error = event.words or "It ended without a result."
        self.failed += 1
        self.manifest.set(job, "failed", error)
        self._announce(job, f"failed: {error}")

    def _announce(self, job: Job, words: str) -> None:
        ended = self.already + self.finished + self.failed
        self.say(f"[{ended}/{len(self.jobs)}] {job.name} {words}")

    def _draw(self) -> None:
        new = self.finished + self.failed + sum(self.running.values())
        done = f"{self.already + self.finished} of {len(self.jobs)} done"
        failures = f", {self.failed} failed" if self.failed else ""
        share = new / max(1, len(self.jobs) - self.already)
        self.progress(share, f"{done}{failures}. {self.words}")

    def close(self) -> None:
        """Note what was running when everything stopped."""
        for job in self.jobs:
            if job.name in self.running:
                if job.done:
                    self.manifest.set(job, "finished", seconds=job.seconds)
                else:
                    self.manifest.set(job, "interrupted")

"""State of all jobs: ``manifest.json``, and ``corpus.log`` with events.

The manifest says nothing that the folders do not: which results are finished is read from them, so
that a process killed between the two loses nothing.
"""

import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

from corporeal.core import store
from corporeal.core.store import disk_errors
from corporeal.jobs.job import Job

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

    def set(
        self, job: Job, status: JobStatus, error: str = "", seconds: float | None = None
    ) -> None:
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
        with (
            disk_errors(self.folder),
            (self.folder / CORPUS_LOG_FILE).open("a", encoding="utf-8") as file,
        ):
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

"""What substeps cost over time: one CSV that grows by some rows a night.

A row is one drop. ``ratio`` is its cost over that of the plain drop of its run: machines and nights
differ, ratios tell what the code did.
"""

import csv
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path

from cost.page import Result

COLUMNS: tuple[str, ...] = ("date", "commit", "law", "particles", "objects", "which", "threads", "cpu_ns", "ratio")


def rows(results: Sequence[Result], date: str, commit: str) -> list[dict[str, str]]:
    """Make the rows of one run; the first of its results is the plain drop.

    Args:
        results: What was measured.
        date: Of the run.
        commit: What was measured, short.

    """
    plain = results[0].cpu
    return [
        {
            "date": date,
            "commit": commit,
            "law": r.drop.law.name.lower(),
            "particles": str(r.particles),
            "objects": str(r.drop.objects),
            "which": r.setting,
            "threads": str(r.drop.threads),
            "cpu_ns": f"{r.cpu:.1f}",
            "ratio": f"{r.cpu / plain:.3f}",
        }
        for r in results
        if r.engine == "corporeal" and r.device == "cpu"
    ]


def append(path: Path, results: Sequence[Result]) -> None:
    """Add a run to the file, with the date and the commit of this checkout."""
    command = ["git", "-C", str(Path(__file__).parent), "rev-parse", "--short", "HEAD"]
    commit = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    new = not path.exists()
    with path.open("a", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        if new:
            writer.writeheader()
        writer.writerows(rows(results, time.strftime("%Y-%m-%d"), commit))

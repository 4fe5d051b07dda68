"""Another checkout of this project beside this one, each in a process of its own that answers.

It stands outside of ``cost``, which the process of each checkout imports from its own folder.
"""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parents[1]
SERVE = "--serve"


class Checkout:
    """A benchmark in one checkout, which answers questions one by one."""

    def __init__(self, benchmark: str, root: Path, *words: str | int | Path) -> None:
        """Start the process.

        Args:
            benchmark: File of the benchmark of this checkout, which serves with ``serving``.
            root: The checkout whose package is measured.
            words: What else the process is told.

        """
        told = [SERVE, str(root), *map(str, words)]
        self.process = subprocess.Popen(
            [sys.executable, benchmark, *told], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def ask(self, question: Any) -> float:
        """Return the answer, a cost; ends the benchmark where the process has ended."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(json.dumps(question) + "\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            sys.exit("One of the checkouts did not run: see above.")
        return json.loads(line)

    def close(self) -> None:
        """End the process."""
        self.process.communicate()


def import_from(root: str) -> None:
    """Let imports take the checkout's package and benchmarks, and not this one's."""
    sys.path[:1] = [f"{root}/benchmarks", f"{root}/src"]


def answer(ask: Callable[[Any], float]) -> None:
    """Answer one line of standard input after the other."""
    for line in sys.stdin:
        sys.stdout.write(json.dumps(ask(json.loads(line))) + "\n")
        sys.stdout.flush()

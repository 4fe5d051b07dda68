"""The same block drop in genesis-world, in a process and an environment of its own."""

import json
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

from cost.blocks import CELL, DENSITY, HEIGHT, POISSON, SPEED, STEP, YOUNG_PA, Drop
from cost.contest import Cost

SCRIPT = Path(__file__).parent.parent / "peers" / "genesis_block.py"
PACKAGES = ("torch==2.13.0", "genesis-world")
"""The first is the build for the CPU: before what depends on it."""


def python_of(folder: Path) -> Path:
    """Where the environment's Python is."""
    return folder / "bin" / "python"


def install(folder: Path) -> None:
    """Make the environment; some 3 GB."""
    venv.create(folder, with_pip=True)
    for package in PACKAGES:
        subprocess.run([python_of(folder), "-m", "pip", "install", "-q", package], check=True)


class Peer:
    """genesis-world's MPM with its corotated elastic material, in single precision."""

    engine = "genesis"
    bytes = grown = float("nan")

    def __init__(self, folder: Path, drop: Drop) -> None:
        """Start the process; its scene is built meanwhile.

        Args:
            folder: The virtual environment with genesis-world.
            drop: Corotated, one object, on the CPU.

        """
        words = (drop.threads, drop.across, CELL, STEP, YOUNG_PA, POISSON, DENSITY, SPEED, HEIGHT)
        self.complaints = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen(
            [str(python_of(folder)), str(SCRIPT), *(str(word) for word in words)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self.complaints,
            text=True,
        )
        self.drop, self.particles, self.version = drop, drop.particles, ""

    def ready(self) -> None:
        """Wait until the scene is built."""
        said = self._answer()
        self.version, self.particles = said["version"], said["particles"]

    def _answer(self) -> dict:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        if not line:
            self.complaints.seek(0)
            sys.exit(f"genesis-world did not run:\n{self.complaints.read()[-2000:]}")
        return json.loads(line)

    def batch(self, substeps: int) -> Cost:
        """Take a third of the substeps: each costs as much as the other, and ten times ours."""
        assert self.process.stdin is not None
        self.process.stdin.write(f"{substeps // 3}\n")
        self.process.stdin.flush()
        said = self._answer()
        unit = 1e9 / said["substeps"] / self.particles
        return Cost(unit * said["seconds"], unit * said["cpu"])

    def close(self) -> None:
        """End the process."""
        self.process.communicate()

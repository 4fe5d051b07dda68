"""Checkpoints, from which an interrupted simulation resumes bit for bit.

``checkpoint.npz`` holds the engine's whole state after a finished frame, and the name of the problem it belongs to;
``checkpoint-before.npz`` is the one before it, for when the last cannot be read. Each is sealed with a digest, written
whole, forced to the disk and then renamed, so that a process or a machine that stops in the middle leaves the old ones.
"""

import hashlib
import logging
import time
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from corporeal.core.errors import BadFileError
from corporeal.simulation.trajectory_files import frame_path, read_arrays, write_arrays

CHECKPOINT_FILE, PREVIOUS_CHECKPOINT_FILE = "checkpoint.npz", "checkpoint-before.npz"
STATE_PREFIX = "engine."

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class CheckpointState:
    """Content of a checkpoint."""

    done: int = 0
    """Frames before it."""
    state: dict[str, np.ndarray] = field(default_factory=dict)
    """State of the engine; empty at the start."""


@dataclass(frozen=True)
class CheckpointConfig:
    """How often checkpoints are written."""

    min_interval_s: float = 10.0
    """Least time of computing between two of them [s]."""
    max_write_time_fraction: float = 0.05
    """Largest fraction of the time that may be spent on writing them [1]."""


DEFAULT_CHECKPOINTS = CheckpointConfig()


class Checkpoints:
    """The last two states of one simulation in one folder."""

    def __init__(self, folder: Path, name: str, config: CheckpointConfig = DEFAULT_CHECKPOINTS) -> None:
        """Manage the checkpoints in a folder.

        Args:
            folder: Where they are, beside the frames.
            name: Fingerprint of the problem; checkpoints with another one are ignored.
            config: How often they are written.
        """
        self.folder, self.name, self.config = folder, name, config
        self.written, self.seconds = time.monotonic(), 0.0

    @property
    def due(self) -> bool:
        """Whether the next checkpoint is due."""
        pause = max(self.config.min_interval_s, self.seconds / self.config.max_write_time_fraction)
        return time.monotonic() - self.written >= pause

    def keep(self, saved: dict[str, np.ndarray], done: int) -> None:
        """Write a state after ``done`` frames; the last one becomes the one before."""
        start = time.monotonic()
        last = self.folder / CHECKPOINT_FILE
        if last.exists():
            last.replace(self.folder / PREVIOUS_CHECKPOINT_FILE)
        saved = {name: np.asarray(value) for name, value in saved.items()}
        state = {f"{STATE_PREFIX}{name}": value for name, value in saved.items()}
        about = {"done": done, "name": self.name, "seal": fingerprint(done, self.name, saved)}
        write_arrays(last, state | {name: np.array(value) for name, value in about.items()})
        self.written = time.monotonic()
        self.seconds = self.written - start

    def newest(self) -> CheckpointState:
        """Return the newest usable checkpoint; an empty one if there is none."""
        for path in (self.folder / CHECKPOINT_FILE, self.folder / PREVIOUS_CHECKPOINT_FILE):
            if not path.exists():
                continue
            try:
                return self._read(path)
            except BadFileError as error:
                log.warning("%s Looking for an earlier one, or starting again.", error)
                path.unlink()
        return CheckpointState()

    def _read(self, path: Path) -> CheckpointState:
        found = read_arrays(path)
        state = {k.removeprefix(STATE_PREFIX): v for k, v in found.items() if k.startswith(STATE_PREFIX)}
        try:
            done, name, seal = int(found["done"]), str(found["name"]), str(found["seal"])
        except KeyError as error:
            raise BadFileError(path, f"is no checkpoint ({error} is missing).") from error
        if seal != fingerprint(done, name, state):
            raise BadFileError(path, "cannot be read (not what was written).")
        if name != self.name:
            raise BadFileError(path, "is of another scene or other settings.")
        missing = [k for k in range(done) if not frame_path(self.folder, k).exists()]
        if missing:
            raise BadFileError(path, f"does not fit: frame {missing[0]} is missing.")
        return CheckpointState(done, state)

    def forget(self) -> None:
        """Remove them: the simulation is finished."""
        for name in (CHECKPOINT_FILE, PREVIOUS_CHECKPOINT_FILE):
            (self.folder / name).unlink(missing_ok=True)


def fingerprint(*objects: Any) -> str:
    """Return a digest of dataclasses, containers, arrays and numbers."""
    total = hashlib.sha256()
    for obj in objects:
        _feed(total, obj)
    return total.hexdigest()[:20]


def _feed(total: Any, obj: Any) -> None:
    """Add a value to the digest, its kind and length first, so that no two values look alike."""
    total.update(type(obj).__name__.encode())
    if isinstance(obj, np.ndarray):
        total.update(f"{obj.dtype.str}{obj.shape}".encode())
        total.update(np.ascontiguousarray(obj).tobytes())
    elif is_dataclass(obj) and not isinstance(obj, type):
        for f in fields(obj):
            total.update(f.name.encode())
            _feed(total, getattr(obj, f.name))
    elif isinstance(obj, dict):
        _feed(total, sorted(obj.items()))
    elif isinstance(obj, list | tuple):
        total.update(str(len(obj)).encode())
        for item in obj:
            _feed(total, item)
    else:
        total.update(repr(obj).encode())

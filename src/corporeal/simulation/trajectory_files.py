"""Trajectory files: one per frame, written atomically, read one by one.

``frames/00000.npz`` holds ``time``, every particle's ``position`` (float32 [m]); of the particles that can deform the
total deformation gradient ``motion`` (float16) and the square root of the von Mises ``stress`` (float16 [√Pa], which
reaches 4 GPa); the ``rotation`` of every rigid object (float64, NaN for the others), and the ledger of that instant
under ``ledger.<name>``. ``frames/layout.npz`` says which particle belongs to which object and which objects are rigid.
``ledger.npz`` gathers the ledger and the times once all frames are there.
"""

import os
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, overload

import numpy as np
from jaxtyping import Bool, Int

from corporeal.core import store
from corporeal.core.errors import BadFileError
from corporeal.core.types import Frame, Ledger, Trajectory
from corporeal.discretization.build_model import ModelMapping

FRAMES_FOLDER = "frames"
LAYOUT_FILE = "layout.npz"
LEDGER_FILE = "ledger.npz"
BREAKS_FILE = "breaks.npz"
"""File on fractures."""
LEDGER_PREFIX = "ledger."
NPZ_ERRORS = (OSError, ValueError, KeyError, EOFError, RuntimeError, zipfile.BadZipFile)
"""Exceptions of reading a damaged npz."""
MAX_FLOAT16_STRETCH = 6e4
"""Largest stretch that float16 can hold [-]."""
FRAME_CACHE_BYTES = 2**26
"""Of frames that are kept in memory once they have been read [bytes]: 60 of 30,000 particles."""


@dataclass(frozen=True)
class FrameLayout:
    """Data common to all frames; P particles, B objects."""

    object: Int[np.ndarray, " P"]
    rigid: Bool[np.ndarray, " B"]

    @classmethod
    def of(cls, posed: ModelMapping) -> "FrameLayout":
        """Return which particle belongs to which object of a problem."""
        bodies, place = posed.problem.bodies, np.empty_like(posed.order)
        place[posed.order] = np.arange(len(posed.order))
        owner = np.repeat(np.arange(len(bodies)), [len(b.position) for b in bodies])
        return cls(object=owner[place], rigid=posed.rigid)

    @property
    def bends(self) -> Bool[np.ndarray, " P"]:
        """Which particles belong to objects that can deform."""
        return ~self.rigid[self.object]


def frame_path(folder: Path, number: int) -> Path:
    """Where frame ``number`` of the trajectory in ``folder`` is."""
    return folder / FRAMES_FOLDER / f"{number:05d}.npz"


def write_arrays(path: Path, arrays: dict[str, Any]) -> None:
    """Write an npz atomically."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".{path.stem}.{os.getpid()}.part")
    try:
        with partial.open("wb") as file:
            np.savez(file, **arrays)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def read_arrays(path: Path, start: str = "", without: str = "\0") -> dict[str, np.ndarray]:
    """Read the arrays of an npz whose names begin with ``start``, and not with ``without``.

    Raises:
        BadFileError: The file is absent or damaged.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            names = [n for n in file.files if n.startswith(start) and not n.startswith(without)]
            return {name: file[name] for name in names}
    except NPZ_ERRORS as error:
        raise BadFileError(path, f"cannot be read ({error}).", "Run corporeal simulate again.") from error


def write_layout(folder: Path, layout: FrameLayout) -> None:
    """Write the data common to all frames."""
    write_arrays(folder / FRAMES_FOLDER / LAYOUT_FILE, {"object": layout.object, "rigid": layout.rigid})


def read_layout(folder: Path) -> FrameLayout:
    """Read the data common to all frames."""
    found = read_arrays(folder / FRAMES_FOLDER / LAYOUT_FILE)
    return FrameLayout(object=found["object"].astype(np.int64), rigid=found["rigid"].astype(bool))


def write_frame(folder: Path, number: int, frame: Frame, layout: FrameLayout, ledger: Ledger) -> None:
    """Write one frame with its ledger."""
    rotation = np.full((len(layout.rigid), 3, 3), np.nan)
    for body in np.flatnonzero(layout.rigid):
        rotation[body] = frame.deformation[np.argmax(layout.object == body)]
    motion = np.clip(frame.deformation[layout.bends], -MAX_FLOAT16_STRETCH, MAX_FLOAT16_STRETCH)
    arrays = {
        "time": np.float64(frame.time),
        "position": frame.position.astype(np.float32),
        "motion": motion.astype(np.float16),
        "rotation": rotation,
    }
    if frame.stress is not None:
        root = np.sqrt(np.clip(frame.stress[layout.bends], 0.0, MAX_FLOAT16_STRETCH**2))
        arrays["stress"] = root.astype(np.float16)
    arrays |= {LEDGER_PREFIX + name: value for name, value in _arrays(ledger).items()}
    write_arrays(frame_path(folder, number), arrays)


def read_frame(folder: Path, number: int, layout: FrameLayout) -> Frame:
    """Read one frame; a rigid object's deformation is its exact rotation."""
    path = frame_path(folder, number)
    return _frame(path, read_arrays(path, without=LEDGER_PREFIX), layout)


def _frame(path: Path, found: dict[str, np.ndarray], layout: FrameLayout) -> Frame:
    """Unpack a frame; the arrays found at ``path`` stay as they are."""
    try:
        deformation = np.empty((len(layout.object), 3, 3), dtype=np.float32)
        deformation[layout.bends] = found["motion"]
        deformation[~layout.bends] = found["rotation"][layout.object[~layout.bends]]
        stress = None
        if "stress" in found:
            stress = np.zeros(len(layout.object), dtype=np.float32)
            stress[layout.bends] = found["stress"].astype(np.float32) ** 2
        return Frame(float(found["time"]), found["position"].copy(), deformation, stress)
    except (KeyError, ValueError, IndexError) as error:
        raise BadFileError(path, f"is not a frame of this run ({error}).", "Run corporeal simulate again.") from error


def read_ledger(folder: Path, number: int) -> Ledger:
    """Read one frame's ledger.

    Raises:
        BadFileError: The frame is absent or damaged, or its ledger has other fields.
    """
    path = frame_path(folder, number)
    found = read_arrays(path, LEDGER_PREFIX)
    return _ledger(path, {k.removeprefix(LEDGER_PREFIX): v for k, v in found.items()})


def _arrays(ledger: Ledger) -> dict[str, np.ndarray]:
    return {f.name: getattr(ledger, f.name) for f in fields(Ledger)}


def _ledger(path: Path, found: dict[str, np.ndarray]) -> Ledger:
    names = [f.name for f in fields(Ledger)]
    absent = [name for name in names if name not in found]
    if absent:
        raise BadFileError(path, f"has a ledger without {', '.join(absent)}.", "Run corporeal simulate again.")
    return Ledger(**{name: found[name] for name in names})


class FrameSequence(Sequence[Frame]):
    """The frames of one trajectory, read from disk when asked for; the first ones only once.

    Audit, video and report each read most of them. What is beyond ``cache_bytes`` is read
    again.
    """

    def __init__(self, folder: Path, count: int, cache_bytes: int = FRAME_CACHE_BYTES) -> None:
        self.folder, self.length = folder, count
        self.layout = read_layout(folder)
        self._kept: dict[int, dict[str, np.ndarray]] = {}
        self._room = cache_bytes

    def __len__(self) -> int:
        return self.length

    @overload
    def __getitem__(self, index: int) -> Frame: ...
    @overload
    def __getitem__(self, index: slice) -> list[Frame]: ...
    def __getitem__(self, index: int | slice) -> Frame | list[Frame]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(self.length))]
        number = index + self.length if index < 0 else index
        if not 0 <= number < self.length:
            raise IndexError(f"frame {index} of {self.length}")
        path = frame_path(self.folder, number)
        found = self._kept.get(number)
        if found is None:
            found = read_arrays(path, without=LEDGER_PREFIX)
            size = sum(array.nbytes for array in found.values())
            if size <= self._room:
                self._room -= size
                self._kept[number] = found
        return _frame(path, found, self.layout)


def gather_ledgers(folder: Path, count: int) -> Trajectory:
    """Collect the ledgers of ``count`` finished frames into ``ledger.npz``."""
    rows = [_arrays(read_ledger(folder, number)) for number in range(count)]
    write_arrays(folder / LEDGER_FILE, {f: np.stack([row[f] for row in rows]) for f in rows[0]})
    return read_trajectory(folder)


def read_trajectory(folder: Path) -> Trajectory:
    """Open a finished trajectory; its frames stay on disk.

    Raises:
        BadFileError: The trajectory is unfinished or damaged.
    """
    path = folder / LEDGER_FILE
    ledger = _ledger(path, read_arrays(path))
    frames, broken = FrameSequence(folder, len(ledger.time)), folder / BREAKS_FILE
    breaks = store.load(broken) if broken.exists() else ()
    return Trajectory(folder, ledger.time, ledger, frames, breaks)

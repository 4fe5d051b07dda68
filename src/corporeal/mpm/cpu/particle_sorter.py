"""Native sort of one field's particles, with its memory."""

from itertools import pairwise
from typing import Protocol

import numpy as np

from corporeal.mpm.cpu.layout import (
    BLOCK_INTEGERS,
    CHANNELS,
    COUNT,
    HISTORY_CHANNELS,
    MAXWELL_CHANNELS,
    RANK,
    SORT_COPY,
    SORT_SURVEY,
    SORTING_RECORD,
)
from corporeal.mpm.cpu.program import (
    COMPILE_OPTIONS,
    MIN_PARTICLES_PER_READING_THREAD,
    CpuProgram,
    MemoryArray,
    aligned_zeros,
    array_in_bytes,
    cache_line_bytes,
    native_source,
)
from corporeal.mpm.quiet_warp import wp

wp.set_module_options(COMPILE_OPTIONS)


@wp.func_native(native_source("sort"))
def sort_native(memory: MemoryArray, stage: int, low: int, high: int): ...


@wp.kernel
def sort_particles(memory: MemoryArray, stage: int, low: int, high: int):
    sort_native(memory, stage, low, high)


GROWTH_DIVISOR, IDLE_DIVISOR = 16, 4
"""Of what a sort fills: by which part more memory it is given, since blocks come and go, and how much more it may be
given at most."""


class SortableWindow(Protocol):
    """What a sort reads and replaces of a window; see ``window.Window``."""

    part: np.ndarray
    history: np.ndarray
    branch: np.ndarray
    block: np.ndarray
    table: np.ndarray
    where: np.ndarray
    origin: np.ndarray
    dim: np.ndarray
    count: int
    kinds: int
    """Rows of the table of materials."""


class SpareMemory:
    """Memory that one sort leaves and the next one fills.

    Memory that is new to a process costs more than the copy: the system empties every page of it.
    """

    def __init__(self, channels: int) -> None:
        self.channels = channels
        self.memory = np.empty(0, np.uint8)

    def rows(self, batches: int) -> np.ndarray:
        """Give memory for so many batches, which may hold anything, (batches, channels, 8)."""
        shape = (batches, self.channels, 8)
        size, kept = cache_line_bytes(shape, np.float32), self.memory
        if kept.nbytes <= size + size // IDLE_DIVISOR:
            self.memory = np.empty(0, np.uint8)
            if size <= kept.nbytes:
                return array_in_bytes(kept, shape, np.float32)
            del kept  # before new memory is asked for
        return aligned_zeros((batches + batches // GROWTH_DIVISOR, *shape[1:]), np.float32)[:batches]

    def keep(self, rows: np.ndarray) -> None:
        """Take back memory of ``rows`` or ``aligned_zeros`` that is unused, if it is the largest."""
        memory = rows.base
        if memory is not None and memory.nbytes > self.memory.nbytes:
            self.memory = memory


class ParticleSorter:
    """Sorts windows one after the other, in memory of its own."""

    def __init__(self, planes: np.ndarray, domain: tuple[float, float], program: CpuProgram) -> None:
        """Prepare.

        Args:
            planes: Normals and offsets [cells], (W, 4).
            domain: How deep in a plane and how far from the origin [cells] a particle is lost.
            program: Whose threads share the copying.
        """
        self.record = np.zeros(1, SORTING_RECORD.dtype)
        self.plane = np.ascontiguousarray(planes, float)
        self.record["plane"], self.record["planes"] = self.plane.ctypes.data, len(planes)
        self.record["deepest"], self.record["farthest"] = domain
        memory = wp.array(ptr=self.record.ctypes.data, dtype=wp.uint64, shape=self.record.nbytes // 8, device="cpu")
        self.launches = [
            wp.launch(sort_particles, dim=1, inputs=[memory, min(k, SORT_COPY), 0, 0], device="cpu", record_cmd=True)
            for k in range(SORT_COPY + program.threads)
        ]
        self.share = program.share
        self.spare = {channels: SpareMemory(channels) for channels in (CHANNELS, HISTORY_CHANNELS, MAXWELL_CHANNELS)}

    def survey(self, window: SortableWindow) -> tuple[bool, float]:
        """See where a window's particles are.

        Returns:
            Whether one is lost, and which share of them is outside of the block it was sorted into.
        """
        self.old = np.ascontiguousarray(window.block[:, :5])
        self._point(part=window.part, history=window.history, branch=window.branch, old=self.old)
        record = self.record[0]
        record["olds"], record["flows"] = len(self.old), len(window.history) > 0
        record["origin"], record["relaxes"] = window.origin, len(window.branch) > 0
        self.launches[SORT_SURVEY].launch()
        return bool(record["lost"]), int(record["out_of_block"]) / window.count

    def arrange(self, window: SortableWindow, longest: int) -> bool:
        """Sort what was surveyed; False, and nothing done, where it spans too many blocks."""
        record = self.record[0]
        shift = record["low"] - 1
        dim = (record["high"] - shift + 2).astype(np.int32)
        if (dim >= longest).any():
            return False
        record["dim"], record["bins"] = dim, 64 * window.kinds
        lines, slots = int(np.prod(dim, dtype=np.int64)), 8 * len(window.part)
        scratch = {
            "line": np.empty(slots, np.int32),
            "inner": np.empty(slots, np.int32),
            "middle": np.empty(window.count, np.int32),
            "count": np.zeros(lines, np.int32),
            "edge": np.zeros(lines, np.int32),
            "bin": np.zeros(64 * window.kinds, np.int32),
        }
        self._point(**scratch)
        self.launches[COUNT].launch()
        blocks = int(record["blocks"])
        scratch["order"] = np.empty(record["slots"], np.int32)
        window.block = np.zeros((blocks, BLOCK_INTEGERS), np.int32)
        window.table = np.full(tuple(dim), -1, np.int32)
        where = np.empty((min(lines, 27 * blocks) + 1, 4), np.int32)
        self._point(order=scratch["order"], block=window.block, table=window.table, where=where)
        self.launches[RANK].launch()
        window.where = where[: record["pool"]].copy()
        window.dim, window.origin = dim, (window.origin + shift).astype(np.int32)
        self._copy(window)
        return True

    def _copy(self, window: SortableWindow) -> None:
        batches = int(self.record["slots"][0]) // 8
        part = self.spare[CHANNELS].rows(batches)
        history = self.spare[HISTORY_CHANNELS].rows(batches if len(window.history) else 0)
        branch = self.spare[MAXWELL_CHANNELS].rows(batches if len(window.branch) else 0)
        self._point(to=part, past_to=history, branch_to=branch)
        copies = self.launches[SORT_COPY:][: max(1, 8 * batches // MIN_PARTICLES_PER_READING_THREAD)]
        end = window.block[:, 1]
        cuts = np.searchsorted(end, np.linspace(0, end[-1], len(copies) + 1)[1:-1])
        for launch, (low, high) in zip(copies, pairwise([0, *cuts, len(end)]), strict=True):
            launch.set_param_at_index(2, int(low))
            launch.set_param_at_index(3, int(high))
        self.share(copies)
        for rows in (window.part, window.history, window.branch):
            self.spare[rows.shape[1]].keep(rows)
        window.part, window.history, window.branch = part, history, branch

    def _point(self, **arrays: np.ndarray) -> None:
        for name, array in arrays.items():
            self.record[name] = array.ctypes.data

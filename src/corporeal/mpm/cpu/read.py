"""Native reading of particles: spread into arrays, or added up by body."""

from itertools import pairwise

import numpy as np

from corporeal.mpm.cpu.layout import READING, RUNS, SUMS
from corporeal.mpm.cpu.program import OPTIONS, SMALLEST_PASS, Memory, Program, native
from corporeal.mpm.cpu.tables import Materials
from corporeal.mpm.cpu.window import Window
from corporeal.mpm.problem import Snapshot
from corporeal.mpm.warp_start import wp

wp.set_module_options(OPTIONS)


@wp.func_native(native("read"))
def read_native(memory: Memory, low: int, high: int): ...


@wp.kernel
def read(memory: Memory, low: int, high: int):
    read_native(memory, low, high)


class Reader:
    """Reads windows, one after the other."""

    def __init__(self, cell: float, program: Program) -> None:
        self.record = np.zeros(1, READING.dtype)
        self.record["dx"], self.record["runs"] = cell, RUNS
        memory = wp.array(
            ptr=self.record.ctypes.data,
            dtype=wp.uint64,
            shape=self.record.nbytes // 8,
            device="cpu",
        )
        self.launches = [
            wp.launch(read, dim=1, inputs=[memory, 0, 0], device="cpu", record_cmd=True)
            for _ in range(program.threads)
        ]
        self.share = program.share

    def spread(self, window: Window, material: Materials, into: Snapshot) -> None:
        """Write a window's particles into a snapshot of all particles of the problem, by number."""
        self._read(
            window,
            material,
            sum=None,
            owner=None,
            position=into.position,
            velocity=into.velocity,
            strain=into.deformation,
            motion=into.motion,
            plastic=into.plastic_strain,
        )

    def total(self, window: Window, material: Materials) -> np.ndarray:
        """Add up a field's bodies, (bodies, SUMS)."""
        owner = material.body - material.body[0]
        owners = int(owner.max()) + 1
        self.record["owners"] = owners
        sums = np.zeros((RUNS, owners, SUMS))
        self._read(window, material, sum=sums, owner=owner.astype(np.int32), position=None)
        total = sums.sum(axis=0)
        total[:, -1] = sums[:, :, -1].max(axis=0)
        return total

    def _read(self, window: Window, material: Materials, **arrays: np.ndarray | None) -> None:
        record = self.record
        arrays |= {"part": window.part, "material": material.table, "block": window.block}
        arrays["history"] = window.history if len(window.history) else None
        arrays["branch"] = window.branch if len(window.branch) else None
        for name, array in arrays.items():
            record[name] = 0 if array is None else array.ctypes.data
        record["origin"], record["blocks"] = window.origin, len(window.block)
        record["swells"] = material.swells
        hands = max(1, min(len(self.launches), window.count // SMALLEST_PASS))
        cuts = np.linspace(0, RUNS, hands + 1).astype(int).tolist()
        for launch, (low, high) in zip(self.launches, pairwise(cuts), strict=False):
            launch.set_param_at_index(1, low)
            launch.set_param_at_index(2, high)
        self.share(self.launches[:hands])

"""Native reading of particles: spread into arrays, or added up by body."""

from itertools import pairwise

import numpy as np
import warp as wp

from corporeal.mpm.kernels import OPTIONS, Memory, Program, native
from corporeal.mpm.tables import swells
from corporeal.mpm.window import Window

wp.set_module_options(OPTIONS)

_POINTERS = "part history material block owner position velocity strain motion plastic sum"
READING = np.dtype(
    [(name, "u8") for name in _POINTERS.split()]
    + [("dx", "f8"), ("origin", "i4", 3)]
    + [(name, "i4") for name in ("runs", "owners", "blocks", "swells")],
    align=True,
)
RUNS = 64
"""Runs of blocks that are added up on their own."""
SUMS = 12
"""Of a body: m x (3), m v (3), angular momentum about the origin (3), kinetic and elastic energy,
and the largest |v|²."""
SHARE = 4096
"""Particles below which a thread is not worth waking."""


@wp.func_native(native("read"))
def read_native(memory: Memory, low: int, high: int): ...


@wp.kernel
def read(memory: Memory, low: int, high: int):
    read_native(memory, low, high)


class Reader:
    """Reads windows, one after the other."""

    def __init__(self, cell: float, program: Program) -> None:
        self.record = np.zeros(1, READING)
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

    def spread(self, window: Window, material: np.ndarray, **arrays: np.ndarray) -> None:
        """Write position [m], velocity [m/s], F, whole motion and plastic strain into arrays.

        Args:
            window: Whose particles.
            material: The field's table of materials.
            arrays: ``position``, ``velocity``, ``strain``, ``motion`` and ``plastic`` of all
                particles of the problem, by number.

        """
        self._read(window, material, sum=None, owner=None, **arrays)

    def total(self, window: Window, material: np.ndarray, owner: np.ndarray) -> np.ndarray:
        """Add up by body, (owners, SUMS).

        Args:
            window: Whose particles.
            material: The field's table of materials.
            owner: Body of each row of it, from 0.

        """
        owners = int(owner.max()) + 1
        self.record["owners"] = owners
        sums = np.zeros((RUNS, owners, SUMS))
        self._read(window, material, sum=sums, owner=owner.astype(np.int32), position=None)
        total = sums.sum(axis=0)
        total[:, -1] = sums[:, :, -1].max(axis=0)
        return total

    def _read(self, window: Window, material: np.ndarray, **arrays: np.ndarray | None) -> None:
        record = self.record
        arrays |= {"part": window.part, "material": material, "block": window.block}
        arrays["history"] = window.history if len(window.history) else None
        for name, array in arrays.items():
            record[name] = 0 if array is None else array.ctypes.data
        record["origin"], record["blocks"] = window.origin, len(window.block)
        record["swells"] = swells(material)
        hands = max(1, min(len(self.launches), window.count // SHARE))
        cuts = np.linspace(0, RUNS, hands + 1).astype(int).tolist()
        for launch, (low, high) in zip(self.launches, pairwise(cuts), strict=False):
            launch.set_param_at_index(1, low)
            launch.set_param_at_index(2, high)
        self.share(self.launches[:hands])

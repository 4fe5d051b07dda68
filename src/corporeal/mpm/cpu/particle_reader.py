"""Native reading of particles into arrays, or sums by body."""

from itertools import pairwise

import numpy as np

from corporeal.mpm.cpu.field_window import FieldWindow
from corporeal.mpm.cpu.layout import BODY_SUMS, READING_RECORD, READING_RUNS
from corporeal.mpm.cpu.native_tables import FieldMaterials
from corporeal.mpm.cpu.program import (
    COMPILE_OPTIONS,
    MIN_PARTICLES_PER_READING_THREAD,
    CpuProgram,
    MemoryArray,
    native_source,
)
from corporeal.mpm.problem import Snapshot
from corporeal.mpm.quiet_warp import wp

wp.set_module_options(COMPILE_OPTIONS)


@wp.func_native(native_source("read"))
def read_particles_native(memory: MemoryArray, low: int, high: int): ...


@wp.kernel
def read_particles(memory: MemoryArray, low: int, high: int):
    read_particles_native(memory, low, high)


class ParticleReader:
    """Reads windows, one after the other."""

    def __init__(self, cell: float, program: CpuProgram) -> None:
        self.record = np.zeros(1, READING_RECORD.dtype)
        self.record["dx"], self.record["runs"] = cell, READING_RUNS
        memory = wp.array(ptr=self.record.ctypes.data, dtype=wp.uint64, shape=self.record.nbytes // 8, device="cpu")
        self.launches = [
            wp.launch(read_particles, dim=1, inputs=[memory, 0, 0], device="cpu", record_cmd=True)
            for _ in range(program.threads)
        ]
        self.share = program.share

    def spread(self, window: FieldWindow, material: FieldMaterials, into: Snapshot) -> None:
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

    def total(self, window: FieldWindow, material: FieldMaterials) -> np.ndarray:
        """Add up a field's bodies, (bodies, SUMS)."""
        owner = material.body - material.body[0]
        owners = int(owner.max()) + 1
        self.record["owners"] = owners
        sums = np.zeros((READING_RUNS, owners, BODY_SUMS))
        self._read(window, material, sum=sums, owner=owner.astype(np.int32), position=None)
        total = sums.sum(axis=0)
        total[:, -1] = sums[:, :, -1].max(axis=0)
        return total

    def _read(self, window: FieldWindow, material: FieldMaterials, **arrays: np.ndarray | None) -> None:
        record = self.record
        arrays |= {"part": window.part, "material": material.table, "block": window.block}
        arrays["history"] = window.history if len(window.history) else None
        arrays["branch"] = window.branch if len(window.branch) else None
        for name, array in arrays.items():
            record[name] = 0 if array is None else array.ctypes.data
        record["origin"], record["blocks"] = window.origin, len(window.block)
        record["uses_mean_dilatation"] = material.uses_mean_dilatation
        hands = max(1, min(len(self.launches), window.count // MIN_PARTICLES_PER_READING_THREAD))
        cuts = np.linspace(0, READING_RUNS, hands + 1).astype(int).tolist()
        for launch, (low, high) in zip(self.launches, pairwise(cuts), strict=False):
            launch.set_param_at_index(1, low)
            launch.set_param_at_index(2, high)
        self.share(self.launches[:hands])

"""The native pieces of the engine, compiled by Warp, and the memory layout they share.

Warp compiles C++ for the machine it runs on and keeps it in a cache; the pieces use vector
extensions, so they build on any processor. ``WORLD`` and ``FIELD`` mirror the structs in
``native/shared.cpp`` byte for byte.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path

import numpy as np
import warp as wp


def _start_quietly() -> None:
    """Start Warp without its word on stderr that there is no graphics card."""
    wp.config.log_level = wp.LOG_ERROR
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        wp.init()
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


_start_quietly()
wp.set_module_options(
    {"enable_backward": False, "cpu_compiler_flags": "-march=native -O3 -ffp-contract=fast"}
)

_POINTERS = "part node material table block where near point rigid surface"
_COUNTS = "blocks pool rigids points surfaces pushed"
FIELD = np.dtype(
    [(name, "u8") for name in _POINTERS.split()]
    + [("mass", "f8"), ("origin", "i4", 3), ("dim", "i4", 3)]
    + [(name, "i4") for name in _COUNTS.split()],
    align=True,
)
_POINTERS = (
    "field task contact_memory list order report plane friction restitution ledger pair_memory "
    "near_memory plane_impulse pair_impulse friction_loss first_contact last_contact contact_point "
    "face blow bond"
)
_COUNTS = (
    "fields planes tasks contacts pairs nears most_contacts most_pairs most_nears full names again "
    "blows bonds"
)
WORLD = np.dtype(
    [(name, "u8") for name in _POINTERS.split()]
    + [("dx", "f8"), ("dt", "f8"), ("time", "f8"), ("kick", "f8", 3)]
    + [(name, "i4") for name in _COUNTS.split()],
    align=True,
)
_POINTERS = "area point rigid impulse signal face"
_NUMBERS = "gust start end half_rho_c work"
BLOW = np.dtype(
    [(name, "u8") for name in _POINTERS.split()]
    + [("wind", "f8", 3)]
    + [(name, "f8") for name in _NUMBERS.split()]
    + [(name, "i4") for name in "field first count free".split()],
    align=True,
)
BOND = np.dtype(
    [(name, "u8") for name in ("slot", "mass")]
    + [(name, "f8") for name in ("per_stiff", "per_soft")]
    + [(name, "i4") for name in ("frame", "soft", "count")],
    align=True,
)

PLACE = 22
"""Places are fixed point: 2**PLACE units per cell."""
XI, VE, AF, DE, ST, MA, VO, EP, VC, MT, ID, TM = 0, 3, 6, 15, 24, 30, 31, 32, 33, 34, 35, 36
"""First channels of a particle's place (3), velocity (3), affine part (9), F - 1 (9), stress (6),
mass, volume, plastic strain, volume correction, material, number, and whole motion - 1 (9)."""
NC = 45
"""Channels of a particle."""
MATERIAL = 16
"""Columns of the table of materials."""
BLOCK = 32
"""Integers of a block's record."""
REPORT = 8
SMALLEST_SHARE = 2000
"""Particles or nodes below which a thread is not worth waking."""
SPEED2, WAVE2, PLASTIC, VISCOUS, ASTRAY, WORK = range(6)
"""Columns of a task's report."""

_NATIVE = Path(__file__).parent / "native"


def _native(*names: str) -> str:
    return "\n".join((_NATIVE / f"{part}.cpp").read_text() for part in ("shared", *names))


Memory = wp.array(dtype=wp.uint64)


@wp.func_native(_native("clear"))
def clear_native(memory: Memory, index: int): ...


@wp.func_native(_native("scatter"))
def scatter_native(memory: Memory, index: int): ...


@wp.func_native(_native("blow"))
def blow_native(memory: Memory, index: int): ...


@wp.func_native(_native("forces"))
def forces_native(memory: Memory, index: int): ...


@wp.func_native(_native("gather"))
def gather_native(memory: Memory, index: int): ...


@wp.func_native(_native("bond", "contact"))
def contact_native(memory: Memory, index: int): ...


@wp.kernel
def clear(memory: Memory, first: int):
    clear_native(memory, first + wp.tid())


@wp.kernel
def scatter(memory: Memory, first: int):
    scatter_native(memory, first + wp.tid())


@wp.kernel
def blow(memory: Memory, first: int):
    blow_native(memory, first + wp.tid())


@wp.kernel
def forces(memory: Memory, first: int):
    forces_native(memory, first + wp.tid())


@wp.kernel
def gather(memory: Memory, first: int):
    gather_native(memory, first + wp.tid())


@wp.kernel
def contact(memory: Memory, first: int):
    contact_native(memory, first + wp.tid())


MEET, TOUCH, CLOSE = 704, 448, 304
"""Bytes of a node where fields meet, of a possible contact, and of a particle near it."""


class Program:
    """The launches of one step, recorded once; phases with many tasks are shared among threads.

    Warp runs a kernel on one thread and lets go of Python's lock meanwhile. Tasks of one phase
    never write to the same place, so the result does not depend on the number of threads.
    """

    def __init__(self, world: np.ndarray, threads: int) -> None:
        self.memory = wp.array(
            ptr=world.ctypes.data, dtype=wp.uint64, shape=world.nbytes // 8, device="cpu"
        )
        self.pool = ThreadPoolExecutor(threads) if threads > 1 else None
        self.threads = threads
        self.smallest_share = SMALLEST_SHARE
        self.contact = self._record(contact, 0, 1)

    def divide(
        self, even: np.ndarray, odd: np.ndarray, nodes: np.ndarray, blown: np.ndarray
    ) -> None:
        """Record one step.

        Args:
            even: How much work each task on particles of even planes is.
            odd: The same of odd planes.
            nodes: The same of the tasks on nodes.
            blown: The same of loads on the particles of each field; empty: there are none.

        """
        both = np.concatenate([even, odd])
        self.before = [
            self._phase(clear, 0, nodes),
            self._phase(scatter, 0, even),
            self._phase(scatter, len(even), odd),
            self._phase(blow, 0, blown),
            self._phase(forces, 0, nodes),
        ]
        self.after = [self._phase(gather, 0, both)]

    def _phase(self, kernel: wp.Kernel, first: int, work: np.ndarray) -> list[wp.Launch]:
        """Cut a run of tasks into one part per thread, of nearly equal work."""
        if len(work) == 0:
            return []
        total = np.cumsum(work)
        threads = self.threads if total[-1] > self.smallest_share * self.threads else 1
        cuts = np.searchsorted(total, total[-1] * np.arange(1, threads) / threads)
        cuts = np.unique([0, *cuts.tolist(), len(work)])
        return [
            self._record(kernel, first + int(low), int(high - low)) for low, high in pairwise(cuts)
        ]

    def _record(self, kernel: wp.Kernel, first: int, count: int) -> wp.Launch:
        return wp.launch(
            kernel, dim=count, inputs=[self.memory, first], device="cpu", record_cmd=True
        )

    def run(self, phases: list[list[wp.Launch]]) -> None:
        """Run phases one after the other, the parts of each at once."""
        for parts in phases:
            if self.pool is None or len(parts) < 2:
                for part in parts:
                    part.launch()
            else:
                others = [self.pool.submit(part.launch) for part in parts[1:]]
                parts[0].launch()
                for other in others:
                    other.result()

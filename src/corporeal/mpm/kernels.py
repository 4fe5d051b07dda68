"""The native pieces of the engine, compiled by Warp, and the memory layout they share.

Warp compiles C++ for the machine it runs on and keeps it in a cache; the pieces use vector
extensions, so they build on any processor. ``WORLD`` and ``FIELD`` mirror the structs in
``native/shared.cpp`` byte for byte.
"""

from pathlib import Path

import numpy as np
import warp as wp

wp.config.log_level = wp.LOG_ERROR
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
    "near_memory plane_impulse pair_impulse friction_loss first_contact last_contact contact_point"
)
_COUNTS = (
    "fields planes tasks contacts pairs nears most_contacts most_pairs most_nears full names again"
)
WORLD = np.dtype(
    [(name, "u8") for name in _POINTERS.split()]
    + [("dx", "f8"), ("dt", "f8"), ("time", "f8"), ("kick", "f8", 3)]
    + [(name, "i4") for name in _COUNTS.split()],
    align=True,
)

PLACE = 22
"""Places are fixed point: 2**PLACE units per cell."""
XI, VE, AF, DE, ST, MA, VO, EP, VC, MT, ID, TM, NC = 0, 3, 6, 15, 24, 30, 31, 32, 33, 34, 35, 36, 45
"""Channels of a particle: place, velocity, affine part, F - 1, stress, mass, volume, plastic strain,
volume correction, material, number, whole motion - 1; and how many channels there are."""
MATERIAL = 16
"""Columns of the table of materials."""
BLOCK = 32
"""Integers of a block's record."""
REPORT = 8
SPEED2, WAVE2, PLASTIC, VISCOUS, ASTRAY, WORK = range(6)
"""Columns of a task's report."""

_NATIVE = Path(__file__).parent / "native"


def _native(name: str) -> str:
    return "\n".join((_NATIVE / f"{part}.cpp").read_text() for part in ("shared", name))


Memory = wp.array(dtype=wp.uint64)


@wp.func_native(_native("clear"))
def clear_native(memory: Memory, index: int): ...


@wp.func_native(_native("scatter"))
def scatter_native(memory: Memory, index: int): ...


@wp.func_native(_native("forces"))
def forces_native(memory: Memory, index: int): ...


@wp.func_native(_native("gather"))
def gather_native(memory: Memory, index: int): ...


@wp.func_native(_native("contact"))
def contact_native(memory: Memory, index: int): ...


@wp.kernel
def clear(memory: Memory, first: int):
    clear_native(memory, first + wp.tid())


@wp.kernel
def scatter(memory: Memory, first: int):
    scatter_native(memory, first + wp.tid())


@wp.kernel
def forces(memory: Memory, first: int):
    forces_native(memory, first + wp.tid())


@wp.kernel
def gather(memory: Memory, first: int):
    gather_native(memory, first + wp.tid())


@wp.kernel
def contact(memory: Memory, first: int):
    contact_native(memory, first + wp.tid())


MEET, TOUCH, CLOSE = 704, 448, 96
"""Bytes of a node where fields meet, of a possible contact, and of a particle near it."""


class Program:
    """The launches of one step, recorded once."""

    def __init__(self, world: np.ndarray) -> None:
        self.memory = wp.array(
            ptr=world.ctypes.data, dtype=wp.uint64, shape=world.nbytes // 8, device="cpu"
        )
        self.world = world
        self.divide(0, 0, 0)

    def divide(self, even: int, odd: int, nodes: int) -> None:
        """Record one step with so many tasks on particles of even and odd planes and on nodes."""
        self.before = self._record(
            [(clear, 0, nodes), (scatter, 0, even), (scatter, even, odd), (forces, 0, nodes)]
        )
        self.contact = self._record([(contact, 0, 1)])[0]
        self.after = self._record([(gather, 0, even + odd)])

    def _record(self, plan: list) -> list:
        return [
            wp.launch(
                kernel, dim=count, inputs=[self.memory, first], device="cpu", record_cmd=True
            )
            for kernel, first, count in plan
            if count
        ]

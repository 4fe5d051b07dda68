"""Native code of the engine, compiled by Warp.

Warp compiles C++ for the machine it runs on and keeps it in a cache; the pieces use vector extensions, so they build on
any processor. What they share with Python is in ``layout``.

A step is a list of phases, ``SCHEDULE``; a phase is a number of tasks of one piece, which any thread may take in any
order. A new one needs four parts: ``loops/NAME.cpp``, which does task ``index`` and returns; a stub ``NAME_native``; a
number and a branch in ``run_tasks``; a ``Phase``. How many tasks it has may be known only at run time: then it is an
int in ``WORLD_RECORD``, which an earlier phase wrote. Tasks of one phase must not write to the same place, or what is
written must not depend on their order. A piece ends the steps through ``World.full`` (a list was too short: Python
lengthens it and goes on at the phase marked ``resume``, with ``World.again`` set) or ``World.stop``.

Before ``PIECE_FORCES`` nodes hold mass, momentum and force: loads add to the force, so that affine FLIP sees them.
After it they hold mass, velocity and the velocity as it was.
"""

import ctypes
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np

from corporeal.mpm.cpu import layout
from corporeal.mpm.cpu.layout import COLOURS, MAX_THREADS, THREAD_POOL_RECORD, WORLD_RECORD
from corporeal.mpm.formulas import formula_options
from corporeal.mpm.quiet_warp import wp

COMPILE_OPTIONS = formula_options(cpu_compiler_flags="-march=native -O3 -ffp-contract=fast")
wp.set_module_options(COMPILE_OPTIONS)

MIN_PARTICLES_PER_THREAD = 500
"""Particles below which a thread is not worth waking …"""
MIN_PARTICLES_PER_READING_THREAD = 4096
"""… and where they are only read or copied, once."""

(PIECE_LAY, PIECE_MOVE, PIECE_TIMESTEP, PIECE_CLEAR, PIECE_WIND, PIECE_SPRING, PIECE_FORCES, PIECE_CONTACT) = range(8)
"""Numbers of the pieces; those of contact follow from the last."""
(
    PIECE_START,
    PIECE_MARK,
    PIECE_FIND,
    PIECE_STAND,
    PIECE_LIST,
    PIECE_LOOK,
    PIECE_SPREAD,
    PIECE_FACE,
    PIECE_REACH,
    PIECE_CHOOSE,
    PIECE_SOLVE,
    PIECE_RESOLVE,
) = range(PIECE_CONTACT, PIECE_CONTACT + 12)
CONTACT_PIECES = "start mark find stand list look spread face reach choose solve resolve"
"""Pieces of contact: ``loops/contact_NAME.cpp``."""
PIECE_SHELL = PIECE_CONTACT + len(CONTACT_PIECES.split())
"""The first of the pieces of shells, see ``layout.SHELL_PLACES``."""
SHELL_PIECES = "places hinges triangles corners vertices"
PIECE_NAMES = [
    *"lay move timestep clear wind spring forces".split(),
    *CONTACT_PIECES.split(),
    *(f"shell {name}" for name in SHELL_PIECES.split()),
]
"""Of all pieces, by number."""


class Phase(NamedTuple):
    """One phase of a step."""

    piece: int
    count: str | int = 1
    """How many tasks; or the field of ``WORLD_RECORD`` that holds it when the phase begins; 0 skips it."""
    which: int = 0
    """Place in it, where it is an array."""
    resume: bool = False
    """Steps go on here after a list was too short and has been lengthened (``World.full``)."""


SCHEDULE = (
    Phase(PIECE_TIMESTEP),
    Phase(PIECE_SHELL + layout.SHELL_PLACES, "shelled"),
    Phase(PIECE_SHELL + layout.SHELL_HINGES, "shell_hinges"),
    Phase(PIECE_SHELL + layout.SHELL_TRIANGLES, "shell_triangles"),
    Phase(PIECE_SHELL + layout.SHELL_CORNERS, "shell_triangles"),
    Phase(PIECE_SHELL + layout.SHELL_VERTICES, "shell_vertices"),
    Phase(PIECE_CLEAR, "bare_nodes"),
    *(Phase(PIECE_LAY, "bare", colour) for colour in range(COLOURS)),
    Phase(PIECE_WIND, "wind_tasks"),
    Phase(PIECE_SPRING, "sprung"),
    Phase(PIECE_FORCES, "nodes"),
    Phase(PIECE_START, "rigids"),
    Phase(PIECE_MARK, "rigids"),
    Phase(PIECE_FIND, resume=True),
    Phase(PIECE_STAND, "stands"),
    Phase(PIECE_LIST, "parts"),
    *(Phase(PIECE_LOOK, "looks", colour) for colour in range(COLOURS)),
    *(Phase(PIECE_SPREAD, "spreads", colour) for colour in range(COLOURS)),
    Phase(PIECE_FACE, "parts"),
    *(Phase(PIECE_REACH, "reaches", colour) for colour in range(COLOURS)),
    Phase(PIECE_REACH, "turns"),
    Phase(PIECE_CHOOSE, "parts"),
    Phase(PIECE_SOLVE, "parts"),
    Phase(PIECE_RESOLVE),
    *(Phase(PIECE_MOVE, "colour", colour) for colour in range(COLOURS)),
)
"""A step. Particles lay the nodes of the next step when they move, so laying is skipped unless the nodes are bare: at
the start, after a sort, and while a push acts; and in fields with shells, whose forces lie down with their vertices."""

_LOOPS = Path(__file__).parent / "loops"


_RECORDS_BEFORE_PIECE = {
    "shared": layout.STEP_RECORDS,
    "contact_shared": layout.CONTACT_RECORDS,
    "sort": (layout.SORTING_RECORD,),
    "read": (layout.READING_RECORD,),
}
"""Structs that stand in front of a file."""


def native_source(*names: str) -> str:
    """Source of a piece: the layout's numbers, what all share, then its own files."""
    return "\n".join([layout.cpp_layout_numbers(), *(_piece_source(part) for part in ("shared", *names))])


def _piece_source(part: str) -> str:
    records = "".join(record.text for record in _RECORDS_BEFORE_PIECE.get(part, ()))
    return records + (_LOOPS / f"{part}.cpp").read_text()


MemoryArray = wp.array(dtype=wp.uint64)


@wp.func_native(native_source("step_loop"))
def step_loop_native(memory: MemoryArray, thread: int) -> int: ...


@wp.func_native(native_source("timestep"))
def timestep_native(memory: MemoryArray, index: int): ...


@wp.func_native(native_source("clear"))
def clear_native(memory: MemoryArray, index: int): ...


@wp.func_native(native_source("node_impulses", "wind"))
def wind_native(memory: MemoryArray, index: int): ...


@wp.func_native(native_source("node_impulses", "springs"))
def springs_native(memory: MemoryArray, index: int): ...


@wp.func_native(native_source("forces"))
def forces_native(memory: MemoryArray, index: int): ...


@wp.func_native(native_source("gather", "scatter", "transfer"))
def transfer_native(memory: MemoryArray, index: int): ...


def _contact_source() -> str:
    """Text of all pieces of contact: what they share, then one branch for each."""
    shared = ("contact_shared", "contact_points", "contact_begins", "contact_lines")
    text = [native_source("rigid_inclusions", *shared)]
    for number, name in enumerate(CONTACT_PIECES.split()):
        piece = _piece_source(f"contact_{name}")
        text.append(f"if (piece == {number}) {{\n{piece}}}")
    return "\n".join(text)


@wp.func_native(_contact_source())
def contact_native(memory: MemoryArray, piece: int, index: int): ...


@wp.func_native(native_source("shells"))
def shells_native(memory: MemoryArray, piece: int, index: int): ...


@wp.kernel
def run_tasks(memory: MemoryArray, thread: int):
    order = step_loop_native(memory, thread)
    while order >= 0:
        piece = order >> 24
        task = order & 0xFFFFFF
        if piece <= PIECE_MOVE:
            transfer_native(memory, 2 * task + 1 - piece)
        elif piece == PIECE_TIMESTEP:
            timestep_native(memory, task)
        elif piece == PIECE_CLEAR:
            clear_native(memory, task)
        elif piece == PIECE_WIND:
            wind_native(memory, task)
        elif piece == PIECE_SPRING:
            springs_native(memory, task)
        elif piece == PIECE_FORCES:
            forces_native(memory, task)
        elif piece >= PIECE_SHELL:
            shells_native(memory, piece - PIECE_SHELL, task)
        elif piece >= PIECE_CONTACT:
            contact_native(memory, piece - PIECE_CONTACT, task)
        order = step_loop_native(memory, thread)


class CpuProgram:
    """Runs steps on several threads without coming back to Python in between.

    Each thread runs one Warp kernel, which lets go of Python's lock, and takes tasks until the steps end. Tasks of one
    phase never write to the same place and phases follow one another in a fixed order, so the result does not depend on
    the number of threads.
    """

    def __init__(self, world: np.ndarray, threads: int) -> None:
        self.world = world
        memory = wp.array(ptr=world.ctypes.data, dtype=wp.uint64, shape=world.nbytes // 8, device="cpu")
        self.threads = min(threads, MAX_THREADS)
        self.thread_pool = aligned_zeros((1,), THREAD_POOL_RECORD.dtype)
        self.phase = np.zeros((len(SCHEDULE), 4), np.int32)
        for row, phase in zip(self.phase, SCHEDULE, strict=True):
            named = isinstance(phase.count, str)
            row[0], row[2] = phase.piece, -1 if named else phase.count
            row[3] = WORLD_RECORD.dtype.fields[phase.count][1] + 4 * phase.which if named else 0
        self.resume = next(i for i, phase in enumerate(SCHEDULE) if phase.resume)
        self.thread_pool["phase"] = self.phase.ctypes.data
        self.thread_pool["phases"] = len(SCHEDULE)
        self.thread_pool["yield_core"] = _yield_address()
        world["thread_pool"] = self.thread_pool.ctypes.data
        self.executor = ThreadPoolExecutor(self.threads) if self.threads > 1 else None
        self.launches = [
            wp.launch(run_tasks, dim=1, inputs=[memory, thread], device="cpu", record_cmd=True)
            for thread in range(self.threads)
        ]
        self.smallest_share = MIN_PARTICLES_PER_THREAD

    def employ(self, particles: Iterable[int]) -> int:
        """Choose how many threads share the particles of some fields."""
        self.hands = max(1, min(self.threads, sum(particles) // self.smallest_share))
        return self.hands

    def divide(self, first: list[int], chores: int) -> None:
        """Return where each colour's chores begin, and how many there are."""
        for row, phase in zip(self.phase, SCHEDULE, strict=True):
            if phase.count in ("bare", "colour", "looks", "spreads", "reaches"):
                row[1] = first[phase.which]
            elif phase.count == "turns":
                row[1] = chores

    def run(self, resume: bool = False) -> None:
        """Step until a piece says stop, or that a list is full."""
        pool = self.thread_pool
        pool["now"] = self.resume - 1 if resume else len(SCHEDULE) - 1
        pool["threads"], pool["started"], pool["stopped"] = self.hands, 0, 0
        pool["post"] = 0
        self.world["stop"] = self.world["full"] = 0
        self.share(self.launches[: self.hands])

    def share(self, launches: list[wp.Launch]) -> None:
        """Run launches at once, one on each thread."""
        others = launches[1:] if self.executor else []
        running = [self.executor.submit(other.launch) for other in others]
        launches[0].launch()
        for other in running:
            other.result()


def aligned_zeros(shape: tuple[int, ...], dtype: np.dtype | type) -> np.ndarray:
    """Zeros that begin on a cache line."""
    return array_in_bytes(np.zeros(cache_line_bytes(shape, dtype), np.uint8), shape, dtype)


def cache_line_bytes(shape: tuple[int, ...], dtype: np.dtype | type) -> int:
    """Bytes in which an array that begins on a cache line finds room."""
    return int(np.prod(shape)) * np.dtype(dtype).itemsize + 64


def array_in_bytes(memory: np.ndarray, shape: tuple[int, ...], dtype: np.dtype | type) -> np.ndarray:
    """Lay an array that begins on a cache line into bytes; its ``base`` are these bytes."""
    start, size = -memory.ctypes.data % 64, cache_line_bytes(shape, dtype) - 64
    return memory[start : start + size].view(dtype).reshape(shape)


def _yield_address() -> int:
    """Address of the system's call that offers a core to others; 0 where there is none."""
    try:
        return ctypes.cast(ctypes.CDLL(None).sched_yield, ctypes.c_void_p).value or 0
    except (AttributeError, OSError, TypeError):
        return 0

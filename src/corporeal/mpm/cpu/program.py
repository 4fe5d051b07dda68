"""The native pieces of the engine, compiled by Warp, and the memory layout they share.

Warp compiles C++ for the machine it runs on and keeps it in a cache; the pieces use vector
extensions, so they build on any processor. What they share with Python stands in ``layout``.

A step is a list of phases, ``SCHEDULE``; a phase is a number of tasks of one piece, which any
thread may take in any order. A new one needs four things: ``loops/NAME.cpp``, which does task
``index`` and returns; a stub ``NAME_native``; a number and a branch in ``work``; a ``Phase``. How
many tasks it has may be known only at run time: then it is an int in ``WORLD``, which an earlier
phase wrote. Tasks of one phase must not write to the same place, or what is written must not depend
on their order. A piece ends the steps through ``World.full`` (a list was too short: Python
lengthens it and goes on at the phase marked ``resume``, with ``World.again`` set) or
``World.stop``.

Before ``FORCES`` nodes hold mass, momentum and force: loads add to the force, so that affine FLIP
sees them. After it they hold mass, velocity and the velocity as it was.
"""

import ctypes
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np

from corporeal.mpm.cpu import layout
from corporeal.mpm.cpu.layout import COLOURS, MOST_THREADS, THREAD_POOL, WORLD
from corporeal.mpm.formulas import options
from corporeal.mpm.warp_start import wp

OPTIONS = options(cpu_compiler_flags="-march=native -O3 -ffp-contract=fast")
wp.set_module_options(OPTIONS)

SMALLEST_SHARE = 500
"""Particles below which a thread is not worth waking …"""
SMALLEST_PASS = 4096
"""… and where they are only read or copied, once."""

LAY, MOVE, PACE, CLEAR, BLOW_ON, SPRING, FORCES, CONTACT = range(8)
"""Numbers of the pieces; those of contact follow from the last."""
START, MARK, FIND, STAND, LIST, LOOK, FACE, REACH, CHOOSE, SOLVE, RESOLVE = range(
    CONTACT, CONTACT + 11
)
TOUCHING = "start mark find stand list look face reach choose solve resolve"
"""Pieces of contact: ``loops/contact_NAME.cpp``."""
NAMES = [*"lay move pace clear blow spring forces".split(), *TOUCHING.split()]
"""Of all pieces, by number."""


class Phase(NamedTuple):
    """One phase of a step."""

    piece: int
    count: str | int = 1
    """How many tasks; or where in ``WORLD`` that stands when the phase begins; 0 skips it."""
    which: int = 0
    """Place in it, where it is an array."""
    resume: bool = False
    """Steps go on here after a list was too short and has been lengthened (``World.full``)."""


SCHEDULE = (
    Phase(PACE),
    Phase(CLEAR, "bare_nodes"),
    *(Phase(LAY, "bare", colour) for colour in range(COLOURS)),
    Phase(BLOW_ON, "blown"),
    Phase(SPRING, "sprung"),
    Phase(FORCES, "nodes"),
    Phase(START, "rigids"),
    Phase(MARK, "rigids"),
    Phase(FIND, resume=True),
    Phase(STAND, "stands"),
    Phase(LIST, "parts"),
    *(Phase(LOOK, "looks", colour) for colour in range(COLOURS)),
    Phase(FACE, "parts"),
    *(Phase(REACH, "reaches", colour) for colour in range(COLOURS)),
    Phase(REACH, "turns"),
    Phase(CHOOSE, "parts"),
    Phase(SOLVE, "parts"),
    Phase(RESOLVE),
    *(Phase(MOVE, "colour", colour) for colour in range(COLOURS)),
)
"""A step. Particles lay the nodes of the next step when they move, so laying is skipped unless the
nodes are bare: at the start, after a sort, and while a push acts."""

_LOOPS = Path(__file__).parent / "loops"


_RECORDS = {
    "shared": layout.STEP,
    "contact_shared": layout.CONTACT,
    "sort": (layout.SORTING,),
    "read": (layout.READING,),
}
"""Structs that stand in front of a file."""


def native(*names: str) -> str:
    """Source of a piece: the layout's numbers, what all share, then its own files."""
    return "\n".join([layout.numbers(), *(_text(part) for part in ("shared", *names))])


def _text(part: str) -> str:
    records = "".join(record.text for record in _RECORDS.get(part, ()))
    return records + (_LOOPS / f"{part}.cpp").read_text()


Memory = wp.array(dtype=wp.uint64)


@wp.func_native(native("conduct"))
def conduct_native(memory: Memory, thread: int) -> int: ...


@wp.func_native(native("pace"))
def pace_native(memory: Memory, index: int): ...


@wp.func_native(native("clear"))
def clear_native(memory: Memory, index: int): ...


@wp.func_native(native("hand", "blow"))
def blow_native(memory: Memory, index: int): ...


@wp.func_native(native("hand", "springs"))
def springs_native(memory: Memory, index: int): ...


@wp.func_native(native("forces"))
def forces_native(memory: Memory, index: int): ...


@wp.func_native(native("gather", "scatter", "transfer"))
def transfer_native(memory: Memory, index: int): ...


def _contact() -> str:
    """Text of all pieces of contact: what they share, then one branch for each."""
    shared = ("contact_shared", "contact_points", "contact_begins", "contact_lines")
    text = [native("bond", *shared)]
    for number, name in enumerate(TOUCHING.split()):
        piece = _text(f"contact_{name}")
        text.append(f"if (piece == {number}) {{\n{piece}}}")
    return "\n".join(text)


@wp.func_native(_contact())
def contact_native(memory: Memory, piece: int, index: int): ...


@wp.kernel
def work(memory: Memory, thread: int):
    order = conduct_native(memory, thread)
    while order >= 0:
        piece = order >> 24
        task = order & 0xFFFFFF
        if piece <= MOVE:
            transfer_native(memory, 2 * task + 1 - piece)
        elif piece == PACE:
            pace_native(memory, task)
        elif piece == CLEAR:
            clear_native(memory, task)
        elif piece == BLOW_ON:
            blow_native(memory, task)
        elif piece == SPRING:
            springs_native(memory, task)
        elif piece == FORCES:
            forces_native(memory, task)
        elif piece >= CONTACT:
            contact_native(memory, piece - CONTACT, task)
        order = conduct_native(memory, thread)


class Program:
    """Runs steps on several threads without coming back to Python in between.

    Each thread runs one Warp kernel, which lets go of Python's lock, and takes tasks until the
    steps end. Tasks of one phase never write to the same place and phases follow one another in a
    fixed order, so the result does not depend on the number of threads.
    """

    def __init__(self, world: np.ndarray, threads: int) -> None:
        self.world = world
        memory = wp.array(
            ptr=world.ctypes.data, dtype=wp.uint64, shape=world.nbytes // 8, device="cpu"
        )
        self.threads = min(threads, MOST_THREADS)
        self.thread_pool = aligned((1,), THREAD_POOL.dtype)
        self.phase = np.zeros((len(SCHEDULE), 4), np.int32)
        for row, phase in zip(self.phase, SCHEDULE, strict=True):
            named = isinstance(phase.count, str)
            row[0], row[2] = phase.piece, -1 if named else phase.count
            row[3] = WORLD.dtype.fields[phase.count][1] + 4 * phase.which if named else 0
        self.resume = next(i for i, phase in enumerate(SCHEDULE) if phase.resume)
        self.thread_pool["phase"] = self.phase.ctypes.data
        self.thread_pool["phases"] = len(SCHEDULE)
        self.thread_pool["yield_core"] = _yield_address()
        world["thread_pool"] = self.thread_pool.ctypes.data
        self.executor = ThreadPoolExecutor(self.threads) if self.threads > 1 else None
        self.launches = [
            wp.launch(work, dim=1, inputs=[memory, thread], device="cpu", record_cmd=True)
            for thread in range(self.threads)
        ]
        self.smallest_share = SMALLEST_SHARE

    def employ(self, particles: Iterable[int]) -> int:
        """Choose how many threads share the particles of some fields."""
        self.hands = max(1, min(self.threads, sum(particles) // self.smallest_share))
        return self.hands

    def divide(self, first: list[int], chores: int) -> None:
        """Say where each colour's chores begin, and how many there are."""
        for row, phase in zip(self.phase, SCHEDULE, strict=True):
            if phase.count in ("bare", "colour", "looks", "reaches"):
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


def aligned(shape: tuple[int, ...], dtype: np.dtype | type) -> np.ndarray:
    """Zeros that begin on a cache line."""
    return within(np.zeros(on_lines(shape, dtype), np.uint8), shape, dtype)


def on_lines(shape: tuple[int, ...], dtype: np.dtype | type) -> int:
    """Bytes in which an array that begins on a cache line finds room."""
    return int(np.prod(shape)) * np.dtype(dtype).itemsize + 64


def within(memory: np.ndarray, shape: tuple[int, ...], dtype: np.dtype | type) -> np.ndarray:
    """Lay an array that begins on a cache line into bytes; its ``base`` are these bytes."""
    start, size = -memory.ctypes.data % 64, on_lines(shape, dtype) - 64
    return memory[start : start + size].view(dtype).reshape(shape)


def _yield_address() -> int:
    """Address of the system's call that offers a core to others; 0 where there is none."""
    try:
        return ctypes.cast(ctypes.CDLL(None).sched_yield, ctypes.c_void_p).value or 0
    except (AttributeError, OSError, TypeError):
        return 0

"""The native pieces of the engine, compiled by Warp, and the memory layout they share.

Warp compiles C++ for the machine it runs on and keeps it in a cache; the pieces use vector
extensions, so they build on any processor. ``WORLD``, ``FIELD`` and the like mirror the structs in
``native/shared.cpp`` byte for byte.

A step is a list of phases, ``SCHEDULE``; a phase is a number of tasks of one piece, which any
thread may take in any order. A new one needs four things: ``native/NAME.cpp``, which does task
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
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

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
OPTIONS = {
    "enable_backward": False,
    "cpu_compiler_flags": "-march=native -O3 -ffp-contract=fast",
}
wp.set_module_options(OPTIONS)

_POINTERS = (
    "part node next history material table block where used near home box have point rigid surface "
    "clump"
)
_COUNTS = "blocks pool rigids points surfaces pushed swells flows"
FIELD = np.dtype(
    [(name, "u8") for name in _POINTERS.split()]
    + [("mass", "f8"), ("slowing", "f8"), ("origin", "i4", 3), ("dim", "i4", 3)]
    + [(name, "i4") for name in _COUNTS.split()]
    + [("floor", "i4"), ("level", "f4", 3), ("side", "i4"), ("clumps", "i4")],
    align=True,
)
_POINTERS = (
    "crew clock field task list contact_memory report plane friction restitution plane_impulse "
    "pair_impulse friction_loss first_contact last_contact contact_point face blow bond tether "
    "joint grip"
)
_COUNTS = (
    "fields planes tasks full names again blows blown bonds tethers joints grips sprung stop nodes"
)
COLOURS = 8
"""Tasks on particles are pieces of columns of blocks. Those of one colour, the parities of their x,
y and number in the column, never overlap."""
WORLD = np.dtype(
    [(name, "u8") for name in _POINTERS.split()]
    + [("dx", "f8"), ("dt", "f8"), ("time", "f8"), ("kick", "f8", 3)]
    + [(name, "i4") for name in _COUNTS.split()]
    + [("colour", "i4", COLOURS), ("bare_nodes", "i4"), ("bare", "i4", COLOURS)]
    + [
        ("stands", "i4"),
        ("parts", "i4"),
        ("looks", "i4", COLOURS),
        ("rigids", "i4"),
        ("turns", "i4"),
    ],
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
    [(name, "u8") for name in ("slot", "mass", "volume", "point")]
    + [("per_soft", "f8")]
    + [(name, "i4") for name in ("frame", "soft", "points", "count")],
    align=True,
)
TETHER = np.dtype(
    [(name, "u8") for name in ("anchor", "rate", "holder")]
    + [(name, "f8") for name in ("damping", "lost")]
    + [(name, "i4") for name in ("field", "first", "count")],
    align=True,
)
JOINT = np.dtype(
    [(name, "u8") for name in ("first", "second")]
    + [(name, "f8", 3) for name in ("arm_first", "arm_second")]
    + [(name, "f8") for name in ("stiffness", "damping", "lost")],
    align=True,
)
GRIP = np.dtype(
    [(name, "u8") for name in ("share", "rigid", "impulse")]
    + [(name, "f8", 3) for name in ("arm", "target")]
    + [(name, "f8") for name in ("stiffness", "damping", "mass", "work")]
    + [(name, "i4") for name in ("field", "first", "count")],
    align=True,
)
THING = np.dtype(
    [("mass", "f8"), ("push", "f8", 3), ("start", "f8"), ("end", "f8"), ("rigid", "u8")]
    + [(name, "i4") for name in ("field", "first", "last", "spare")]
)
CLOCK = np.dtype(
    [(name, "u8") for name in ("thing", "external_impulse", "push_work")]
    + [(name, "f8") for name in "until given stable speed wave smallest largest".split()]
    + [("gravity", "f8", 3)]
    + [(name, "f8") for name in "ramp courant rigid_courant fall".split()]
    + [("count", "i8"), ("budget", "i8")]
    + [(n, "i4") for n in "things started last laid fuse fused pushed spare".split()]
)
CREW = np.dtype(
    [("nap", "u8"), ("phase", "u8")]
    + [(n, "i4") for n in "phases threads now piece first count started spare".split()]
    + [("fill0", "u8", 2), ("epoch", "i4"), ("stopped", "i4"), ("fill1", "u8", 7)]
    + [("done", "i4"), ("spare2", "i4"), ("fill2", "u8", 7), ("post", "u8", (64, 8))]
)
REACHED, STRAYED, PAUSED, INFINITE = 1, 2, 3, 4
"""Why steps ended: time is up; a particle left its block; enough for now; something overflowed."""

PLACE = 22
"""Places are fixed point: 2**PLACE units per cell."""
XI, VE, AF, DE, ST, MA, VO, MT, ID = 0, 3, 6, 15, 24, 30, 31, 32, 33
"""First channels of a particle's place (3), velocity (3), affine part (9), F - 1 (9), stress (6),
mass, volume, material and number."""
NC = 34
"""Channels of a particle."""
EP, VC, TM = 0, 1, 2
"""First channels of what matter that flows remembers besides: plastic strain, volume correction,
whole motion - 1 (9)."""
NH = 11
"""Channels of that."""
MATERIAL = 16
"""Columns of the table of materials."""
BLOCK = 32
"""Integers of a block's record."""
REPORT = 8
SMALLEST_SHARE = 500
"""Particles below which a thread is not worth waking."""
MOST_THREADS = 64
SPEED2, WAVE2, PLASTIC, VISCOUS, ASTRAY, WORK = range(6)
"""Columns of a task's report."""

LAY, MOVE, PACE, CLEAR, BLOW_ON, SPRING, FORCES, CONTACT = range(8)
"""Numbers of the pieces; those of contact follow from the last."""
START, MARK, FIND, STAND, LIST, LOOK, FACE, REACH, CHOOSE, SOLVE, SETTLE = range(
    CONTACT, CONTACT + 11
)
TOUCHING = "start mark find stand list look face reach choose solve settle"
"""Pieces of contact: ``native/contact_NAME.cpp``."""


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
    *(Phase(REACH, "looks", colour) for colour in range(COLOURS)),
    Phase(REACH, "turns"),
    Phase(CHOOSE, "parts"),
    Phase(SOLVE, "parts"),
    Phase(SETTLE),
    *(Phase(MOVE, "colour", colour) for colour in range(COLOURS)),
)
"""A step. Particles lay the nodes of the next step when they move, so laying is skipped unless the
nodes are bare: at the start, after a sort, and while a push acts."""

_NATIVE = Path(__file__).parent / "native"


def native(*names: str) -> str:
    """Source of a piece: what all share, then its own files."""
    return "\n".join((_NATIVE / f"{part}.cpp").read_text() for part in ("shared", *names))


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


@wp.func_native(native("laws", "gather", "scatter", "transfer"))
def transfer_native(memory: Memory, index: int): ...


def _contact() -> str:
    """Text of all pieces of contact: what they share, then one branch for each."""
    text = [native("bond", "contact_shared")]
    for number, name in enumerate(TOUCHING.split()):
        piece = (_NATIVE / f"contact_{name}.cpp").read_text()
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
        self.crew = aligned((1,), CREW)
        self.phase = np.zeros((len(SCHEDULE), 4), np.int32)
        for row, phase in zip(self.phase, SCHEDULE, strict=True):
            named = isinstance(phase.count, str)
            row[0], row[2] = phase.piece, -1 if named else phase.count
            row[3] = WORLD.fields[phase.count][1] + 4 * phase.which if named else 0
        self.resume = next(i for i, phase in enumerate(SCHEDULE) if phase.resume)
        self.crew["phase"], self.crew["phases"] = self.phase.ctypes.data, len(SCHEDULE)
        self.crew["nap"] = _yield_address()
        world["crew"] = self.crew.ctypes.data
        self.pool = ThreadPoolExecutor(self.threads) if self.threads > 1 else None
        self.launches = [
            wp.launch(work, dim=1, inputs=[memory, thread], device="cpu", record_cmd=True)
            for thread in range(self.threads)
        ]
        self.smallest_share = SMALLEST_SHARE

    def divide(self, first: list[int], tasks: int, particles: int) -> None:
        """Say where each colour's tasks begin, and how many tasks and particles there are."""
        for row, phase in zip(self.phase, SCHEDULE, strict=True):
            if phase.count in ("bare", "colour", "looks"):
                row[1] = first[phase.which]
            elif phase.count == "turns":
                row[1] = tasks
        self.hands = max(1, min(self.threads, particles // self.smallest_share))

    def run(self, resume: bool = False) -> None:
        """Step until a piece says stop, or that a list is full."""
        crew = self.crew
        crew["now"] = self.resume - 1 if resume else len(SCHEDULE) - 1
        crew["threads"], crew["started"], crew["stopped"] = self.hands, 0, 0
        crew["post"] = 0
        self.world["stop"] = self.world["full"] = 0
        self.share(self.launches[: self.hands])

    def share(self, launches: list[wp.Launch]) -> None:
        """Run launches at once, one on each thread."""
        mates = [self.pool.submit(other.launch) for other in launches[1:]] if self.pool else []
        launches[0].launch()
        for mate in mates:
            mate.result()


def aligned(shape: tuple[int, ...], dtype: np.dtype | type) -> np.ndarray:
    """Zeros that begin on a cache line."""
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    raw = np.zeros(size + 64, np.uint8)
    start = -raw.ctypes.data % 64
    return raw[start : start + size].view(dtype).reshape(shape)


def _yield_address() -> int:
    """Address of the system's call that offers a core to others; 0 where there is none."""
    try:
        return ctypes.cast(ctypes.CDLL(None).sched_yield, ctypes.c_void_p).value or 0
    except (AttributeError, OSError, TypeError):
        return 0

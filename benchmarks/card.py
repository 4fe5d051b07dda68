"""What a step costs a card, counted without one: launches, atomics, bytes, registers.

    python benchmarks/card.py [--kernels ARCHITECTURE …]

Runs the engine for cards on the processor until some particles have strayed from the blocks they
were sorted into, and counts what its groups of threads do in that state. With ``--kernels`` it
also compiles what a step launches and prints the registers and the stack of every kernel.
"""

import argparse
import struct
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from cost.blocks import Drop, drop_of, problem_of

from corporeal.mpm.constants import OUT_OF_BLOCK_FRACTION
from corporeal.mpm.cuda import layout, particle_memory, program
from corporeal.mpm.cuda.engine import CudaEngine
from corporeal.mpm.cuda.layout import wp

DROPS = {
    "one object": drop_of(100_000),
    "one object in the air": drop_of(100_000, floor=False),
    "a heap of eight": drop_of(8_000, objects=8, heap=True),
}
STEPS = 8
SCATTER_READS = "cell place velocity affine stress mass kind"
GATHER_READS = "cell place velocity affine strain volume plastic opened kind"
GATHER_WRITES = "cell place velocity affine strain stress"
"""Channels of an elastic particle that nothing blows on, but for its block, which both read."""
BEFORE = 216
"""Adds of a particle before arenas: mass and momentum, momentum as it was and a zero, 27 nodes."""
WARP, SECTOR, WORD = 32, 32, 4
"""Threads that read together; bytes that memory gives at least; of a number."""


# ---------------------------------------------------------------- launches


@contextmanager
def listed() -> Iterator[list[str]]:
    """List the kernels that are launched, and launch none."""
    names, launch = [], wp.launch
    wp.launch = lambda kernel, *_, **__: names.append(kernel.key)
    try:
        yield names
    finally:
        wp.launch = launch


def launches(of: Callable[[], None]) -> list[str]:
    """Kernels that a part of a program launches, but for those that repeat within it."""
    with listed() as names:
        of()
    return names


# ---------------------------------------------------------------- atomics


@dataclass(frozen=True)
class Adds:
    """Numbers that a scatter adds to memory with atomics, for each particle."""

    kept: float
    """Of those in the blocks they were sorted into, which share an arena."""
    strays: float
    """Share of particles that have left them."""

    @property
    def all(self) -> float:
        """Together with strays, each of which adds to its 27 nodes by itself."""
        return (1.0 - self.strays) * self.kept + self.strays * 27 * layout.ARENA_SUMS


def adds(engine: CudaEngine) -> Adds:
    """Count what the next scatter adds, from where particles are."""
    a = engine.arrays
    count = int(a.sheet.flag.numpy()[layout.FLAG_TASKS])
    tasks = np.column_stack([getattr(a.grid, f"task_{name}").numpy()[:count] for name in ("home", "first", "last")])
    where = a.grid.where.numpy()
    cell = particle_memory.read_rows(a.particles, "cell")
    corner = np.array(list(np.ndindex(3, 3, 3)))
    total = here = 0
    for home, first, last in tasks:
        own = cell[first:last]
        own = own[(own >> 2 == where[home]).all(axis=1)]
        nodes = ((own & 3)[:, None] + corner).reshape(-1, 3)
        total += layout.ARENA_SUMS * len(np.unique(nodes, axis=0))
        here += len(own)
    return Adds(total / max(here, 1), 1.0 - here / len(cell))


# ---------------------------------------------------------------- bytes


def words(names: str) -> list[int]:
    """Length of each channel's row [words]; a particle's block is one."""
    return [int(np.prod(particle_memory.PARTICLE_STATE[name][0])) for name in names.split()]


def moved() -> dict[str, int]:
    """Bytes of an elastic particle that a step reads and writes."""
    return {
        "scatter reads": WORD * (1 + sum(words(SCATTER_READS))),
        "gather reads": WORD * (1 + sum(words(GATHER_READS))),
        "gather writes": WORD * sum(words(GATHER_WRITES)),
    }


def sectors(by_channel: bool) -> int:
    """Sectors that a warp asks for in a gather, word by word, for rows by channel or one by one."""
    rows = [*words(f"{GATHER_READS} {GATHER_WRITES}"), 1]
    spread = [1 if by_channel else row for row in rows]
    return sum(row * min(WARP, WARP * WORD * apart // SECTOR) for row, apart in zip(rows, spread, strict=True))


# ---------------------------------------------------------------- registers


@dataclass(frozen=True)
class Kernel:
    """What a compiled kernel takes of a card."""

    name: str
    registers: int
    stack: int
    """Of each thread [bytes]: what does not fit in registers, or is indexed."""


def kernels(module: Any, architecture: int) -> list[Kernel]:
    """Compile a module for a card that need not be there, and read what its kernels take."""
    with tempfile.TemporaryDirectory() as folder:
        made = wp.compile_aot_module(module, arch=architecture, module_dir=folder, use_ptx=False)
        return [kernel for path in made for kernel in read_cubin(path.read_bytes())]


def read_cubin(data: bytes) -> list[Kernel]:
    """Read registers and stack of all kernels from an ELF file for cards."""
    (table,) = struct.unpack_from("<Q", data, 40)
    size, count, names_at = struct.unpack_from("<3H", data, 58)
    headers = [struct.unpack_from("<IIQQQQIIQQ", data, table + size * k) for k in range(count)]
    sections = {text_at(data, headers[names_at][4] + h[0]): (data[h[4] : h[4] + h[5]], h) for h in headers}
    symbols, _ = sections[".symtab"]
    strings, _ = sections[".strtab"]
    found: dict[int, dict[int, int]] = {}
    info, at = sections[".nv.info"][0], 0
    while at < len(info):
        form, what, length = struct.unpack_from("<BBH", info, at)
        at += 4
        if form == 4:
            if what in (REGISTERS, STACK):
                symbol, value = struct.unpack_from("<II", info, at)
                found.setdefault(symbol, {})[what] = value
            at += length
    return [
        Kernel(
            text_at(strings, struct.unpack_from("<I", symbols, 24 * symbol)[0]).split("_cuda_")[0],
            values[REGISTERS],
            values.get(STACK, 0),
        )
        for symbol, values in found.items()
        if REGISTERS in values
    ]


REGISTERS, STACK = 0x2F, 0x11
"""Attributes of a kernel in section .nv.info: registers, bytes of a stack frame."""


def text_at(data: bytes, at: int) -> str:
    """Text up to a zero byte."""
    return data[at : data.index(b"\0", at)].decode()


# ---------------------------------------------------------------- the table


def report(name: str, drop: Drop) -> None:
    """Print what a step of a drop costs."""
    engine = CudaEngine(problem_of(drop), device="cpu")
    fresh, run = adds(engine), engine.program
    for _ in range(STEPS):
        engine.step(engine.stable_step())
    later = adds(engine)
    names = launches(run._step)
    print(f"\n{name}, {drop.particles} particles")
    print(f"  launches of a step: {len(names)}: {' '.join(names)}")
    print(f"  launches of a sort: {len(launches(run.arrange))}")
    print(f"  adds a particle, sorted, as it starts: {fresh.kept:.1f} (before: {BEFORE})")
    print(f"  … and {STEPS} steps later: {later.kept:.1f}; with a tenth strayed: ", end="")
    print(f"{Adds(later.kept, OUT_OF_BLOCK_FRACTION).all:.1f}")


def main() -> None:
    """Count, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kernels", type=int, nargs="*", metavar="ARCHITECTURE", default=[])
    chosen = parser.parse_args()
    for architecture in chosen.kernels:
        for one in (k for module in program.KERNEL_MODULES for k in kernels(module, architecture)):
            print(f"sm_{architecture} {one.name:26s} {one.registers:4d} registers", end=" ")
            print(f"{one.stack:4d} bytes of stack")
    for name, drop in DROPS.items():
        report(name, drop)
    print("\nan elastic particle [bytes]:", *(f"{k} {v}" for k, v in moved().items()))
    print(f"sectors of a warp in a gather: {sectors(True)}; of rows one by one: {sectors(False)}")


if __name__ == "__main__":
    main()

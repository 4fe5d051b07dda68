"""Contestants take turns, a batch of substeps each, so that all of them meet the same machine."""

import os
import time
from collections.abc import Iterator
from typing import Any, NamedTuple, Protocol

import numpy as np
import warp as wp

from corporeal.mpm.cpu.engine import CpuEngine
from cost.blocks import Drop, problem_of

ROUNDS = 5
"""Batches of each contestant; the best counts."""


class Cost(NamedTuple):
    """What a batch took, per particle and substep."""

    wall: float
    """[ns]"""
    cpu: float
    """Of all threads together [ns]: what hardly depends on what else the machine does."""


class Contestant(Protocol):
    """One engine with one drop."""

    engine: str
    drop: Drop
    particles: int
    bytes: float
    """Of all arrays that the engine holds; nan: not known."""
    grown: float
    """What the process grew by while it was made; nan: not known."""

    def batch(self, substeps: int) -> Cost:
        """Take some substeps."""
        ...

    def close(self) -> None:
        """Give back what it holds."""
        ...


class Ours:
    """The production engine, or the one on a graphics card."""

    engine = "corporeal"

    def __init__(self, drop: Drop) -> None:
        """Build the problem and lay out the engine."""
        problem = problem_of(drop)
        before = resident()
        if drop.device == "cpu":
            self.solver: Any = CpuEngine(problem, threads=drop.threads)
        else:
            from corporeal.mpm.cuda.engine import CudaEngine

            self.solver = CudaEngine(problem, drop.device)
        self.drop, self.particles = drop, drop.particles
        self.step = self.solver.stable_step()
        self.batch(4)
        self.grown = float(resident() - before)
        self.bytes = float(held(self.solver))

    def batch(self, substeps: int) -> Cost:
        """Advance by so many of the first stable steps, and count those that were taken."""
        taken = self.solver.steps.count
        start, busy = time.perf_counter(), time.process_time()
        self.solver.advance(self.solver.time + substeps * self.step)
        wall, cpu = time.perf_counter() - start, time.process_time() - busy
        unit = 1e9 / (self.solver.steps.count - taken) / self.particles
        return Cost(unit * wall, unit * cpu)

    def upkeep(self) -> dict[str, float]:
        """Return what is done once a frame beside the substeps, and how long it takes [s]."""
        seconds = {}
        for words, what in (
            ("read all particles", self.solver.snapshot),
            ("add up the ledger", self.solver.measure),
            ("copy the state for a checkpoint", self.solver.save),
        ):
            start = time.perf_counter()
            what()
            seconds[words] = time.perf_counter() - start
        return seconds

    def close(self) -> None:
        """Let go of the engine."""
        del self.solver


def contest(contestants: list[Contestant], substeps: int) -> list[Cost]:
    """Return the least that a batch of each took."""
    best = [Cost(np.inf, np.inf)] * len(contestants)
    for contestant in contestants:
        contestant.batch(substeps)  # what is compiled or settles at first counts for nobody
    for _ in range(ROUNDS):
        for k, contestant in enumerate(contestants):
            now = contestant.batch(substeps)
            best[k] = Cost(min(best[k].wall, now.wall), min(best[k].cpu, now.cpu))
    return best


def resident() -> int:
    """Memory of this process now [bytes]."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def held(engine: Any) -> int:
    """Bytes of all arrays that an engine holds beside its problem, each memory counted once."""
    blocks: dict[int, int] = {}
    seen: set[int] = set()
    todo = [engine]
    while todo:
        thing = todo.pop()
        if id(thing) in seen or thing is engine.problem:
            continue
        seen.add(id(thing))
        if isinstance(thing, np.ndarray):
            while isinstance(thing.base, np.ndarray):
                thing = thing.base
            blocks[thing.ctypes.data] = thing.nbytes
        elif isinstance(thing, wp.array):
            if thing.deleter is not None:
                blocks[int(thing.ptr or 0)] = thing.capacity
        else:
            todo.extend(_inside(thing))
    return sum(blocks.values())


def _inside(thing: Any) -> Iterator[Any]:
    if isinstance(thing, dict):
        yield from thing.values()
    elif isinstance(thing, list | tuple | set):
        yield from thing
    elif type(thing).__module__.startswith("corporeal.mpm"):
        yield from vars(thing).values() if hasattr(thing, "__dict__") else ()

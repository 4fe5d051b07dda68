"""Timing of the phases of a step, for benchmarks."""

import ctypes
import time

import numpy as np

from corporeal.core.errors import UserError
from corporeal.mpm.cpu import program
from corporeal.mpm.cpu.layout import NANOSECONDS


class PhaseClock:
    """Processor time of a program's phases, read from one thread as each of them ends."""

    def __init__(self, watched: program.CpuProgram) -> None:
        """Begin to watch a program that runs on one thread.

        Raises:
            UserError: It runs on several threads, or this system has no such clock.

        """
        if watched.threads != 1:
            raise UserError(f"Phases are timed on one thread, not {watched.threads}: ask for --threads 1.")
        self.pool = watched.thread_pool
        phases = len(program.SCHEDULE)
        self.spent = np.zeros(phases + 1)
        """Of each phase [ns]; then the reading at which the present one began, 0: none does."""
        self.pool["clock_id"] = time.CLOCK_THREAD_CPUTIME_ID
        self.pool["read_clock"] = _address_of("clock_gettime")
        self.pool["spent"] = self.spent.ctypes.data

    def clear(self) -> None:
        """Count from zero."""
        self.spent[:] = 0.0

    def seconds(self) -> dict[str, float]:
        """Processor time since the last ``clear`` by piece [s], in the order of a step."""
        found: dict[str, float] = {}
        seconds = (self.spent[:-1] / NANOSECONDS).tolist()
        for phase, spent in zip(program.SCHEDULE, seconds, strict=True):
            name = program.PIECE_NAMES[phase.piece]
            found[name] = found.get(name, 0.0) + spent
        return found


def _address_of(name: str) -> int:
    """Address of a function of the system's library."""
    try:
        return ctypes.cast(getattr(ctypes.CDLL(None), name), ctypes.c_void_p).value or 0
    except (AttributeError, OSError, TypeError) as error:
        raise UserError(f"Phases cannot be timed on this system: it has no {name}.") from error

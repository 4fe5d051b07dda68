"""Resources available to this process."""

import atexit
import ctypes
import gc
import os
from math import ceil
from pathlib import Path

CPU_QUOTA_FILE = Path("/sys/fs/cgroup/cpu.max")
"""Where a container's share of the processor stands, as "microseconds per-period" (Linux)."""
UNLIMITED_CORES = 1 << 16
KEPT_FREED_BYTES = 1 << 26
"""Memory that was freed and stays with the process [bytes]: some pictures of a video."""
GC_THRESHOLD_OBJECTS = 50_000
"""Objects made, less those that ended, after which unused cycles of them are looked for."""
TRIM_THRESHOLD, MMAP_THRESHOLD, ARENA_MAX = -1, -3, -8
"""Numbers of these settings in glibc's ``malloc.h``."""


def usable_cores(quota: Path = CPU_QUOTA_FILE) -> int:
    """Count the processor cores that this process may keep busy, at least 1.

    Fewer than the machine has where an affinity mask (``taskset``, a batch system), a container's
    quota or ``OMP_NUM_THREADS`` says so: threads beyond that number only stand in each other's
    way.
    """
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return max(1, min(allowed or 1, _quota_cores(quota), _environment_threads()))


def keep_freed_memory() -> bool:
    """Let arrays reuse what others freed instead of asking the system for each; whether it does.

    Usual is that every large array is fresh memory of the system, which has to empty each page of it at the first
    touch, and that threads have memory apart (arenas), most of which goes back to the system when it is freed, whatever
    is to be kept; here they share one. Where the C library is not glibc, or the environment has a ``MALLOC_`` setting
    of its own, nothing is changed.
    """
    if any(name.startswith("MALLOC_") for name in os.environ):
        return False
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (AttributeError, OSError, TypeError):
        return False
    wanted = {MMAP_THRESHOLD: KEPT_FREED_BYTES, TRIM_THRESHOLD: KEPT_FREED_BYTES, ARENA_MAX: 1}
    return all(mallopt(what, value) == 1 for what, value in wanted.items())


def relax_garbage_collection() -> None:
    """Let Python look for unused cycles of objects after every 50,000, not 700.

    Modules and materials are hundreds of thousands of objects that stay, and each search goes through many of them: 2 %
    of the demo. Large arrays are in no cycles. When the process ends, Python would search all of them several times
    more; the system takes their memory back anyway.
    """
    gc.set_threshold(GC_THRESHOLD_OBJECTS, *gc.get_threshold()[1:])
    atexit.register(gc.freeze)


def _quota_cores(quota: Path) -> int:
    """Return the cores that a container's quota amounts to; very many where there is none."""
    try:
        share, period = quota.read_text(encoding="ascii").split()
    except (OSError, ValueError):
        return UNLIMITED_CORES
    return UNLIMITED_CORES if share == "max" else ceil(int(share) / int(period))


def _environment_threads() -> int:
    """Return the threads that the environment grants; very many where it says nothing."""
    asked = os.environ.get("OMP_NUM_THREADS", "").split(",")[0].strip()
    return int(asked) if asked.isdecimal() and int(asked) > 0 else UNLIMITED_CORES

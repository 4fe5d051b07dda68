"""What this process may use of the machine that it runs on."""

import os
from math import ceil
from pathlib import Path

QUOTA = Path("/sys/fs/cgroup/cpu.max")
"""Where a container's share of the processor stands, as "microseconds per-period" (Linux)."""


def cores(quota: Path = QUOTA) -> int:
    """Count the processor cores that this process may keep busy, at least 1.

    Fewer than the machine has where an affinity mask (``taskset``, a batch system) or a
    container's quota says so: threads beyond that number only stand in each other's way.
    """
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return max(1, min(allowed or 1, _granted(quota)))


def _granted(quota: Path) -> int:
    """Give the cores that a container's quota amounts to; very many where there is none."""
    unlimited = 1 << 16
    try:
        share, period = quota.read_text(encoding="ascii").split()
    except (OSError, ValueError):
        return unlimited
    return unlimited if share == "max" else ceil(int(share) / int(period))

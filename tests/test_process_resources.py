"""What this process may use of the machine."""

import gc
import os
import platform
import subprocess
import sys

import pytest

from corporeal.core.process_resources import (
    GC_THRESHOLD_OBJECTS,
    keep_freed_memory,
    relax_garbage_collection,
    usable_cores,
)


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="Linux only")
def test_an_affinity_mask_counts(tmp_path):
    before = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {min(before)})
        assert usable_cores(tmp_path / "none") == 1
    finally:
        os.sched_setaffinity(0, before)


@pytest.mark.parametrize(
    ("text", "most"), [("50000 100000\n", 1), ("max 100000\n", None), ("nonsense", None), ("150000 100000", 2)]
)
def test_a_quota_counts(tmp_path, text, most):
    free = usable_cores(tmp_path / "none")
    (tmp_path / "cpu.max").write_text(text)
    assert usable_cores(tmp_path / "cpu.max") == min(most or free, free)


@pytest.mark.parametrize(("text", "most"), [("1", 1), ("1,2", 1), ("0", None), ("many", None), ("", None)])
def test_a_wish_in_the_environment_counts(tmp_path, monkeypatch, text, most):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    free = usable_cores(tmp_path / "none")
    monkeypatch.setenv("OMP_NUM_THREADS", text)
    assert usable_cores(tmp_path / "none") == min(most or free, free)


def test_cycles_are_looked_for_seldom_and_still_found():
    before, found = gc.get_threshold(), []
    watch = lambda phase, info: found.append(info) if phase == "stop" else None  # noqa: E731
    try:
        relax_garbage_collection()
        gc.collect()
        gc.callbacks.append(watch)
        for _ in range(2 * GC_THRESHOLD_OBJECTS + 100):
            cycle: list = []
            cycle.append(cycle)
        assert 1 <= len(found) <= 3
        assert sum(info["collected"] for info in found) >= GC_THRESHOLD_OBJECTS
    finally:
        gc.callbacks.remove(watch)
        gc.set_threshold(*before)


THREADS = """
import os, sys
{before}
from corporeal import cli
print(os.environ["OPENBLAS_NUM_THREADS"])
"""


@pytest.mark.parametrize(("before", "then"), [("", "1"), ("2", "2")])
def test_the_command_line_gives_blas_one_thread_unless_the_environment_says_so(before, then):
    quiet = {k: v for k, v in os.environ.items() if k != "OPENBLAS_NUM_THREADS"}
    given = quiet | ({"OPENBLAS_NUM_THREADS": before} if before else {})
    command = [sys.executable, "-c", THREADS.format(before="assert 'numpy' not in sys.modules")]
    told = subprocess.run(command, env=given, capture_output=True, text=True, check=True)
    assert told.stdout.strip() == then


FAULTS = """
import resource, sys
import numpy as np
from corporeal.core.process_resources import keep_freed_memory
if sys.argv[1] == "keep" and not keep_freed_memory():
    sys.exit("no")
np.ones(2_000_000)
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(20):
    np.ones(2_000_000)
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="a setting of glibc's malloc")
def test_an_array_takes_the_pages_that_the_last_one_freed():
    quiet = {k: v for k, v in os.environ.items() if not k.startswith("MALLOC_")}
    usual, kept = (
        int(subprocess.check_output([sys.executable, "-c", FAULTS, how], env=quiet)) for how in ("usual", "keep")
    )
    assert kept < 0.1 * usual


HEAP = """
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
import numpy as np
from corporeal.core.process_resources import keep_freed_memory
keep_freed_memory()
def kept_by_the_program():
    place = np.ones(2_000_000).ctypes.data
    lines = Path("/proc/self/maps").read_text().splitlines()
    low, high = (int(x, 16) for x in next(k for k in lines if "[heap]" in k).split()[0].split("-"))
    return low <= place < high
print(kept_by_the_program(), ThreadPoolExecutor(1).submit(kept_by_the_program).result())
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="a setting of glibc's malloc")
def test_arrays_of_threads_have_no_memory_apart():
    quiet = {k: v for k, v in os.environ.items() if not k.startswith("MALLOC_")}
    told = subprocess.check_output([sys.executable, "-c", HEAP], env=quiet, text=True)
    assert told.split() == ["True", "True"]


def test_a_setting_of_ones_own_for_memory_stays(monkeypatch):
    monkeypatch.setenv("MALLOC_TRIM_THRESHOLD_", "131072")
    assert not keep_freed_memory()


LOOPED = """
from corporeal.core.process_resources import relax_garbage_collection
relax_garbage_collection()
class Loop:
    def __init__(self):
        self.itself = self
    def __del__(self):
        print("searched for")
Loop()
"""


def test_a_process_that_ends_searches_for_no_cycles():
    command = [sys.executable, "-c", LOOPED]
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == ""
    plain = [sys.executable, "-c", LOOPED.replace("relax_garbage_collection()\n", "")]
    told = subprocess.run(plain, capture_output=True, text=True, check=True)
    assert told.stdout == "searched for\n"

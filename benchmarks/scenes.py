"""Compose many scenes in one process: seconds each, attempts, and whether memory stays flat.

    python benchmarks/scenes.py POOL --count 1000 --json scenes.json

POOL is what `corporeal assets index` made. No views are taken. Every scene has its own seed and one
to four things of all classes; scenes that are refused are counted, with the reason. Memory is
the resident set of the process, and handles are its open files, after each tenth of the scenes.
"""

import argparse
import json
import resource
import shutil
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

from corporeal.core.errors import UserError
from corporeal.pipeline.stages.compose import ComposeConfig, compose
from corporeal.pool.pool_index import read_pool

WARM_UP = 20
"""Scenes before memory is looked at: code is loaded and compiled, pieces are cut."""


def main() -> None:
    """Compose, print, keep."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    words.add_argument("pool", type=Path)
    words.add_argument("--count", type=int, default=1000)
    words.add_argument("--first-seed", type=int, default=0)
    words.add_argument("--json", type=Path)
    asked = words.parse_args()
    result = measure(asked.pool, asked.count, asked.first_seed)
    print_table(result)
    if asked.json:
        asked.json.write_text(json.dumps(result, indent=1))


def measure(folder: Path, count: int, first: int) -> dict:
    """Compose ``count`` scenes one after the other."""
    pool = read_pool(folder)
    work = Path(tempfile.mkdtemp())
    seconds, attempts, refused, looks = [], Counter(), Counter(), []
    try:
        for k in range(count):
            start = time.perf_counter()
            try:
                made = compose(pool, work / str(k), ComposeConfig(seed=first + k))
                attempts[made.certificate.attempts] += 1
            except UserError as error:
                refused[reason(str(error))] += 1
            seconds.append(time.perf_counter() - start)
            shutil.rmtree(work / str(k), ignore_errors=True)
            if k + 1 == WARM_UP or (k + 1) % max(count // 10, 1) == 0:
                looks.append({"scenes": k + 1, **look()})
                tell(k + 1, count, seconds, looks[-1])
    finally:
        shutil.rmtree(work, ignore_errors=True)
    return {
        "scenes": count,
        "assets": len(pool.assets),
        "seconds_mean": float(np.mean(seconds)),
        "seconds_median": float(np.median(seconds)),
        "seconds_p95": float(np.percentile(seconds, 95)),
        "seconds_max": float(np.max(seconds)),
        "attempts": dict(sorted(attempts.items())),
        "refused": dict(refused.most_common()),
        "looks": looks,
    }


def reason(sentence: str) -> str:
    """Drop names and numbers from a refusal, so that alike ones are counted together."""
    words = sentence.split(": ", 1)[-1]
    return "".join("#" if c.isdigit() else c for c in words.split(". Try")[0])


def look() -> dict:
    """Resident memory [MB] and open files of this process."""
    handles = len(list(Path("/proc/self/fd").iterdir())) if sys.platform == "linux" else None
    if sys.platform == "linux":
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        memory = pages * resource.getpagesize() / 1e6
    else:
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    return {"memory_mb": round(memory, 1), "handles": handles}


def tell(done: int, count: int, seconds: list[float], now: dict) -> None:
    """One line of progress."""
    left = (count - done) * float(np.mean(seconds)) / 60
    print(f"{done} of {count}, {np.mean(seconds):.2f} s each, {now}, {left:.0f} min left", flush=True)


def print_table(result: dict) -> None:
    """Print what was measured."""
    for key in ("scenes", "assets", "seconds_mean", "seconds_median", "seconds_p95", "seconds_max"):
        print(f"{key:16} {result[key]:.5g}")
    print("attempts        ", result["attempts"])
    for words, times in result["refused"].items():
        print(f"refused {times:4} × {words}")


if __name__ == "__main__":
    main()

"""How long taking objects apart takes, and how much memory: seconds and peak, in fresh processes.

    python benchmarks/regions.py [--points 100000 500000] [--channels 768] [--threads 2]

Points fill the faces of boxes, each box one part; its points' features are a direction of its own
and noise, in half precision, structural and semantic alike. Time is on the clock, of everything
``regions.naming.name_parts`` does with CLIP's words, compiled loops warm; seconds of the processor
stand beside it. Memory is the process's peak, the features included.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import time

import numpy as np

PARTS = 6
NOISE = 1.0
"""Length of the noise beside the direction of length 1."""
BATCH = 10_000


def scene(points: int, channels: int):
    """Return a cloud of boxes, their words' vectors, and which point is of which box."""
    from corporeal.core.types import FeatureCloud

    rng = np.random.default_rng(0)
    part = np.sort(rng.integers(0, PARTS, points))
    face = rng.integers(0, 3, points)
    position = rng.random((points, 3))
    position[np.arange(points), face] = rng.integers(0, 2, points)
    position += np.array([[k % 3, k // 3, 0.0] for k in range(PARTS)])[part]
    made = {}
    for name in ("structural", "semantic"):
        look = rng.normal(size=(PARTS, channels))
        look /= np.linalg.norm(look, axis=1, keepdims=True)
        rows = np.empty((points, channels), np.float16)
        for k in range(0, points, BATCH):
            noise = rng.normal(size=rows[k : k + BATCH].shape) * NOISE / np.sqrt(channels)
            one = look[part[k : k + BATCH]] + noise
            rows[k : k + BATCH] = one / np.linalg.norm(one, axis=1, keepdims=True)
        made[name] = rows, look
    colour = rng.random((points, 3))
    structural, (semantic, words) = made["structural"][0], made["semantic"]
    cloud = FeatureCloud(position, colour, semantic, structural, np.ones(points, np.int64))
    return cloud, words, part


def once(points: int, channels: int) -> None:
    """Take one cloud apart, in this process, and print what it took."""
    from segmentation.segmentation_scores import named_iou

    from corporeal.core.types import ObjectDescription, PartDescription
    from corporeal.reconstruction.segment.part_naming import name_parts

    thing = ObjectDescription("boxes", "boxes", tuple(PartDescription(f"box {k}", None) for k in range(PARTS)))
    small, words, _ = scene(2000, channels)
    name_parts(small, thing, words)
    cloud, words, part = scene(points, channels)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    clock, spent = time.perf_counter(), time.process_time()
    found = name_parts(cloud, thing, words)
    row = {
        "points": points,
        "channels": channels,
        "clock_s": time.perf_counter() - clock,
        "processor_s": time.process_time() - spent,
        "before_gb": before,
        "peak_gb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,
        "clusters": len(found.part_of_cluster),
        "iou": named_iou(part, found.part_of_point),
    }
    print(json.dumps(row))


def main() -> None:
    """Measure every size in a process of its own."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", nargs="+", type=int, default=[100_000, 500_000])
    parser.add_argument("--channels", type=int, default=768)
    parser.add_argument("--threads", default="2")
    parser.add_argument("--once", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.once:
        once(asked.points[0], asked.channels)
        return
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
    threads = os.environ | dict.fromkeys(names, asked.threads)
    cores = ["taskset", "-c", ",".join(map(str, range(int(asked.threads))))]
    for points in asked.points:
        command = [sys.executable, __file__, "--once", "--points", str(points)]
        command += ["--channels", str(asked.channels)]
        out = subprocess.run([*cores, *command], env=threads, capture_output=True, text=True)
        if out.returncode:
            raise SystemExit(out.stderr)
        r = json.loads(out.stdout)
        print(
            f"{points} points x {r['channels']}: {r['clock_s']:.1f} s on {asked.threads} cores "
            f"({r['processor_s']:.1f} s of the processor), {r['peak_gb']:.2f} GB at most "
            f"({r['before_gb']:.2f} before), {r['clusters']} clusters, mean IoU {r['iou']:.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()

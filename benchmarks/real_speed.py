"""Real photographs: seconds from photographs alone to closed surfaces, by phase.

    python benchmarks/real_speed.py FOLDER/flowerpot [--photographs 20 40] [--long-side 640]
        [--training normal] [--threads 2] [--out runs/speed] [--json FILE]

Of a folder with ``images``, as many photographs as asked for, evenly spaced in the order of their
names, are reduced to the long side and reconstructed by a fresh process each: nobody says where
they were taken from, nor what of them is the object. The clock is read where one phase of the work
ends and the next begins; seconds of the processor, all threads together, stand beside it. On a
machine with nothing else to do both are true; else the clock is not.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from PIL import Image, ImageOps

from corporeal.core import store
from corporeal.core.terminal import show_table
from corporeal.pipeline.stages.reconstruct import PROGRESS_AFTER_TRAINING, reconstruct
from corporeal.reconstruction.gaussian_source import MASKED_PROGRESS, POSED_PROGRESS
from corporeal.reconstruction.gaussians.training_schedule import TRAINING_PRESETS
from corporeal.reconstruction.reconstruct_config import ReconstructConfig

PHASES = {
    "poses": POSED_PROGRESS * PROGRESS_AFTER_TRAINING,
    "masks": (POSED_PROGRESS + MASKED_PROGRESS) * PROGRESS_AFTER_TRAINING,
    "training": PROGRESS_AFTER_TRAINING,
    "surfaces": 1.0,
}
"""Of the work, and the fraction of it that is done after each, in order."""
THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")


def reduced(folder: Path, count: int, long_side: int, place: Path) -> Path:
    """Write some of a folder's photographs, as large as asked for."""
    names = sorted((folder / "images").iterdir())
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    for index in np.linspace(0, len(names) - 1, count).round().astype(int):
        with Image.open(names[index]) as picture:
            exif = picture.getexif()
            small = ImageOps.contain(picture.convert("RGB"), (long_side, long_side))
            small.save(place / f"{names[index].stem}.jpg", quality=92, exif=exif)
    return place


def timed(photographs: Path, training: str, work: Path) -> dict[str, tuple[float, float]]:
    """Reconstruct; return seconds of the clock and of the processor of each phase."""
    begins: dict[str, tuple[float, float]] = {}

    def told(fraction: float, words: str) -> None:
        phase = next((p for p, end in PHASES.items() if fraction < end), "surfaces")
        begins.setdefault(phase, (time.perf_counter(), time.process_time()))

    told(0.0, "")
    config = ReconstructConfig(training=training)  # type: ignore[arg-type]
    reconstruct(photographs, config, folder=work, progress=told)
    ends = [*list(begins.values())[1:], (time.perf_counter(), time.process_time())]
    return {
        phase: (end[0] - begin[0], end[1] - begin[1]) for (phase, begin), end in zip(begins.items(), ends, strict=True)
    }


def measured(photographs: Path, training: str, threads: int, work: Path) -> dict:
    """Reconstruct in a process of its own, on so many threads."""
    shutil.rmtree(work, ignore_errors=True)
    command = [sys.executable, __file__, str(photographs), "--one", str(work)]
    command += ["--training", training]
    few = dict.fromkeys(THREADS, str(threads))
    done = subprocess.run(command, env=os.environ | few, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(done.stderr)
    return json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    """Time every number of photographs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--photographs", nargs="+", type=int, default=[20, 40])
    parser.add_argument("--long-side", type=int, default=640)
    parser.add_argument("--training", choices=tuple(TRAINING_PRESETS), default="normal")
    parser.add_argument("--threads", nargs="+", type=int, default=[2])
    parser.add_argument("--out", type=Path, default=Path("runs/speed"))
    parser.add_argument("--json", type=Path, help="rows as data")
    parser.add_argument("--one", type=Path, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.one is not None:
        print(json.dumps(timed(asked.folder, asked.training, asked.one)))
        return
    if not (asked.folder / "images").is_dir():
        parser.error(f"{asked.folder} has no folder images, in which photographs lie.")
    there = sum(1 for _ in (asked.folder / "images").iterdir())
    if not 3 <= min(asked.photographs) <= max(asked.photographs) <= there:
        parser.error(f"--photographs: {asked.folder} has {there}; 3 of them are the fewest.")
    rows = []
    for count in asked.photographs:
        name = f"{asked.folder.name}-{count}"
        photographs = reduced(asked.folder, count, asked.long_side, asked.out / name)
        for threads in asked.threads:
            spent = measured(photographs, asked.training, threads, asked.out / f"{name}-{threads}")
            rows.append({"photographs": count, "threads": threads, "seconds": spent})
            cells = [f"{clock:.0f} ({processor:.0f})" for clock, processor in spent.values()]
            whole = [f"{sum(part):.0f}" for part in zip(*spent.values(), strict=True)]
            shown = (str(count), str(threads), *cells, f"{whole[0]} ({whole[1]})")
            show_table(("photographs", "threads", *PHASES, "whole, clock (CPU) [s]"), [shown])
    if asked.json:
        store.write_json(asked.json, rows)


if __name__ == "__main__":
    main()

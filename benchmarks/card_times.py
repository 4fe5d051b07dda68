"""What a substep takes on a graphics card, beside the processor, and each of a step's kernels.

    python benchmarks/card_times.py [--quick]

Cubes of one material drop on the floor and slide (``cost/blocks.py``). Contestants of one size
take turns, batch by batch, and the best of five batches counts. Kernels are timed by events of
the card, launched one by one and not in a graph.
"""

import argparse
import re
from collections import defaultdict
from dataclasses import replace

import numpy as np
import warp as wp
from cost.blocks import Drop, drop_of
from cost.contest import Ours, contest

from corporeal.core.process_resources import usable_cores
from corporeal.mpm.cuda import layout, timestep

SIZES = (10_000, 100_000, 1_000_000, 5_000_000)
QUICK = SIZES[:2]
PROCESSOR = 1_000_000
"""More particles than this are asked of the card alone."""
SUBSTEPS = 32
STEPS = 40
"""That kernels are timed in: least of all counts."""


def drops(quick: bool) -> list[Drop]:
    """List what is measured."""
    heap = drop_of(100_000, objects=16, heap=True)
    return [*(drop_of(count) for count in (QUICK if quick else SIZES)), heap]


def times(drop: Drop, card: str) -> None:
    """Print what a substep takes each contestant [ns per particle], and the ratio."""
    rivals = [replace(drop, device=card)]
    if drop.particles <= 1.1 * PROCESSOR:
        rivals += [replace(drop, threads=t) for t in (1, 4) if t <= usable_cores()]
    engines = [Ours(rival) for rival in rivals]
    found = [cost.wall for cost in contest(engines, SUBSTEPS)]
    name = f"{drop.objects} object{'s' if drop.objects > 1 else ''}, {drop.particles:,} particles"
    print(f"\n{name}: ns per particle and substep; us per substep")
    for rival, wall in zip(rivals, found, strict=True):
        where = rival.device if rival.device != "cpu" else f"cpu, {rival.threads} threads"
        print(f"  {where:14s} {wall:9.3f} {wall * drop.particles / 1e3:12.1f}", end="")
        print(f"  {wall / found[0]:8.1f} times the card", flush=True)
    for name, spent in kernels(engines[0].solver).items():
        print(f"    {name:16s} {spent:9.1f} us", flush=True)
    for one in engines:
        one.close()


def kernels(engine: object) -> dict[str, float]:
    """Time the kernels of a step, launched one by one [us]: the median of each launch, summed."""
    run, sheet = engine.program, engine.arrays.sheet
    spent: dict[str, list[float]] = defaultdict(list)
    engine._set(layout.CLOCK_FORCED, 0.0)
    for _ in range(STEPS):
        engine._set(layout.CLOCK_UNTIL, engine.time + engine.stable_step())
        engine._arrange()
        run._one_group(timestep.begin_frame, sheet, engine.arrays.rigid)
        wp.timing_begin(cuda_filter=wp.TIMING_KERNEL)
        run._step()
        once: dict[str, float] = defaultdict(float)
        for result in wp.timing_end():
            once[kernel_name(result.name)] += 1e3 * result.elapsed
        for name, us in once.items():
            spent[name].append(us)
    medians = {name: float(np.median(all_)) for name, all_ in spent.items()}
    ranked = sorted(medians.items(), key=lambda pair: -pair[1])
    return {**dict(ranked), "all kernels": sum(medians.values())}


def kernel_name(full: str) -> str:
    """Leave out what Warp adds to a kernel's name."""
    return re.sub(r"_[0-9a-f]{8}$", "", full.split()[-1].split("_cuda_kernel")[0])


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small sizes only")
    chosen = parser.parse_args()
    for card in wp.get_cuda_devices():
        print(f"{card.alias}: {card.name}; {usable_cores()} cores")
        for drop in drops(chosen.quick):
            times(drop, card.alias)


if __name__ == "__main__":
    main()

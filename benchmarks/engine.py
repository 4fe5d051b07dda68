"""What a substep costs: nanoseconds and bytes per particle, ours and genesis-world's side by side.

    python benchmarks/engine.py [--quick] [--json FILE] [--history FILE] [--docs] [--peer DIR]
    python benchmarks/engine.py --phases [--quick]

Cubes of one material drop on the floor and slide. All contestants take turns, batch by batch, and
the best of five batches counts, so that all of them meet the same machine.

The peer lives in a virtual environment of its own, because it needs other versions of things:

    python benchmarks/engine.py --peer-install ~/genesis     (pip install torch genesis-world)
    python benchmarks/engine.py --peer ~/genesis
"""

import argparse
import json
from dataclasses import dataclass, replace
from pathlib import Path

import warp as wp
from cost import history, page, phases
from cost.blocks import Drop, drop_of
from cost.contest import Contestant, Ours, contest
from cost.peer import Peer, install

from corporeal.core.process_resources import usable_cores
from corporeal.core.types import Law


@dataclass(frozen=True)
class Size:
    """How much is measured."""

    particles: int
    """Of everything but the series of sizes."""
    series: tuple[int, ...]
    objects: tuple[int, ...]
    extents: tuple[int, ...]
    """Cells across which eight objects are spread."""
    substeps: int
    """Of one batch."""
    peer_threads: tuple[int, ...]


FULL = Size(
    100_000, (10_000, 30_000, 100_000, 300_000, 1_000_000, 5_000_000), (2, 4, 8, 16), (64, 128, 256), 64, (1, 2, 4)
)
QUICK = Size(20_000, (10_000, 100_000), (16,), (64, 256), 24, (1,))
PHASED = (
    drop_of(100_000),
    drop_of(100_000, objects=16, heap=True),
    drop_of(16_000, objects=16, heap=True),
    drop_of(100_000, objects=16),
    drop_of(1_000_000),
)
"""What is timed phase by phase …"""
PHASED_QUICK = (drop_of(20_000), drop_of(16_000, objects=16, heap=True))
"""… and in a quick look."""
DOCS = Path(__file__).parent.parent / "docs"
WIDTHS = (16, 6, 2, 16, 10, 3, 24, 8, 8, 5)
"""Of the columns on the screen."""


def rivals(size: Size) -> list[Drop]:
    """List all drops that meet in the first contest."""
    free = usable_cores()
    plain = drop_of(size.particles)
    laws = [replace(plain, law=law, threads=t) for law in Law for t in (1, 2, 4) if t <= free]
    heaps = [drop_of(size.particles, objects=count, heap=heap) for count in size.objects for heap in (False, True)]
    many = drop_of(size.particles, objects=size.objects[-1], heap=True)
    heaps += [replace(many, threads=t) for t in (2, 4) if t <= free]
    spread = [drop_of(size.particles, objects=8, extent=cells) for cells in size.extents]
    cards = [replace(plain, law=law, device=card) for law in Law for card in cuda_devices()]
    return [*laws, *heaps, *spread, *cards, replace(plain, floor=False)]


def cuda_devices() -> list[str]:
    """Name the graphics cards of this machine."""
    return [device.alias for device in wp.get_cuda_devices()]


def measure(size: Size, peer: Path | None) -> list[page.Result]:
    """Hold the contest among all drops of one size, and then the one among sizes."""
    threads = [t for t in size.peer_threads if t <= usable_cores()]
    plain = drop_of(size.particles)
    peers = [Peer(peer, replace(plain, threads=t)) for t in threads] if peer else []
    ours = [Ours(drop) for drop in rivals(size)]
    for other in peers:
        other.ready()
    found = held_contest([*ours, *peers], size.substeps)
    return found + held_contest([Ours(drop_of(count)) for count in size.series], size.substeps)


def held_contest(contestants: list[Contestant], substeps: int) -> list[page.Result]:
    """Let contestants take turns; print and return what each needed."""
    found = []
    for one, cost in zip(contestants, contest(contestants, substeps), strict=True):
        version = one.version if isinstance(one, Peer) else ""
        upkeep = one.upkeep() if isinstance(one, Ours) else {}
        found.append(page.Result(one.engine, one.drop, one.particles, *cost, one.bytes, one.grown, version, upkeep))
        one.close()
        cells = zip(found[-1].cells(), WIDTHS, strict=True)
        print(" ".join(f"{cell:{width}s}" for cell, width in cells), flush=True)
    return found


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer particles and substeps")
    parser.add_argument("--json", type=Path, help="write the rows to this file")
    parser.add_argument("--docs", action="store_true", help="write the page of results")
    parser.add_argument("--history", type=Path, help="add what each cost to this CSV")
    parser.add_argument("--peer", type=Path, help="virtual environment with genesis-world")
    parser.add_argument("--peer-install", type=Path, help="make that environment here, and stop")
    parser.add_argument("--phases", action="store_true", help="print where a substep's time goes, and stop")
    chosen = parser.parse_args()
    if chosen.phases:
        size = QUICK if chosen.quick else FULL
        print(phases.table(PHASED_QUICK if chosen.quick else PHASED, size.substeps))
        return
    if chosen.peer_install:
        install(chosen.peer_install)
        return
    machine = page.machine()
    results = measure(QUICK if chosen.quick else FULL, chosen.peer)
    if chosen.json:
        rows = [result.row() for result in results if result.drop.floor and not result.drop.heap]
        chosen.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    if chosen.history:
        history.append(chosen.history, results)
    if chosen.docs:
        flags = {"--quick": chosen.quick, "--docs": True, "--peer DIR": chosen.peer}
        command = " ".join(["python benchmarks/engine.py", *(f for f, on in flags.items() if on)])
        page.write(results, machine, command, DOCS)


if __name__ == "__main__":
    main()

"""What a change costs: substeps of this checkout beside those of another one, batch by batch.

    git worktree add ../before COMMIT
    python benchmarks/against.py ../before [--particles N] [--rounds N] [--law NAME ...]

Each checkout runs in a process of its own with its own ``benchmarks/cost``; the two take turns, so
both meet the same machine. The figure is CPU time per particle and substep, and the ratio is the
median over the rounds of this checkout's batch to the other's batch beside it.
"""

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from checkout import HERE, SERVE, Checkout, answer, import_from

LAWS = ("COROTATED", "NEO_HOOKEAN", "HENCKY", "DRUCKER_PRAGER", "VON_MISES")


@dataclass(frozen=True)
class Case:
    """One drop."""

    law: str
    objects: int
    particles: int

    @property
    def name(self) -> str:
        """Say what falls."""
        return f"{self.law.lower()}, {'a heap of 16' if self.objects > 1 else 'one body'}"


def serve(root: str, law: str, objects: str, particles: str) -> None:
    """Answer with what each of so many substeps costs per particle [ns of CPU time]."""
    import_from(root)
    from cost.blocks import drop_of
    from cost.contest import Ours

    from corporeal.core.types import Law

    many = int(objects)
    ours = Ours(drop_of(int(particles), law=Law[law], objects=many, heap=many > 1))
    answer(lambda substeps: ours.batch(substeps).cpu)


def _ready(root: Path, case: Case) -> Checkout:
    """Start a checkout and wait until its engine is built."""
    started = Checkout(__file__, root, case.law, case.objects, case.particles)
    started.ask(4)
    return started


def compare(case: Case, other: Path, rounds: int, substeps: int) -> tuple[float, float, float]:
    """Return the least cost here and there [ns], and the median ratio of here to there."""
    here, there = _ready(HERE, case), _ready(other, case)
    pairs = []
    for k in range(rounds):
        # Who goes first changes, so that a machine that slows down favours nobody.
        order = (here, there) if k % 2 == 0 else (there, here)
        took = {id(one): one.ask(substeps) for one in order}
        pairs.append((took[id(here)], took[id(there)]))
    here.close()
    there.close()
    return min(a for a, _ in pairs), min(b for _, b in pairs), median(a / b for a, b in pairs)


def main() -> None:
    """Compare, and print a line for each case."""
    if sys.argv[1:2] == [SERVE]:
        serve(*sys.argv[2:])
        return
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", type=Path, help="the other checkout")
    parser.add_argument("--particles", type=int, default=100_000)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--substeps", type=int, default=24, help="of one batch")
    parser.add_argument("--law", nargs="+", choices=LAWS, default=LAWS)
    asked = parser.parse_args()
    cases = [Case(law, 1, asked.particles) for law in asked.law]
    cases.append(Case(asked.law[0], 16, asked.particles))
    print(f"{'':32s}{'here':>8s}{'there':>8s}{'ratio':>8s}")
    for case in cases:
        here, there, ratio = compare(case, asked.other.resolve(), asked.rounds, asked.substeps)
        print(f"{case.name:32s}{here:8.1f}{there:8.1f}{ratio:8.3f}", flush=True)


if __name__ == "__main__":
    main()

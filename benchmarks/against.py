"""What a change costs: substeps of this checkout beside those of another one, batch by batch.

    git worktree add ../before COMMIT
    python benchmarks/against.py ../before [--particles N] [--rounds N] [--law NAME ...]

Each checkout runs in a process of its own with its own ``benchmarks/cost``; the two take turns, so
both meet the same machine. The figure is CPU time per particle and substep, and the ratio is the
median over the rounds of this checkout's batch to the other's batch beside it.
"""

import argparse
import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from statistics import median

HERE = Path(__file__).resolve().parents[1]
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


class Checkout:
    """The drop in one checkout, in a process of its own."""

    def __init__(self, root: Path, case: Case) -> None:
        """Start the process and wait until the engine is built."""
        words = (str(root), case.law, str(case.objects), str(case.particles))
        self.process = subprocess.Popen(
            [sys.executable, __file__, "--serve", *words],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.ask(4)

    def ask(self, substeps: int) -> float:
        """Take some substeps; return what each cost per particle [ns of CPU time]."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(f"{substeps}\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            sys.exit("One of the checkouts did not run: see above.")
        return json.loads(line)

    def close(self) -> None:
        """End the process."""
        self.process.communicate()


def serve(root: str, law: str, objects: str, particles: str) -> None:
    """Answer one line of standard input after the other with the cost of so many substeps."""
    sys.path[:1] = [f"{root}/benchmarks", f"{root}/src"]
    from cost.blocks import drop_of
    from cost.contest import Ours

    from corporeal.types import Law

    many = int(objects)
    ours = Ours(drop_of(int(particles), law=Law[law], objects=many, heap=many > 1))
    for line in sys.stdin:
        sys.stdout.write(json.dumps(ours.batch(int(line)).cpu) + "\n")
        sys.stdout.flush()


def compare(case: Case, other: Path, rounds: int, substeps: int) -> tuple[float, float, float]:
    """Return the least cost here and there [ns], and the median ratio of here to there."""
    here, there = Checkout(HERE, case), Checkout(other, case)
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
    if sys.argv[1:2] == ["--serve"]:
        serve(*sys.argv[2:])
        return
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
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

"""Where a substep's time goes: by phases of one body and of heaps, in turns, on one thread."""

from collections.abc import Sequence

from corporeal.mpm.constants import KEPT_STEPS
from corporeal.mpm.cpu.phase_clock import PhaseClock
from cost.blocks import drop_of
from cost.contest import ROUNDS, Ours

REST = ("list", "face", "choose", "find", "resolve")
"""Pieces of contact that are shown as one row: each is small."""
ROWS = ("move", "reach", "solve", "look", REST)


class Watched:
    """One drop whose phases are timed."""

    def __init__(self, particles: int, objects: int) -> None:
        """Build the engine and begin to watch it."""
        self.ours = Ours(drop_of(particles, objects=objects, heap=objects > 1))
        self.clock = PhaseClock(self.ours.solver.program)
        self.name = "one body" if objects == 1 else f"a heap of {objects}"
        self.name += f", {self.ours.particles:,}"
        self.best: dict[str, float] = {}

    def round(self, substeps: int) -> None:
        """Take a batch; keep it if it took less than all before it."""
        self.clock.clear()
        before = self.ours.solver.steps.count
        self.ours.batch(substeps)
        unit = 1e9 / (self.ours.solver.steps.count - before) / self.ours.particles
        now = {name: unit * seconds for name, seconds in self.clock.seconds().items()}
        if not self.best or sum(now.values()) < sum(self.best.values()):
            self.best = now


def table(sizes: Sequence[tuple[int, int]], substeps: int) -> str:
    """Measure and lay out a table: ns per particle and substep.

    Args:
        sizes: Particles and objects of each column; the first is what the last row divides by.
        substeps: Of one batch, at least: whole rounds of those of which one looks at all contacts.

    """
    substeps = -(-substeps // KEPT_STEPS) * KEPT_STEPS
    watched = [Watched(*size) for size in sizes]
    for one in watched:
        one.ours.batch(substeps)
    for _ in range(ROUNDS):
        for one in watched:
            one.round(substeps)
    lines = [" | ".join(["| phase", *(one.name for one in watched)]) + " |"]
    lines.append("| --- " * (1 + len(watched)) + "|")
    shown: set[str] = set()
    for row in ROWS:
        pieces = (row,) if isinstance(row, str) else row
        shown |= set(pieces)
        lines.append(_line(" ".join(pieces), watched, [_sum(one, pieces) for one in watched]))
    others = [n for n in watched[0].best if n not in shown]
    lines.append(_line("all others", watched, [_sum(one, others) for one in watched]))
    whole = [sum(one.best.values()) for one in watched]
    lines.append(_line("all", watched, whole))
    ratios = " | ".join(f"{total / whole[0]:.2f}" for total in whole)
    lines.append(f"| against the first | {ratios} |")
    return "\n".join(lines)


def _sum(one: Watched, pieces: Sequence[str]) -> float:
    return sum(one.best.get(piece, 0.0) for piece in pieces)


def _line(name: str, watched: Sequence[Watched], values: Sequence[float]) -> str:
    assert len(values) == len(watched)
    return f"| {name} | " + " | ".join(f"{value:.1f}" for value in values) + " |"

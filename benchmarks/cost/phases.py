"""Where a substep's time goes: by phases of one body and of several, in turns, on one thread."""

from collections.abc import Sequence

from corporeal.mpm.constants import NORMAL_CACHE_STEPS
from cost.blocks import Drop
from cost.contest import ROUNDS, Ours
from cost.phase_clock import PhaseClock

REST = ("list", "face", "choose", "find", "resolve")
"""Pieces of contact that are shown as one row: each is small."""
ROWS = ("move", "reach", "solve", "look", REST)
BETWEEN = "sorts, and between steps"
"""What a batch takes beside its phases."""


class Watched:
    """One drop whose phases are timed."""

    def __init__(self, drop: Drop) -> None:
        """Build the engine and begin to watch it."""
        self.ours = Ours(drop)
        self.clock = PhaseClock(self.ours.solver.program)
        several = f"a heap of {drop.objects}" if drop.heap else f"{drop.objects} side by side"
        self.name = "one body" if drop.objects == 1 else several
        self.name += f", {self.ours.particles:,}"
        self.best: dict[str, float] = {}

    def round(self, substeps: int) -> None:
        """Take a batch; keep it if it took less than all before it."""
        self.clock.clear()
        before = self.ours.solver.steps.count
        whole = self.ours.batch(substeps).cpu
        unit = 1e9 / (self.ours.solver.steps.count - before) / self.ours.particles
        now = {name: unit * seconds for name, seconds in self.clock.seconds().items()}
        now[BETWEEN] = max(0.0, whole - sum(now.values()))
        if not self.best or sum(now.values()) < sum(self.best.values()):
            self.best = now


def table(drops: Sequence[Drop], substeps: int) -> str:
    """Measure and lay out a table: ns per particle and substep.

    Args:
        drops: One for each column; the first is what the last row divides by.
        substeps: Of one batch, at least: whole rounds of those of which one looks at all contacts.

    """
    substeps = -(-substeps // NORMAL_CACHE_STEPS) * NORMAL_CACHE_STEPS
    watched = [Watched(drop) for drop in drops]
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
    others = [n for n in watched[0].best if n not in shown and n != BETWEEN]
    lines.append(_line("all others", watched, [_sum(one, others) for one in watched]))
    lines.append(_line(BETWEEN, watched, [one.best[BETWEEN] for one in watched]))
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

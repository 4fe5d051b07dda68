"""What a simulation that runs while somebody watches can afford."""

from collections.abc import Mapping

from corporeal.treatment.plan import QUALITIES, Detail, Quality
from corporeal.types import Particles

CELLS = (8, 6, 5, 4)
"""Cells across the smallest deformable object, the finest first."""
SHARE = 0.7
"""Of the threads' time that steps may take; the rest shows pictures."""
COST = 1.0e-7
"""CPU seconds per deformable particle and step: 50 to 160 ns were measured on seven scenes."""
FEWEST = 3e3
"""Steps per simulated second below which coarser cells are better."""
MOST = 20e3
"""Steps per simulated second beyond which no draft goes either."""


def live_quality(deformable: int, detail: Detail, threads: int) -> Quality:
    """Choose the finest cells whose predicted cost is real time, and as many steps as fit.

    Spare time buys stiffness: the step budget keeps the order of stiffness.

    Args:
        deformable: Particles that deform in the scene as it was filled.
        detail: With which it was filled.
        threads: Of the engine.

    """
    filled: Mapping[str, Quality] = QUALITIES
    across = filled[detail].cells_across

    def steps_at(cells: int) -> float:
        """Return the steps per simulated second that fit."""
        count = max(deformable * (cells / across) ** 3, 1.0)
        return SHARE * threads / (COST * count)

    cells = next((c for c in CELLS if steps_at(c) >= FEWEST), CELLS[-1])
    steps = min(max(steps_at(cells), FEWEST), MOST)
    coarse = filled["draft"]
    along = coarse.cells_along * cells // coarse.cells_across
    return Quality(cells, along, coarse.particles, steps, float("inf"))


def deformable(particles: Particles) -> int:
    """Count the particles that deform."""
    return sum(
        int((particles.part == k).sum())
        for k, t in enumerate(particles.treatments)
        if t.kind != "rigid"
    )

"""What a simulation that runs while somebody watches can afford."""

from dataclasses import dataclass, replace

from corporeal.core.types import Particles
from corporeal.discretization.plan import QUALITIES, Detail, Quality
from corporeal.discretization.step_budget import counted
from corporeal.mpm.constants import COURANT

CELLS = (8, 7, 6, 5, 4)
"""Cells across the smallest deformable object, the finest first."""
SHARE = 0.4
"""Of the threads' time that steps may take as they cost before anything touches: once it does they
cost about twice as much (2.1 to 2.4 times in the first two showcase scenes)."""
OUTRUN = 4.0
"""Waves run at least so many times faster than anything moves [-]; a run asks for 10, at which the
duck on mud takes 2.3 times the steps. What is softer for it is said in the page."""
ENOUGH = 3e3
"""Steps per simulated second below which coarser cells are better, where cells can be coarser."""
FEWEST = 1e3
"""Steps per simulated second that any scene gets."""
MOST = 20e3
"""Steps per simulated second beyond which no draft goes either."""


@dataclass(frozen=True)
class Demand:
    """What a filled scene asks of whoever steps it."""

    cost: float
    """CPU seconds of a step, as it was filled: measured, as few particles in many cells cost more
    each than many in few."""
    cells: int
    """Across the smallest deformable object, as it was filled."""
    cell: float
    """dx, as it was filled [m]."""
    steps: float
    """Per simulated second, as it was filled; 0: nothing in it deforms."""
    motion: float
    """Fastest that anything is expected to move [m/s]."""
    stiffened: float
    """Wave speed over the one that the step budget counts [-]: what loss adds."""

    @classmethod
    def of(cls, particles: Particles, detail: Detail, cost: float) -> "Demand":
        """Look at what was filled with a detail, of which a step costs so many CPU seconds."""
        treatments = particles.treatments
        waving = [t for t in treatments if t.wave_speed > 0]
        return cls(
            cost,
            QUALITIES[detail].cells_across,
            particles.cell,
            max((1 / t.step for t in waving), default=0.0),
            max((t.impact_speed for t in treatments), default=0.0),
            max((t.wave_speed / counted(t) for t in waving), default=1.0),
        )

    def step_cost(self, cells: int) -> float:
        """Return what a step costs with so many cells [CPU s]."""
        return self.cost * (cells / self.cells) ** 3

    def least_steps(self, cells: int) -> float:
        """Return the steps per simulated second that no budget goes below.

        Waves must outrun what moves, whatever the budget (``step_budget.fit_budget``).
        """
        cell = self.cell * self.cells / cells
        outrun = (OUTRUN * self.stiffened + 1) * self.motion / (COURANT * cell)
        return min(max(outrun, ENOUGH), self.steps * cells / self.cells)


def live_quality(demand: Demand, threads: int) -> Quality:
    """Choose the finest cells whose predicted cost is real time, and as many steps as fit.

    Spare time buys stiffness: the step budget keeps the order of stiffness.

    Args:
        demand: Of the scene as it was filled.
        threads: Of the engine.

    """

    def steps_at(cells: int) -> float:
        """Return the steps per simulated second that fit."""
        return SHARE * threads / demand.step_cost(cells)

    cells = next((c for c in CELLS if steps_at(c) >= demand.least_steps(c)), CELLS[-1])
    # Loss stiffens: that many more steps are taken than the budget counts.
    steps = min(max(steps_at(cells) / demand.stiffened, FEWEST), MOST)
    coarse = QUALITIES["draft"]
    along = coarse.cells_along * cells // coarse.cells_across
    return Quality(cells, along, coarse.particles, steps, float("inf"), OUTRUN)


def held(quality: Quality, demand: Demand, cell: float, threads: int) -> Quality:
    """Return a quality with fewer steps where its cells turned out finer than it asked for.

    What is rigid is at least a cell wide, whatever the budget: then only steps can be saved.

    Args:
        quality: From ``live_quality``.
        demand: Of the scene as it was filled before.
        cell: dx that it led to [m].
        threads: Of the engine.

    """
    fits = SHARE * threads / (demand.cost * (demand.cell / cell) ** 3)
    steps = max(fits / demand.stiffened, FEWEST)
    return replace(quality, steps_per_second=min(quality.steps_per_second, steps))

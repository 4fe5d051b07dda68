"""Resolution of interactive simulations."""

from dataclasses import dataclass, replace

from corporeal.core.types import Particles
from corporeal.discretization.discretization_plan import QUALITY_PRESETS, DetailLevel, QualityPreset
from corporeal.discretization.step_budget import counted_wave_speed
from corporeal.mpm.constants import COURANT

LIVE_CELLS_ACROSS = (8, 7, 6, 5, 4)
"""Cells across the smallest deformable object, the finest first."""
MAX_STEP_TIME_FRACTION = 0.4
"""Of the threads' time that steps may take as they cost before anything touches: once it does they cost about twice as
much (2.1 to 2.4 times in the first two showcase scenes)."""
LIVE_WAVE_SPEED_RATIO = 4.0
"""Waves run at least so many times faster than anything moves [-]; a run asks for 10, at which the duck on mud takes
2.3 times the steps. The page states what is softer for it."""
SUFFICIENT_STEPS_PER_SECOND = 3e3
"""Steps per simulated second below which coarser cells are better, where cells can be coarser."""
MIN_STEPS_PER_SECOND = 1e3
"""Steps per simulated second that any scene gets."""
MAX_STEPS_PER_SECOND = 20e3
"""Steps per simulated second beyond which no draft goes either."""


@dataclass(frozen=True)
class LiveDemand:
    """What a filled scene asks of whoever steps it."""

    cost: float
    """CPU seconds of a step, as it was filled: measured, as few particles in many cells cost more each than many in
    few."""
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
    def of(cls, particles: Particles, detail: DetailLevel, cost: float) -> "LiveDemand":
        """Look at what was filled with a detail, of which a step costs so many CPU seconds."""
        treatments = particles.treatments
        waving = [t for t in treatments if t.wave_speed > 0]
        return cls(
            cost,
            QUALITY_PRESETS[detail].cells_across,
            particles.cell,
            max((1 / t.step for t in waving), default=0.0),
            max((t.impact_speed for t in treatments), default=0.0),
            max((t.wave_speed / counted_wave_speed(t) for t in waving), default=1.0),
        )

    def step_cost(self, cells: int) -> float:
        """Return what a step costs with so many cells [CPU s]."""
        return self.cost * (cells / self.cells) ** 3

    def least_steps(self, cells: int) -> float:
        """Return the steps per simulated second that no budget goes below.

        Waves must outrun what moves, whatever the budget (``step_budget.fit_budget``).
        """
        cell = self.cell * self.cells / cells
        outrun = (LIVE_WAVE_SPEED_RATIO * self.stiffened + 1) * self.motion / (COURANT * cell)
        return min(max(outrun, SUFFICIENT_STEPS_PER_SECOND), self.steps * cells / self.cells)


def choose_live_quality(demand: LiveDemand, threads: int) -> QualityPreset:
    """Choose the finest cells whose predicted cost is real time, and as many steps as fit.

    Spare time buys stiffness: the step budget keeps the order of stiffness.
    """

    def steps_at(cells: int) -> float:
        """Return the steps per simulated second that fit."""
        return MAX_STEP_TIME_FRACTION * threads / demand.step_cost(cells)

    cells = next((c for c in LIVE_CELLS_ACROSS if steps_at(c) >= demand.least_steps(c)), LIVE_CELLS_ACROSS[-1])
    # Loss stiffens: that many more steps are taken than the budget counts.
    steps = min(max(steps_at(cells) / demand.stiffened, MIN_STEPS_PER_SECOND), MAX_STEPS_PER_SECOND)
    coarse = QUALITY_PRESETS["draft"]
    along = coarse.cells_along * cells // coarse.cells_across
    return QualityPreset(cells, along, coarse.particles, steps, float("inf"), LIVE_WAVE_SPEED_RATIO)


def limit_live_steps(quality: QualityPreset, demand: LiveDemand, cell: float, threads: int) -> QualityPreset:
    """Return a quality with fewer steps where its cells turned out finer than it asked for.

    What is rigid is at least a cell wide, whatever the budget: then only steps can be saved.

    Args:
        quality: From ``choose_live_quality``.
        demand: Of the scene as it was filled before.
        cell: dx that it led to [m].
        threads: Of the engine.
    """
    fits = MAX_STEP_TIME_FRACTION * threads / (demand.cost * (demand.cell / cell) ** 3)
    steps = max(fits / demand.stiffened, MIN_STEPS_PER_SECOND)
    return replace(quality, steps_per_second=min(quality.steps_per_second, steps))

"""Settings of closed surfaces."""

from dataclasses import dataclass

from corporeal.reconstruction.gaussians.hull_config import DEFAULT_HULL, HullConfig


@dataclass(frozen=True)
class ClosedSurfaceConfig:
    """How finely closed surfaces of objects are carved."""

    object_grid_cells: int = 1_000_000
    """Cells of the grid about each object, about [1]."""
    survey_grid_cells: int = 200_000
    """Cells of the grid about everything, where each object is looked for [1]."""
    hull: HullConfig = DEFAULT_HULL
    """How the visual hull is carved in which photographs are asked how deep they see."""
    threads: int | None = None
    """None: one per core that this process may use. Changes no result."""


DEFAULT_CLOSED_SURFACE = ClosedSurfaceConfig()


@dataclass(frozen=True)
class FreeSpaceConfig:
    """How finely space is carved that cameras see to be empty."""

    grid_cells: int = 1_000_000
    """Cells of the grid about everything, about [1]."""
    threads: int | None = None
    """None: one per core that this process may use. Changes no result."""


DEFAULT_FREE_SPACE = FreeSpaceConfig()

"""Settings of the visual hull."""

from dataclasses import dataclass


@dataclass(frozen=True)
class HullConfig:
    """How the visual hull is carved from masks."""

    grid_cells: int = 2_000_000
    """Cells of the grid that it is carved from [1]."""
    min_mask_fill_fraction: float = 0.996
    """Fraction of its mask that a silhouette of the hull fills where masks agree, in the median view [1]. Outlines that
    err by 10 of 640 pixels leave .992, exact ones and those that err by 4 leave nothing. 0: masks are taken at their
    word."""
    phantom_max_views: int = 7
    """Where no more views look, silhouettes may cross by chance where there is nothing [1]. 0: all pieces are kept."""


DEFAULT_HULL = HullConfig()

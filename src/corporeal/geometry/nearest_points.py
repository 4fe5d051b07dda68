"""Nearest neighbours of evenly spaced points: by cells, and by a tree for distant queries.

Cells one spacing wide hold about one point each: some thirty distances settle which is nearest, in
a fifth of the time that a tree of points takes. The answer is the same.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

from corporeal.geometry import kernels_nearest

MAX_CELLS_PER_POINT = 4
"""Cells per point, at most: what lies far off must not make the table large."""


@dataclass(frozen=True)
class PointCells:
    """Points in order of their cells."""

    points: Float[np.ndarray, "N 3"]
    """[m]"""
    number: Int[np.ndarray, " N"]
    """Of each point, as it was given."""
    low: Float[np.ndarray, " 3"]
    """Corner of the first cell [m]."""
    width: float
    """Of a cell [m]."""
    counts: Int[np.ndarray, " 3"]
    first: Int[np.ndarray, " C1"]
    """Point that each cell begins with; one more at the end."""

    def nearest(self, places: Float[np.ndarray, "M 3"]) -> Int[np.ndarray, " M"]:
        """Which point is nearest to each place."""
        found = np.full(len(places), -1, np.int64)
        kernels_nearest.nearest_in_cells(
            places, self.points, self.low, self.width, self.counts, self.first, found
        )
        far = np.flatnonzero(found < 0)
        if len(far):
            found[far] = KDTree(self.points).query(places[far])[1]
        return self.number[found]


def sort_into_cells(points: Float[np.ndarray, "N 3"], spacing: float) -> PointCells:
    """Sort points into cells.

    Args:
        points: At least one [m].
        spacing: About how far apart they are [m].

    """
    low = points.min(axis=0)
    span = points.max(axis=0) - low
    width = max(spacing, 1e-300)
    while np.prod(np.floor(span / width) + 1) > MAX_CELLS_PER_POINT * len(points) + 1000:
        width *= 1.5
    counts = np.floor(span / width).astype(np.int64) + 1
    place = np.minimum(((points - low) / width).astype(np.int64), counts - 1)
    key = (place[:, 0] * counts[1] + place[:, 1]) * counts[2] + place[:, 2]
    order = np.argsort(key, kind="stable")
    held = np.bincount(key, minlength=int(np.prod(counts)))
    first = np.concatenate([[0], np.cumsum(held)])
    return PointCells(np.ascontiguousarray(points[order]), order, low, width, counts, first)

"""The mark in sand, mud, snow or paste: how deep its free surface fell, and how high a rim rose.

Cohesive bodies are dented where their material went (``residual_shape.dent``). Grains and pastes separate: a splash
carries a few far away, which says nothing of the depth of the hollow. Its depth is that of the surface, in columns
along z of a width of ``COLUMN_WIDTH_DX`` cells.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.core.types import Material
from corporeal.mpm.laws import CONSTITUTIVE_LAWS
from corporeal.simulation.residual_shape import trusted_fit

COLUMN_WIDTH_DX = 1.0
"""Side of a column [cells]: a layer of it is four particles, half a cell apart."""
PARTICLES_ABOVE_SURFACE = 2
"""So many particles of a column may lie above its surface: half a layer, grains that lie loose."""


@dataclass(frozen=True)
class SurfaceMark:
    """Change of the free surface of a body."""

    depth: float
    """By how much the surface fell in the column where it fell most [m]."""
    rim: float
    """By how much it rose in the column where it rose most [m], 0: nowhere."""
    place: Float[np.ndarray, " 3"]
    """Centroid of what fell by more than the threshold, weighted by how far squared, on the surface as it started [m];
    nan: nothing did."""
    share: float
    """Share of the columns that fell so far [-]."""


def keeps_surface_mark(material: Material) -> bool:
    """Whether a material loses cohesion but keeps a mark: grains and yielding pastes."""
    return CONSTITUTIVE_LAWS[material.law].granular or material.yield_shear > 0.0


def surface_mark(
    start: Float[np.ndarray, "N 3"], now: list[Float[np.ndarray, "N 3"]], cell: float, threshold: float
) -> SurfaceMark:
    """Compare the heights of a body's free surface with those at the start.

    The rigid motion of what kept its shape is taken off first. A column whose particles have all gone fell to where the
    lowest of them lay. Columns that were empty at the start count for
    nothing: what is thrown beside a heap is no rim.

    Args:
        start: Where the particles started, z up [m].
        now: Where they are in each of the last frames; the median of the heights counts, so that what flies past a
            column is none of its surface [m].
        cell: Grid spacing dx, of particles half a cell apart [m].
        threshold: What fell by less belongs to no mark [m].
    """
    columns = HeightColumns.over(start, COLUMN_WIDTH_DX * cell)
    before = columns.heights(start)
    after = np.median([columns.heights(trusted_fit(start, x).undo(x)) for x in now], axis=0)
    filled = before > columns.bottom
    if not filled.any():
        return SurfaceMark(0.0, 0.0, np.full(3, np.nan), 0.0)
    fall = np.zeros(len(before))
    fall[filled] = before[filled] - after[filled]
    deep = fall > threshold
    place = np.full(3, np.nan)
    if deep.any():
        middle = np.column_stack([columns.middles(), before])
        place = np.average(middle[deep], axis=0, weights=fall[deep] ** 2)
    share = float(deep.sum() / filled.sum())
    return SurfaceMark(max(0.0, float(fall.max())), max(0.0, float(-fall.min())), place, share)


@dataclass(frozen=True)
class HeightColumns:
    """Columns of square section along z over a body, C of them."""

    corner: Float[np.ndarray, " 2"]
    """[m]"""
    width: float
    """[m]"""
    count: Int[np.ndarray, " 2"]
    """Along x and y."""
    bottom: Float[np.ndarray, " C"]
    """Height of the lowest point of each at the start [m]; inf: it has none."""

    @classmethod
    def over(cls, points: Float[np.ndarray, "N 3"], width: float) -> "HeightColumns":
        """Lay columns over the points that a body starts with.

        Their edges lie half a spacing beside its outermost points, so that where points are a lattice no row of them is
        on an edge.
        """
        corner = points[:, :2].min(axis=0) - width / 4
        count = np.floor((points[:, :2].max(axis=0) - corner) / width).astype(int) + 1
        columns = cls(corner, width, count, np.full(count.prod(), np.inf))
        np.minimum.at(columns.bottom, columns.of(points)[0], points[:, 2])
        return columns

    def of(self, points: Float[np.ndarray, "N 3"]) -> tuple[Int[np.ndarray, " M"], Bool[np.ndarray, " N"]]:
        """Return the columns of those points that are in any, and which points those are."""
        cells = np.floor((points[:, :2] - self.corner) / self.width)
        inside = np.asarray(((cells >= 0) & (cells < self.count)).all(axis=1))
        x, y = cells[inside].astype(int).T
        return x * self.count[1] + y, inside

    def heights(self, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " C"]:
        """Height of the surface in each column [m]: of the highest point but ``PARTICLES_ABOVE_SURFACE`` others.

        Where there are fewer points it is the bottom.
        """
        column, inside = self.of(points)
        height = points[inside, 2]
        downwards = np.lexsort((-height, column))
        column, height = column[downwards], height[downwards]
        number = np.arange(len(self.bottom))
        surface = np.searchsorted(column, number) + PARTICLES_ABOVE_SURFACE
        found = surface < np.searchsorted(column, number, side="right")
        result = self.bottom.copy()
        result[found] = np.maximum(result[found], height[surface[found]])
        return result

    def middles(self) -> Float[np.ndarray, "C 2"]:
        """Return the middle of each column in the plane [m]."""
        x, y = np.unravel_index(np.arange(len(self.bottom)), self.count)
        return self.corner + (np.column_stack([x, y]) + 0.5) * self.width

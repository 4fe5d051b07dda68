"""Inside test of a mesh along parallel columns: exact where the mesh is closed.

A ray that is shot at triangles one after the other passes between two of them, and misses the
second of two faces in one plane, as where a cushion lies on its frame. Here triangles are drawn
onto the plane that the columns stand on, as a raster is, and every edge is decided once: all
triangles that share it get the same answer, however numbers round. What a column enters it leaves,
as long as edges are walked as often one way as the other.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.geometry import kernels_vertical_lines as kernels


@dataclass(frozen=True)
class ColumnCrossings:
    """Where columns cross a mesh, column by column, from below; H crossings."""

    first: Int[np.ndarray, " C1"]
    """Number of each column's first crossing; one more at the end."""
    height: Float[np.ndarray, " H"]
    """Ascending within a column; in units of the lattice."""
    step: Int[np.ndarray, " H"]
    """1 into the shape, -1 out."""

    @property
    def open(self) -> Bool[np.ndarray, " C"]:
        """Whether a column does not leave the shape as often as it enters it."""
        total = np.concatenate([[0], np.cumsum(self.step)])
        return np.diff(total[self.first]) != 0


def column_crossings(
    vertices: Float[np.ndarray, "V 3"],
    triangles: Int[np.ndarray, "T 3"],
    columns: Float[np.ndarray, "nx ny 2"],
) -> ColumnCrossings:
    """Find where columns along the third axis cross a mesh.

    Args:
        vertices: In units of the lattice, from the corner of its first cube.
        triangles: Their vertices.
        columns: Where each column stands: within the cube of its number, [i, i + 1) by [j, j + 1).

    """
    count = np.zeros(columns.shape[:2], np.int64)
    kernels.collect_crossings(vertices, triangles, columns, count, np.zeros((0, 2)))
    first = np.concatenate([[0], np.cumsum(count)])
    met = np.zeros((first[-1], 2))
    kernels.collect_crossings(
        vertices, triangles, columns, first[:-1].reshape(count.shape).copy(), met
    )
    kernels.sort_crossings(first, met)
    return ColumnCrossings(first, met[:, 0].copy(), met[:, 1].astype(np.int64))


def points_wound_around(
    met: ColumnCrossings, heights: Float[np.ndarray, "C nz"]
) -> tuple[Int[np.ndarray, " N"], Int[np.ndarray, " N"]]:
    """Find the points that the mesh winds around at all.

    Args:
        met: Where the columns cross it.
        heights: Of each column's points, ascending.

    Returns:
        Column and layer of each.

    """
    count = np.zeros(len(heights), np.int64)
    crossed = met.first, met.height, met.step
    kernels.collect_points_in_columns(crossed, heights, count, np.zeros(0, np.int64))
    column = np.repeat(np.arange(len(heights)), count)
    layer = np.zeros(len(column), np.int64)
    kernels.collect_points_in_columns(crossed, heights, np.cumsum(count) - count, layer)
    return column, layer

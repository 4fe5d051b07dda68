"""Quadrature weights of points.

Points spread evenly stand for unequal shares of a body all the same. If all weigh alike, a ball
of some thousand points has its mass beside its middle and is softer here than there: dropped
upright it bounces off to a side. Each point at the centroid of its Voronoi cell and with the cell's
volume is the midpoint rule: exact for whatever is linear within cells, so for mass and its centre.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float

from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.geometry.nearest_points import sort_into_cells
from corporeal.geometry.point_relaxation import keep_points_inside
from corporeal.geometry.point_sampling import scatter_points_by_slab

SAMPLES_PER_SPACING = 5
"""Samples per spacing. With 3 a rubber ball bounces off to a side four times as far."""


def centroidal_points(
    points: Float[np.ndarray, "N 3"],
    shape: QueryMesh,
    spacing: float,
    held: Bool[np.ndarray, " N"],
    empty: Callable[[np.ndarray], np.ndarray] | None = None,
) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, " N"]]:
    """Move points to the centroids of their Voronoi cells within a shape, and measure these.

    Args:
        points: Inside the shape, about ``spacing`` apart [m].
        shape: What is divided among them.
        spacing: [m]
        held: Points that stay: layers in the middle of what is thin.
        empty: For each point given, whether it belongs to something else; None: nothing does.

    Returns:
        Positions [m] and volumes of the cells [m³].

    """
    if not len(points):
        return points, np.zeros(0)
    table = sort_into_cells(points, spacing)
    count, total = np.zeros(len(points)), np.zeros_like(points)
    for samples in scatter_points_by_slab(
        shape, spacing / SAMPLES_PER_SPACING, np.random.default_rng(5)
    ):
        if empty is not None:
            samples = samples[~empty(samples)]
        owner = table.nearest(samples)
        count += np.bincount(owner, minlength=len(points))
        for axis in range(3):
            total[:, axis] += np.bincount(owner, samples[:, axis], len(points))
    moved = np.flatnonzero((count > 0) & ~held)
    centre = points.copy()
    centre[moved] = total[moved] / count[moved, None]
    return keep_points_inside(centre, points, shape, moved), count * (
        spacing / SAMPLES_PER_SPACING
    ) ** 3

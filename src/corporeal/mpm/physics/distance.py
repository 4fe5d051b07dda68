"""How far bodies are apart, and how deep they reach into each other and into the floor.

A particle stands for a ball of a quarter cell (two particles per cell and axis); its surface is
that far outside its centre.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from corporeal.mpm.constants import BOXES_APART, DEEPEST_PARTICLES, OVERLAP_REACH, PARTICLE_RADIUS
from corporeal.mpm.problem import Plane

_U = np.linspace(-1.0, 1.0, 401)
_FILLED = 0.5 + 0.75 * _U - 0.25 * _U**3


def pair_gaps(
    bodies: Sequence[Float[np.ndarray, "_ 3"]], cell: float
) -> tuple[Float[np.ndarray, "B B"], Float[np.ndarray, "B B"]]:
    """Distance of surfaces and depth of overlap of every two bodies, both [m].

    Args:
        bodies: Particle positions of each body [m].
        cell: Grid spacing dx [m].

    Returns:
        Gap, negative when particles interleave, inf on the diagonal; depth, 0 when apart.

    """
    count = len(bodies)
    gap, depth = np.full((count, count), np.inf), np.zeros((count, count))
    for a in range(count):
        for c in range(a + 1, count):
            gap[a, c], depth[a, c] = pair_gap(bodies[a], bodies[c], cell)
            gap[c, a], depth[c, a] = gap[a, c], depth[a, c]
    return gap, depth


def pair_gap(a: np.ndarray, c: np.ndarray, cell: float) -> tuple[float, float]:
    """Gap and depth of two bodies [m]."""
    apart = np.maximum(0.0, np.maximum(a.min(0) - c.max(0), c.min(0) - a.max(0)))
    distance = float(np.linalg.norm(apart))
    if distance > BOXES_APART * cell:
        return distance - 2 * PARTICLE_RADIUS * cell, 0.0
    reach = distance + 2 * BOXES_APART * cell
    near_a, near_c = within(a, c, reach), within(c, a, reach)
    if len(near_a) == 0 or len(near_c) == 0:
        return reach, 0.0
    tree_a, tree_c = KDTree(near_a), KDTree(near_c)
    close = OVERLAP_REACH * cell
    to_c = tree_c.query(near_a, distance_upper_bound=close)[0]  # bounded: far ones cost most
    to_a = tree_a.query(near_c, distance_upper_bound=close)[0]
    if np.isinf(to_c).all():
        to_c = tree_c.query(near_a)[0]
    depth = max(
        overlap(near_a[to_c < close], tree_c, cell), overlap(near_c[to_a < close], tree_a, cell)
    )
    return float(to_c.min()) - 2 * PARTICLE_RADIUS * cell, depth


def within(points: np.ndarray, other: np.ndarray, reach: float) -> np.ndarray:
    """Points not farther than ``reach`` outside the other's bounding box [m]."""
    inside = (points > other.min(0) - reach) & (points < other.max(0) + reach)
    return points[inside.all(axis=1)]


def overlap(points: np.ndarray, tree: KDTree, cell: float) -> float:
    """How deep the deepest of some points, as balls, lie below the surface of a body [m].

    The share φ of a ball of radius r that lies in a half space whose face is s away is
    φ = ½ + ¾ s/r - ¼ (s/r)³ (spherical cap): the number of neighbours gives s.
    """
    if len(points) == 0:
        return 0.0
    reach = OVERLAP_REACH * cell
    full = 8.0 * 4.0 / 3.0 * np.pi * OVERLAP_REACH**3
    neighbours = np.asarray(tree.query_ball_point(points, reach, return_length=True))
    signed = reach * np.interp(neighbours / full, _FILLED, _U)
    deepest = np.sort(signed)[-DEEPEST_PARTICLES:].mean()
    return max(0.0, float(deepest) + PARTICLE_RADIUS * cell)


def plane_depth(
    points: Float[np.ndarray, "N 3"],
    plane: Plane,
    motion: Float[np.ndarray, "N 3 3"] | None,
    cell: float,
) -> float:
    """How deep a body reaches into a wall [m].

    Args:
        points: Surface points, or particle centres when ``motion`` is given [m].
        plane: The floor or a wall.
        motion: Deformation gradients: a particle's ball becomes an ellipsoid of half width
            r ‖Fᵀ n‖ along n; grains that have flowed far are no ellipsoid any more, so it is
            at most 2 r.
        cell: Grid spacing dx [m].

    """
    normal = np.array(plane.normal)
    height = points @ normal - plane.offset
    if motion is not None:
        stretch = np.minimum(np.linalg.norm(normal @ motion, axis=1), 2.0)
        height = height - PARTICLE_RADIUS * cell * stretch
    return max(0.0, -float(height.min(initial=np.inf)))

"""Distances between bodies, and penetration into each other and into planes.

A particle stands for a ball of a quarter cell (two particles per cell and axis); its surface is that far outside its
centre.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from corporeal.mpm.constants import (
    BOUNDING_BOX_DISTANCE_DX,
    OVERLAP_DEPTH_PARTICLES,
    OVERLAP_RADIUS_DX,
    PARTICLE_RADIUS_DX,
    SQUEEZED_VOLUME_RATIO,
)
from corporeal.mpm.problem import Plane

_CAP_HEIGHTS = np.linspace(-1.0, 1.0, 401)
_CAP_FRACTIONS = 0.5 + 0.75 * _CAP_HEIGHTS - 0.25 * _CAP_HEIGHTS**3


def pair_gaps(
    bodies: Sequence[Float[np.ndarray, "_ 3"]], cell: float, squeezed: Sequence[Float[np.ndarray, " _"]] | None = None
) -> tuple[Float[np.ndarray, "B B"], Float[np.ndarray, "B B"]]:
    """Distance of surfaces and depth of overlap of every two bodies, both [m].

    Args:
        bodies: Particle positions of each body [m].
        cell: Grid spacing dx [m].
        squeezed: Volume of each of these particles over its volume at rest, at most 1 [-]; None: all at rest.

    Returns:
        Gap, negative when particles interleave, inf on the diagonal; depth, 0 when apart.
    """
    count = len(bodies)
    if squeezed is None:
        squeezed = [np.ones(len(b)) for b in bodies]
    lumps = [BodyPoints(b, v) for b, v in zip(bodies, squeezed, strict=True)]
    gap, depth = np.full((count, count), np.inf), np.zeros((count, count))
    for a in range(count):
        for c in range(a + 1, count):
            gap[a, c], depth[a, c] = pair_gap(lumps[a], lumps[c], cell)
            gap[c, a], depth[c, a] = gap[a, c], depth[a, c]
    return gap, depth


@dataclass(frozen=True)
class BodyPoints:
    """Particles of one body."""

    points: Float[np.ndarray, "N 3"]
    """[m]"""
    squeezed: Float[np.ndarray, " N"]
    """Volume over volume at rest, at most 1 [-]."""

    @cached_property
    def box(self) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
        """Lowest and highest corner of the bounding box [m]."""
        # Axis by axis: NumPy takes ten times as long for rows of three.
        low, high = zip(*((x.min(), x.max()) for x in self.points.T), strict=True)
        return np.array(low), np.array(high)

    def near(self, other: "BodyPoints", reach: float) -> "BodyPoints":
        """Particles not farther than ``reach`` outside the other's bounding box [m]."""
        inside = np.ones(len(self.points), np.bool_)
        for x, low, high in zip(self.points.T, *other.box, strict=True):
            inside &= (x > low - reach) & (x < high + reach)
        return BodyPoints(self.points[inside], self.squeezed[inside])


def pair_gap(a: BodyPoints, c: BodyPoints, cell: float) -> tuple[float, float]:
    """Gap and depth of two bodies [m]."""
    (low_a, high_a), (low_c, high_c) = a.box, c.box
    apart = np.maximum(0.0, np.maximum(low_a - high_c, low_c - high_a))
    distance = float(np.linalg.norm(apart))
    if distance > BOUNDING_BOX_DISTANCE_DX * cell:
        return distance - 2 * PARTICLE_RADIUS_DX * cell, 0.0
    reach = distance + 2 * BOUNDING_BOX_DISTANCE_DX * cell
    near_a, near_c = a.near(c, reach), c.near(a, reach)
    if len(near_a.points) == 0 or len(near_c.points) == 0:
        return reach, 0.0
    distance, depth = _close_gap(near_a, near_c, cell)
    if np.isinf(distance):
        distance = float(KDTree(near_c.points).query(near_a.points)[0].min())
    return distance - 2 * PARTICLE_RADIUS_DX * cell, depth


def _close_gap(a: BodyPoints, c: BodyPoints, cell: float) -> tuple[float, float]:
    """Smallest distance of particles and depth of overlap [m]; inf and 0: none is in reach.

    Only particles in reach of the other body's box are looked at: of a body that lies on a large one most are not.
    """
    close = OVERLAP_RADIUS_DX * cell
    near_a, near_c = a.near(c, close), c.near(a, close)
    if len(near_a.points) == 0 or len(near_c.points) == 0:
        return np.inf, 0.0
    tree_a, tree_c = KDTree(near_a.points), KDTree(near_c.points)
    to_c = tree_c.query(near_a.points, distance_upper_bound=close)[0]
    to_a = tree_a.query(near_c.points, distance_upper_bound=close)[0]
    volume_a, volume_c = (
        near.squeezed if whole.squeezed.min() <= SQUEEZED_VOLUME_RATIO else None
        for near, whole in ((near_a, a), (near_c, c))
    )
    depth = max(
        overlap_depth(near_a.points[to_c < close], tree_c, volume_c, cell),
        overlap_depth(near_c.points[to_a < close], tree_a, volume_a, cell),
    )
    return float(to_c.min()), depth


def overlap_depth(points: np.ndarray, tree: KDTree, squeezed: np.ndarray | None, cell: float) -> float:
    """How deep the deepest of some points, as balls, lie below the surface of a body [m].

    The share φ of a ball of radius r that lies in a half space whose face is s away is
    φ = ½ + ¾ s/r - ¼ (s/r)³ (spherical cap): the volume of the body's particles in it gives s. Foam
    squeezed to half its volume has twice as many particles there, and no more depth.

    Args:
        points: Particles of one body (N, 3) [m].
        tree: Of the other body's.
        squeezed: Their volumes over those at rest [-]; None: all at rest, so that counting does.
        cell: Grid spacing dx [m].
    """
    if len(points) == 0:
        return 0.0
    reach = OVERLAP_RADIUS_DX * cell
    full = 8.0 * 4.0 / 3.0 * np.pi * OVERLAP_RADIUS_DX**3
    if squeezed is None:
        filled = np.asarray(tree.query_ball_point(points, reach, return_length=True))
    else:
        near = tree.query_ball_point(points, reach)
        filled = np.array([squeezed[k].sum() for k in near])
    signed = reach * np.interp(filled / full, _CAP_FRACTIONS, _CAP_HEIGHTS)
    deepest = np.sort(signed)[-OVERLAP_DEPTH_PARTICLES:].mean()
    return max(0.0, float(deepest) + PARTICLE_RADIUS_DX * cell)


def plane_depth(
    points: Float[np.ndarray, "N 3"], plane: Plane, motion: Float[np.ndarray, "N 3 3"] | None, cell: float
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
        height = height - PARTICLE_RADIUS_DX * cell * stretch
    return max(0.0, -float(height.min(initial=np.inf)))

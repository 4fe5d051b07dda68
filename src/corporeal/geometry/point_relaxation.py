"""Relaxation of points to an even distribution inside a shape."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.geometry.point_sampling import repulsion

RELAX_ROUNDS, RELAX_STEPS_PER_ROUND = 7, 5
REPULSION_REACH_SPACINGS = 1.2
"""Of the repulsion, in spacings."""
MAX_STRIDE_SPACINGS = 0.3
"""Longest way of a point in one step, in spacings."""
SURFACE_PULL_DEPTH_SPACINGS = 0.85
"""The surface draws what lies shallower than this, in spacings."""
UNFELT_DEPTH_SPACINGS = 2.5
"""What is deeper than this feels no surface in the steps of a round, in spacings: that is more than
``SURFACE_PULL_DEPTH_SPACINGS`` and ``RELAX_STEPS_PER_ROUND`` strides."""


@dataclass(frozen=True)
class NearestSurface:
    """The nearest piece of surface as a plane, for points near enough to feel it; M of N points."""

    which: np.ndarray
    """Their numbers."""
    foot: Float[np.ndarray, "M 3"]
    """A point on the plane [m]."""
    inward: Float[np.ndarray, "M 3"]
    """Unit, from the surface towards the point."""

    def depth(self, points: np.ndarray) -> Float[np.ndarray, " M"]:
        """Distance below the plane [m]."""
        return np.einsum("md,md->m", points[self.which] - self.foot, self.inward)


@dataclass
class FreeDistances:
    """How far points may go from where they were last asked, before they can feel the surface."""

    start: Float[np.ndarray, "N 3"]
    """Where each was [m]."""
    free: Float[np.ndarray, " N"]
    """Way that each may go [m]; 0 or less: it must be asked."""

    def note(self, points: np.ndarray, which: np.ndarray, free: np.ndarray) -> None:
        """Fix the points that were given where they are."""
        self.start[which], self.free[which] = points[which], free

    def still(self, points: np.ndarray, which: np.ndarray) -> Bool[np.ndarray, " M"]:
        """Whether each of some points is so deep yet that asking again would change nothing."""
        return np.linalg.norm(points - self.start[which], axis=1) < self.free[which]


def relax_points(
    points: Float[np.ndarray, "N 3"],
    shape: QueryMesh,
    outer: QueryMesh,
    spacing: float,
    deepest: Float[np.ndarray, " N"] | None = None,
    held: Bool[np.ndarray, " N"] | None = None,
) -> Float[np.ndarray, "N 3"]:
    """Spread points evenly inside, the outermost layer half a spacing below the surface.

    Repulsion between neighbours alternates with the surface, which draws the nearest layer to half a spacing of depth
    and leaves nothing shallower. A stair-stepped lattice would act as teeth in contact; a layer that follows the face
    does not.

    Args:
        points: Where to start, inside [m].
        shape: What they must stay in.
        outer: The part of its surface that meets the outside.
        spacing: [m]
        deepest: How far below the surface each may be, for walls [m]; None: anywhere.
        held: Points that do not move but repel.

    Returns:
        Positions [m].
    """
    start, points = points, points.copy()
    free = np.ones(len(points), dtype=bool) if held is None else ~held
    limit = np.full(len(points), np.inf) if deepest is None else deepest
    limit = np.maximum(limit - 0.5 * spacing, 0.5 * spacing)
    if not free.any():
        return points
    candidates = np.flatnonzero(free & (np.isfinite(limit) | outer.may_be_within(4 * spacing, points)))
    near, deep = candidates, FreeDistances(points.copy(), np.zeros(len(points)))
    # Repulsion in rounds; the surface is looked up once a round, and draws from the third on.
    for turn in range(RELAX_ROUNDS):
        asked = candidates[~deep.still(points[candidates], candidates)] if turn % 3 == 0 else near
        distance, skin = _nearest_surface(points, asked, outer, spacing)
        far = np.where(limit[asked] == np.inf, skin.depth(points) - UNFELT_DEPTH_SPACINGS * spacing, 0.0)
        deep.note(points, asked, far)
        near = asked[(distance < 2 * spacing) | (distance > limit[asked] - spacing)]
        for _ in range(RELAX_STEPS_PER_ROUND):
            move = repulsion(points, REPULSION_REACH_SPACINGS * spacing)
            length = np.linalg.norm(move, axis=1) + 1e-300
            move *= np.minimum(1, MAX_STRIDE_SPACINGS * spacing / length)[:, None]
            points[free] += move[free]
            _apply_surface(points, skin, spacing, limit, draw=turn >= 2)
    # Last, only the surface: nothing may be left shallower than half a spacing.
    for _ in range(3):
        distance, skin = _nearest_surface(points, near, outer, spacing)
        _apply_surface(points, skin, spacing, limit, draw=False)
        near = near[(distance < spacing) | (distance > limit[near] - spacing)]
    return keep_points_inside(points, start, shape, near)


def _nearest_surface(
    points: np.ndarray, which: np.ndarray, outer: QueryMesh, spacing: float
) -> tuple[np.ndarray, NearestSurface]:
    distance, triangle, foot = outer.closest(points[which])
    inward = (points[which] - foot) / np.maximum(distance, 1e-300)[:, None]
    inward[distance < 1e-6 * spacing] = -outer.mesh.normals[triangle[distance < 1e-6 * spacing]]
    out = np.einsum("md,md->m", inward, outer.mesh.normals[triangle]) > 0
    inward[out] = -inward[out]
    return distance, NearestSurface(which, foot, inward)


def _apply_surface(points: np.ndarray, skin: NearestSurface, spacing: float, limit: np.ndarray, *, draw: bool) -> None:
    """Apply the surface to the points, in place."""
    depth = skin.depth(points)
    half = 0.5 * spacing
    wanted = depth
    if draw:
        wanted = np.where(depth < SURFACE_PULL_DEPTH_SPACINGS * spacing, depth + 0.3 * (half - depth), depth)
    wanted = np.clip(wanted, half, limit[skin.which])
    points[skin.which] += (wanted - depth)[:, None] * skin.inward


def keep_points_inside(
    points: Float[np.ndarray, "N 3"], start: Float[np.ndarray, "N 3"], shape: QueryMesh, lost: Int[np.ndarray, " M"]
) -> Float[np.ndarray, "N 3"]:
    """Take back, by halves and then wholly, which of some points ended outside; in place.

    Gaps may be narrower than points are apart.
    """
    for share in (0.5, 0.25, 0.0):
        lost = lost[~shape.inside(points[lost])]
        if not len(lost):
            break
        points[lost] = start[lost] + share * (points[lost] - start[lost])
    return points

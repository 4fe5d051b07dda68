"""Flat facets of a rigid body, on which round bodies roll."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import Delaunay, QhullError

from corporeal.mpm.constants import (
    FACE_SCATTER_DX,
    FACET_HOLE_RATIO,
    FACET_MAX_HEIGHT_RATIO,
    FACET_MIN_NORMAL_COSINE,
    FACET_NORMAL_COSINE,
    FACET_ROW,
    FACET_SPREAD_RATIO,
    FLAT_BODY_GAP_DX,
    MIN_FLAT_SURFACE_FRACTION,
    MIN_POINTS_PER_FACET,
    OPPOSED_FACES_COSINE,
)


class BodyFacets(NamedTuple):
    """F faces of a body in its own frame, and N points on them, face after face."""

    row: Float[np.ndarray, "F 11"]
    """Outward unit normal (3) and offset along it [m]; middle (3) and radius [m] of a ball around the points; how far
    from a point the face goes on [m]; its first and last point."""
    point: Float[np.ndarray, "N 3"]
    """[m]"""


def facets_of(surface: Float[np.ndarray, "S 3"], curvature: Float[np.ndarray, "S 12"]) -> BodyFacets:
    """Find the flat faces among a body's surface points: those that look alike and lie in a plane.

    Args:
        surface: In the body's frame [m].
        curvature: See ``types.CURVATURE_COLUMNS``.
    """
    curved = np.any(curvature[:, [6, 7, 10, 11]] != 0.0, axis=1)
    known = np.any(curvature[:, :3] != 0.0, axis=1) & ~curved
    left = np.flatnonzero(known)
    rows, points, count = [], [np.zeros((0, 3))], 0
    while len(left):
        first, normal = surface[left[0]], curvature[left[0], :3]
        reach = FACET_SPREAD_RATIO * curvature[left[0], 8]
        height = (surface[left] - first) @ normal
        alike = curvature[left, :3] @ normal >= FACET_MIN_NORMAL_COSINE
        mine = alike & (np.abs(height) <= FACET_MAX_HEIGHT_RATIO * reach)
        if mine.sum() >= MIN_POINTS_PER_FACET:
            held = surface[left[mine]]
            stands = float(np.median(curvature[left[mine], 8]))
            reach = max(FACET_SPREAD_RATIO * stands, _widest_hole(held, normal, FACET_HOLE_RATIO * stands))
            middle = 0.5 * (held.min(axis=0) + held.max(axis=0))
            radius = np.linalg.norm(held - middle, axis=1).max()
            ends = count, count + len(held)
            rows.append([*normal, first @ normal, *middle, radius, reach, *ends])
            points.append(held)
            count += len(held)
        left = left[~mine]
    return BodyFacets(np.array(rows).reshape(-1, FACET_ROW), np.concatenate(points))


def is_bounded_by_facets(facets: BodyFacets, surface: Float[np.ndarray, "S 3"]) -> bool:
    """Return whether a body is bounded by flat faces: most of its surface points lie on some."""
    return len(facets.point) > MIN_FLAT_SURFACE_FRACTION * len(surface)


def has_edges(rows: Float[np.ndarray, "S W"]) -> bool:
    """Return whether a body has any: whether it is known not to be round all over.

    Args:
        rows: How its surface curves at its points, ``types.CURVATURE_COLUMNS``; without normals where that is not
            known.
    """
    return bool(np.any(rows[:, :3].any(axis=1) & (rows[:, 6:8].sum(axis=1) <= 0.0)))


def lies_over_facet(
    points: Float[np.ndarray, "N 3"], normal: Float[np.ndarray, "3"], reach: float, place: Float[np.ndarray, "M 3"]
) -> Bool[np.ndarray, " M"]:
    """Whether places lie over a face: one of its points is no farther aside [m]."""
    apart = place[:, None] - points
    along = apart @ normal
    return np.any(np.sum(apart**2, axis=2) - along**2 <= reach**2, axis=1)


class FacetsAtNodes(NamedTuple):
    """Flat faces of one of two bodies that meet at E nodes, now; F of them."""

    outward: Float[np.ndarray, "F 3"]
    height: Float[np.ndarray, "E F"]
    """Of the nodes over their planes [cells]."""
    mean: Float[np.ndarray, "E 3"]
    """X̄ of the body [cells]."""


def facet_normals(
    normal: Float[np.ndarray, "E 3"], slip: Float[np.ndarray, "E 3"], first: FacetsAtNodes, second: FacetsAtNodes
) -> Float[np.ndarray, "E 3"]:
    """Return the normals along which two bodies of flat faces meet at nodes, a to c.

    Near an edge the normal of a node leans, and what slides along a face seems to come nearer: where the lean feigns
    more of that than there is, the normal becomes that of the face, which is known. It is of each body the one that
    looks most along the node's normal, or, where that leans far from all, those two that look at one another. Of these
    the two count that are farthest apart, in cells and by how much they look along the normal. Of two faces, each
    weighs as much as the node sees of an edge of the other body, by how far that one's mean offset lies aside from its
    face's normal. A node whose normal is of no face is of two edges, and keeps it.

    Args:
        normal: Unit, of the nodes.
        slip: Speed of a over c there [m/s].
        first: Faces of a.
        second: Faces of c.
    """
    cosine, other = normal @ first.outward.T, -normal @ second.outward.T
    one, two = np.argmax(cosine, axis=1), np.argmax(other, axis=1)
    limit = np.full(len(normal), FACET_NORMAL_COSINE)
    far = np.flatnonzero(np.maximum(cosine.max(axis=1), other.max(axis=1)) <= FACET_NORMAL_COSINE)
    facing = first.outward @ second.outward.T < -FACET_NORMAL_COSINE
    apart = first.height[far, :, None] + second.height[far, None, :]
    met = facing & (cosine[far, :, None] > OPPOSED_FACES_COSINE) & (apart < FLAT_BODY_GAP_DX)
    value = np.where(met, apart + cosine[far, :, None], -np.inf).reshape(len(far), facing.size)
    best, there = np.argmax(value, axis=1), np.isfinite(value.max(axis=1))
    one[far[there]], two[far[there]] = np.divmod(best[there], facing.shape[1])
    limit[far[there]] = -1.0
    row = np.arange(len(normal))
    p, q = first.outward[one], second.outward[two]
    weight = np.where(cosine[row, one] > limit, _aside(second.mean, q), 0.0)
    counter = np.where(other[row, two] > limit, _aside(first.mean, p), 0.0)
    found = weight[:, None] * p - counter[:, None] * q
    size = np.linalg.norm(found, axis=1, keepdims=True)
    found /= np.where(size > 0.0, size, 1.0)
    approach, real = np.sum(slip * normal, axis=1), np.sum(slip * found, axis=1)
    feigns = approach > np.maximum(2.0 * real, 0.0)
    return np.where(feigns[:, None] & (size > 0.0), found, normal)


def _aside(mean: Float[np.ndarray, "E 3"], face: Float[np.ndarray, "E 3"]) -> np.ndarray:
    """How far mean offsets lie aside from faces' normals, squared [cells²], and what any may."""
    return np.sum(mean**2, axis=1) - np.sum(mean * face, axis=1) ** 2 + FACE_SCATTER_DX**2


def _widest_hole(points: Float[np.ndarray, "N 3"], normal: Float[np.ndarray, "3"], at_most: float) -> float:
    """How far the middle of the widest hole between points of a face is from them [m].

    Points at random leave some: what rolls must not fall into one. What is wider than ``at_most`` is an opening of the
    face. The places farthest from points are the middles of circles around triangles of Delaunay's.
    """
    across = np.linalg.svd(normal[None])[2][1:]
    flat = points @ across.T
    try:
        net = Delaunay(flat - flat.mean(axis=0))
    except QhullError:  # all in a row
        return 0.0
    first, *others = np.moveaxis(net.points[net.simplices], 1, 0)
    sides = np.stack([other - first for other in others], axis=1)
    thick = np.abs(np.linalg.det(sides)) > 0.0
    square = 0.5 * np.sum(sides[thick] ** 2, axis=2)
    to_middle = np.linalg.solve(sides[thick], square[..., None])[..., 0]
    away = np.linalg.norm(to_middle, axis=1)
    inside = net.find_simplex(first[thick] + to_middle) >= 0
    return float(away[inside & (away <= at_most)].max(initial=0.0))

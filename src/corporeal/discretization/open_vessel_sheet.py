"""Area of the sheet that open ware is formed from, independent of its hollow.

Reconstructions show the outside of a bowl well, and its plain inside hardly, so only the outside is measured.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import ConvexHull, Delaunay, KDTree

from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh, sphere_directions
from corporeal.geometry.point_sampling import sample_surface

VESSEL_SURFACE_SAMPLES, LOOK_DIRECTIONS_COUNT = 4000, 64
"""Places on the surface that are asked, and ways in which each looks."""
NORMAL_AVERAGING_RADIUS_FRACTION = 0.05
"""Radius over which normals are averaged, of the middle extent: what is finer is roughness."""
MOUTH_SEARCH_HEIGHT_FRACTION = 0.05
"""Share of the height at either end in which the mouth and the foot are looked for."""
MIN_MOUTH_PLAN_FRACTION = 0.25
"""Share of the plan from which on what lies at the top is a mouth, and no handle or peak."""


@dataclass(frozen=True)
class VesselOutside:
    """Places evenly on a surface, and how far each is one of ware's outside; N places."""

    points: Float[np.ndarray, "N 3"]
    """[m]"""
    normals: Float[np.ndarray, "N 3"]
    counts: Float[np.ndarray, " N"]
    """1: wall or bottom, 0: inside, or what closes the mouth."""
    evenness: Float[np.ndarray, " N"]
    """Cosine between the normal and the mean one about it [-]."""


def vessel_sheet_area(shape: QueryMesh, part: Mesh, rng: np.random.Generator) -> float:
    """Return the area of one side of the sheet that open ware is made of, mouth upward [m²].

    Roughness is taken off: an area counts as it looks along the mean normal about it.

    Args:
        shape: All that may hide it; closed, or open below its rim.
        part: Its surface, normals outward.
        rng: Source of the places that are asked.
    """
    found = find_vessel_outside(shape, part, rng)
    return float(part.areas.sum() * np.mean(found.counts * found.evenness))


def find_vessel_outside(shape: QueryMesh, part: Mesh, rng: np.random.Generator) -> VesselOutside:
    """Tell the outside of open ware, mouth upward, from its inside and from what fills it.

    A face counts by what it sees of the open at its own height and below, all of it if that is half of what lies before
    it: walls and bottom do. The inside of a hollow sees the open above alone, and counts nothing. A roof that slopes by
    β counts 1 - cos β, so that what closes a mouth adds the area that it has more than the mouth. Where a wide mouth
    lies at the very top, what closes in on it from outside is wall, too.
    """
    points, triangle = sample_surface(part, VESSEL_SURFACE_SAMPLES, rng)
    normals = part.normals[triangle]
    below, seen = _openness(shape, points, normals)
    counts = np.minimum(1.0, 2.0 * below)
    # half of the depth below, to separate the outer and the inner side of a mouth
    beside = below > 0.25 * (1.0 - normals[:, 2])
    counts[beside & _is_beside_mouth(points, seen > 0.1)] = 1.0
    reach = NORMAL_AVERAGING_RADIUS_FRACTION * float(np.sort(np.ptp(points, axis=0))[1])
    return VesselOutside(points, normals, counts, _normal_evenness(points, normals, seen, reach))


def _openness(
    shape: QueryMesh, points: Float[np.ndarray, "N 3"], normals: Float[np.ndarray, "N 3"]
) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, " N"]]:
    """Return how much of the open places see below their own height, and in all, of half a sphere."""
    start = points + 1e-5 * shape.mesh.extent * normals
    below, seen = np.zeros(len(points)), np.zeros(len(points))
    for direction in sphere_directions(LOOK_DIRECTIONS_COUNT):
        facing = normals @ direction
        some = np.flatnonzero(facing > 0.02)
        free = ~np.isfinite(shape.reach(start[some], np.tile(direction, (len(some), 1))))
        share = facing[some] * free * 4 / LOOK_DIRECTIONS_COUNT
        seen[some] += share
        if direction[2] <= 0:
            below[some] += share
    return below, seen


def _normal_evenness(
    points: Float[np.ndarray, "N 3"], normals: Float[np.ndarray, "N 3"], seen: Float[np.ndarray, " N"], reach: float
) -> Float[np.ndarray, " N"]:
    """Return each normal's cosine with the mean of those near it that look the same way [-]."""
    near = KDTree(points).query_pairs(reach, output_type="ndarray")
    alike = np.einsum("kd,kd->k", normals[near[:, 0]], normals[near[:, 1]]) > 0
    one, other = near[alike].T
    mean = seen[:, None] * normals
    np.add.at(mean, one, seen[other, None] * normals[other])
    np.add.at(mean, other, seen[one, None] * normals[one])
    length = np.linalg.norm(mean, axis=1)
    along = np.einsum("nd,nd->n", mean, normals)
    return np.divide(along, length, out=np.zeros(len(points)), where=length > 0).clip(0.0)


def _is_beside_mouth(points: Float[np.ndarray, "N 3"], seen: Bool[np.ndarray, " N"]) -> Bool[np.ndarray, " N"]:
    """Return which places lie outside of a mouth at the top, in plan; none if none is wide enough.

    What is wider at its foot than at its top is a cover: its top is no mouth.
    """
    height = points[:, 2]
    low, high = height[seen].min(), height[seen].max()
    rim = points[seen & (height > high - MOUTH_SEARCH_HEIGHT_FRACTION * (high - low)), :2]
    foot = points[seen & (height < low + MOUTH_SEARCH_HEIGHT_FRACTION * (high - low)), :2]
    mouth, plan = _hull_area_in_plan(rim), _hull_area_in_plan(points[:, :2])
    if mouth < max(MIN_MOUTH_PLAN_FRACTION * plan, _hull_area_in_plan(foot)):
        return np.zeros(len(points), dtype=bool)
    return Delaunay(rim).find_simplex(points[:, :2]) < 0


def _hull_area_in_plan(points: Float[np.ndarray, "N 2"]) -> float:
    """Return the area inside a taut line around points [m²]; 0: they lie on a line."""
    if len(points) < 3 or np.linalg.matrix_rank(points - points[0]) < 2:
        return 0.0
    return float(ConvexHull(points).volume)

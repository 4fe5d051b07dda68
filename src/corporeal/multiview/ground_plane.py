"""Robust estimation of the ground plane from points.

RANSAC (Fischler & Bolles 1981) with the truncated loss of MSAC (Torr & Zisserman 2000), refined by reweighted least
squares. Points below a plane speak against it: nothing is under a floor.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull, QhullError

from corporeal.geometry.convex_hull import remove_outliers
from corporeal.multiview.point_cloud_geometry import SIGMA_PER_MEDIAN_DEVIATION

PLANE_HYPOTHESES_COUNT = 3000
"""Planes through three points that are tried."""
SCORING_POINTS_COUNT = 2500
"""Points that judge each of them."""
MAX_REFINEMENT_POINTS = 30_000
"""Points that the best are fitted to."""
INITIAL_TOLERANCE_RADII = 0.02
"""Distance from the plane of what belongs to it, in radii of the scene, at first."""
FINAL_TOLERANCE_RADII = 0.002
"""The same at the end, at least."""
POINT_BELOW_PENALTY_POINTS = 0.5
"""What a point under the plane costs, in points on it."""
MIN_GROUND_POINT_FRACTION = 0.08
"""Share of the points that must be on a plane for it to be one."""
MIN_GROUND_DENSITY_RATIO = 2.5
"""How many times denser points must be on it than in the layers just above it."""
MAX_BELOW_GROUND_FRACTION = 0.05
"""Share of the points that may be below it, though fewer are above."""
MIN_CARRIED_FRACTION = 0.75
"""Share of what is above it that must be above the patch of it that was seen."""
MIN_CAMERAS_ABOVE_FRACTION = 0.8
"""Share of the cameras that must be above it."""


@dataclass(frozen=True)
class GroundPlane:
    """A plane n · x = offset."""

    normal: Float[np.ndarray, "3"]
    """Unit, to the side where objects are."""
    offset: float
    """[m], or the file's unit."""
    share: float
    """Of all points: how many are on it."""
    thickness: float
    """Standard deviation of those from it."""


@dataclass(frozen=True)
class GroundSearch:
    """Where a ground may be."""

    up: Float[np.ndarray, "3"]
    """What is thought to be up: unit."""
    tilt: float
    """Largest angle between that and the plane's normal [rad]; π: any."""
    radius: float
    """Of the scene."""
    eyes: Float[np.ndarray, "V 3"]
    """Where cameras are; none may be."""
    middle: Float[np.ndarray, "3"] | None = None
    """What objects are about. Then it is enough that the ground carries what is within one radius of it: a wall behind
    stands beside the patch that is seen of the floor."""


def find_ground_plane(
    points: Float[np.ndarray, "N 3"], search: GroundSearch, rng: np.random.Generator
) -> GroundPlane | None:
    """Return the plane that most points are on and few are below; None: there is none."""
    if len(points) < 10:
        return None
    asked = points[rng.permutation(len(points))[:SCORING_POINTS_COUNT]]
    many = points[rng.permutation(len(points))[:MAX_REFINEMENT_POINTS]]
    best, most = None, -np.inf
    for normal, offset in _candidate_planes(asked, search, rng):
        plane = _refined_plane(many, normal, offset, search)
        score = plane.share - POINT_BELOW_PENALTY_POINTS * _fraction_below(many, plane, search)
        if score > most and _is_allowed_plane(plane, search):
            best, most = plane, score
    return (
        best
        if best is not None and most > MIN_GROUND_POINT_FRACTION / 2 and _is_ground_plane(many, best, search)
        else None
    )


def _candidate_planes(points: np.ndarray, search: GroundSearch, rng: np.random.Generator) -> list:
    """Return the normals and offsets of the best planes through three of the points."""
    corners = points[rng.integers(len(points), size=(PLANE_HYPOTHESES_COUNT, 3))]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    normals = normals[length > 0] / length[length > 0, None]
    corners = corners[length > 0]
    normals *= np.where(normals @ search.up < 0, -1.0, 1.0)[:, None]
    # Among three points of a small patch noise tilts the plane: be lenient, and refine.
    fit = normals @ search.up > np.cos(min(search.tilt + np.radians(10), np.pi))
    normals, corners = normals[fit], corners[fit]
    if search.tilt >= np.pi:  # either side may be up
        normals, corners = np.concatenate([normals, -normals]), np.concatenate([corners] * 2)
    offsets = np.einsum("md,md->m", normals, corners[:, 0])
    near = INITIAL_TOLERANCE_RADII * search.radius
    scores = np.empty(len(normals))
    for start in range(0, len(normals), 500):
        some = slice(start, start + 500)
        heights = (points @ normals[some].T - offsets[some]) / near
        on = np.maximum(0, 1 - heights**2).mean(axis=0)
        scores[some] = on - POINT_BELOW_PENALTY_POINTS * (heights < -2).mean(axis=0)
    return [(normals[k], offsets[k]) for k in np.argsort(-scores, kind="stable")[:5]]


def _refined_plane(points: np.ndarray, normal: np.ndarray, offset: float, search: GroundSearch) -> GroundPlane:
    """Fit a plane to the points near it, again and again (Tukey's biweight)."""
    near = INITIAL_TOLERANCE_RADII * search.radius
    for _ in range(12):
        heights = points @ normal - offset
        weight = np.square(np.maximum(0, 1 - np.square(heights / near)))
        if np.count_nonzero(weight) < 3:
            break
        middle = weight @ points / weight.sum()
        spread = (points - middle).T @ (weight[:, None] * (points - middle))
        turned = np.linalg.eigh(spread)[1][:, 0]
        normal = turned if turned @ normal > 0 else -turned
        offset = float(normal @ middle)
        heights = np.abs(points @ normal - offset)
        typical = SIGMA_PER_MEDIAN_DEVIATION * float(np.median(heights[weight > 0]))
        near = np.clip(4 * typical, FINAL_TOLERANCE_RADII * search.radius, near)
    heights = np.abs(points @ normal - offset)
    on = heights < near
    deviation = float(np.sqrt(np.mean(heights[on] ** 2))) if on.any() else 0.0
    return GroundPlane(normal, offset, float(on.mean()), deviation)


def _fraction_below(points: np.ndarray, plane: GroundPlane, search: GroundSearch) -> float:
    far = 2 * INITIAL_TOLERANCE_RADII * search.radius
    return float((points @ plane.normal - plane.offset < -far).mean())


def _is_allowed_plane(plane: GroundPlane, search: GroundSearch) -> bool:
    if plane.share < MIN_GROUND_POINT_FRACTION or plane.normal @ search.up < np.cos(search.tilt):
        return False
    eyes = search.eyes @ plane.normal - plane.offset
    return not len(eyes) or (eyes > 0).mean() >= MIN_CAMERAS_ABOVE_FRACTION


def _is_ground_plane(points: np.ndarray, plane: GroundPlane, search: GroundSearch) -> bool:
    return _stands_out(points, plane, search) and _carries(points, plane, search)


def _stands_out(points: np.ndarray, plane: GroundPlane, search: GroundSearch) -> bool:
    """Return whether many more points are on it than just above it."""
    heights = points @ plane.normal - plane.offset
    half = max(3 * plane.thickness, FINAL_TOLERANCE_RADII * search.radius)
    on = (np.abs(heights) < half).sum()
    over = ((heights > 2 * half) & (heights < 8 * half)).sum() / 3
    return bool(on >= MIN_GROUND_DENSITY_RATIO * over)


def _carries(points: np.ndarray, plane: GroundPlane, search: GroundSearch) -> bool:
    """Return whether objects are above it, and most of them above the patch that was seen of it."""
    heights = points @ plane.normal - plane.offset
    half = max(3 * plane.thickness, FINAL_TOLERANCE_RADII * search.radius)
    flat = points @ np.linalg.svd(plane.normal[None])[2][1:].T
    patch = remove_outliers(flat[np.abs(heights) < half])
    above, below = flat[heights > 2 * half], (heights < -2 * half).mean()
    if below > max(MAX_BELOW_GROUND_FRACTION, len(above) / len(points)):
        return False
    if not len(above):
        return True
    try:
        hull = ConvexHull(patch)
    except (QhullError, ValueError):
        return False
    rim = above @ hull.equations[:, :2].T + hull.equations[:, 2]
    carried = rim.max(axis=1) <= 0
    if carried.mean() >= MIN_CARRIED_FRACTION:
        return True
    if search.middle is None:
        return False
    near = np.linalg.norm(points[heights > 2 * half] - search.middle, axis=1) < search.radius
    return bool(near.any() and carried[near].mean() >= MIN_CARRIED_FRACTION)

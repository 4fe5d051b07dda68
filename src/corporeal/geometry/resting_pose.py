"""Resting poses of an object on a level floor."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull, KDTree, QhullError

ROLL_STEPS = 800
FIRST_ROLL_STEP_RAD = np.radians(1.5)
"""Of the first step; the last is 0."""
MIN_NEAR_NEIGHBOURS = 8
"""Neighbours that a point must have nearby, or it is astray."""
OUTLIER_DISTANCE_MEDIANS = 3.0
"""Mean distance to them from which on it is, in medians of all points."""
MAX_RESTING_POINTS = 20_000
"""Points that are looked at."""


@dataclass(frozen=True)
class RestingPose:
    """The nearest pose at rest."""

    up: Float[np.ndarray, "3"]
    """What is up then, in the points' frame: unit."""
    tilt: float
    """How far the object rolled [rad]."""


def find_resting_pose(
    points: Float[np.ndarray, "N 3"], up: Float[np.ndarray, "3"]
) -> RestingPose | None:
    """Return how a rigid object would lie after rolling slowly down from where it was put.

    The height of the centre of mass over the lowest point, c · u − min_i v_i · u, falls along its
    steepest slope to the nearest minimum over directions u: there the lowest points support it. The
    points weigh all the same. None: they span no body.
    """
    body = points[:: max(1, len(points) // MAX_RESTING_POINTS)]
    centre = body.mean(axis=0)
    try:
        corners = body[ConvexHull(body).vertices]
    except QhullError:
        return None
    start = up / np.linalg.norm(up)
    here = best = start
    least = np.inf
    for k in range(ROLL_STEPS):
        heights = corners @ here
        lowest = np.argmin(heights)
        rise = centre @ here - heights[lowest]
        if rise < least:
            least, best = rise, here
        slope = centre - corners[lowest]
        slope = slope - (slope @ here) * here
        steep = np.linalg.norm(slope)
        if steep < 1e-12:
            break
        here = here - FIRST_ROLL_STEP_RAD * (1 - k / ROLL_STEPS) * slope / steep
        here = here / np.linalg.norm(here)
    return RestingPose(best, float(np.arccos(np.clip(best @ start, -1, 1))))


def remove_outliers(points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "M 3"]:
    """Return the points without those that are astray: far from all others."""
    if len(points) <= MIN_NEAR_NEIGHBOURS:
        return points
    apart = KDTree(points).query(points, k=MIN_NEAR_NEIGHBOURS + 1)[0][:, 1:].mean(axis=1)
    return points[apart <= OUTLIER_DISTANCE_MEDIANS * np.median(apart)]

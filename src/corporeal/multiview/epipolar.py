"""Epipolar geometry of two cameras.

Hartley & Zisserman, "Multiple View Geometry", 2nd ed., chapters 9, 11, 12 and 14.
"""

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Camera

SAME_PLACE_DISTANCE_RATIO = 1e-9
"""Cameras nearer to each other than this share of their distance from the origin are in one place.
"""
ImagePoints = Float[np.ndarray, "N 2"]


def fundamental_matrix(a: Camera, b: Camera) -> Float[np.ndarray, "3 3"]:
    """Return F with x_b^T F x_a = 0 for pictures x of one point: K_b^-T [t]x R K_a^-1.

    It is 0 for cameras in one place.
    """
    b_from_a = np.linalg.inv(b.world_from_camera) @ a.world_from_camera
    shift = a.world_from_camera[:3, 3] - b.world_from_camera[:3, 3]
    here = np.abs([c.world_from_camera[:3, 3] for c in (a, b)]).max()
    x, y, z = b_from_a[:3, 3] if np.abs(shift).max() > SAME_PLACE_DISTANCE_RATIO * here else np.zeros(3)
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.linalg.inv(b.K).T @ across @ b_from_a[:3, :3] @ np.linalg.inv(a.K)


def sampson_distance(F: Float[np.ndarray, "3 3"], a: ImagePoints, b: ImagePoints) -> Float[np.ndarray, " N"]:
    """Return how far matches are from agreeing, to first order their reprojection error [px].

    |x_b^T F x_a| / sqrt((F x_a)_1² + (F x_a)_2² + (F^T x_b)_1² + (F^T x_b)_2²), eq. 11.9; infinite
    where cameras in one place leave nothing to agree on.
    """
    x, y = _homogeneous_points(a), _homogeneous_points(b)
    across, back = x @ F.T, y @ F
    slope = np.hypot(np.hypot(*across[:, :2].T), np.hypot(*back[:, :2].T))
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.abs((y * across).sum(axis=1)) / slope
    return np.where(slope > 0, error, np.inf)


def depths_of_match(a: Camera, b: Camera, x: ImagePoints, y: ImagePoints) -> Float[np.ndarray, "N 2"]:
    """Return how far ahead of each camera the point of a match lies [m]; negative: behind.

    Linear triangulation, section 12.2.
    """
    P, Q = projection_matrix(a), projection_matrix(b)
    rows = np.stack(
        [x[:, :1] * P[2] - P[0], x[:, 1:] * P[2] - P[1], y[:, :1] * Q[2] - Q[0], y[:, 1:] * Q[2] - Q[1]], axis=1
    )
    rows /= np.linalg.norm(rows, axis=2, keepdims=True)
    world = np.linalg.svd(rows)[2][:, 3]
    world = world / np.where(world[:, 3:] == 0, 1e-300, world[:, 3:])
    return np.stack([world @ np.linalg.inv(c.world_from_camera)[2] for c in (a, b)], axis=-1)


def projection_matrix(camera: Camera) -> Float[np.ndarray, "3 4"]:
    """Return P = K [R | t]."""
    return camera.K @ np.linalg.inv(camera.world_from_camera)[:3]


def consensus_fraction(
    a: ImagePoints, b: ImagePoints, tolerance: float, rng: np.random.Generator, trials: int = 300
) -> float:
    """Return the share of matches that some pair of distant cameras would explain.

    Seen from afar, matches lie on a plane in (x_a, x_b), section 14.3: the best one through four
    of them, by trying.
    """
    if len(a) < 8:
        return 0.0
    joint = np.concatenate([a, b], axis=1)
    picks = np.array([rng.choice(len(joint), 4, replace=False) for _ in range(trials)])
    middle = joint[picks].mean(axis=1)
    normal = np.linalg.svd(joint[picks] - middle[:, None])[2][:, 3]
    offset = (normal * middle).sum(axis=1)
    near = np.abs(joint @ normal.T - offset) < tolerance
    return float((near.sum(axis=0).max() - 4) / (len(joint) - 4))


def _homogeneous_points(points: ImagePoints) -> Float[np.ndarray, "N 3"]:
    return np.concatenate([points, np.ones((len(points), 1))], axis=1)

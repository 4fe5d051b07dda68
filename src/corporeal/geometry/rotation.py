"""Rotations as matrices and as unit quaternions (w, x, y, z)."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class RigidFit:
    """x ≈ R (X - centre) + moved."""

    rotation: Float[np.ndarray, "3 3"]
    centre: Float[np.ndarray, " 3"]
    """[m]"""
    moved: Float[np.ndarray, " 3"]
    """[m]"""

    def undo(self, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """Bring points back to where the body started [m]."""
        return (points - self.moved) @ self.rotation + self.centre

    @property
    def angle(self) -> float:
        """How far the body turned [rad]."""
        return rotation_angle(self.rotation)


def rotation_angle(rotation: Float[np.ndarray, "3 3"]) -> float:
    """How far a rotation turns [rad]."""
    return float(np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1)))


def fit_rigid_motion(
    start: Float[np.ndarray, "N 3"], now: Float[np.ndarray, "N 3"], weight: Float[np.ndarray, " N"]
) -> RigidFit:
    """Best rigid motion from one set of points to another (Kabsch 1976)."""
    share = weight / weight.sum()
    centre, moved = share @ start, share @ now
    u, _, vt = np.linalg.svd((start - centre).T @ ((now - moved) * share[:, None]))
    mirror = np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    return RigidFit((u @ mirror @ vt).T, centre, moved)


def quaternion_from_matrix(rotation: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "4"]:
    """Return the unit quaternion (w, x, y, z), w ≥ 0, of a rotation (Bar-Itzhack 2000).

    It is the eigenvector of the greatest eigenvalue of a symmetric matrix of R's elements.
    """
    R = rotation
    K = np.array(
        [
            [R[0, 0] + R[1, 1] + R[2, 2], R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]],
            [0, R[0, 0] - R[1, 1] - R[2, 2], R[0, 1] + R[1, 0], R[0, 2] + R[2, 0]],
            [0, 0, R[1, 1] - R[0, 0] - R[2, 2], R[1, 2] + R[2, 1]],
            [0, 0, 0, R[2, 2] - R[0, 0] - R[1, 1]],
        ]
    )
    q = np.linalg.eigh(np.triu(K, 1).T + np.triu(K))[1][:, -1]
    return q if q[0] >= 0 else -q


def matrix_from_quaternion(q: Float[np.ndarray, "4"]) -> Float[np.ndarray, "3 3"]:
    """Return the rotation of a quaternion (w, x, y, z) of any length but 0."""
    w, x, y, z = np.asarray(q, dtype=float) / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_product(a: Float[np.ndarray, "4"], b: Float[np.ndarray, "N 4"]) -> Float[np.ndarray, "N 4"]:
    """Return the quaternions of turning by each b, then by a."""
    w, x, y, z = a
    left = np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])
    return b @ left.T


def nearest_rotation(turn: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3 3"]:
    """Return the rotation nearest to a matrix whose determinant is positive (polar factor)."""
    left, _, right = np.linalg.svd(turn)
    return left @ right

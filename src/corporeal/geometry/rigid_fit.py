"""Best rigid motion between two sets of points."""

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

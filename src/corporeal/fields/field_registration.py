"""Registration of points of unknown frame and unit to a surface: axis rotation, scale, shift.

Of the 24 rotations that take axes to axes the first whose misfit is within a tenth of the best is taken, the usual ones
first; scale and shift follow from the bounding boxes. Objects that look alike under such a turn (a cube, a ball) may be
registered wrongly, and nothing here notices.
"""

from dataclasses import dataclass
from itertools import permutations, product
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from corporeal.core.errors import BadFileError

SAME_MISFIT_RATIO = 1.1
"""Misfits within this factor of the best are as good."""
SAME_MISFIT_TOLERANCE = 1e-3
"""Misfits that differ by less are as good, of the diagonal [-]."""
MAX_REGISTRATION_MISFIT = 0.05
"""Largest misfit of points that belong to a surface, of the diagonal [-]."""
MISFIT_POINTS_COUNT = 4000
"""Points of the surface that a misfit is measured at."""


@dataclass(frozen=True)
class RegisteredPoints:
    """Points in the frame of a surface."""

    position: Float[np.ndarray, "N 3"]
    """[m]"""
    misfit: float
    """Mean distance of the surface from the nearest point, plus that of the points from its box, over its diagonal
    [-]."""
    spacing: float
    """Median distance of neighbouring points [m]."""


def axis_turns() -> list[Float[np.ndarray, "3 3"]]:
    """Return the 24 rotations that take axes to axes: as is, +Y up to +Z up, then all others."""
    found = [np.eye(3), np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])]
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        turn = np.zeros((3, 3))
        turn[range(3), order] = signs
        if np.linalg.det(turn) > 0 and not any(np.array_equal(turn, f) for f in found):
            found.append(turn)
    return found


def register_points(
    points: Float[np.ndarray, "N 3"], surface: Float[np.ndarray, "M 3"], path: Path
) -> RegisteredPoints:
    """Register points with a surface.

    Args:
        points: In any frame that differs by axis turn, scale and shift.
        surface: Points spread over it [m].
        path: Of the file that they were read from.

    Raises:
        BadFileError: No turn brings them onto the surface.
    """
    looked = surface[:: max(1, len(surface) // MISFIT_POINTS_COUNT)]
    box = np.stack([surface.min(axis=0), surface.max(axis=0)])
    tried = [_fit_scale_and_shift(points @ turn.T, looked, box) for turn in axis_turns()]
    best = min(misfit for misfit, _ in tried)
    misfit, placed = next(t for t in tried if t[0] <= SAME_MISFIT_RATIO * best + SAME_MISFIT_TOLERANCE)
    if misfit > MAX_REGISTRATION_MISFIT:
        what = f"does not fit the scene: its points miss the surface by {misfit:.0%} of its size."
        raise BadFileError(path, what, "Is it a file of another object?")
    return RegisteredPoints(placed, misfit, _point_spacing(placed))


def _fit_scale_and_shift(
    points: np.ndarray, surface: np.ndarray, box: np.ndarray
) -> tuple[float, Float[np.ndarray, "N 3"]]:
    """Return the misfit of turned points [-], and where scale and shift put them [m]."""
    low, high = points.min(axis=0), points.max(axis=0)
    scale = np.ptp(box, axis=0).max() / (high - low).max()
    placed = (points - (low + high) / 2) * scale + box.mean(axis=0)
    # Points inside a solid are far from its surface: of them, what leaves the box counts.
    beyond = np.linalg.norm(np.maximum(0, np.maximum(box[0] - placed, placed - box[1])), axis=1)
    away = KDTree(placed).query(surface)[0].mean() + beyond.mean()
    return float(away / np.linalg.norm(np.ptp(box, axis=0))), placed


def _point_spacing(points: np.ndarray) -> float:
    distinct = np.unique(points, axis=0)
    return float(np.median(KDTree(distinct).query(distinct, k=2)[0][:, 1]))

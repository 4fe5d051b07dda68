"""Which way is up, as cameras tell: people hold them level.

The x-axis of a camera that is held level is horizontal, however far it looks up or down. Up is the
direction that all x-axes are perpendicular to, in the least squares sense, robust to a few that
were held upright.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from corporeal.geometry.region import region
from corporeal.types import Camera

TILT = np.sin(np.radians(8))
"""Tilt of x-axes at which a camera counts a quarter (Geman & McClure)."""
SPANNED = 0.04
"""Least share of x-axes' squares across their main direction, for them to span a plane."""
DOWN = np.cos(np.radians(12))
"""Cameras that look down more steeply than this do not show what is up in their pictures."""
FEW = 3
"""Cameras from which on agreement says something."""


@dataclass(frozen=True)
class Level:
    """Up, and how well the cameras agree on it."""

    up: Float[np.ndarray, "3"]
    """Unit."""
    error: float
    """Standard error of that direction [rad]; inf where nothing but the pictures' up is known."""
    sure: float
    """0 (a guess) to 1."""
    warnings: tuple[str, ...]


def level(cameras: tuple[Camera, ...]) -> Level:
    """Return what is up for most cameras."""
    axes = np.stack([c.world_from_camera[:3, :3] for c in cameras])
    right, above, back = axes[:, :, 0], -axes[:, :, 1], -axes[:, :, 2]
    up, weight = _perpendicular(right, above.mean(axis=0))
    share = np.linalg.eigvalsh(_spread(right, weight))[1]
    warnings = []
    if share < SPANNED or len(cameras) < FEW:
        up = _across(above.mean(axis=0), right, weight)
        warnings.append(
            "The cameras stand side by side and look the same way: how far they look up or down "
            "is not known from them."
        )
        error, sure = np.inf, 0.2
    else:
        tilt = float(np.sqrt(weight @ np.square(right @ up) / weight.sum()))
        error = tilt / np.sqrt(len(cameras) * share)
        agreed = float((np.abs(right @ up) < 2 * TILT).mean())
        sure = agreed * float(np.exp(-np.square(tilt / TILT / 2)))
    up, doubt = _signed(up, above, back, cameras)
    return Level(up, error, sure * (0.5 if doubt else 1.0), (*warnings, *doubt))


def _spread(right: np.ndarray, weight: np.ndarray) -> np.ndarray:
    return (right * weight[:, None]).T @ right / weight.sum()


def _perpendicular(right: np.ndarray, above: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the direction that most are perpendicular to, and the weight of each.

    From two starts, because cameras that are held upright spoil the least squares.
    """
    starts = [np.linalg.eigh(right.T @ right)[1][:, 0]]
    if np.linalg.norm(above) > 0.1:
        starts.append(above / np.linalg.norm(above))
    found = []
    for up in starts:
        for _ in range(30):
            weight = 1 / np.square(1 + np.square(right @ up / TILT))
            up = np.linalg.eigh(_spread(right, weight))[1][:, 0]
        residual = np.square(right @ up / TILT)
        found.append((float((residual / (1 + residual)).mean()), up))
    up = min(found, key=lambda f: f[0])[1]
    return up, 1 / np.square(1 + np.square(right @ up / TILT))


def _across(above: np.ndarray, right: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return what is up in the pictures on average, made perpendicular to their common x-axis."""
    along = np.linalg.eigh(_spread(right, weight))[1][:, -1]
    up = above - (above @ along) * along
    length = np.linalg.norm(up)
    return up / length if length > 1e-6 else np.array([0.0, 0.0, 1.0])


def _signed(
    up: np.ndarray, above: np.ndarray, back: np.ndarray, cameras: tuple[Camera, ...]
) -> tuple[np.ndarray, list[str]]:
    """Turn up to where it is up in the pictures; where these look straight down, to the cameras."""
    steep = (np.abs(back @ up) > DOWN).mean()
    vote = float((above @ up).mean())
    if steep < 0.5 and abs(vote) > 0.05:
        return np.copysign(1.0, vote) * up, []
    centre = np.array(region(cameras).centre)
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras])
    stand = float(np.mean((eyes - centre) @ up))
    words = "The cameras look straight up or down: they were taken to be above what they look at."
    return np.copysign(1.0, stand) * up, [words]

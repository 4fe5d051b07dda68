"""Up direction from cameras, which people hold level or upright.

One axis of a camera that is held level is horizontal, however far it looks up or down: its x-axis, or its y-axis where
it is held upright. Up is the direction to which of every camera one of the two is perpendicular. All directions of half
a sphere are tried, because which axis it is depends on up; the best is refined by least squares over the axes that it
chose, robust to a few that lean.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from corporeal.core.types import Camera
from corporeal.multiview.viewed_region import find_viewed_region

CAMERA_TILT_SCALE_SIN = np.sin(np.radians(8))
"""Tilt of an axis at which a camera counts a quarter (Geman & McClure)."""
MIN_SPANNED_FRACTION = 0.04
"""Least share of the axes' squares across their main direction, for them to span a plane."""
STEEP_VIEW_COS = np.cos(np.radians(12))
"""Cameras that look down more steeply than this do not show what is up in their pictures."""
MIN_CAMERAS_FOR_AGREEMENT = 3
"""Cameras from which on agreement says something."""
HALF_SPHERE_DIRECTIONS_COUNT = 20_000
"""Of half a sphere, 1° apart."""
MAX_LEAN_DEG = 20.0
"""Lean from which on all are as bad [deg]."""
UNCLEAR_DIRECTION_COST_DEG = 2.0
"""What a direction costs about which no camera is turned clearly [deg]: a camera that looks along it has both axes
level and says nothing."""
MIN_MEAN_CAMERA_VOTE = 0.2
"""Mean of what cameras say, below which a direction is not considered."""
RIVAL_ANGLE_COS = np.cos(np.radians(25))
"""Directions further from the best are its rivals."""
SURE_RIVAL_COST_DEG = 1.0
"""How much more a rival must cost for the best to be sure [deg]."""
HELD_LEVEL_LEAN_DEG, DISAGREEING_LEAN_DEG = 6.0, 9.0
"""Mean lean up to which cameras were held level, and from which on they agree on nothing [deg]."""
HALF_RING_MEAN_AXIS_LENGTH = 0.5
"""Length of the mean of optical axes that go round less than about half a circle."""
MIN_LEVEL_CAMERAS_FRACTION = 0.1
"""Share of the cameras that must be held level for pictures to say on which side up is."""


@dataclass(frozen=True)
class UpDirection:
    """Up, and how well the cameras agree on it."""

    up: Float[np.ndarray, "3"]
    """Unit."""
    error: float
    """Standard error of that direction [rad]; inf where nothing but the pictures' up is known."""
    sure: float
    """0 (a guess) to 1."""
    warnings: tuple[str, ...]


def estimate_up_direction(cameras: tuple[Camera, ...]) -> UpDirection:
    """Return what is up for most cameras."""
    axes = np.stack([c.world_from_camera[:3, :3] for c in cameras])
    right, above, back = axes[:, :, 0], -axes[:, :, 1], -axes[:, :, 2]
    start, ahead = _search_up(right, above)
    rolled = np.abs(above @ start) < np.abs(right @ start)
    flat = np.where(rolled[:, None], above, right)
    up, weight = _perpendicular_to_most(flat, start)
    share, more = np.linalg.eigvalsh(_axis_spread(flat, weight))[1:]
    # Of parallel x-axes on less than half a circle it is ambiguous whether they are all level or all upright: an arm
    # that swings up is a ring of cameras on their sides.
    parallel = np.linalg.eigvalsh(right.T @ right / len(right))[1] < MIN_SPANNED_FRACTION
    alike = parallel and np.linalg.norm(back.mean(axis=0)) > HALF_RING_MEAN_AXIS_LENGTH
    warnings = []
    if share < MIN_SPANNED_FRACTION or alike or len(cameras) < MIN_CAMERAS_FOR_AGREEMENT:
        up = _mean_image_up(above.mean(axis=0), right, np.ones(len(right)))
        rolled = np.zeros(len(right), bool)
        warnings.append("The cameras are side by side and parallel: their pitch is unknown.")
        error, sure = np.inf, 0.2
    else:
        tilt = float(np.sqrt(weight @ np.square(flat @ up) / weight.sum()))
        error = tilt * float(np.sqrt((1 / share + 1 / more) / len(cameras)))
        agreed = float((np.abs(flat @ up) < 2 * CAMERA_TILT_SCALE_SIN).mean())
        sure = (
            agreed * float(np.exp(-np.square(tilt / CAMERA_TILT_SCALE_SIN / 2))) * ahead * _level_hold_score(flat @ up)
        )
    up, doubt = _choose_up_sign(up, (above, back), rolled, cameras)
    return UpDirection(up, error, sure * (0.5 if doubt else 1.0), (*warnings, *doubt))


def _search_up(
    right: Float[np.ndarray, "V 3"], above: Float[np.ndarray, "V 3"]
) -> tuple[Float[np.ndarray, "3"], float]:
    """Return the best direction of half a sphere, and how clearly it is the best, 0 to 1."""
    k = np.arange(HALF_SPHERE_DIRECTIONS_COUNT) + 0.5
    z, turn = (1 - k / HALF_SPHERE_DIRECTIONS_COUNT, np.pi * (3 - np.sqrt(5)) * k)  # Fibonacci's spiral
    flat = np.sqrt(1 - z * z)
    tried = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
    x, y = np.abs(tried @ right.T), np.abs(tried @ above.T)
    lean = np.degrees(np.arcsin(np.clip(np.minimum(x, y), 0, 1)))
    said = np.maximum(x, y)
    cost = (said * np.minimum(lean, MAX_LEAN_DEG)).sum(axis=1) / said.sum(axis=1)
    cost += UNCLEAR_DIRECTION_COST_DEG * (1 - said.mean(axis=1)) + MAX_LEAN_DEG * (
        said.mean(axis=1) < MIN_MEAN_CAMERA_VOTE
    )
    best = tried[cost.argmin()]
    rivals = cost[np.abs(tried @ best) < RIVAL_ANGLE_COS]
    return best, float(min((rivals.min() - cost.min()) / SURE_RIVAL_COST_DEG, 1.0))


def _level_hold_score(sine: Float[np.ndarray, " V"]) -> float:
    """Return 1 where cameras lean as little as hands do, in the mean; 0 where they lean anyhow."""
    lean = float(np.degrees(np.arcsin(np.clip(np.abs(sine), 0, 1))).mean())
    return float(np.clip((DISAGREEING_LEAN_DEG - lean) / (DISAGREEING_LEAN_DEG - HELD_LEVEL_LEAN_DEG), 0, 1))


def _axis_spread(axes: np.ndarray, weight: np.ndarray) -> np.ndarray:
    return (axes * weight[:, None]).T @ axes / weight.sum()


def _perpendicular_to_most(flat: np.ndarray, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the direction that most are perpendicular to, and the weight of each."""
    up = start
    for _ in range(30):
        weight = 1 / np.square(1 + np.square(flat @ up / CAMERA_TILT_SCALE_SIN))
        up = np.linalg.eigh(_axis_spread(flat, weight))[1][:, 0]
    return up, 1 / np.square(1 + np.square(flat @ up / CAMERA_TILT_SCALE_SIN))


def _mean_image_up(above: np.ndarray, right: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return what is up in the pictures on average, made perpendicular to their common x-axis."""
    along = np.linalg.eigh(_axis_spread(right, weight))[1][:, -1]
    up = above - (above @ along) * along
    length = np.linalg.norm(up)
    return up / length if length > 1e-6 else np.array([0.0, 0.0, 1.0])


def _choose_up_sign(
    up: np.ndarray, axes: tuple[np.ndarray, np.ndarray], rolled: Bool[np.ndarray, " V"], cameras: tuple[Camera, ...]
) -> tuple[np.ndarray, list[str]]:
    """Turn up to where it is up in the pictures that were held level; else to the cameras."""
    above, back = axes
    steep = (np.abs(back @ up) > STEEP_VIEW_COS).mean()
    if steep < 0.5 and (~rolled).mean() > MIN_LEVEL_CAMERAS_FRACTION:
        vote = float((above[~rolled] @ up).mean())
        if abs(vote) > 0.05:
            return np.copysign(1.0, vote) * up, []
    centre = np.array(find_viewed_region(cameras).centre)
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras])
    stand = float(np.mean((eyes - centre) @ up))
    why = "look straight up or down" if steep >= 0.5 else "were held upright"
    words = [f"The cameras {why}: they were assumed to be above what they look at."]
    return np.copysign(1.0, stand) * up, words

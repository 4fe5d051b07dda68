"""Automatic placement of cameras above the floor."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Camera, Vector

VIEW_DIRECTION: Vector = (0.80, -0.62, 0.36)
"""Three-quarter view: objects face +x."""
PICTURE_FILL_FRACTION = 0.84
"""Share of the picture that the motion takes at most."""
MIN_ELEVATION_SINE, MAX_ELEVATION_SINE = 0.17, 0.96
"""Sines of the least and the greatest angle above the horizon, of cameras all around: 10°, 74°."""
OUTLIER_POINTS_PERCENT = 1.0
"""Percent of points, at either end, that need not be in pictures."""
GOLDEN_ANGLE_RAD = np.pi * (3 - np.sqrt(5))
"""Turn from one of them to the next [rad]."""


@dataclass(frozen=True)
class CameraAim:
    """Where to look from and at what, +z up in the picture: what a picture is ordered by.

    Rays are cast from these numbers and not from a ``Camera``, whose matrices would round them: equal aims give equal
    bytes, and a model's kept answers are found by the bytes of pictures.
    """

    eye: Vector
    """[m]"""
    target: Vector
    """[m]"""
    field_of_view: float = 30.0
    """Vertical [deg]."""
    width: int = 640
    height: int = 480


def camera_axes(view: Sequence[float] | np.ndarray) -> Float[np.ndarray, "3 3"]:
    """Rows: right, up and back of a camera that stands in direction ``view`` from its target."""
    back = np.asarray(view, dtype=float)
    back = back / np.linalg.norm(back)
    right = np.cross([0.0, 0.0, 1.0], back)
    if np.linalg.norm(right) < 1e-6:
        right = np.array([0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(back, right), back])


def camera_from_aim(aim: CameraAim) -> Camera:
    """Return the camera that an aim amounts to."""
    right, up, back = camera_axes(np.subtract(aim.eye, aim.target))
    focal = aim.height / 2 / np.tan(np.radians(aim.field_of_view) / 2)
    world_from_camera = np.eye(4)
    world_from_camera[:3] = np.stack([right, -up, -back, np.asarray(aim.eye)], axis=1)
    K = np.array([[focal, 0, aim.width / 2], [0, focal, aim.height / 2], [0, 0, 1.0]])
    return Camera(K, world_from_camera, aim.width, aim.height)


def fit_camera(
    boxes: Float[np.ndarray, "F B 2 3"],
    size: tuple[int, int],
    view: Vector | None = None,
    fill: float = PICTURE_FILL_FRACTION,
) -> CameraAim:
    """See every box of every frame, as large as the picture allows.

    boxes: lower and upper corners [m] of B objects in F frames; nan where an object is absent.
    The direction is ``view`` where given, else the one near ``VIEW_DIRECTION`` in which the
    objects hide each other least.
    """
    corners = _corners(boxes)
    direction = _lift_above_floor(view) if view is not None else _least_overlap_turn(corners)
    points = corners.reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) == 0:
        points = np.zeros((1, 3))
    frame = camera_axes(direction)
    local = points @ frame.T
    tangent = np.tan(np.radians(15.0)) * np.array([size[0] / size[1], 1.0]) * fill
    centre, distance = _fit(local, tangent)
    target = centre @ frame
    eye = target + distance * frame[2]
    return CameraAim(tuple(eye.tolist()), tuple(target.tolist()), 30.0, *size)


def fit_cameras_around(
    boxes: Float[np.ndarray, "F B 2 3"], count: int, size: tuple[int, int], fill: float = PICTURE_FILL_FRACTION
) -> list[CameraAim]:
    """See every box of every frame from evenly about the upper half of a sphere."""
    return [fit_camera(boxes, size, view, fill) for view in fibonacci_directions(count)]


def cameras_around(points: Float[np.ndarray, "N 3"], count: int, size: tuple[int, int]) -> tuple[Camera, ...]:
    """Return cameras that see nearly all of some points, from all sides above."""
    box = np.percentile(points, (OUTLIER_POINTS_PERCENT, 100 - OUTLIER_POINTS_PERCENT), axis=0)
    return tuple(camera_from_aim(aim) for aim in fit_cameras_around(box[None, None], count, size))


def fibonacci_directions(count: int) -> list[Vector]:
    """Return unit vectors towards cameras: a spiral of equal areas (Fibonacci lattice)."""
    z = MAX_ELEVATION_SINE - (MAX_ELEVATION_SINE - MIN_ELEVATION_SINE) * (np.arange(count) + 0.5) / count
    turn = GOLDEN_ANGLE_RAD * np.arange(count)
    flat = np.sqrt(1 - z * z)
    x, y = flat * np.cos(turn), flat * np.sin(turn)
    return [(float(a), float(b), float(c)) for a, b, c in zip(x, y, z, strict=True)]


def _fit(local: np.ndarray, tangent: np.ndarray) -> tuple[np.ndarray, float]:
    """Target (camera axes) and distance at which all points lie inside the view pyramid.

    Each side of the pyramid is a plane that must touch the points: |x - cx| ≤ (c + D - z) tan.
    """
    left, right = (sign * local[:, :2] + tangent * local[:, 2:] for sign in (-1, 1))
    low, high = left.max(axis=0), right.max(axis=0)
    centre = (high - low) / 2
    depth = ((high + low) / 2 / tangent).max()
    middle = (local[:, 2].min() + local[:, 2].max()) / 2
    extent = max(float(np.ptp(local, axis=0).max()), 1e-9)
    nearest = local[:, 2].max() + 0.05 * extent
    return np.array([centre[0], centre[1], middle]), max(depth, nearest) - middle


def _lift_above_floor(view: Vector) -> np.ndarray:
    """Lift the wished direction so that the eye stays above the floor."""
    v = np.asarray(view, dtype=float)
    length = np.linalg.norm(v)
    v = v / length if length > 0 and np.isfinite(length) else np.asarray(VIEW_DIRECTION)
    return np.array([v[0], v[1], max(v[2], 0.12)])


def _corners(boxes: np.ndarray) -> np.ndarray:
    """(F, B, 8, 3)."""
    pick = (np.arange(8)[:, None] >> np.arange(3)) & 1
    return boxes[:, :, pick, np.arange(3)]


def _least_overlap_turn(corners: np.ndarray) -> np.ndarray:
    """Turn about the vertical in steps until the objects stand beside each other."""
    best, least = np.asarray(VIEW_DIRECTION), np.inf
    for turn in (0, -25, 25, -50, 50):
        angle = np.radians(turn)
        c, s = np.cos(angle), np.sin(angle)
        view = np.array(
            [
                c * VIEW_DIRECTION[0] - s * VIEW_DIRECTION[1],
                s * VIEW_DIRECTION[0] + c * VIEW_DIRECTION[1],
                VIEW_DIRECTION[2],
            ]
        )
        cost = _overlap(corners @ camera_axes(view)[:2].T) + 0.06 * abs(turn) / 25
        if cost < least - 1e-9:
            best, least = view, cost
    return best


def _overlap(flat: np.ndarray) -> float:
    """Mean share of an object's rectangle in the picture that another one covers."""
    low, high = flat.min(axis=2), flat.max(axis=2)
    count = low.shape[1]
    shares = []
    for i in range(count):
        for j in range(i + 1, count):
            both = np.minimum(high[:, i], high[:, j]) - np.maximum(low[:, i], low[:, j])
            area = np.clip(both, 0, None).prod(axis=-1)
            small = np.minimum((high[:, i] - low[:, i]).prod(axis=-1), (high[:, j] - low[:, j]).prod(axis=-1))
            shares.append(area / np.maximum(small, 1e-12))
    shares = [s[np.isfinite(s)] for s in shares]
    return float(np.mean(np.concatenate(shares))) if shares and sum(map(len, shares)) else 0.0

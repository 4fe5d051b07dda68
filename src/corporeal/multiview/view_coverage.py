"""Coverage of the views, and gaps around the object."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Camera, Note, NoteKind
from corporeal.multiview.up_direction import estimate_up_direction
from corporeal.multiview.viewed_region import find_viewed_region

MIN_UNSEEN_GAP_DEG = 60.0
"""Angle between neighbouring cameras, about what they look at, that leaves a side unseen [deg]."""
UNSEEN_HALF_GAP_DEG = 180.0
"""Such an angle from which on a flat face that looks to its middle is in no photograph [deg]."""

MIN_COVERED_ANGLE_DEG = 90.0
"""Angle of the circle around an object, below which outlines leave its depth open [deg]: between two tangent cones that
are so far apart a ball reaches 1 / sin 45° = 1.4 times as deep as it is.
"""
STEEP_VIEW_ELEVATION_DEG = 45.0
"""Height of a camera over the floor's horizon from which on an object that stands there seems no deeper than it is by
its height [deg].
"""


@dataclass(frozen=True)
class _ViewGap:
    """The widest angle between neighbouring cameras."""

    angle: float
    """[deg]"""
    ends: str
    """Names of the pictures beside it."""


def unseen_side_text(cameras: Sequence[Camera], names: Sequence[str]) -> str | None:
    """Say between which pictures a side was not photographed, if a wide gap is there.

    Of half of the circle and more ``unseen_half_text`` says it.
    """
    gap = _widest_gap(cameras, names)
    if not MIN_UNSEEN_GAP_DEG <= gap.angle < UNSEEN_HALF_GAP_DEG:
        return None
    return Note(
        f"Between {gap.ends} lie {gap.angle:.0f}° without photographs: surfaces facing there are "
        "invented. Photograph that side next time.",
        NoteKind.GRAVE,
    )


def unseen_half_text(cameras: Sequence[Camera], names: Sequence[str]) -> str | None:
    """State that half of the circle around it was not photographed, if so."""
    gap = _widest_gap(cameras, names)
    if gap.angle < UNSEEN_HALF_GAP_DEG:
        return None
    return Note(
        f"Its shape is known from one side only: between {gap.ends} lie {gap.angle:.0f}° of the "
        "circle around it, without photographs, and all surfaces facing there are invented. "
        "Photograph it from there, too.",
        NoteKind.GRAVE,
    )


def widest_unseen_angle(cameras: Sequence[Camera]) -> float:
    """Return the widest angle of the circle around what cameras look at that none is in [deg]."""
    return float(_view_gaps(*_camera_azimuths(tuple(cameras))).max())


def depth_doubt_text(cameras: Sequence[Camera]) -> str | None:
    """Return in a clause that photographs leave open how deep objects are; None: they do not."""
    seen = 360 - widest_unseen_angle(cameras)
    if seen >= MIN_COVERED_ANGLE_DEG or _steepest_elevation(tuple(cameras)) >= STEEP_VIEW_ELEVATION_DEG:
        return None
    return (
        f"all photographs were taken from {seen:.0f}° of the circle around it, and none from "
        "steeply above, so that its depth is unknown"
    )


def _steepest_elevation(cameras: tuple[Camera, ...]) -> float:
    """Return how high the highest camera stands over the middle of what all look at [deg]."""
    away = np.stack([c.world_from_camera[:3, 3] for c in cameras])
    away -= np.array(find_viewed_region(cameras).centre)
    sine = away @ estimate_up_direction(cameras).up / np.maximum(np.linalg.norm(away, axis=1), np.finfo(float).tiny)
    return float(np.degrees(np.arcsin(np.clip(sine, -1, 1))).max())


def _view_gaps(angle: Float[np.ndarray, " V"], order: np.ndarray) -> Float[np.ndarray, " V"]:
    """Return the angle from each camera to the next around the circle [deg]."""
    return np.degrees(np.diff(np.append(angle[order], angle[order[0]] + 2 * np.pi)))


def _widest_gap(cameras: Sequence[Camera], names: Sequence[str]) -> _ViewGap:
    angle, order = _camera_azimuths(tuple(cameras))
    gaps = _view_gaps(angle, order)
    widest = int(gaps.argmax())
    first, second = int(order[widest]), int(order[(widest + 1) % len(order)])
    return _ViewGap(float(gaps[widest]), f"{names[first]} and {names[second]}")


def _camera_azimuths(cameras: tuple[Camera, ...]) -> tuple[Float[np.ndarray, " V"], np.ndarray]:
    """Return the angle of each camera about the axis that is up [rad], and their order."""
    up = estimate_up_direction(cameras).up
    ahead = np.cross(up, np.eye(3)[np.abs(up).argmin()])
    ahead /= np.linalg.norm(ahead)
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras])
    away = eyes - np.array(find_viewed_region(cameras).centre)
    angle = np.arctan2(away @ np.cross(up, ahead), away @ ahead)
    return angle, np.argsort(angle)

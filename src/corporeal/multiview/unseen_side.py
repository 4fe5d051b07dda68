"""From which side of what cameras look at there is no photograph."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Camera, Note, NoteKind
from corporeal.multiview.level import level
from corporeal.multiview.region import region

GAP = 60.0
"""Angle between neighbouring cameras, about what they look at, that leaves a side unseen [deg]."""
HALF = 180.0
"""Such an angle from which on a flat face that looks to its middle is in no photograph [deg]."""

QUARTER = 90.0
"""Angle of the circle around a thing, below which outlines leave its depth open [deg]: between two
tangent cones that are so far apart a ball reaches 1 / sin 45° = 1.4 times as deep as it is."""
STEEP = 45.0
"""Height of a camera over the floor's horizon from which on a thing that stands there seems no
deeper than it is by its height [deg]."""


@dataclass(frozen=True)
class _Gap:
    """The widest angle between neighbouring cameras."""

    angle: float
    """[deg]"""
    ends: str
    """Names of the pictures beside it."""


def unseen_side(cameras: Sequence[Camera], names: Sequence[str]) -> str | None:
    """Say between which pictures a side was not photographed, if a wide gap is there.

    Of half of the circle and more ``unseen_half`` says it.

    Args:
        cameras: Of the photographs.
        names: Of these.

    """
    gap = _widest(cameras, names)
    if not GAP <= gap.angle < HALF:
        return None
    return Note(
        f"Between {gap.ends} lie {gap.angle:.0f}° from which nobody looked: what "
        "faces there is made up. Photograph that side next time.",
        NoteKind.GRAVE,
    )


def unseen_half(cameras: Sequence[Camera], names: Sequence[str]) -> str | None:
    """Say that half of the circle around it was not photographed, if so.

    Args:
        cameras: Of the photographs.
        names: Of these.

    """
    gap = _widest(cameras, names)
    if gap.angle < HALF:
        return None
    return Note(
        f"Its shape is known from one side only: between {gap.ends} lie {gap.angle:.0f}° of the "
        "circle around it, from which nobody looked, and all that faces there is made up. "
        "Photograph it from there, too.",
        NoteKind.GRAVE,
    )


def mostly_unseen(cameras: Sequence[Camera]) -> float:
    """Return the widest angle of the circle around what cameras look at that none is in [deg]."""
    return float(_gaps(*_around(tuple(cameras))).max())


def hardly_round(cameras: Sequence[Camera]) -> str | None:
    """Say in a clause that photographs leave open how deep things are; None: they do not.

    Args:
        cameras: Of the photographs.

    """
    seen = 360 - mostly_unseen(cameras)
    if seen >= QUARTER or _steepest(tuple(cameras)) >= STEEP:
        return None
    return (
        f"all photographs were taken from {seen:.0f}° of the circle around it, and none from "
        "steeply above, so that nothing says how deep it is"
    )


def _steepest(cameras: tuple[Camera, ...]) -> float:
    """Return how high the highest camera stands over the middle of what all look at [deg]."""
    away = np.stack([c.world_from_camera[:3, 3] for c in cameras])
    away -= np.array(region(cameras).centre)
    sine = away @ level(cameras).up / np.maximum(np.linalg.norm(away, axis=1), np.finfo(float).tiny)
    return float(np.degrees(np.arcsin(np.clip(sine, -1, 1))).max())


def _gaps(angle: Float[np.ndarray, " V"], order: np.ndarray) -> Float[np.ndarray, " V"]:
    """Return the angle from each camera to the next around the circle [deg]."""
    return np.degrees(np.diff(np.append(angle[order], angle[order[0]] + 2 * np.pi)))


def _widest(cameras: Sequence[Camera], names: Sequence[str]) -> _Gap:
    angle, order = _around(tuple(cameras))
    gaps = _gaps(angle, order)
    widest = int(gaps.argmax())
    first, second = int(order[widest]), int(order[(widest + 1) % len(order)])
    return _Gap(float(gaps[widest]), f"{names[first]} and {names[second]}")


def _around(cameras: tuple[Camera, ...]) -> tuple[Float[np.ndarray, " V"], np.ndarray]:
    """Return the angle of each camera about the axis that is up [rad], and their order."""
    up = level(cameras).up
    ahead = np.cross(up, np.eye(3)[np.abs(up).argmin()])
    ahead /= np.linalg.norm(ahead)
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras])
    away = eyes - np.array(region(cameras).centre)
    angle = np.arctan2(away @ np.cross(up, ahead), away @ ahead)
    return angle, np.argsort(angle)

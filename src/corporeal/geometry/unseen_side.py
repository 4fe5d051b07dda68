"""From which side of what cameras look at there is no photograph."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from corporeal.geometry.level import level
from corporeal.geometry.region import region
from corporeal.types import Camera

GAP = 60.0
"""Angle between neighbouring cameras, about what they look at, that leaves a side unseen [deg]."""
HALF = 180.0
"""Such an angle from which on a flat face that looks to its middle is in no photograph [deg]."""


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
    return (
        f"Between {gap.ends} lie {gap.angle:.0f}° from which nobody looked: what "
        "faces there is made up. Photograph that side next time."
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
    return (
        f"Its shape is known from one side only: between {gap.ends} lie {gap.angle:.0f}° of the "
        "circle around it, from which nobody looked, and all that faces there is made up. "
        "Photograph it from there, too."
    )


def _widest(cameras: Sequence[Camera], names: Sequence[str]) -> _Gap:
    angle, order = _around(tuple(cameras))
    gaps = np.degrees(np.diff(np.append(angle[order], angle[order[0]] + 2 * np.pi)))
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

"""Time remapping: real time, or slow motion about one instant."""

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Frame

SLOW_BEFORE_S, SLOW_AFTER_S = 0.06, 0.24
"""A slow motion begins and ends so long before and after its instant [s]."""


def frame_positions(time: Float[np.ndarray, " F"], slow: float, about: float | None) -> Float[np.ndarray, " N"]:
    """Return the place of every picture among the frames: 2.5 is halfway from frame 2 to 3.

    Args:
        time: Of the frames [s].
        slow: How many times slower the video is about the instant.
        about: The instant [s]; None: all of it is slow.
    """
    last = len(time) - 1
    places, at = [0.0], 0.0
    while at < last:
        now = float(np.interp(at, np.arange(last + 1), time))
        at = min(at + 1.0 / (slow if is_slow(now, about) else 1.0), float(last))
        places.append(at)
    return np.array(places)


def is_slow(time: float, about: float | None) -> bool:
    """Whether the video is slow at a time [s]."""
    return about is None or about - SLOW_BEFORE_S <= time <= about + SLOW_AFTER_S


def interpolate_frames(first: Frame, second: Frame, share: float) -> Frame:
    """Return the instant between two frames, at ``share`` of the way.

    Places and deformations are taken to change evenly; a rotation's small shrinkage in between is (1 - cos α/2) for a
    turn α from frame to frame.
    """
    if share <= 0:
        return first

    def mixed(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return ((1 - share) * a + share * b).astype(a.dtype)

    return Frame(
        (1 - share) * first.time + share * second.time,
        mixed(first.position, second.position),
        mixed(first.deformation, second.deformation),
    )

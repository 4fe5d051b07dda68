"""Reuse of frames without visible change."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from corporeal.render.camera_placement import CameraAim

MAX_CORNER_SHIFT_PX = 0.125
"""Pixels by which every corner may lie beside where the last picture that was cast shows it."""
MAX_NORMAL_CHANGE = 0.01
"""Length by which its unit normal may differ there."""


class LastRenderedPose:
    """The pose that the last picture was cast of.

    Each pose is compared with that one and not with the one before: slow motion adds up until it is seen.
    """

    def __init__(self, aim_at: Callable[[float], CameraAim]) -> None:
        """Take poses as a camera sees them: ``aim_at`` says where it is at a time [s]."""
        self._aim_at = aim_at
        self._pose: tuple[np.ndarray, np.ndarray] | None = None

    def moved(self, place: Float[np.ndarray, "V 3"], normal: Float[np.ndarray, "V 3"], time: float) -> bool:
        """Whether a pose is to be cast anew; if so, it is the one that others are compared with.

        Args:
            place: Of the vertices [m].
            normal: Their unit normals.
            time: Of the pose [s].
        """
        if self._pose is not None and len(place):
            before, turned = self._pose
            gone = np.linalg.norm(place - before, axis=1).max()
            turn = np.linalg.norm(normal - turned, axis=1).max()
            if gone <= self._pixel(place, time) * MAX_CORNER_SHIFT_PX and turn <= MAX_NORMAL_CHANGE:
                return False
        self._pose = place, normal
        return True

    def _pixel(self, place: np.ndarray, time: float) -> float:
        """Size of a pixel where the nearest vertex is [m]."""
        aim = self._aim_at(time)
        near = float(np.linalg.norm(place - np.asarray(aim.eye), axis=1).min())
        return 2 * np.tan(np.radians(aim.field_of_view) / 2) / aim.height * near

"""Test whether a control differs from the reference by more than the simulation's error."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from video_judge.video_motion import VideoMotion, object_diagonals

MIN_YARDSTICK_RATIO = 2.0
"""A control must differ by more than so many times what a finer run does."""
MIN_VISIBLE_PATH, MIN_VISIBLE_SHAPE = 0.02, 0.01
"""Least difference that pictures can show, over an object's diagonal [-]: one or two pixels of an object 100 pixels
wide."""
COMPARED_AFTER_CONTACT_S = 0.2
"""Draft and finer paths are compared until so long after an object's first contact [s]: from there on small differences
of a rebound part them."""


@dataclass(frozen=True)
class MotionDifference:
    """How far a video is from the reference, at most over objects [diagonals of the object]."""

    path: float
    """Root mean square distance of the centres."""
    shape: float
    """Largest change of a principal width (standard deviation of its material)."""

    @property
    def limit(self) -> "MotionDifference":
        """What a control must exceed in one of the two, where this is the yardstick."""
        return MotionDifference(
            max(MIN_YARDSTICK_RATIO * self.path, MIN_VISIBLE_PATH),
            max(MIN_YARDSTICK_RATIO * self.shape, MIN_VISIBLE_SHAPE),
        )

    def exceeds(self, limit: "MotionDifference") -> bool:
        """Whether path or shape is beyond a limit."""
        return self.path > limit.path or self.shape > limit.shape


NO_DIFFERENCE = MotionDifference(0.0, 0.0)
"""Yardstick of a scene without a finer run: what is visible decides alone."""


def compare_motions(
    reference: VideoMotion,
    other: VideoMotion,
    times: Float[np.ndarray, " T"],
    until: Float[np.ndarray, " B"] | None = None,
) -> MotionDifference:
    """Compare two videos of the same objects at the same instants.

    Args:
        reference: Sets the scale.
        other: May have other particles.
        times: [s]
        until: Instant of each object after which it is not compared [s]; None: all are.

    """
    size = np.maximum(object_diagonals(reference.prepared), 1e-12)
    counted = np.ones((len(times), len(size)), bool)
    if until is not None:
        counted = times[:, None] <= until[None]
    weight = counted / np.maximum(counted.sum(axis=0), 1)
    apart = np.linalg.norm(other.centres(times) - reference.centres(times), axis=-1) / size
    path = np.sqrt((apart**2 * weight).sum(axis=0))
    changed = np.abs(principal_widths(other, times) - principal_widths(reference, times)).max(axis=-1) / size
    return MotionDifference(float(path.max()), float((changed * counted).max()))


def principal_widths(video: VideoMotion, times: Float[np.ndarray, " T"]) -> Float[np.ndarray, "T B 3"]:
    """Return standard deviations of every object's material along its principal axes [m]."""
    mass = video.prepared.particles.mass
    rows = []
    for time in times.tolist():
        x = video.at(time).position.astype(float)
        rows.append([_widths(x[m], mass[m]) for m in video.members])
    return np.array(rows)


def _widths(x: np.ndarray, mass: np.ndarray) -> np.ndarray:
    covariance = np.cov(x.T, aweights=mass) if len(x) > 1 else np.zeros((3, 3))
    return np.sqrt(np.maximum(np.linalg.eigvalsh(covariance), 0.0))

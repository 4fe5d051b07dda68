"""Pixels that show the floor for certain: other views see the same pattern at that place of it.

Where an object stands its contact shadow may have the colours of the object, and an outline that is
found by colour spreads over the floor. But a pattern on the floor is one plane's: taken to that
plane by its homography, views from different sides agree about it, and about nothing that stands
above it. Patches are compared by normalised cross-correlation, which shadows leave as it is.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import map_coordinates, minimum_filter, uniform_filter

from corporeal.core.types import Camera, Views
from corporeal.multiview.ground_plane import Plane
from corporeal.multiview.region import Region
from corporeal.reconstruction.masks.floor_square import WITNESSES, Square, square, witnessed

PATCH = 7
"""Cells along a patch that is compared."""
CONTRAST = 3.0
"""Standard deviation of the greys of a patch, of 255, below which it has no pattern."""
AGREE = 0.8
"""Correlation from which on two patches are one pattern."""


def shows_floor(views: Views, floor: Plane | None, around: Region) -> Bool[np.ndarray, "V H W"]:
    """Tell which pixels show a pattern that lies on the floor; none where nobody knows the floor.

    Args:
        views: The pictures; a patch is PATCH of their pixels wide.
        floor: The plane that objects stand on, its normal up.
        around: The ball that all look at.

    """
    if floor is None or len(views.cameras) <= WITNESSES:
        return np.zeros(views.rgb.shape[:3], np.bool_)
    ground = square(views.cameras, floor, around)
    seen = [_seen(rgb, c, ground) for rgb, c in zip(views.rgb, views.cameras, strict=True)]

    def agreeing(k: int, others: Int[np.ndarray, " P"]) -> Bool[np.ndarray, "P n n"]:
        return np.stack([_correlation(seen[k], seen[p]) > AGREE for p in others])

    return witnessed(views.cameras, floor, around, agreeing)


@dataclass(frozen=True)
class _Seen:
    """The floor as one view has it; black where it is not in its picture."""

    grey: Float[np.ndarray, "n n"]
    mean: Float[np.ndarray, "n n"]
    """Of the patch around each cell."""
    deviation: Float[np.ndarray, "n n"]
    """0: a part of the patch is not in the picture."""


def _seen(rgb: np.ndarray, camera: Camera, ground: Square) -> _Seen:
    size, at = (ground.count, ground.count), ground.seen_by(camera)
    grey = map_coordinates(rgb.mean(axis=-1), at, order=1, cval=np.nan).reshape(size)
    shown = minimum_filter(np.isfinite(grey), PATCH)
    grey = np.nan_to_num(grey)  # running sums would carry what is no number along
    mean = uniform_filter(grey, PATCH)
    square = uniform_filter(grey * grey, PATCH) - mean * mean
    return _Seen(grey, mean, np.where(shown, np.sqrt(np.maximum(square, 0)), 0.0))


def _correlation(a: _Seen, b: _Seen) -> Float[np.ndarray, "n n"]:
    """Return the normalised cross-correlation of patches; -1 where there is no pattern."""
    product = uniform_filter(a.grey * b.grey, PATCH) - a.mean * b.mean
    with np.errstate(divide="ignore", invalid="ignore"):
        found = product / (a.deviation * b.deviation)
    clear = (a.deviation > CONTRAST) & (b.deviation > CONTRAST)
    return np.where(clear, found, -1.0)

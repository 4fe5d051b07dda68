"""Certain floor pixels by consistency of their texture over views.

Where an object stands its contact shadow may have the colours of the object, and an outline that is found by colour
spreads over the floor. But a pattern on the floor is one plane's: taken to that plane by its homography, views from
different sides agree about it, and about nothing that stands above it. Patches are compared by normalised
cross-correlation, which shadows leave as it is.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import map_coordinates, minimum_filter, uniform_filter

from corporeal.core.types import Camera, Views
from corporeal.multiview.ground_plane import GroundPlane
from corporeal.multiview.viewed_region import ViewedRegion
from corporeal.reconstruction.masks.floor_grid import (
    MIN_AGREEING_PARTNERS,
    FloorGrid,
    floor_grid,
    pixels_on_agreed_floor,
)

PATTERN_PATCH_CELLS = 7
"""Cells along a patch that is compared."""
MIN_PATTERN_CONTRAST_U8 = 3.0
"""Standard deviation of the greys of a patch, of 255, below which it has no pattern."""
MIN_PATTERN_CORRELATION = 0.8
"""Correlation from which on two patches are one pattern."""


def shows_floor_pattern(views: Views, floor: GroundPlane | None, around: ViewedRegion) -> Bool[np.ndarray, "V H W"]:
    """Return which pixels show a pattern that lies on the floor; none where the floor is unknown.

    Args:
        views: The pictures; a patch is PATCH of their pixels wide.
        floor: The plane that objects stand on, its normal up.
        around: The ball that all look at.
    """
    if floor is None or len(views.cameras) <= MIN_AGREEING_PARTNERS:
        return np.zeros(views.rgb.shape[:3], np.bool_)
    ground = floor_grid(views.cameras, floor, around)
    seen = [_floor_view(rgb, c, ground) for rgb, c in zip(views.rgb, views.cameras, strict=True)]

    def agreeing(k: int, others: Int[np.ndarray, " P"]) -> Bool[np.ndarray, "P n n"]:
        return np.stack([_patch_correlation(seen[k], seen[p]) > MIN_PATTERN_CORRELATION for p in others])

    return pixels_on_agreed_floor(views.cameras, floor, around, agreeing)


@dataclass(frozen=True)
class _FloorView:
    """The floor as one view has it; black where it is not in its picture."""

    grey: Float[np.ndarray, "n n"]
    mean: Float[np.ndarray, "n n"]
    """Of the patch around each cell."""
    deviation: Float[np.ndarray, "n n"]
    """0: a part of the patch is not in the picture."""


def _floor_view(rgb: np.ndarray, camera: Camera, ground: FloorGrid) -> _FloorView:
    size, at = (ground.count, ground.count), ground.seen_by(camera)
    grey = map_coordinates(rgb.mean(axis=-1), at, order=1, cval=np.nan).reshape(size)
    shown = minimum_filter(np.isfinite(grey), PATTERN_PATCH_CELLS)
    grey = np.nan_to_num(grey)  # running sums would carry what is no number along
    mean = uniform_filter(grey, PATTERN_PATCH_CELLS)
    square = uniform_filter(grey * grey, PATTERN_PATCH_CELLS) - mean * mean
    return _FloorView(grey, mean, np.where(shown, np.sqrt(np.maximum(square, 0)), 0.0))


def _patch_correlation(a: _FloorView, b: _FloorView) -> Float[np.ndarray, "n n"]:
    """Return the normalised cross-correlation of patches; -1 where there is no pattern."""
    product = uniform_filter(a.grey * b.grey, PATTERN_PATCH_CELLS) - a.mean * b.mean
    with np.errstate(divide="ignore", invalid="ignore"):
        found = product / (a.deviation * b.deviation)
    clear = (a.deviation > MIN_PATTERN_CONTRAST_U8) & (b.deviation > MIN_PATTERN_CONTRAST_U8)
    return np.where(clear, found, -1.0)

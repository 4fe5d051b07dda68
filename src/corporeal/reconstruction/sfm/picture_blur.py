"""Blur of photographs by the sharpest edges in their middle.

An edge that is smeared by s rises over a distance that grows with s: smoothed by σ its steepest
slope is proportional to 1 / √(σ² + s²). Two smoothings tell s whatever the contrast (Elder and
Zucker, "Local scale control for edge detection and blur estimation", PAMI 1998). Noise has no
edges of that size, and what is out of focus behind the object does not count: the sharpest does.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from PIL import Image
from scipy.ndimage import gaussian_filter

BLURRED_SIGMA_PX = 5.0
"""Standard deviation of a blur [px] from which on points that pictures share are lost: photographs of four real sets
and of twelve made ones have up to 4.8."""
FINE_SIGMA_PX, COARSE_SIGMA_PX = 2.0, 6.0
"""Standard deviations of the two smoothings [px]."""
MIDDLE_SIDE_PX = 640
"""Side of the part in the middle that is looked at [px]."""
STEEPEST_SLOPE_PERCENTILE = 99.5
"""Percentile of slopes that are the sharpest edges'."""
MIN_EDGE_SLOPE = 0.05
"""Slope [of 255 a px] below which there is no edge at all."""


def blurred_pictures(folder: Path, names: Sequence[str]) -> tuple[str, ...]:
    """Return which pictures are heavily blurred."""
    found = []
    for name in names:
        with Image.open(folder / name) as picture:
            if picture_blur(np.asarray(picture.convert("L"), np.float32)) > BLURRED_SIGMA_PX:
                found.append(name)
    return tuple(found)


def picture_blur(grey: Float[np.ndarray, "H W"]) -> float:
    """Return the standard deviation of a picture's blur [px], along the way it is worst.

    Args:
        grey: Of 255.
    """
    height, width = grey.shape
    top, left = max(0, height - MIDDLE_SIDE_PX) // 2, max(0, width - MIDDLE_SIDE_PX) // 2
    part = grey[top : top + MIDDLE_SIDE_PX, left : left + MIDDLE_SIDE_PX]
    pairs = zip(_steepest_slopes(part, FINE_SIGMA_PX), _steepest_slopes(part, COARSE_SIGMA_PX), strict=True)
    return max(_blur_from_slopes(fine, coarse) for fine, coarse in pairs)


def _steepest_slopes(grey: np.ndarray, sigma: float) -> list[float]:
    """Return the steepest slopes across, down, and along both diagonals [of 255 a px]."""
    down, across = np.gradient(gaussian_filter(grey, sigma))
    diagonal = np.sqrt(0.5)
    ways = (across, down, diagonal * (across + down), diagonal * (across - down))
    return [float(np.percentile(np.abs(way), STEEPEST_SLOPE_PERCENTILE)) for way in ways]


def _blur_from_slopes(fine: float, coarse: float) -> float:
    if fine < MIN_EDGE_SLOPE:
        return 0.0
    ratio = (fine / max(coarse, 1e-9)) ** 2
    if ratio <= 1:
        return float(MIDDLE_SIDE_PX)
    return float(np.sqrt(max(COARSE_SIGMA_PX**2 - ratio * FINE_SIGMA_PX**2, 0.0) / (ratio - 1)))

"""Cropping of photographs to their masks before downscaling.

An object that fills a third of each photograph has a third of the pixels along its sides that a reduced photograph has:
its thin parts and walls are lost. What is around it is of no use where masks say so. So each photograph is cut out
about its mask, all to one size, before it is reduced.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

CROP_MARGIN_FRACTION = 0.08
"""On either side of the largest box, in its longer side: masks err, and outlines need a rim."""
MIN_CROP_ZOOM_RATIO = 1.15
"""How much larger an object must become for photographs to be cut out."""


@dataclass(frozen=True)
class CropWindow:
    """How photographs are brought to one size; all in pixels, width and height."""

    whole: tuple[int, int]
    """Size that each is reduced to at first."""
    window: tuple[int, int]
    """Size of what is then cut out of it."""

    def corner(self, mask: Bool[np.ndarray, "H W"]) -> tuple[int, int]:
        """Return column and row at which the window about a mask of the whole begins."""
        columns, rows = (np.flatnonzero(mask.any(axis=k)) for k in (0, 1))
        if not len(columns):
            columns, rows = np.arange(self.whole[0]), np.arange(self.whole[1])
        middle = (columns[0] + columns[-1] + 1) / 2, (rows[0] + rows[-1] + 1) / 2
        sizes = zip(middle, self.window, self.whole, strict=True)
        across, down = (min(max(round(m - w / 2), 0), all_ - w) for m, w, all_ in sizes)
        return across, down


def mask_box_fractions(mask: Bool[np.ndarray, "H W"]) -> tuple[float, float] | None:
    """Return the sides of the box about a mask, in those of the picture; None: it is empty."""
    columns, rows = (np.flatnonzero(mask.any(axis=k)) for k in (0, 1))
    if not len(columns):
        return None
    height, width = mask.shape
    return (columns[-1] - columns[0] + 1) / width, (rows[-1] - rows[0] + 1) / height


def plan_crop(boxes: Float[np.ndarray, "V 2"], size: tuple[int, int], largest: tuple[int, int]) -> CropWindow:
    """Return how photographs are cut out about what masks show.

    The window is square, where the photographs are as high: a long object is seen from all sides.

    Args:
        boxes: Sides of the boxes about masks, in those of the pictures.
        size: That the whole photographs would be reduced to [px].
        largest: Size of the photographs as they are [px].
    """
    longest = max(size)
    needed = float((boxes * size).max()) * (1 + 2 * CROP_MARGIN_FRACTION) if len(boxes) else longest
    zoom = min(longest / max(needed, 1.0), max(largest) / longest)
    if zoom < MIN_CROP_ZOOM_RATIO:
        return CropWindow(size, size)
    whole = round(size[0] * zoom), round(size[1] * zoom)
    return CropWindow(whole, (min(longest, whole[0]), min(longest, whole[1])))

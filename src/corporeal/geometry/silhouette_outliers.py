"""Views whose silhouettes contradict those of all others: their poses, or their masks, are wrong.

A camera that was placed on the wrong piece of a repeating pattern has an ordinary reprojection
error; only what it shows of the object is not where the others see it. The visual hull is carved
with each view left out, and forgives a few of the rest, so that one wrong view does not carve away
what the right ones agree on.
"""

import numpy as np
from jaxtyping import Bool, Float, UInt8
from scipy.ndimage import binary_dilation

from corporeal.geometry.silhouettes import cells_of, cube_around, small
from corporeal.types import Camera

SIDE = 128
"""Longer side at which silhouettes are compared [px]."""
FORGIVEN = 0.1
"""Share of the views that may deny a point of the hull, at least one."""
FEWEST = 8
"""Views from which on a hull tells one that is wrong from those that are right."""
OUTLIER = 0.75
"""Overlap with the hull of the others, over the median of all views, below which a view is wrong.
Measured on real sets: right views 0.9 and more, wrong ones 0.7 and less."""
MOST = 0.34
"""Share of the views from which on nobody can say which ones are right."""


def outliers(masks: UInt8[np.ndarray, "V H W"], cameras: tuple[Camera, ...]) -> tuple[int, ...]:
    """Return the numbers of views that do not show what the others see; (): of none that is known.

    Args:
        masks: 255: the object; views with an empty one say nothing.
        cameras: In any frame and unit.

    """
    if len(cameras) < FEWEST:
        return ()
    overlap = overlaps(masks, cameras)
    wrong = np.flatnonzero(overlap < OUTLIER * np.nanmedian(overlap))
    return tuple(wrong.tolist()) if len(wrong) <= MOST * len(cameras) else ()


def overlaps(
    masks: UInt8[np.ndarray, "V H W"], cameras: tuple[Camera, ...]
) -> Float[np.ndarray, " V"]:
    """Return the intersection over union of each mask and the hull of the others; NaN: empty."""
    points = cube_around(masks, cameras)
    coarse = [small(mask, SIDE) for mask in masks]
    denied = np.zeros(len(points), np.int16)
    seen = np.zeros(len(points), np.int16)
    cells, denials = [], []
    for mask, camera in zip(coarse, cameras, strict=True):
        cell = cells_of(points, camera, mask.shape)
        near = np.asarray(binary_dilation(mask), bool)
        deny = (cell >= 0) & ~near.ravel()[cell]
        cells.append(cell.astype(np.int32))
        denials.append(deny)
        denied += deny
        seen += cell >= 0
    allowed = max(1, int(FORGIVEN * len(cameras)))
    looked = seen > len(cameras) / 4
    return np.array(
        [
            _overlap(mask, cell[looked & (denied - deny <= allowed)])
            for mask, cell, deny in zip(coarse, cells, denials, strict=True)
        ]
    )


def _overlap(mask: Bool[np.ndarray, "h w"], cell: np.ndarray) -> float:
    if not mask.any():
        return float("nan")
    shown = np.zeros(mask.size, bool)
    shown[cell[cell >= 0]] = True
    return float((shown & mask.ravel()).sum() / (shown | mask.ravel()).sum())

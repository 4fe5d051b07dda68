"""Where boxes go so that none is in another. N axis-aligned boxes (low, high) [m], z up."""

import numpy as np
from jaxtyping import Float

ROW_GAP_FRACTION = 0.05
"""Between neighbours on the floor, over the sum of their widths: they must not touch."""
STACK_GAP_FRACTION = 0.01
"""Between an object and the one below it, over its height."""
SAME_BASE_TOLERANCE = 1e-3
"""Bases whose heights differ by less, over the larger height, stand on one support."""

AxisBoxes = Float[np.ndarray, "N 2 3"]
BoxShifts = Float[np.ndarray, "N 3"]


def row_shifts(boxes: AxisBoxes) -> BoxShifts:
    """Return the shift of each box that puts all in a row along x, on the floor, y centred."""
    shifts = floor_shifts(boxes)
    width = boxes[:, 1, 0] - boxes[:, 0, 0]
    gaps = ROW_GAP_FRACTION * (width[1:] + width[:-1])
    left = np.concatenate([[0.0], np.cumsum(width[:-1] + gaps)])
    left -= (left[-1] + width[-1]) / 2
    shifts[:, 0] = left - boxes[:, 0, 0]
    return shifts


def stack_shifts(boxes: AxisBoxes) -> BoxShifts:
    """Return the shift of each box that puts all above each other, the first on the floor."""
    shifts = floor_shifts(boxes)
    height = boxes[:, 1, 2] - boxes[:, 0, 2]
    gap = STACK_GAP_FRACTION * height[1:]
    shifts[1:, 2] += np.cumsum(height[:-1] + gap)
    return shifts


def floor_shifts(boxes: AxisBoxes) -> BoxShifts:
    """Return the shift of each box that puts the middle of its underside at the origin."""
    shifts = -boxes.mean(axis=1)
    shifts[:, 2] = -boxes[:, 0, 2]
    return shifts


def lift_heights(boxes: AxisBoxes, drop: float) -> Float[np.ndarray, " N"]:
    """Return how far each box rises to hang ``drop`` of its size above what supports it [m].

    A box rests on those whose footprint it shares and whose base is lower, so it rises with them; boxes with shared
    footprint and base rise together, as they may be hooked into each other.
    """
    own = drop * (boxes[:, 1] - boxes[:, 0]).max(axis=1)
    base = boxes[:, 0, 2]
    tolerance = SAME_BASE_TOLERANCE * (boxes[:, 1, 2] - boxes[:, 0, 2]).max()
    shared = _shares_footprint(boxes)
    together = shared & (np.abs(base[:, None] - base[None]) <= tolerance)
    below = shared & (base[:, None] > base[None] + tolerance)
    rise = np.zeros(len(boxes))
    for k in np.argsort(base, kind="stable"):
        mates = together[k] | (np.arange(len(boxes)) == k)
        supports = below[mates].any(axis=0)
        rise[k] = own[mates].max() + rise[supports].max(initial=0.0)
    return rise


def overlapping_boxes(boxes: AxisBoxes) -> list[tuple[int, int]]:
    """Return the pairs of boxes with common volume."""
    low = np.maximum(boxes[:, None, 0], boxes[None, :, 0])
    high = np.minimum(boxes[:, None, 1], boxes[None, :, 1])
    common = np.triu((high > low).all(axis=2), 1)
    return [(int(a), int(b)) for a, b in np.argwhere(common)]


def _shares_footprint(boxes: AxisBoxes) -> np.ndarray:
    low = np.maximum(boxes[:, None, 0, :2], boxes[None, :, 0, :2])
    high = np.minimum(boxes[:, None, 1, :2], boxes[None, :, 1, :2])
    return np.all(high > low, axis=2)

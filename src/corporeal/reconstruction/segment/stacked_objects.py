"""Segmentation of stacked thin objects."""

import numpy as np
from jaxtyping import Int

from corporeal.reconstruction.segment.patch_graph import SurfacePatches

MAX_THIN_RATIO = 1 / 3
"""Height over the smaller width of what is thin [-]."""
MIN_COVERED_FRACTION = 0.5
"""Share of the smaller outline, seen from above, under or on which something lies."""
MAX_GAP_RATIO = 0.5
"""Distance of one's top and the other's bottom, over the thin one's height [-]."""


def count_stacked_objects(found: SurfacePatches, instance: Int[np.ndarray, " M"]) -> int:
    """Return how many objects are thin and lie on or under another.

    An object's box stands upright, turned about the vertical as its patches lie. It is thin where
    it is less than a third as high as wide; the other lies on it, or under it, where their outlines
    overlap by half of the smaller and one begins where the other ends.
    """
    count = int(instance.max()) + 1
    rows = [found.centre[instance == k] for k in range(count)]
    height = np.array([np.ptp(r[:, 2]) for r in rows])
    width = np.array([_outline_width(r[:, :2]) for r in rows])
    thin = (height < MAX_THIN_RATIO * width) & (width > 0)
    return sum(
        any(_are_touching(rows[a], rows[b], height[a]) for b in range(count) if b != a)
        for a in np.flatnonzero(thin)
    )


def _outline_width(flat: np.ndarray) -> float:
    """Return the smaller width of an outline."""
    if len(flat) < 3:
        return 0.0
    local = flat - flat.mean(axis=0)
    axes = np.linalg.eigh(local.T @ local)[1]
    return float(np.ptp(local @ axes, axis=0).min())


def _are_touching(a: np.ndarray, b: np.ndarray, height: float) -> bool:
    gap = min(abs(float(low[:, 2].max() - high[:, 2].min())) for low, high in ((a, b), (b, a)))
    corners = [np.array([r[:, :2].min(axis=0), r[:, :2].max(axis=0)]) for r in (a, b)]
    low, high = np.maximum(*(c[0] for c in corners)), np.minimum(*(c[1] for c in corners))
    common = float(np.prod(np.maximum(high - low, 0)))
    smaller = min(float(np.prod(c[1] - c[0])) for c in corners)
    return gap < MAX_GAP_RATIO * height and common > MIN_COVERED_FRACTION * smaller

"""Detection of objects beside the masks.

Masks are of what has the colours of the middle, so that a second object of other colours is lost without a word. But it
stands up, and what of the hull of all that does is seen beside masks is something else.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from corporeal.reconstruction.masks.floor_parallax import MIN_PIECE_TO_MASK_RATIO, StandingRegions, pixels_to_mask_ratio

MIN_ASIDE_FRACTION = 0.6
"""Of the pixels of a piece, in the median view, that are beside masks: what masks lack of an object has .0 to .5, other
objects .9.
"""


@dataclass(frozen=True)
class ObjectBesideMasks:
    """Where something else is."""

    as_large: float
    """Pixels that it covers over those of masks, in the median view [-]."""
    view: int
    """In which the most of it is seen."""
    across: float
    """Where it is there, in widths of the picture from the left."""
    down: float
    """The same, in heights from the top."""


def find_object_beside_masks(
    stands: StandingRegions, masks: Bool[np.ndarray, "V H W"], near: Bool[np.ndarray, "V H W"]
) -> ObjectBesideMasks | None:
    """Find the largest object that stands beside what masks show; None: nothing does.

    Args:
        stands: All that stands on the floor.
        masks: What was taken for objects.
        near: The same and what borders on it, which is left out.
    """
    piece, count = stands.room.pieces(stands.beside(near))
    found = [
        _place_in_picture(stands.room.silhouettes(piece == k), masks, near)
        for k in range(1, count + 1)
        if stands.free(piece == k)
    ]
    return max(filter(None, found), key=lambda one: one.as_large, default=None)


def _place_in_picture(
    seen: Bool[np.ndarray, "V H W"], masks: Bool[np.ndarray, "V H W"], near: np.ndarray
) -> ObjectBesideMasks | None:
    """Return where a piece is seen; None: it is too small, or a part of what masks show."""
    count = seen.sum(axis=(1, 2))
    apart = (seen & ~near).sum(axis=(1, 2))
    large = pixels_to_mask_ratio(seen, masks)
    if large < MIN_PIECE_TO_MASK_RATIO or np.median(apart / np.maximum(count, 1)) < MIN_ASIDE_FRACTION:
        return None
    view = int(apart.argmax())
    down, across = (np.argwhere(seen[view]).mean(axis=0) + 0.5) / seen.shape[1:]
    return ObjectBesideMasks(large, view, float(across), float(down))

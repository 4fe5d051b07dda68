"""Something that stands on the floor beside what masks show, and is in none of them.

Masks are of what has the colours of the middle, so that a second thing of other colours is lost
without a word. But it stands up, and what of the hull of all that does is seen beside masks is
something else.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from corporeal.reconstruction.masks.parallax import AS_LARGE, Standing, as_large

ASIDE = 0.6
"""Of the pixels of a piece, in the median view, that are beside masks: what masks lack of a thing
has .0 to .5, other things .9."""


@dataclass(frozen=True)
class Beside:
    """Where something else is."""

    as_large: float
    """Pixels that it covers over those of masks, in the median view [-]."""
    view: int
    """In which the most of it is seen."""
    across: float
    """Where it is there, in widths of the picture from the left."""
    down: float
    """The same, in heights from the top."""


def beside(
    stands: Standing, masks: Bool[np.ndarray, "V H W"], near: Bool[np.ndarray, "V H W"]
) -> Beside | None:
    """Find the largest thing that stands beside what masks show; None: nothing does.

    Args:
        stands: All that stands on the floor.
        masks: What was taken for objects.
        near: The same and what borders on it, where nothing is said.

    """
    piece, count = stands.room.pieces(stands.beside(near))
    found = [
        _told(stands.room.silhouettes(piece == k), masks, near)
        for k in range(1, count + 1)
        if stands.free(piece == k)
    ]
    return max(filter(None, found), key=lambda one: one.as_large, default=None)


def _told(
    seen: Bool[np.ndarray, "V H W"], masks: Bool[np.ndarray, "V H W"], near: np.ndarray
) -> Beside | None:
    """Return where a piece is seen; None: it is too small, or a part of what masks show."""
    count = seen.sum(axis=(1, 2))
    apart = (seen & ~near).sum(axis=(1, 2))
    large = as_large(seen, masks)
    if large < AS_LARGE or np.median(apart / np.maximum(count, 1)) < ASIDE:
        return None
    view = int(apart.argmax())
    down, across = (np.argwhere(seen[view]).mean(axis=0) + 0.5) / seen.shape[1:]
    return Beside(large, view, float(across), float(down))

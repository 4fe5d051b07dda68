"""Attached parts of objects with other colours than their masks.

The grey head of a hammer whose handle is yellow is in no mask that grows from the handle's colours. Of the hull of all
that stands, which knows no colours, it is the part beside masks that borders on theirs.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from corporeal.reconstruction.masks.floor_parallax import MIN_PIECE_TO_MASK_RATIO, StandingRegions, pixels_to_mask_ratio


@dataclass(frozen=True)
class MaskAttachments:
    """What hangs on masks; V views of H × W."""

    shown: Bool[np.ndarray, "V H W"]
    """Pixels beside masks that show it."""
    within: Bool[np.ndarray, "V H W"]
    """Silhouettes of its hull, which no view's colours make smaller."""


def find_mask_attachments(stands: StandingRegions, masks: Bool[np.ndarray, "V H W"]) -> MaskAttachments | None:
    """Find what hangs on masks; None: nothing does."""
    room, own = stands.room, stands.room.carved(masks)
    whole, _ = room.pieces(stands.cells | own)
    joined = np.isin(whole, whole[own])
    piece, count = room.pieces(stands.beside(masks) & ~own & joined)
    within = np.zeros_like(masks)
    for k in range(1, count + 1):
        if stands.free(piece == k):
            seen = room.silhouettes(piece == k)
            within |= seen & (pixels_to_mask_ratio(seen, masks) >= MIN_PIECE_TO_MASK_RATIO)
    shown = within & stands.shown & ~masks
    return MaskAttachments(shown, within) if pixels_to_mask_ratio(shown, masks) >= MIN_PIECE_TO_MASK_RATIO else None

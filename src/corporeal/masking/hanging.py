"""What stands on the floor and hangs together with what masks show, but has other colours.

The grey head of a hammer whose handle is yellow is in no mask that grows from the handle's colours.
Of the hull of all that stands, which knows no colours, it is the part beside masks that borders on
theirs.
"""

import numpy as np
from jaxtyping import Bool

from corporeal.masking.standing import AS_LARGE, Standing, as_large


def hanging(stands: Standing, masks: Bool[np.ndarray, "V H W"]) -> Bool[np.ndarray, "V H W"] | None:
    """Return the pixels beside masks that show what hangs on them; None: nothing does.

    Args:
        stands: All that stands on the floor.
        masks: What was taken for objects.

    """
    room, own = stands.room, stands.room.carved(masks)
    whole, _ = room.pieces(stands.cells | own)
    joined = np.isin(whole, whole[own])
    piece, count = room.pieces(stands.beside(masks) & ~own & joined)
    shown = np.zeros_like(masks)
    for k in range(1, count + 1):
        if stands.free(piece == k):
            seen = room.silhouettes(piece == k)
            shown |= seen & stands.shown & ~masks & (as_large(seen, masks) >= AS_LARGE)
    return shown if as_large(shown, masks) >= AS_LARGE else None

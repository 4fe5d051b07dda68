"""Morphological opening of carved cavities by a ball.

Where a face shines, stereo finds highlights behind it, here and there. Carved as deep, a wet object is full of caverns
with mouths of some pixels. What a camera truly looks into has a mouth as wide as what is seen in it: of what depths of
photographs add to the carving, only that is accepted which a ball can enter from outside, and what is left of it in
corners.
"""

import numpy as np
from jaxtyping import Bool, Float
from scipy import ndimage
from skimage import measure

CORNER_GAP_RADII = 1.5
"""What is left in a corner is no farther from the ball [radii]: a wedge of angle α has
1/sin(α/2) - 1, that is .4 for a right angle and 1.5 for one of 47 degrees."""


def open_by_ball(
    before: Float[np.ndarray, "X Y Z"], after: Float[np.ndarray, "X Y Z"], radius: float
) -> Float[np.ndarray, "X Y Z"]:
    """Return ``after`` but for caverns, which are as ``before``.

    Args:
        before: Distance to a surface, negative inside [cells].
        after: The same of one that lies deeper.
        radius: Of the ball [cells].
    """
    taken = (before < 0) & (after >= 0)
    if not taken.any():
        return after
    away = _distance_to_swept(before >= 0, after >= 0, radius)
    piece = np.asarray(measure.label(taken & (away > 0), connectivity=1))
    number = np.arange(piece.max() + 1)
    cavern = (np.asarray(ndimage.maximum(away, piece, number)) > CORNER_GAP_RADII * radius) & (number > 0)
    return np.where(cavern[piece], before, after)


def _distance_to_swept(
    outside: Bool[np.ndarray, "X Y Z"], free: Bool[np.ndarray, "X Y Z"], radius: float
) -> Float[np.ndarray, "X Y Z"]:
    """How far cells are from what a ball covers that moves through free ones, from outside."""
    # Beyond the grid all is free.
    room = int(np.ceil(radius)) + 1
    free, outside = (np.pad(x, room, constant_values=True) for x in (free, outside))
    middles = np.asarray(ndimage.distance_transform_edt(free)) > radius
    piece = np.asarray(measure.label(middles, connectivity=1))
    ways = np.unique(piece[outside & middles])
    ball = np.isin(piece, ways[ways > 0])
    inner = (slice(room, -room),) * 3
    return np.maximum(np.asarray(ndimage.distance_transform_edt(~ball))[inner] - radius, 0)

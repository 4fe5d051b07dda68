"""Pixels with the colours of objects outside the silhouettes of the hull.

Masks agree with their hull because they are kept to it. What it lost is seen beside it: pieces so flat that they pass
for a pattern on the floor, or what pictures of other places would not carve.
"""

import numpy as np
from jaxtyping import Bool

from corporeal.core.types import Camera
from corporeal.multiview.ground_plane import GroundPlane
from corporeal.multiview.viewed_region import ViewedRegion
from corporeal.reconstruction.masks.floor_grid import floor_grid, floor_intersections


def residual_fraction(
    coloured: Bool[np.ndarray, "V H W"], masks: Bool[np.ndarray, "V H W"], where: Bool[np.ndarray, "V H W"]
) -> float:
    """Return how much has the colours of objects where none was taken, over what was taken [-].

    The median of all views.

    Args:
        coloured: Pixels that would be objects' if colours and edges alone decided.
        masks: What was taken for objects.
        where: Pixels that count, none near objects.
    """
    beside, taken = (coloured & where).sum(axis=(1, 2)), masks.sum(axis=(1, 2))
    return float(np.median(beside / np.maximum(taken, 1)))


def pixels_before_floor(
    cameras: tuple[Camera, ...], floor: GroundPlane | None, around: ViewedRegion
) -> Bool[np.ndarray, "V H W"]:
    """Tell behind which pixels the floor under the ball lies; none where the floor is unknown.

    Walls, and what stands before them, may have any colour.
    """
    made = np.zeros((len(cameras), cameras[0].height, cameras[0].width), np.bool_)
    if floor is None:
        return made
    ground = floor_grid(cameras, floor, around)
    for one, camera in zip(made, cameras, strict=True):
        one[:] = (ground.cells(floor_intersections(camera, floor)) >= 0).reshape(one.shape)
    return made

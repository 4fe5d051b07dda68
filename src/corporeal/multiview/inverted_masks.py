"""Detection of inverted masks.

Programs differ in what white means. Inverted masks contradict neither the pictures nor one another:
together they show the surroundings without the object.
"""

import numpy as np
from jaxtyping import Bool

from corporeal.core.types import Camera
from corporeal.multiview.viewed_region import find_viewed_region

MIN_INVERTED_BORDER_FRACTION = 0.5
"""Share of a picture's border, and of what all cameras look at, in the median picture: an object
that pictures cut off on most of their sides is still where they look, and what has a hole there is
not cut off on most.
"""
CENTRE_HALF_SIDE_WIDTHS = 0.05
"""Half the side of the square about what all cameras look at, in widths of the picture."""


def are_masks_inverted(masks: Bool[np.ndarray, "V H W"], cameras: tuple[Camera, ...]) -> bool:
    """Return whether most masks hold most of the borders, and not what all cameras look at.

    Args:
        masks: Which pixels are said to be on objects.
        cameras: Of the pictures.

    """
    frame = np.ones(masks.shape[1:], np.bool_)
    frame[1:-1, 1:-1] = False
    around = np.median(masks[:, frame].mean(axis=1))
    place = np.array([*find_viewed_region(cameras).centre, 1.0])
    middles = [_centre_mask_fraction(m, c, place) for m, c in zip(masks, cameras, strict=True)]
    return bool(
        around > MIN_INVERTED_BORDER_FRACTION
        and np.median(middles) < 1 - MIN_INVERTED_BORDER_FRACTION
    )


def _centre_mask_fraction(
    mask: Bool[np.ndarray, "H W"], camera: Camera, place: np.ndarray
) -> float:
    """Return how much of the square about a place (4,), homogeneous, is in a mask [-].

    Of a place that a picture does not show, the nearest square on it.
    """
    across, down, ahead = camera.K @ (np.linalg.inv(camera.world_from_camera) @ place)[:3]
    height, width = mask.shape
    half = max(1, round(CENTRE_HALF_SIDE_WIDTHS * width))
    ahead = max(ahead, 1e-9)
    u, v = (int(np.clip(x / ahead, half, n - half)) for x, n in ((across, width), (down, height)))
    return float(mask[v - half : v + half, u - half : u + half].mean())

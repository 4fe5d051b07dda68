"""Pictures whose masks are cut off at the border."""

import numpy as np
from jaxtyping import Bool

MIN_CROPPED_BORDER_FRACTION = 0.1
"""Share of a side of a picture that a mask fills where what it shows is cropped."""


def find_cropped_masks(masks: Bool[np.ndarray, "V H W"]) -> Bool[np.ndarray, " V"]:
    """Tell in which pictures masks fill much of a border."""
    sides = masks[:, 0], masks[:, -1], masks[:, :, 0], masks[:, :, -1]
    return np.max([side.mean(axis=1) for side in sides], axis=0) > MIN_CROPPED_BORDER_FRACTION

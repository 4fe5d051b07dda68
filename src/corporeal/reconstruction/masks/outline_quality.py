"""Quality of mask outlines: image edges, and thickness.

A cut through a table, where the light of a flash falls off, has colours of its own on either side and agrees with its
hull as well as any. But nothing changes across it.
"""

import numpy as np
from jaxtyping import Bool, Float, Float32, UInt8
from scipy.ndimage import binary_erosion, find_objects, gaussian_filter, gaussian_filter1d, maximum_filter
from skimage.color import rgb2lab

NOTICEABLE_COLOUR_STEP_LAB = 2.3
"""Step of colour in CIELAB that is just noticed (Mahy, Van Eycken and Oosterlinck 1994)."""
GRADIENT_SIGMA_PX = 1.0
"""Of the Gaussian by which pictures are smoothed before they are derived [px]."""
EDGE_SEARCH_PX = 2
"""How far beside an outline its edge may lie [px]."""
MASK_THRESHOLD = 0.5
"""Of a pixel: from here on it is inside."""


def faint_outline_fraction(rgb: UInt8[np.ndarray, "V H W 3"], inside: Float32[np.ndarray, "V H W"]) -> float:
    """Return along which share of the outlines no edge is seen, the median of all views."""
    shares = []
    for picture, mask in zip(rgb, inside > MASK_THRESHOLD, strict=True):
        box = find_objects(mask.astype(np.uint8))
        if not box:
            continue
        about = tuple(slice(max(s.start - 4 * EDGE_SEARCH_PX, 0), s.stop + 4 * EDGE_SEARCH_PX) for s in box[0])
        rim = _outline_pixels(mask[about]) & ~_at_border(mask.shape)[about]
        if rim.any():
            shares.append(float((_colour_step(picture[about], mask[about])[rim] < NOTICEABLE_COLOUR_STEP_LAB).mean()))
    return float(np.median(shares)) if shares else 0.0


def rim_fraction(inside: Float32[np.ndarray, "V H W"]) -> float:
    """Return which share of masks their outermost pixels are, the median of all views.

    Masks that are a pixel too wide overlap with right ones by 1 less that.
    """
    masks = inside > MASK_THRESHOLD
    shares = [_outline_pixels(mask).sum() / mask.sum() for mask in masks if mask.any()]
    return float(np.median(shares)) if shares else 0.0


def _outline_pixels(mask: Bool[np.ndarray, "h w"]) -> Bool[np.ndarray, "h w"]:
    return mask & ~np.asarray(binary_erosion(mask, border_value=1), np.bool_)


def _at_border(shape: tuple[int, ...]) -> Bool[np.ndarray, "H W"]:
    """Return which pixels are so near the border that an edge of theirs may lie beyond."""
    border = np.ones(shape, np.bool_)
    border[EDGE_SEARCH_PX:-EDGE_SEARCH_PX, EDGE_SEARCH_PX:-EDGE_SEARCH_PX] = False
    return border


def _colour_step(picture: UInt8[np.ndarray, "h w 3"], mask: Bool[np.ndarray, "h w"]) -> Float[np.ndarray, "h w"]:
    """Return the highest step of colour across the outline near each pixel, in CIELAB.

    A step of height h that is smoothed is h / (σ √(2π)) steep. What crosses an outline, such as the grain of a table,
    is no edge of it.
    """
    across = np.array(np.gradient(gaussian_filter(mask.astype(float), EDGE_SEARCH_PX)))
    across /= np.maximum(np.linalg.norm(across, axis=0), np.finfo(float).tiny)
    lab = np.moveaxis(np.asarray(rgb2lab(picture)), -1, 0)
    slopes = [across[0] * _colour_slope(one, 0) + across[1] * _colour_slope(one, 1) for one in lab]
    steep = np.linalg.norm(slopes, axis=0)
    return np.sqrt(2 * np.pi) * GRADIENT_SIGMA_PX * maximum_filter(steep, 2 * EDGE_SEARCH_PX + 1)


def _colour_slope(one: Float[np.ndarray, "h w"], axis: int) -> Float[np.ndarray, "h w"]:
    return gaussian_filter1d(gaussian_filter1d(one, GRADIENT_SIGMA_PX, axis, order=1), GRADIENT_SIGMA_PX, 1 - axis)

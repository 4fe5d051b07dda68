"""Detection of background in masks by inconsistency with other photographs.

Masks that are grown from colours take in pieces of the background of an object, where these have
its colours. If every view that could see past such a place has a piece of something there, the
hull of all masks holds it, though each view shows something else in it. Gaussians learned from
all photographs know: what is at one place has about one colour, so that they mostly show nothing
there (the colour consistency of Seitz and Dyer, "Photorealistic scene reconstruction by voxel
coloring", 1999, asked of what was learned in place of voxels).
"""

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import binary_dilation, distance_transform_edt, shift
from skimage import measure

from corporeal.core.types import Gaussians, Views
from corporeal.reconstruction.gaussians.depth_rendering import render_depth
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool

COLOUR_DIFFERENCE_RMS = 3.0
"""A pixel is of another colour if it differs by so many root mean squares of all differences."""
EXPLAINED_TOLERANCE_PX = 1.5
"""What is so near to a pixel that is explained may be its outline, which is as wrong [px]."""
THIN_MASK_DEPTH_PX = 2.0
"""Where masks reach no deeper [px], they are four wide: legs and wires so thin are not learned."""
MIN_BARE_FRACTION, MIN_HUE_DIFFERENCE_FRACTION = 0.5, 0.1
"""Share of a piece that Gaussians leave bare, at least; or of the square of its mean difference, what is not the same
in all channels: what they cover and is but lighter, or darker, may be a highlight, or a shade."""
MAX_CONTAMINATION_FRACTION = 0.25
"""Share of a view's mask. Where more is unexplained, that view is placed wrongly, or shows the object in another light,
which says nothing of its mask."""
PIXEL_OFFSETS = np.argwhere(np.ones((3, 3))) - 1
"""Pixels that a colour is looked for in: what was learned is as sharp as that."""


def mask_contamination(
    gaussians: Gaussians, views: Views, masks: Bool[np.ndarray, "V H W"], threads: int | None = None
) -> Bool[np.ndarray, "V H W"]:
    """Return the pieces of masks that reach their rim and show what Gaussians do not.

    Args:
        gaussians: Learned from the photographs and the masks.
        views: The photographs.
        masks: Their pixels on objects, as far as is known.
        threads: None: one per core that this process may use.
    """
    with ThreadPool(threads) as pool:
        seen = render_depth(gaussians, views.cameras, pool)
    covered, real = np.isfinite(seen.depth), views.rgb.astype(np.float32) / 255
    compared = zip(real, seen.rgb, masks & covered, strict=True)
    more = np.stack([_colour_excess(*one) for one in compared])
    off = np.stack([_pixel_differences(*one) for one in zip(real, more, strict=True)])
    known = off[masks & np.isfinite(off)]
    if not len(known):
        return np.zeros_like(masks)
    same = off < COLOUR_DIFFERENCE_RMS * np.sqrt(np.mean(known**2))
    return np.stack([_beyond_explained(*one) for one in zip(masks, masks & same, more, strict=True)])


def drop_thin_pieces(pieces: Bool[np.ndarray, "V H W"], masks: Bool[np.ndarray, "V H W"]) -> Bool[np.ndarray, "V H W"]:
    """Return those pieces of masks that are not thin, as legs are that no Gaussians show."""
    out = np.zeros_like(pieces)
    for made, found, mask in zip(out, pieces, masks, strict=True):
        number = np.asarray(measure.label(found, connectivity=1))
        deep = np.asarray(distance_transform_edt(mask)) > THIN_MASK_DEPTH_PX
        made[:] = np.isin(number, number[np.logical_and(found, deep)]) & found
    return out


def _colour_excess(
    real: Float[np.ndarray, "H W 3"], made: Float[np.ndarray, "H W 3"], both: Bool[np.ndarray, "H W"]
) -> Float[np.ndarray, "H W 3"]:
    """Return a photograph less a picture after the gain that suits it, in sRGB; inf: bare."""
    power = np.square(made[both]).sum(axis=0)
    gain = (made[both] * real[both]).sum(axis=0) / np.maximum(power, np.finfo(np.float32).tiny)
    return np.where(both[..., None], real - gain * made, np.inf)


def _pixel_differences(real: Float[np.ndarray, "H W 3"], more: Float[np.ndarray, "H W 3"]) -> Float[np.ndarray, "H W"]:
    """Return how far each pixel is from the most alike of those beside it; inf: all are bare.

    Root mean square of the channels.
    """
    shown, best = real - more, np.full(real.shape[:2], np.inf)
    for down, right in PIXEL_OFFSETS:
        moved = shift(shown, (down, right, 0), order=0, cval=-np.inf)
        best = np.minimum(best, np.sqrt(np.square(real - moved).mean(axis=-1)))
    return best


def _beyond_explained(
    mask: Bool[np.ndarray, "H W"], same: Bool[np.ndarray, "H W"], more: Float[np.ndarray, "H W 3"]
) -> Bool[np.ndarray, "H W"]:
    """Return what of a mask is farther from explained pixels than an outline errs, and its rim."""
    none = np.zeros_like(mask)
    if not same.any():
        return none
    other = mask & ~same
    rim = np.asarray(binary_dilation(~mask))
    far = mask & (np.asarray(distance_transform_edt(~same)) > EXPLAINED_TOLERANCE_PX)
    number = np.asarray(measure.label(other, connectivity=1))
    # What is enclosed is a highlight, or a pattern that was learned badly.
    outer = np.intersect1d(number[far], number[np.logical_and(other, rim)])
    found = other & np.isin(number, outer)
    found = np.logical_and(found, binary_dilation(far, iterations=2))
    piece = np.asarray(measure.label(found, connectivity=1))
    strange = np.zeros(int(piece.max()) + 1, bool)
    for k in range(1, len(strange)):
        off = more[piece == k]
        shown = off[np.isfinite(off).all(axis=1)]
        strange[k] = len(off) - len(shown) > MIN_BARE_FRACTION * len(off) or _has_other_hue(shown.mean(axis=0))
    found = strange[piece]
    return found if np.count_nonzero(found) <= MAX_CONTAMINATION_FRACTION * np.count_nonzero(mask) else none


def _has_other_hue(off: Float[np.ndarray, "3"]) -> bool:
    """Return whether a difference is not one of light alone."""
    return bool(np.square(off - off.mean()).sum() > MIN_HUE_DIFFERENCE_FRACTION * np.square(off).sum())

"""Colours of objects and of what is around them: histograms in CIELAB, as in GrabCut.

Rother, Kolmogorov and Blake, "GrabCut" (2004), learn a mixture of Gaussians for either side; over
all pictures together there are enough pixels for a histogram.
"""

import numpy as np
from jaxtyping import Float, Float32, Int32, UInt8
from scipy.ndimage import gaussian_filter
from skimage.color import rgb2lab

BINS = 24
"""Along each axis of CIELAB."""
LEVELS = 4
"""Of how well a pixel fits something else that is known of its place; not known: 0."""
LOW, SPAN = (0.0, -60.0, -60.0), (100.0, 120.0, 120.0)
"""Of L*, a* and b*; more saturated colours fall into the last bins."""
SMOOTH = 0.8
"""Standard deviation of the blur of histograms [bins]: noise and shading spread a colour."""
RARE = 1e-6
"""Added to every bin's share, so that a colour that was never seen decides nothing."""
SUREST = 3.0
"""Largest log-likelihood ratio that one pixel's colour may have."""


def bins_of(
    rgb: UInt8[np.ndarray, "V H W 3"], level: UInt8[np.ndarray, "V H W"]
) -> Int32[np.ndarray, "V H W"]:
    """Return the number of the bin that each pixel's colour falls into, at its level."""
    made = np.empty(rgb.shape[:3], np.int32)
    for one, picture in zip(made, rgb, strict=True):
        place = (rgb2lab(picture) - LOW) / SPAN * BINS
        lightness, a, b = np.clip(place, 0, BINS - 1).astype(np.int32).transpose(2, 0, 1)
        one[:] = (lightness * BINS + a) * BINS + b
    return made + BINS**3 * level.astype(np.int32)


def histogram(
    bins: Int32[np.ndarray, "V H W"], weight: Float[np.ndarray, "V H W"]
) -> Float[np.ndarray, " K"]:
    """Return the share of the weight that falls into each bin."""
    counts = np.bincount(bins.ravel(), weight.ravel().astype(float), LEVELS * BINS**3)
    counts = counts.reshape(LEVELS, BINS, BINS, BINS)
    smooth = gaussian_filter(counts, (0, SMOOTH, SMOOTH, SMOOTH)).ravel()
    return smooth / max(smooth.sum(), RARE)


def against(
    bins: Int32[np.ndarray, "V H W"],
    inside: Float[np.ndarray, " K"],
    outside: Float[np.ndarray, " K"],
) -> Float32[np.ndarray, "V H W"]:
    """Return log p(colour | outside) / p(colour | inside) of every pixel, limited to ± SUREST."""
    ratio = np.log((outside + RARE) / (inside + RARE))
    return np.clip(ratio, -SUREST, SUREST).astype(np.float32)[bins]


def overlap(inside: Float[np.ndarray, " K"], outside: Float[np.ndarray, " K"]) -> float:
    """Return Bhattacharyya's coefficient: 0 where no colour is on both sides, 1 where all are."""
    return float(np.sqrt(inside * outside).sum())

"""Colour models of objects and background: histograms in CIELAB, as in GrabCut.

Rother, Kolmogorov and Blake, "GrabCut" (2004), learn a mixture of Gaussians for either side; over all pictures together
there are enough pixels for a histogram.
"""

import numpy as np
from jaxtyping import Float, Float32, Int32, UInt8
from scipy.ndimage import gaussian_filter
from skimage.color import rgb2lab

BINS_PER_AXIS = 24
"""Along each axis of CIELAB."""
FIT_LEVELS = 4
"""Of how well a pixel fits something else that is known of its place; not known: 0."""
LAB_LOW, LAB_SPAN = (0.0, -60.0, -60.0), (100.0, 120.0, 120.0)
"""Of L*, a* and b*; more saturated colours fall into the last bins."""
HISTOGRAM_BLUR_BINS = 0.8
"""Standard deviation of the blur of histograms [bins]: noise and shading spread a colour."""
BIN_FLOOR_FRACTION = 1e-6
"""Added to every bin's share, so that a colour that was never seen decides nothing."""
MAX_LOG_LIKELIHOOD_RATIO = 3.0
"""Largest log-likelihood ratio that one pixel's colour may have."""


def colour_bins(rgb: UInt8[np.ndarray, "V H W 3"], level: UInt8[np.ndarray, "V H W"]) -> Int32[np.ndarray, "V H W"]:
    """Return the number of the bin that each pixel's colour falls into, at its level."""
    made = np.empty(rgb.shape[:3], np.int32)
    for one, picture in zip(made, rgb, strict=True):
        place = (rgb2lab(picture) - LAB_LOW) / LAB_SPAN * BINS_PER_AXIS
        lightness, a, b = np.clip(place, 0, BINS_PER_AXIS - 1).astype(np.int32).transpose(2, 0, 1)
        one[:] = (lightness * BINS_PER_AXIS + a) * BINS_PER_AXIS + b
    return made + BINS_PER_AXIS**3 * level.astype(np.int32)


def colour_histogram(bins: Int32[np.ndarray, "V H W"], weight: Float[np.ndarray, "V H W"]) -> Float[np.ndarray, " K"]:
    """Return the share of the weight that falls into each bin."""
    counts = np.bincount(bins.ravel(), weight.ravel().astype(float), FIT_LEVELS * BINS_PER_AXIS**3)
    counts = counts.reshape(FIT_LEVELS, BINS_PER_AXIS, BINS_PER_AXIS, BINS_PER_AXIS)
    smooth = gaussian_filter(counts, (0, HISTOGRAM_BLUR_BINS, HISTOGRAM_BLUR_BINS, HISTOGRAM_BLUR_BINS)).ravel()
    return smooth / max(smooth.sum(), BIN_FLOOR_FRACTION)


def background_log_likelihood(
    bins: Int32[np.ndarray, "V H W"], inside: Float[np.ndarray, " K"], outside: Float[np.ndarray, " K"]
) -> Float32[np.ndarray, "V H W"]:
    """Return log p(colour | outside) / p(colour | inside) of every pixel, limited to ± SUREST."""
    ratio = np.log((outside + BIN_FLOOR_FRACTION) / (inside + BIN_FLOOR_FRACTION))
    return np.clip(ratio, -MAX_LOG_LIKELIHOOD_RATIO, MAX_LOG_LIKELIHOOD_RATIO).astype(np.float32)[bins]


def colour_overlap(inside: Float[np.ndarray, " K"], outside: Float[np.ndarray, " K"]) -> float:
    """Return Bhattacharyya's coefficient: 0 where no colour is on both sides, 1 where all are."""
    return float(np.sqrt(inside * outside).sum())

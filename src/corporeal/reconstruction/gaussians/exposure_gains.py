"""Per-photograph gains for exposure and white balance.

One gain for each photograph and channel, on sRGB values: an exposure multiplies light, and sRGB is nearly a power of
light. Gains are relative: their geometric mean over all photographs is 1.
"""

import numpy as np
from jaxtyping import Float, Float32, UInt8

from corporeal.reconstruction.gaussians.rasteriser_numba import Drawing

MAX_TRANSMITTANCE = 0.05
"""Pixels where less than this shines through from behind are compared."""
MIN_COMPARED_VALUE, MAX_COMPARED_VALUE = 0.04, 0.98
"""Darker and brighter values say little of gains: noise, and what is cut off."""
COMPARED_ROWS = 64
"""That many rows and columns are compared, about; gains are one number for all."""
MIN_COMPARED_PIXELS = 50
"""Pixels that it takes to know a gain."""
MAX_GAIN = 4.0
"""Gains are at most that, or one over it."""
GAIN_UPDATE_FRACTION = 0.3
"""Share of what a step finds that enters the gain."""
EXPOSURE_SPREAD_LOG = 0.04
"""Standard deviation of logarithms from which on exposures differ."""

ExposureGains = Float32[np.ndarray, "V 3"]


def exposure_gain(
    drawing: Drawing, rgb: UInt8[np.ndarray, "H W 3"], mask: UInt8[np.ndarray, "H W"] | None
) -> Float[np.ndarray, "3"]:
    """Return how much brighter a photograph is than a drawing: medians of ratios; nan: unknown."""
    pace = max(1, max(rgb.shape[:2]) // COMPARED_ROWS)
    some = slice(pace // 2, None, pace)
    covered = drawing.planes[3, some, some] < MAX_TRANSMITTANCE
    if mask is not None:
        covered = covered & (mask[some, some] == 255)
    made = drawing.planes[:3, some, some][:, covered]
    real = rgb[some, some][covered].T.astype(np.float32) / 255
    fit = (
        (made > MIN_COMPARED_VALUE)
        & (made < MAX_COMPARED_VALUE)
        & (real > MIN_COMPARED_VALUE)
        & (real < MAX_COMPARED_VALUE)
    )
    out = np.full(3, np.nan)
    for q in range(3):
        if np.count_nonzero(fit[q]) >= MIN_COMPARED_PIXELS:
            out[q] = np.median(real[q, fit[q]] / made[q, fit[q]])
    return np.clip(out, 1 / MAX_GAIN, MAX_GAIN)


def update_gain(gains: ExposureGains, k: int, found: Float[np.ndarray, "3"]) -> ExposureGains:
    """Return gains of which that of view k went some way to what was found."""
    logs = np.log(gains)
    logs[k] += GAIN_UPDATE_FRACTION * np.nan_to_num(np.log(found) - logs[k])
    return np.exp(logs - logs.mean(axis=0)).astype(np.float32)


def exposures_differ(gains: ExposureGains) -> bool:
    """Return whether photographs differ in exposure or white balance."""
    return bool(np.log(gains).std(axis=0).max() > EXPOSURE_SPREAD_LOG)

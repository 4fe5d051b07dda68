"""Brightness that differs from photograph to photograph: cameras choose exposure and white balance.

One gain for each photograph and channel, on sRGB values: an exposure multiplies light, and sRGB is
nearly a power of light. Gains are relative: their geometric mean over all photographs is 1.
"""

import numpy as np
from jaxtyping import Float, Float32, UInt8

from corporeal.reconstruction.gaussians.raster import Drawing

COVERED = 0.05
"""Pixels where less than this shines through from behind are compared."""
DARK, BRIGHT = 0.04, 0.98
"""Darker and brighter values say little of gains: noise, and what is cut off."""
PIXELS = 64
"""That many rows and columns are compared, about; gains are one number for all."""
FEWEST = 50
"""Pixels that it takes to know a gain."""
WIDEST = 4.0
"""Gains are at most that, or one over it."""
PACE = 0.3
"""Share of what a step finds that enters the gain."""
DIFFERS = 0.04
"""Standard deviation of logarithms from which on exposures differ."""

Gains = Float32[np.ndarray, "V 3"]


def gain(
    drawing: Drawing, rgb: UInt8[np.ndarray, "H W 3"], mask: UInt8[np.ndarray, "H W"] | None
) -> Float[np.ndarray, "3"]:
    """Return how much brighter a photograph is than a drawing: medians of ratios; nan: unknown."""
    pace = max(1, max(rgb.shape[:2]) // PIXELS)
    some = slice(pace // 2, None, pace)
    covered = drawing.planes[3, some, some] < COVERED
    if mask is not None:
        covered = covered & (mask[some, some] == 255)
    made = drawing.planes[:3, some, some][:, covered]
    real = rgb[some, some][covered].T.astype(np.float32) / 255
    fit = (made > DARK) & (made < BRIGHT) & (real > DARK) & (real < BRIGHT)
    out = np.full(3, np.nan)
    for q in range(3):
        if np.count_nonzero(fit[q]) >= FEWEST:
            out[q] = np.median(real[q, fit[q]] / made[q, fit[q]])
    return np.clip(out, 1 / WIDEST, WIDEST)


def followed(gains: Gains, k: int, found: Float[np.ndarray, "3"]) -> Gains:
    """Return gains of which that of view k went some way to what was found."""
    logs = np.log(gains)
    logs[k] += PACE * np.nan_to_num(np.log(found) - logs[k])
    return np.exp(logs - logs.mean(axis=0)).astype(np.float32)


def differ(gains: Gains) -> bool:
    """Tell whether photographs differ in exposure or white balance."""
    return bool(np.log(gains).std(axis=0).max() > DIFFERS)

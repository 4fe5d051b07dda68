"""Conversion between sRGB and linear light (IEC 61966-2-1)."""

import numpy as np


def srgb_to_linear(colour: np.ndarray) -> np.ndarray:
    """Return linear light in [0, 1] of sRGB in [0, 1], of any shape."""
    c = np.asarray(colour, dtype=np.float64)
    return np.where(c <= 0.04045, c / 12.92, ((np.maximum(c, 0) + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(light: np.ndarray) -> np.ndarray:
    """Return sRGB in [0, 1] of linear light in [0, 1], of any shape."""
    c = np.clip(light, 0, 1)
    return np.where(c <= 0.0031308, 12.92 * c, 1.055 * np.maximum(c, 1e-9) ** (1 / 2.4) - 0.055)

"""What training makes small: how far a picture is from a photograph.

0.8 mean|Δ| + 0.2 (1 - mean SSIM) + 0.1 mean|α - mask|
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, UInt8

from corporeal.reconstruction.gaussians.kernels_learn import compare
from corporeal.reconstruction.gaussians.raster import Drawing
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool

L1, SSIM, COVER = 0.8, 0.2, 0.1
EVEN = np.ones(3, np.float32)
"""The gain of a photograph that is as bright as it is to be."""


@dataclass(frozen=True)
class Goal:
    """One photograph as it is to be matched."""

    planes: Float32[np.ndarray, "3 H W"]
    """sRGB in [0, 1], before the background where there is a mask."""
    mask: Float32[np.ndarray, "h w"]
    """Share of each pixel that objects cover; (0, 0): unknown."""


@dataclass(frozen=True)
class Loss:
    """How far off, and where to go."""

    value: float
    error: float
    """Mean of Δ²."""
    slope: Float32[np.ndarray, "4 H W"]
    """dL/d(red, green, blue, transmittance)."""


def goal(
    rgb: UInt8[np.ndarray, "H W 3"],
    mask: UInt8[np.ndarray, "H W"] | None,
    background: Float32[np.ndarray, "3"],
    gain: Float32[np.ndarray, "3"] = EVEN,
) -> Goal:
    """Return a photograph laid on a background.

    mask: 255 on objects. gain: of red, green and blue, by which the photograph is too bright.
    """
    planes = np.moveaxis(rgb, -1, 0) / (255 * gain[:, None, None])
    if mask is None:
        return Goal(planes, np.zeros((0, 0), np.float32))
    cover = mask.astype(np.float32) / 255
    return Goal(cover * planes + (1 - cover) * background[:, None, None], cover)


def loss(drawing: Drawing, aim: Goal, pool: ThreadPool) -> Loss:
    """Compare a drawing with what it is to be."""
    _, height, width = aim.planes.shape
    pixels = height * width
    weights = np.array([L1 / 3, SSIM / 3, COVER], np.float32) / pixels
    slope = np.empty((4, height, width), np.float32)
    spans = pool.spans(height)
    sums = np.zeros((len(spans), 4))
    rest = drawing.planes, aim.planes, aim.mask, weights
    pool.each(compare, [(*rest, *span, slope, row) for span, row in zip(spans, sums, strict=True)])
    l1, alike, cover, l2 = sums.sum(axis=0)
    value = (L1 * l1 / 3 + SSIM * (pixels - alike / 3) + COVER * cover) / pixels
    return Loss(float(value), float(l2 / 3 / pixels), slope)

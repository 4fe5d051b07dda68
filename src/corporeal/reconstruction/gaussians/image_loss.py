"""Training loss of a rendered picture against a photograph.

0.8 mean|Δ| + 0.2 (1 - mean SSIM) + 0.1 mean|α - mask|
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, UInt8

from corporeal.reconstruction.gaussians.kernels_training import loss_slope
from corporeal.reconstruction.gaussians.rasteriser_numba import Drawing
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool

L1_WEIGHT, SSIM_WEIGHT, COVERAGE_WEIGHT = 0.8, 0.2, 0.1
UNIT_GAIN = np.ones(3, np.float32)
"""The gain of a photograph that is as bright as it is to be."""


@dataclass(frozen=True)
class TargetImage:
    """One photograph as it is to be matched."""

    planes: Float32[np.ndarray, "3 H W"]
    """sRGB in [0, 1], before the background where there is a mask."""
    mask: Float32[np.ndarray, "h w"]
    """Share of each pixel that objects cover; (0, 0): unknown."""


@dataclass(frozen=True)
class ImageLoss:
    """How far off, and where to go."""

    value: float
    error: float
    """Mean of Δ²."""
    slope: Float32[np.ndarray, "4 H W"]
    """dL/d(red, green, blue, transmittance)."""


def target_image(
    rgb: UInt8[np.ndarray, "H W 3"],
    mask: UInt8[np.ndarray, "H W"] | None,
    background: Float32[np.ndarray, "3"],
    gain: Float32[np.ndarray, "3"] = UNIT_GAIN,
) -> TargetImage:
    """Return a photograph laid on a background.

    mask: 255 on objects. gain: of red, green and blue, by which the photograph is too bright.
    """
    planes = np.moveaxis(rgb, -1, 0) / (255 * gain[:, None, None])
    if mask is None:
        return TargetImage(planes, np.zeros((0, 0), np.float32))
    cover = mask.astype(np.float32) / 255
    return TargetImage(cover * planes + (1 - cover) * background[:, None, None], cover)


def image_loss(drawing: Drawing, aim: TargetImage, pool: ThreadPool) -> ImageLoss:
    """Compare a drawing with what it is to be."""
    _, height, width = aim.planes.shape
    pixels = height * width
    weights = np.array([L1_WEIGHT / 3, SSIM_WEIGHT / 3, COVERAGE_WEIGHT], np.float32) / pixels
    slope = np.empty((4, height, width), np.float32)
    spans = pool.spans(height)
    sums = np.zeros((len(spans), 4))
    rest = drawing.planes, aim.planes, aim.mask, weights
    pool.each(loss_slope, [(*rest, *span, slope, row) for span, row in zip(spans, sums, strict=True)])
    l1, alike, cover, l2 = sums.sum(axis=0)
    value = (L1_WEIGHT * l1 / 3 + SSIM_WEIGHT * (pixels - alike / 3) + COVERAGE_WEIGHT * cover) / pixels
    return ImageLoss(float(value), float(l2 / 3 / pixels), slope)

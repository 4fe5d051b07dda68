"""Rendering quality on held-out photographs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from corporeal.core.types import Gaussians, Vector, Views
from corporeal.reconstruction.gaussians.exposure_gains import exposure_gain
from corporeal.reconstruction.gaussians.gaussian_initialisation import free_depths
from corporeal.reconstruction.gaussians.gaussian_parameters import parameters_of_gaussians
from corporeal.reconstruction.gaussians.kernels_training import sum_ssim
from corporeal.reconstruction.gaussians.rasteriser_numba import BLACK_RGB, draw, picture_of_drawing, pinhole_of_camera
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool

RgbImage = Float[np.ndarray, "H W 3"]


@dataclass(frozen=True)
class HeldOutQuality:
    """Means over the views looked at."""

    psnr: float
    """Whole pictures [dB]."""
    psnr_on_objects: float | None
    """Only pixels on objects [dB]; None without masks."""
    ssim: float
    """Of whole pictures."""
    views: tuple[int, ...]
    """Which."""


def heldout_quality(
    gaussians: Gaussians,
    views: Views,
    which: Sequence[int],
    masks: Bool[np.ndarray, "V H W"] | None = None,
    background: Vector | None = None,
    apart: bool = False,
) -> HeldOutQuality:
    """Compare pictures with views.

    masks: which pixels are on objects. background: where given, what is beside objects is that in both; else whole
    photographs are compared, and black is behind everything. What is nearer to a camera than its ``start.clearance`` is
    not drawn. apart: photographs differ in exposure; each drawing has the gain that suits it best.
    """
    theta, rows, clear = parameters_of_gaussians(gaussians), [], free_depths(views.cameras)
    behind = np.array(BLACK_RGB if background is None else background, np.float32)
    with ThreadPool() as pool:
        for k in which:
            eye = pinhole_of_camera(views.cameras[k], near=clear[k])
            made = draw(theta, eye, behind, pool)
            rgb, real = picture_of_drawing(made).rgb, views.rgb[k] / np.float32(255)
            if apart:
                on_thing = None if masks is None else masks[k] * np.uint8(255)
                under = made.planes[3, ..., None] * behind
                factor = np.nan_to_num(exposure_gain(made, views.rgb[k], on_thing), nan=1.0)
                rgb = factor * (rgb - under) + under
            rgb = np.clip(rgb, 0, 1)
            if masks is not None and background is not None:
                real = np.where(masks[k][..., None], real, behind)
            on = [psnr(rgb[masks[k]], real[masks[k]])] if masks is not None else []
            rows.append([psnr(rgb, real), ssim(rgb, real), *on])
    whole, alike, *on = (float(x) for x in np.nanmean(rows, axis=0))
    return HeldOutQuality(whole, on[0] if on else None, alike, tuple(which))


def psnr(a: np.ndarray, b: np.ndarray) -> float:
    """Return the peak signal-to-noise ratio [dB] of values in [0, 1]; nan of none."""
    if a.size == 0:
        return float("nan")
    error = np.mean((a.astype(np.float64) - b) ** 2)
    return float(-10 * np.log10(max(error, 1e-12)))


def ssim(a: RgbImage, b: RgbImage) -> float:
    """Return the structural similarity (Wang et al. 2004), mean over pixels and channels."""
    total, slope = 0.0, np.empty(a.shape[:2], np.float32)
    for q in range(3):
        x, y = (np.ascontiguousarray(p[..., q], dtype=np.float32) for p in (a, b))
        total += sum_ssim(x, y, 0, len(x), np.float32(0), slope)
    return total / a.size

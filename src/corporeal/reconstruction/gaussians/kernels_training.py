"""Kernels of training: loss with gradient, and Adam's step."""

import numba
import numpy as np

from corporeal.reconstruction.gaussians.gaussian_parameters import PARAM_OPACITY, PARAM_SCALE
from corporeal.reconstruction.gaussians.kernels_harmonics import JIT_OPTIONS
from corporeal.reconstruction.gaussians.kernels_project import from_camera, project_to_pixel

f4 = np.float32
SSIM_RADIUS_PX = 5
"""Of the window that SSIM looks through [px]; its standard deviation is 1.5 px."""
SSIM_WINDOW = np.exp(-(np.arange(-SSIM_RADIUS_PX, SSIM_RADIUS_PX + 1.0) ** 2) / (2 * 1.5**2))
SSIM_WINDOW = (SSIM_WINDOW / SSIM_WINDOW.sum()).astype(np.float32)
SSIM_C1, SSIM_C2 = f4(0.01**2), f4(0.03**2)
ADAM_BETA1, ADAM_BETA2, ADAM_EPSILON = f4(0.9), f4(0.999), f4(1e-15)
MAX_OPACITY_LOGIT = f4(12)
"""Logits of opacities stay within ± this."""


@numba.njit(**JIT_OPTIONS)
def _blur_row(row, out):
    """Blur a row of W + 10 numbers into W."""
    out[:] = 0
    for t in range(2 * SSIM_RADIUS_PX + 1):
        for x in range(len(out)):
            out[x] += SSIM_WINDOW[t] * row[x + t]


@numba.njit(**JIT_OPTIONS)
def _blur_rows(rows, r, out):
    """Blur rows r - 5 to r + 5 into one; there is nothing above the first and below the last."""
    out[:] = 0
    for t in range(-SSIM_RADIUS_PX, SSIM_RADIUS_PX + 1):
        if 0 <= r + t < len(rows):
            for x in range(len(out)):
                out[x] += SSIM_WINDOW[t + SSIM_RADIUS_PX] * rows[r + t, x]


@numba.njit(**JIT_OPTIONS)
def sum_ssim(x, y, top, bottom, weight, slope):
    """Sum SSIM (Wang et al. 2004) over rows top to bottom of two planes (H, W).

    Adds weight · dΣSSIM/dx to these rows of the slope, Σ over the whole plane.
    """
    height, width = x.shape
    high, low = max(0, top - 2 * SSIM_RADIUS_PX), min(height, bottom + 2 * SSIM_RADIUS_PX)
    flat = np.empty((5, low - high, width), np.float32)
    wide = np.zeros((5, width + 2 * SSIM_RADIUS_PX), np.float32)
    for r in range(high, low):
        for c in range(width):
            a, b = x[r, c], y[r, c]
            wide[0, c + SSIM_RADIUS_PX], wide[1, c + SSIM_RADIUS_PX] = a, b
            (wide[2, c + SSIM_RADIUS_PX], wide[3, c + SSIM_RADIUS_PX], wide[4, c + SSIM_RADIUS_PX]) = (
                a * a,
                b * b,
                a * b,
            )
        for q in range(5):
            _blur_row(wide[q], flat[q, r - high])
    first, last = max(0, top - SSIM_RADIUS_PX), min(height, bottom + SSIM_RADIUS_PX)
    partial = np.empty((3, last - first, width), np.float32)
    mean = np.empty((5, width), np.float32)
    total = 0.0
    for r in range(first, last):
        for q in range(5):
            _blur_rows(flat[q], r - high, mean[q])
        own = 0.0
        for c in range(width):
            mx, my = mean[0, c], mean[1, c]
            a1, a2 = f4(2) * mx * my + SSIM_C1, f4(2) * (mean[4, c] - mx * my) + SSIM_C2
            b1, b2 = (mx * mx + my * my + SSIM_C1, mean[2, c] - mx * mx + mean[3, c] - my * my + SSIM_C2)
            below = f4(1) / (b1 * b2)
            s = a1 * a2 * below
            own += s
            wide[0, c + SSIM_RADIUS_PX] = f4(2) * (my * (a2 - a1) * below + s * mx * (f4(1) / b2 - f4(1) / b1))
            wide[1, c + SSIM_RADIUS_PX] = -s / b2
            wide[2, c + SSIM_RADIUS_PX] = f4(2) * a1 * below
        total += own if top <= r < bottom else 0.0
        for q in range(3):
            _blur_row(wide[q], partial[q, r - first])
    for r in range(top, bottom):
        for q in range(3):
            _blur_rows(partial[q], r - first, mean[q])
        for c in range(width):
            along = mean[0, c] + f4(2) * x[r, c] * mean[1, c] + y[r, c] * mean[2, c]
            slope[r, c] += weight * along
    return total


@numba.njit(**JIT_OPTIONS)
def loss_slope(planes, target, mask, weights, top, bottom, slope, sums):
    """Fill in rows top to bottom of the loss's slope; sums: Σ|Δ|, Σ SSIM, Σ|α - mask|, Σ Δ².

    planes, slope: red, green, blue, transmittance; target (3, H, W); mask (H, W), or (0, 0) where there is none;
    weights: of the three terms, each per pixel and channel.
    """
    _, _, width = target.shape
    l1, l2, cover = 0.0, 0.0, 0.0
    for q in range(3):
        for r in range(top, bottom):
            for c in range(width):
                d = planes[q, r, c] - target[q, r, c]
                l1 += abs(d)
                l2 += d * d
                slope[q, r, c] = weights[0] if d > 0 else (-weights[0] if d < 0 else f4(0))
        sums[1] += sum_ssim(planes[q], target[q], top, bottom, -weights[1], slope[q])
    slope[3, top:bottom] = 0
    if mask.shape[0] > 0:
        for r in range(top, bottom):
            for c in range(width):
                d = f4(1) - planes[3, r, c] - mask[r, c]
                cover += abs(d)
                slope[3, r, c] = -weights[2] if d > 0 else (weights[2] if d < 0 else f4(0))
    sums[0], sums[2], sums[3] = l1, cover, l2


@numba.njit(**JIT_OPTIONS)
def adam_rows(theta, gradient, first, second, rates, step, decay, limits, spans, start, stop):
    """One step of Adam (Kingma and Ba 2015) for rows start to stop.

    decay: pull on opacities and on scales, as a slope of the loss; limits: as ``limits.Limits``;
    spans: as ``raster.Drawing``. A gradient that is no finite number moves nothing.
    """
    opacity_pull, scale_pull = decay
    unbias = np.sqrt(1 - ADAM_BETA2**step) / (1 - ADAM_BETA1**step)
    for i in range(start, stop):
        if limits[i, 3] > 0 and spans[i, 0] == spans[i, 1]:
            continue
        o = f4(1) / (f4(1) + np.exp(-theta[i, PARAM_OPACITY]))
        gradient[i, PARAM_OPACITY] += opacity_pull * o * (f4(1) - o)
        for j in range(PARAM_SCALE, PARAM_SCALE + 3):
            gradient[i, j] += scale_pull * np.exp(theta[i, j])
        for j in range(int(limits[i, 2])):
            g = gradient[i, j]
            g = g if abs(g) < f4(1e15) else f4(0)
            m = ADAM_BETA1 * first[i, j] + (f4(1) - ADAM_BETA1) * g
            v = ADAM_BETA2 * second[i, j] + (f4(1) - ADAM_BETA2) * g * g
            first[i, j], second[i, j] = m, v
            theta[i, j] -= rates[j] * f4(unbias) * m / (np.sqrt(v) + ADAM_EPSILON)
        theta[i, PARAM_OPACITY] = min(max(theta[i, PARAM_OPACITY], -MAX_OPACITY_LOGIT), MAX_OPACITY_LOGIT)
        flat = PARAM_SCALE
        for j in range(PARAM_SCALE, PARAM_SCALE + 3):
            flat = j if theta[i, j] < theta[i, flat] else flat
        for j in range(PARAM_SCALE, PARAM_SCALE + 3):
            theta[i, j] = min(theta[i, j], limits[i, 1] if j == flat else limits[i, 0])


@numba.njit(**JIT_OPTIONS)
def count_mask_votes(points, first, last, cameras, pictures, masks, patience, out):
    """Ask every view about points first to last.

    cameras (V, 16): camera from world (3 × 4), fx, fy, cx, cy; pictures (V, H, W, 3); masks
    (V, H, W), true on objects; patience: after more views that see it beside objects
    no other view is read. out (N, 5): views that see it, views that see it beside objects, sums of
    red, green and blue [0–1].
    """
    views, height, width, _ = pictures.shape
    for i in range(first, last):
        out[i] = 0
        for k in range(views):
            c = cameras[k]
            right, down, ahead = from_camera(c, points[i, 0], points[i, 1], points[i, 2])
            if not ahead > 0:
                continue
            u, v = project_to_pixel(c, right, down, ahead)
            if not (0 <= u < width and 0 <= v < height):
                continue
            if not masks[k, int(v), int(u)]:
                out[i, 1] += 1
                if out[i, 1] > patience:
                    break
                continue
            out[i, 0] += 1
            for q in range(3):
                out[i, 2 + q] += pictures[k, int(v), int(u), q] / 255

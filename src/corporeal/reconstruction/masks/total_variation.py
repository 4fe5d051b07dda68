"""Two-region segmentation by total variation, the convex form of a graph cut.

    min over 0 ≤ u ≤ 1 of  Σ f u + λ Σ w |∇u|,   w = floor + (1 - floor) exp(-|Δ|² / 2 σ²)

f is the evidence against each pixel, Δ the difference of colour to the next pixel, σ its root mean square in the
picture. Every threshold of a minimiser is one of the binary problem (Nikolova, Esedoğlu and Chan 2006); found by
Chambolle and Pock's primal-dual iteration (2011).
"""

from concurrent.futures import ThreadPoolExecutor

import numba
import numpy as np
from jaxtyping import Float32, UInt8
from skimage.color import rgb2lab

from corporeal.core.process_resources import usable_cores

OUTLINE_COST = 2.0
"""λ, in log-likelihood of one pixel per pixel of outline."""
MIN_EDGE_WEIGHT = 0.05
"""Weight of the strongest edges."""
PRIMAL_DUAL_ITERATIONS = 80
"""Of the iteration; after them hardly a pixel crosses ½."""
PRIMAL_DUAL_STEP = 0.35
"""τ and σ of the iteration: τ σ |∇|² < 1, |∇|² ≤ 8."""


class TotalVariationCutter:
    """Cuts pictures of one size in two, several times with other evidence."""

    def __init__(self, rgb: UInt8[np.ndarray, "V H W 3"]) -> None:
        self.weights = [_edge_weights(picture) for picture in rgb]

    def cut(self, against: Float32[np.ndarray, "V H W"]) -> Float32[np.ndarray, "V H W"]:
        """Return how far each pixel is inside, 0 to 1; ½ is the outline."""
        inside = np.empty(against.shape, np.float32)
        pairs = zip(against, self.weights, inside, strict=True)
        with ThreadPoolExecutor(usable_cores()) as pool:
            for done in [pool.submit(_cut_picture, f, *w, u) for f, w, u in pairs]:
                done.result()
        return inside


def _edge_weights(picture: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return λ w between each pixel and the one below it, and the one right of it (H, W)."""
    lab = rgb2lab(picture).astype(np.float32)
    down = np.square(np.diff(lab, axis=0, append=lab[-1:])).sum(axis=2)
    right = np.square(np.diff(lab, axis=1, append=lab[:, -1:])).sum(axis=2)
    usual = max(float(down.mean() + right.mean()) / 2, np.finfo(np.float32).tiny)
    below, beside = (MIN_EDGE_WEIGHT + (1 - MIN_EDGE_WEIGHT) * np.exp(-d / (2 * usual)) for d in (down, right))
    below[-1], beside[:, -1] = 0, 0
    return np.float32(OUTLINE_COST) * below, np.float32(OUTLINE_COST) * beside


@numba.njit(nogil=True, cache=True, fastmath=True)
def _cut_picture(against, below, beside, u):
    """Minimise for one picture (H, W)."""
    shape = against.shape
    down, right = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    for r in range(shape[0]):
        for c in range(shape[1]):
            u[r, c] = np.float32(against[r, c] < 0)
    ahead = u.copy()
    for _ in range(PRIMAL_DUAL_ITERATIONS):
        _ascend(ahead, below, beside, down, right)
        _descend(against, down, right, u, ahead)


@numba.njit(nogil=True, cache=True, fastmath=True)
def _ascend(ahead, below, beside, down, right):
    """Step of the dual variables: flow to the pixel below and to the one right, within λ w."""
    height, width = ahead.shape
    step = np.float32(PRIMAL_DUAL_STEP)
    for r in range(height - 1):
        for c in range(width):
            p = down[r, c] + step * (ahead[r + 1, c] - ahead[r, c])
            down[r, c] = min(max(p, -below[r, c]), below[r, c])
    for r in range(height):
        for c in range(width - 1):
            p = right[r, c] + step * (ahead[r, c + 1] - ahead[r, c])
            right[r, c] = min(max(p, -beside[r, c]), beside[r, c])


@numba.njit(nogil=True, cache=True, fastmath=True)
def _descend(against, down, right, u, ahead):
    """Step of u, and its extrapolation."""
    height, width = u.shape
    step = np.float32(PRIMAL_DUAL_STEP)
    for r in range(height):
        for c in range(width):
            flow = down[r, c] + right[r, c]
            flow -= down[r - 1, c] if r > 0 else np.float32(0)
            flow -= right[r, c - 1] if c > 0 else np.float32(0)
            new = u[r, c] + step * (flow - against[r, c])
            new = min(max(new, np.float32(0)), np.float32(1))
            ahead[r, c] = 2 * new - u[r, c]
            u[r, c] = new

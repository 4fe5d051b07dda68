"""Gaussians as one matrix of unbounded numbers, a row each: what training moves.

A row holds mean (3), quaternion (4), logarithms of the scales (3), logit of the opacity (1) and the
spherical harmonics coefficient by coefficient (3 K).
"""

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Gaussians

MEAN, ROTATION, SCALE, OPACITY, COLOUR = 0, 3, 7, 10, 11
"""Where in a row each begins."""
LEAST = 1e-6
"""Opacities are kept that far from 0 and 1, where their logits exist."""
THINNEST = 1e-9
"""Scales are at least that [m]: their logarithms exist."""

Parameters = Float[np.ndarray, "N D"]


def parameters(gaussians: Gaussians) -> Parameters:
    """Return the matrix of some Gaussians, in single precision."""
    opacity = np.clip(gaussians.opacity.astype(np.float64), LEAST, 1 - LEAST)
    return np.concatenate(
        [
            gaussians.mean,
            gaussians.rotation,
            np.log(np.maximum(gaussians.scale, THINNEST)),
            np.log(opacity / (1 - opacity))[:, None],
            gaussians.sh.reshape(gaussians.count, 3 * gaussians.sh.shape[1]),
        ],
        axis=1,
        dtype=np.float32,
    )


def gaussians_of(theta: Parameters) -> Gaussians:
    """Return the Gaussians of a matrix."""
    q = theta[:, ROTATION:SCALE]
    return Gaussians(
        mean=theta[:, MEAN:ROTATION].copy(),
        rotation=q / np.linalg.norm(q, axis=1, keepdims=True),
        scale=np.exp(theta[:, SCALE:OPACITY]),
        opacity=opacity(theta),
        sh=theta[:, COLOUR:].reshape(len(theta), (theta.shape[1] - COLOUR) // 3, 3).copy(),
    )


def opacity(theta: Parameters) -> Float[np.ndarray, " N"]:
    """Return the opacities in (0, 1)."""
    return 1 / (1 + np.exp(-theta[:, OPACITY]))

"""Gaussians as a matrix of unconstrained training parameters.

A row holds mean (3), quaternion (4), logarithms of the scales (3), logit of the opacity (1) and the spherical harmonics
coefficient by coefficient (3 K).
"""

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Gaussians

PARAM_MEAN, PARAM_ROTATION, PARAM_SCALE, PARAM_OPACITY, PARAM_COLOUR = 0, 3, 7, 10, 11
"""Where in a row each begins."""
MIN_OPACITY_MARGIN = 1e-6
"""Opacities are kept that far from 0 and 1, where their logits exist."""
MIN_SCALE_M = 1e-9
"""Scales are at least that [m]: their logarithms exist."""

ParameterMatrix = Float[np.ndarray, "N D"]


def parameters_of_gaussians(gaussians: Gaussians) -> ParameterMatrix:
    """Return the matrix of some Gaussians, in single precision."""
    opacity = np.clip(gaussians.opacity.astype(np.float64), MIN_OPACITY_MARGIN, 1 - MIN_OPACITY_MARGIN)
    return np.concatenate(
        [
            gaussians.mean,
            gaussians.rotation,
            np.log(np.maximum(gaussians.scale, MIN_SCALE_M)),
            np.log(opacity / (1 - opacity))[:, None],
            gaussians.sh.reshape(gaussians.count, 3 * gaussians.sh.shape[1]),
        ],
        axis=1,
        dtype=np.float32,
    )


def gaussians_of_parameters(theta: ParameterMatrix) -> Gaussians:
    """Return the Gaussians of a matrix."""
    q = theta[:, PARAM_ROTATION:PARAM_SCALE]
    return Gaussians(
        mean=theta[:, PARAM_MEAN:PARAM_ROTATION].copy(),
        rotation=q / np.linalg.norm(q, axis=1, keepdims=True),
        scale=np.exp(theta[:, PARAM_SCALE:PARAM_OPACITY]),
        opacity=opacities(theta),
        sh=theta[:, PARAM_COLOUR:].reshape(len(theta), (theta.shape[1] - PARAM_COLOUR) // 3, 3).copy(),
    )


def opacities(theta: ParameterMatrix) -> Float[np.ndarray, " N"]:
    """Return the opacities in (0, 1)."""
    return 1 / (1 + np.exp(-theta[:, PARAM_OPACITY]))

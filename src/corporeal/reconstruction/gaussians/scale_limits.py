"""Scale limits of Gaussians, and trainable parameters.

Where masks forbid haze, there is one limit for all, if any. Where there are none, what is wide is
flat, and small in every picture; what few views see has one colour for all sides.
"""

import numpy as np
from jaxtyping import Bool, Float32

from corporeal.reconstruction.gaussians.gaussian_parameters import (
    PARAM_COLOUR,
    PARAM_MEAN,
    PARAM_OPACITY,
    PARAM_ROTATION,
    PARAM_SCALE,
    ParameterMatrix,
)
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.gaussians.view_depths import ViewDepths

MAX_SCALE_TO_DEPTH = 0.1
"""Scale over the least depth at which it is seen [-]."""
MAX_THICKNESS_TO_DEPTH = 0.01
"""The same, of the least of three scales."""
MAX_SCALE_RADII = 10.0
"""No scale is more, in radii of what the cameras look at."""

ScaleLimits = Float32[np.ndarray, "N 4"]
"""Of each Gaussian: logarithms of the greatest scale and of the greatest least scale that it may
have; how many of its numbers move; whether it stays as it is, moments too, while out of the picture
(1), or fades (0)."""


def equal_scale_limits(theta: ParameterMatrix, widest: float) -> ScaleLimits:
    """Return limits that are the same for all: no scale is more than this [m]."""
    limits = np.full((len(theta), 4), np.log(widest), np.float32)
    limits[:, 2], limits[:, 3] = theta.shape[1], 0
    return limits


def scale_limits_from_views(
    theta: ParameterMatrix, radius: float, surfaces: ViewDepths, pool: ThreadPool
) -> tuple[ScaleLimits, Bool[np.ndarray, " N"]]:
    """Return the limits of Gaussians that views judge, and which of them are haze."""
    widths = np.exp(theta[:, PARAM_SCALE:PARAM_OPACITY]).max(axis=1)
    judged = surfaces.judge(theta[:, PARAM_MEAN:PARAM_ROTATION], widths, pool)
    limits = equal_scale_limits(theta, MAX_SCALE_RADII * radius)
    near = np.minimum(judged.nearest, MAX_SCALE_RADII * radius / MAX_SCALE_TO_DEPTH)
    limits[:, 0] = np.log(MAX_SCALE_TO_DEPTH * near)
    limits[:, 1] = np.log(MAX_THICKNESS_TO_DEPTH * near)
    limits[judged.few, 2], limits[:, 3] = PARAM_COLOUR + 3, 1
    return limits, judged.haze

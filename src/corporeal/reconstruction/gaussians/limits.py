"""How large Gaussians may grow, and which of their numbers move.

Where masks forbid haze, there is one limit for all, if any. Where there are none, what is wide is
flat, and small in every picture; what few views see has one colour for all sides.
"""

import numpy as np
from jaxtyping import Bool, Float32

from corporeal.reconstruction.gaussians.parameters import (
    COLOUR,
    MEAN,
    OPACITY,
    ROTATION,
    SCALE,
    Parameters,
)
from corporeal.reconstruction.gaussians.surfaces import Surfaces
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool

WIDEST = 0.1
"""Scale over the least depth at which it is seen [-]."""
THICKEST = 0.01
"""The same, of the least of three scales."""
REACH = 10.0
"""No scale is more, in radii of what the cameras look at."""

Limits = Float32[np.ndarray, "N 4"]
"""Of each Gaussian: logarithms of the greatest scale and of the greatest least scale that it may
have; how many of its numbers move; whether it stays as it is, moments too, while out of the picture
(1), or fades (0)."""


def even(theta: Parameters, widest: float) -> Limits:
    """Return limits that are the same for all: no scale is more than this [m]."""
    limits = np.full((len(theta), 4), np.log(widest), np.float32)
    limits[:, 2], limits[:, 3] = theta.shape[1], 0
    return limits


def strict(
    theta: Parameters, radius: float, surfaces: Surfaces, pool: ThreadPool
) -> tuple[Limits, Bool[np.ndarray, " N"]]:
    """Return the limits of Gaussians that views judge, and which of them are haze."""
    widths = np.exp(theta[:, SCALE:OPACITY]).max(axis=1)
    judged = surfaces.judge(theta[:, MEAN:ROTATION], widths, pool)
    limits = even(theta, REACH * radius)
    near = np.minimum(judged.nearest, REACH * radius / WIDEST)
    limits[:, 0] = np.log(WIDEST * near)
    limits[:, 1] = np.log(THICKEST * near)
    limits[judged.few, 2], limits[:, 3] = COLOUR + 3, 1
    return limits, judged.haze

"""Densification: dead Gaussians move to where live ones are, and more join them.

3DGS-MCMC (Kheradmand et al. 2024): a new one takes the place of a share of an old one such that their sum looks as
before.

Scale limits of Gaussians, and trainable parameters.

Where masks forbid haze, there is one limit for all, if any. Where there are none, what is wide is flat, and small in
every picture; what few views see has one colour for all sides.
"""

from math import comb

import numpy as np
from jaxtyping import Bool, Float, Float32

from corporeal.reconstruction.gaussians.gaussian_parameters import (
    PARAM_COLOUR,
    PARAM_MEAN,
    PARAM_OPACITY,
    PARAM_ROTATION,
    PARAM_SCALE,
    ParameterMatrix,
    opacities,
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
"""Of each Gaussian: logarithms of the greatest scale and of the greatest least scale that it may have; how many of its
numbers move; whether it stays as it is, moments too, while out of the picture (1), or fades (0)."""


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


DEAD_OPACITY = 0.005
"""A Gaussian less opaque than this is dead."""
GROWTH_FACTOR = 1.05
"""Factor by which their number grows a round."""
MAX_COPIES = 51
"""As many stand in for one at most."""
BINOMIAL_COEFFICIENTS = np.array([[comb(i, k) * (-1.0) ** k for k in range(MAX_COPIES)] for i in range(MAX_COPIES)])


def densify(
    theta: ParameterMatrix, moments: list[ParameterMatrix], most: int, rng: np.random.Generator
) -> tuple[ParameterMatrix, list[ParameterMatrix]]:
    """Return the Gaussians after one round, and the optimiser's moments with them.

    Those that come and those that make room begin with moments of 0.
    """
    o = opacities(theta).astype(np.float64)
    dead = np.flatnonzero(~(o > DEAD_OPACITY))
    joining = max(0, min(int(GROWTH_FACTOR * len(theta)), most) - len(theta))
    chance = np.where(o > DEAD_OPACITY, o, 0)
    if len(dead) + joining == 0 or not chance.sum() > 0:
        return theta, moments
    source = rng.choice(len(theta), len(dead) + joining, p=chance / chance.sum())
    crowd = np.minimum(np.bincount(source, minlength=len(theta))[source] + 1, MAX_COPIES)
    share, shrink = split_opacity_and_scale(o[source], crowd)
    theta = theta.copy()
    theta[source, PARAM_OPACITY] = np.log(share / (1 - share))
    theta[source, PARAM_SCALE:PARAM_OPACITY] += np.log(shrink)[:, None]
    theta[dead] = theta[source[: len(dead)]]
    grown = np.concatenate([theta, theta[source[len(dead) :]]])
    fresh = []
    for moment in moments:
        moment = np.concatenate([moment, np.zeros_like(theta, shape=(joining, theta.shape[1]))])
        moment[source] = moment[dead] = 0
        fresh.append(moment)
    return grown, fresh


def split_opacity_and_scale(
    o: Float[np.ndarray, " N"], crowd: np.ndarray
) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, " N"]]:
    """Return opacity and factor of the scale of each of a crowd that replaces one Gaussian.

    o' = 1 - (1 - o)^(1/C);  s'/s = o / Σ_{i=1..C} Σ_{k<i} binom(i-1, k) (-1)^k o'^(k+1) / √(k+1)
    (equation 9 of the paper).
    """
    new = np.clip(1 - (1 - o) ** (1 / crowd), DEAD_OPACITY, 0.995)
    k = np.arange(MAX_COPIES)
    powers = new[:, None] ** (k + 1) / np.sqrt(k + 1)
    terms = powers @ BINOMIAL_COEFFICIENTS.T  # term i - 1 of the outer sum
    total = np.where(k < crowd[:, None], terms, 0).sum(axis=1)
    return new, np.clip(o / total, 1e-3, 1)


def random_steps(theta: ParameterMatrix, reach: float, rng: np.random.Generator) -> ParameterMatrix:
    """Return steps at random for the means, in the shape of each Gaussian; opaque ones stay.

    reach: in standard deviations. Σ^½ η reach / (1 + exp(100 (o - 0.005))), η normal. The paper has Σ for Σ^½, which
    makes the reach depend on the unit of length.
    """
    q = theta[:, PARAM_ROTATION:PARAM_SCALE] / np.linalg.norm(theta[:, PARAM_ROTATION:PARAM_SCALE], axis=1)[:, None]
    loose = reach / (1 + np.exp(np.minimum(100 * (opacities(theta) - DEAD_OPACITY), 80)))
    step = loose[:, None] * np.exp(theta[:, PARAM_SCALE:PARAM_OPACITY]) * rng.normal(size=(len(theta), 3))
    return rotate_by_quaternions(q, step).astype(np.float32)


def rotate_by_quaternions(q: Float[np.ndarray, "N 4"], x: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
    """Return vectors turned by unit quaternions."""
    t = 2 * np.cross(q[:, 1:], x)
    return x + q[:, :1] * t + np.cross(q[:, 1:], t)

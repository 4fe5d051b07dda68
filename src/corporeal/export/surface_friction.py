"""Fit of friction per surface to friction per pair."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float, Int

FrictionRule = Literal["multiply", "average", "geometric", "larger"]
"""How an engine makes one coefficient of two: their product, mean, geometric mean, or maximum."""
TORSIONAL_FRICTION_M, ROLLING_FRICTION_M = 1e-4, 2e-5
"""Coefficients against turning about the normal and rolling [m]: only to steady solvers."""
MIN_FRICTION = 1e-3
"""Smallest coefficient that is distinguished from none [-]."""


@dataclass(frozen=True)
class SurfaceFriction:
    """Coefficients of K parts, then of the floor, and how far they are from the pairs'."""

    coefficient: Float[np.ndarray, " K1"]
    """[-]"""
    misfit: float
    """Largest difference from the friction of a pair that can meet [-]."""


def surface_friction(
    pairs: Float[np.ndarray, "K1 K1"], solid: Int[np.ndarray, " K"], rule: FrictionRule
) -> SurfaceFriction:
    """Fit one coefficient per part, by least squares over the pairs that can meet.

    Products and geometric means are fitted in logarithms. A maximum is no linear function: each part gets the least
    friction that it has with anything, so that no pair is rougher than ours.

    Args:
        pairs: Friction of every two parts; the last row and column are the floor.
        solid: Which solid each part belongs to: parts of one solid never meet.
        rule: How the engine combines two coefficients.
    """
    owner = np.append(solid, -1)
    i, j = np.nonzero(np.triu(owner[:, None] != owner[None, :]))
    wanted = pairs[i, j]
    if rule == "larger":
        met = np.where(owner[:, None] != owner[None, :], pairs, np.inf)
        single = met.min(axis=1)
        return SurfaceFriction(single, _pair_misfit(np.maximum(single[i], single[j]), wanted))
    A = np.zeros((len(i), len(owner)))
    A[np.arange(len(i)), i] = A[np.arange(len(i)), j] = 1.0 if rule == "multiply" else 0.5
    if rule == "average":
        single = np.linalg.lstsq(A, wanted, rcond=None)[0].clip(0.0)
        return SurfaceFriction(single, _pair_misfit(A @ single, wanted))
    logs = np.linalg.lstsq(A, np.log(wanted.clip(MIN_FRICTION)), rcond=None)[0]
    return SurfaceFriction(np.exp(logs), _pair_misfit(np.exp(A @ logs), wanted))


def _pair_misfit(found: np.ndarray, wanted: np.ndarray) -> float:
    return float(np.abs(found - wanted).max(initial=0.0))

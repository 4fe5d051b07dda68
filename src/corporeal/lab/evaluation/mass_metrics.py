"""Errors of predicted masses, as the literature on mass from pictures reports them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class MassErrors:
    """Means over objects."""

    count: int
    ade: float
    """Absolute difference |m̂ - m| [kg]."""
    alde: float
    """Absolute difference of natural logarithms |ln m̂ - ln m| [-]."""
    ape: float
    """Absolute relative error |m̂ - m|/m [-]."""
    mnre: float
    """Ratio min(m̂/m, m/m̂) [-]: 1 is perfect."""
    within_2: float
    """Share of the objects whose mass is right within a factor of two [-]."""


def mass_errors(predicted: Sequence[float], measured: Sequence[float]) -> MassErrors:
    """Compare masses [kg], all above zero.

    Definitions as in Zhai et al. 2024, *Physical property understanding from language-embedded
    feature fields*, after Standley et al. 2017, *image2mass*.
    """
    m, true = np.asarray(predicted, dtype=float), np.asarray(measured, dtype=float)
    apart = np.abs(np.log(m) - np.log(true))
    return MassErrors(
        count=len(true),
        ade=float(np.mean(np.abs(m - true))),
        alde=float(np.mean(apart)),
        ape=float(np.mean(np.abs(m - true) / true)),
        mnre=float(np.mean(np.exp(-apart))),
        within_2=float(np.mean(apart <= np.log(2.0))),
    )


def interval_coverage(
    low: Sequence[float], high: Sequence[float], measured: Sequence[float]
) -> float:
    """Share of the measured masses that lie in their predicted intervals [-]."""
    true = np.asarray(measured, dtype=float)
    return float(np.mean((np.asarray(low) <= true) & (true <= np.asarray(high))))

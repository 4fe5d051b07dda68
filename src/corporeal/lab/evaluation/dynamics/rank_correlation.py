"""Kendall's rank correlation, pooled over groups: only pairs within one group are compared."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import sqrt

RankedPair = tuple[float, float]


@dataclass(frozen=True)
class RankCorrelation:
    """Whether two orders agree."""

    tau: float | None
    """τ_b = (concordant - discordant) / √(untied in x · untied in y), in [-1, 1] (Kendall 1945);
    None: no pair is untied in both."""
    pairs: int
    """Pairs that are untied in x."""


def rank_correlation(groups: Iterable[Sequence[RankedPair]]) -> RankCorrelation:
    """Correlate the ranks of x and y within each group, all groups counted together.

    Args:
        groups: Of (x, y).

    """
    balance = untied_x = untied_y = 0
    for group in groups:
        for (a, b), (c, d) in combinations(group, 2):
            balance += _sign(a - c) * _sign(b - d)
            untied_x += a != c
            untied_y += b != d
    both = sqrt(untied_x * untied_y)
    return RankCorrelation(balance / both if both else None, untied_x)


def _sign(value: float) -> int:
    return (value > 0) - (value < 0)

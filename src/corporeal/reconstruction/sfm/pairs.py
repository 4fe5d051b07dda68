"""Which pictures are matched with one another: a search for poses costs what its pairs cost.

All pairs grow with the square of the pictures. Small copies have told which two share points
(``groups.py``): of many partners a picture needs the best, whose points join it with the others.
"""

import numpy as np
from jaxtyping import Int

EXHAUSTIVE = 80
"""Pictures up to which all pairs are matched, but for those that small copies speak against."""
OVERLAP = (*range(1, 11), 16, 32, 64)
"""Distances by name at which more pictures are then matched."""
PARTNERS = 16
"""Of pictures that share points with it when small, so many are matched, which share most."""
FEW = 4
"""Partners when small below which a picture is matched as if small copies said nothing: pairs of a
banana that share nothing when small carry its model."""
BESIDE = 3
"""Distance by name up to which pictures are matched whatever small copies say."""
Pairs = list[tuple[int, int]]


def pairs_of(total: int) -> Pairs:
    """Return which of so many pictures, in order of their names, are matched with one another."""
    return _at(range(1, total) if total <= EXHAUSTIVE else OVERLAP, total)


def partners_of(shared: Int[np.ndarray, "N N"]) -> Pairs:
    """Return the same of pictures of which small copies were matched.

    Args:
        shared: Points that each two share when small; 0: they are not joined.

    """
    total = len(shared)
    few = ((shared > 0).sum(axis=1) < FEW).tolist()
    best = np.argsort(-shared, axis=1, kind="stable")[:, :PARTNERS].tolist()
    kept = [(a, b) for a, row in enumerate(best) for b in row if shared[a, b] > 0]
    alike = {(min(a, b), max(a, b)) for a, b in kept}
    unsure = {(a, b) for a, b in pairs_of(total) if few[a] or few[b]}
    return sorted(alike | unsure | set(_at(range(1, BESIDE + 1), total)))


def _at(apart: range | tuple[int, ...], total: int) -> Pairs:
    return [(k, k + d) for k in range(total) for d in apart if k + d < total]

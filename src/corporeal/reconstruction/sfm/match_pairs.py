"""Choice of picture pairs for matching.

All pairs grow with the square of the pictures. Small copies have told which two share points
(``groups.py``): of many partners a picture needs the best, whose points join it with the others.
"""

import numpy as np
from jaxtyping import Int

MAX_EXHAUSTIVE_PICTURES = 80
"""Pictures up to which all pairs are matched, but for those that small copies speak against."""
NAME_DISTANCES = (*range(1, 11), 16, 32, 64)
"""Distances by name at which more pictures are then matched."""
MAX_PARTNERS = 16
"""Of pictures that share points with it when small, so many are matched, which share most."""
FEW_PARTNERS = 4
"""Partners when small below which a picture is matched as if small copies said nothing: pairs of a
banana that share nothing when small carry its model."""
ALWAYS_MATCHED_DISTANCE = 3
"""Distance by name up to which pictures are matched whatever small copies say."""
PicturePairs = list[tuple[int, int]]


def match_pairs(total: int) -> PicturePairs:
    """Return which of so many pictures, in order of their names, are matched with one another."""
    return _pairs_at_distance(
        range(1, total) if total <= MAX_EXHAUSTIVE_PICTURES else NAME_DISTANCES, total
    )


def match_partners(shared: Int[np.ndarray, "N N"]) -> PicturePairs:
    """Return the same of pictures of which small copies were matched.

    Args:
        shared: Points that each two share when small; 0: they are not joined.

    """
    total = len(shared)
    few = ((shared > 0).sum(axis=1) < FEW_PARTNERS).tolist()
    best = np.argsort(-shared, axis=1, kind="stable")[:, :MAX_PARTNERS].tolist()
    kept = [(a, b) for a, row in enumerate(best) for b in row if shared[a, b] > 0]
    alike = {(min(a, b), max(a, b)) for a, b in kept}
    unsure = {(a, b) for a, b in match_pairs(total) if few[a] or few[b]}
    return sorted(
        alike | unsure | set(_pairs_at_distance(range(1, ALWAYS_MATCHED_DISTANCE + 1), total))
    )


def _pairs_at_distance(apart: range | tuple[int, ...], total: int) -> PicturePairs:
    return [(k, k + d) for k in range(total) for d in apart if k + d < total]

"""Optimal assignment of found objects to names."""

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import linear_sum_assignment


def optimal_assignment(similarity: Float[np.ndarray, "A B"]) -> Int[np.ndarray, " A"]:
    """Pair each of A with at most one of B so that the sum of similarities is largest.

    The Hungarian method. -1: none is left, or none may be; -inf forbids a pair.

    Args:
        similarity: Any numbers, larger is more alike; -inf: never.
    """
    found = np.full(len(similarity), -1, np.int64)
    if not similarity.size:
        return found
    allowed = np.isfinite(similarity)
    known = np.where(allowed, similarity, 0.0)
    worst = known.min() - (np.ptp(known) + 1.0) * (min(similarity.shape) + 1)
    rows, columns = linear_sum_assignment(np.where(allowed, known, worst), maximize=True)
    kept = allowed[rows, columns]
    found[rows[kept]] = columns[kept]
    return found

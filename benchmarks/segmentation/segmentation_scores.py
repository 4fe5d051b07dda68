"""Scores of segmentation against ground truth."""

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import linear_sum_assignment


def iou_matrix(
    truth: Int[np.ndarray, " N"], found: Int[np.ndarray, " N"], parts: int, clusters: int
) -> Float[np.ndarray, "K C"]:
    """Return intersection over union of every part and every cluster [-]; 0 where both are empty.

    Points of no part or no cluster, -1, count for the other side's union.
    """
    both = np.zeros((parts, clusters))
    known = (truth >= 0) & (found >= 0)
    np.add.at(both, (truth[known], found[known]), 1)
    a = np.bincount(truth[truth >= 0], minlength=parts)[:, None]
    b = np.bincount(found[found >= 0], minlength=clusters)[None]
    return both / np.maximum(a + b - both, 1)


def matched_iou(truth: Int[np.ndarray, " N"], found: Int[np.ndarray, " N"]) -> float:
    """Return the mean over true parts of the IoU with the one cluster each is paired with.

    Pairs are those of the largest sum (Hungarian method); a part without a cluster counts 0. A cluster too many costs
    by what it takes from the others.
    """
    present, part = np.unique(truth, return_inverse=True)
    shares = iou_matrix(part, found, len(present), int(found.max()) + 1)
    rows, columns = linear_sum_assignment(shares, maximize=True)
    return float(shares[rows, columns].sum() / len(present))


def named_iou(truth: Int[np.ndarray, " N"], found: Int[np.ndarray, " N"]) -> float:
    """Return the mean over true parts of the IoU with what bears the same number."""
    count = int(max(truth.max(), found.max())) + 1
    return float(np.diag(iou_matrix(truth, found, count, count))[np.unique(truth)].mean())


def majority_names(truth: Int[np.ndarray, " N"], found: Int[np.ndarray, " N"]) -> np.ndarray:
    """Return points with each cluster named after the part that most of its points are of."""
    both = np.zeros((int(found.max()) + 1, int(truth.max()) + 1))
    np.add.at(both, (found, truth), 1)
    return both.argmax(axis=1)[found]

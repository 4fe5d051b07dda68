"""Objects with space between them: what single linkage joins last.

Distances are those of mutual reachability (Campello et al. 2013), so that stray points build no
bridges. A number of objects is believed where it holds over a range of distances: gaps within an
object are where no view looked, and narrow; gaps between objects are wider.
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.spatial import KDTree
from scipy.spatial.distance import pdist

ASKED = 5000
"""Points that are looked at."""
MATES = 5
"""A place is as dense as the distance to so many neighbours says."""
LEAST = 0.01
"""Share of the points that make an object."""
CLEAR = 1.8
"""Factor between the widest gap within objects and the narrowest between them."""


def with_space_between(
    position: Float[np.ndarray, "N 3"], most: int | None = None, seed: int = 0
) -> Int[np.ndarray, " N"]:
    """Return which points are of one object, as far as space alone tells; most points first.

    Args:
        position: Points on objects.
        most: How many objects there are at most; None: not given.
        seed: Of the points that are looked at.

    """
    count = len(position)
    if count <= MATES or most == 1:
        return np.zeros(count, np.int64)
    random = np.random.default_rng(seed)
    few = np.sort(random.choice(count, min(count, ASKED), replace=False))
    points = position[few]
    tree = KDTree(points)
    core = np.asarray(tree.query(points, k=MATES + 1)[0])[:, -1]
    first, second = np.triu_indices(len(points), 1)
    apart = np.maximum(pdist(points), np.maximum(core[first], core[second]))
    label = _finest(linkage(apart, "single"), len(points), most)
    sure = np.flatnonzero(label >= 0)
    return label[sure][np.asarray(KDTree(points[sure]).query(position)[1])]


def _finest(tree: Float[np.ndarray, "J 4"], count: int, most: int | None) -> Int[np.ndarray, " n"]:
    """Return the finest groups that hold over a clear range of distances."""
    least = max(LEAST * count, MATES)
    # Where two groups that both are objects join, the number of objects changes.
    size = np.concatenate([np.ones(count), tree[:, 3]])
    joins = np.minimum(size[tree[:, 0].astype(int)], size[tree[:, 1].astype(int)]) >= least
    widest, usual = np.sort(tree[joins, 2])[::-1], _usual(tree)
    for k in range(min(len(widest), (most or len(widest) + 1) - 1), 0, -1):
        below = max(widest[k], usual) if k < len(widest) else usual
        if widest[k - 1] >= CLEAR * below:
            middle = np.sqrt(widest[k - 1] * below)
            return _large(fcluster(tree, middle, "distance") - 1, least)
    return np.zeros(count, np.int64)


def _usual(tree: np.ndarray) -> float:
    """Return the distance at which nearly all has been joined: within objects there are such gaps.

    Where an object is plain, its Gaussians are large and few, and their means far apart.
    """
    return float(np.percentile(tree[:, 2], 99))


def _large(group: Int[np.ndarray, " n"], least: float) -> Int[np.ndarray, " n"]:
    """Return groups that are objects by number, most points first; -1: stray."""
    sizes = np.bincount(group)
    order = [g for g in np.argsort(-sizes, kind="stable") if sizes[g] >= least]
    rank = np.full(len(sizes), -1, np.int64)
    rank[order] = np.arange(len(order))
    return rank[group]

"""Detection of pictures from one viewpoint: a tripod, or crops of one picture.

There nothing is nearer than anything else. What two such pictures share differs by a shift, a turn and a scale alone,
and COLMAP looks for depth in vain, or finds what is not there. Whoever takes but five degrees around an object, or
above it, shortens what lies on its floor: that is no similarity. Where a camera turns on the spot, its pictures differ
by a rotation in space, seen through one lens.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

MAX_POINT_SHIFT_FRACTION = 0.0025
"""Median distance of points after a similarity, in the longer side of pictures, up to which two were taken from one
place: compression and noise move points by less."""
MIN_EXPLAINED_PAIRS_FRACTION = 0.8
"""Share of the pairs of pictures with points in common that one place explains, from which on all were taken there. Of
bursts on a way around an object few pairs are of one burst.
"""
MIN_PAIRS = 10
"""Pairs without which there is no result."""
MIN_PICTURES_FRACTION = 0.5
"""Of all pictures that must be of that place."""
REFIT_ROUNDS = 3
"""Of fitting again to the half that agrees best."""
TRIED_FOCAL_RATIOS = (0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.4, 1.7, 2.0, 2.5, 3.0)
"""Focal lengths that are tried, in the longer side: the right one is not known."""
FOCAL_SAMPLE_PAIRS = 200
"""Pairs by which one of them is chosen for all."""
PointPair = tuple[Float[np.ndarray, "M 2"], Float[np.ndarray, "M 2"]]
"""Points of one picture and the same of another, from the middle of each, in its longer side."""


def is_same_viewpoint(a: Float[np.ndarray, "M 2"], b: Float[np.ndarray, "M 2"], longest: int) -> bool:
    """Return whether a shift, a turn and a scale take points of one picture to those of another.

    Args:
        a: Of the one [px].
        b: The same points, of the other [px].
        longest: Longer side of the pictures [px].
    """
    x, y = a[:, 0] + 1j * a[:, 1], b[:, 0] + 1j * b[:, 1]
    kept, off = np.ones(len(x), bool), np.zeros(len(x))
    for _ in range(REFIT_ROUNDS):
        middle = x[kept].mean(), y[kept].mean()
        spread = float(np.square(np.abs(x[kept] - middle[0])).sum())
        if spread == 0:
            return False
        turn = (np.conj(x[kept] - middle[0]) * (y[kept] - middle[1])).sum() / spread
        off = np.abs(turn * (x - middle[0]) + middle[1] - y)
        kept = off <= np.median(off)
    return float(np.median(off)) < MAX_POINT_SHIFT_FRACTION * longest


def pairs_of_rotation(pairs: Sequence[PointPair]) -> Bool[np.ndarray, " P"]:
    """Return which pairs a rotation of one camera explains, whose focal length explains the most."""
    some = pairs[:: max(1, len(pairs) // FOCAL_SAMPLE_PAIRS)]
    counts = [
        sum(_rotation_error(a, b, focal) < MAX_POINT_SHIFT_FRACTION for a, b in some) for focal in TRIED_FOCAL_RATIOS
    ]
    focal = TRIED_FOCAL_RATIOS[int(np.argmax(counts))]
    return np.array([_rotation_error(a, b, focal) < MAX_POINT_SHIFT_FRACTION for a, b in pairs], bool)


def _rotation_error(a: Float[np.ndarray, "M 2"], b: Float[np.ndarray, "M 2"], focal: float) -> float:
    """Return the median distance after the best rotation, in the longer side."""
    x, y = (np.c_[points / focal, np.ones(len(points))] for points in (a, b))
    x, y = (rays / np.linalg.norm(rays, axis=1, keepdims=True) for rays in (x, y))
    kept, off = np.ones(len(x), bool), np.zeros(len(x))
    for _ in range(REFIT_ROUNDS):
        left, _, right = np.linalg.svd(y[kept].T @ x[kept])  # Kabsch 1976
        proper = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
        off = focal * np.linalg.norm(y - x @ (left @ proper @ right).T, axis=1)
        kept = off <= np.median(off)
    return float(np.median(off))


def describe_one_viewpoint(
    joined: Bool[np.ndarray, "N N"], same: Bool[np.ndarray, "N N"], by: str = "a shift, a turn and a scale alone"
) -> str | None:
    """Return in a clause that most of N pictures are from one place, if they are."""
    pairs, alike = (int(np.triu(which, 1).sum()) for which in (joined, joined & same))
    if pairs < MIN_PAIRS or alike < MIN_EXPLAINED_PAIRS_FRACTION * pairs:
        return None
    _, label = connected_components(csr_array(joined & same), directed=False)
    together = int(np.bincount(label).max())
    if together < MIN_PICTURES_FRACTION * len(joined):
        return None
    return f"{together} of {len(joined)} were taken from one place: what they share differs by {by}"

"""Connected pieces of points by free space between them."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree


@dataclass(frozen=True)
class SpacePieces:
    """Pieces with empty space between them."""

    piece_of_point: Int[np.ndarray, " N"]
    """0 … the number of pieces - 1, what has most points first."""
    alone: bool = False
    """Whether nothing else tells objects apart, so that what touches is one."""


def join_nearest_pieces(
    piece_of_point: Int[np.ndarray, " N"], position: Float[np.ndarray, "N 3"], most: int | None
) -> Int[np.ndarray, " N"]:
    """Join pieces that are nearest to each other until they are few enough.

    Args:
        piece_of_point: 0 … the number of pieces - 1.
        position: Of the points.
        most: How many objects there are at most; None: not given.

    """
    label, count = piece_of_point.copy(), int(piece_of_point.max(initial=-1)) + 1
    if most is None or count <= most:
        return label
    trees = [KDTree(position[piece_of_point == k]) for k in range(count)]
    pairs = combinations(range(count), 2)
    gaps = sorted((float(trees[a].query(trees[b].data)[0].min()), a, b) for a, b in pairs)
    for _, a, b in gaps:
        if len(np.unique(label)) <= most:
            break
        one, other = (label[piece_of_point == k][0] for k in (a, b))
        label[label == other] = one
    return np.unique(label, return_inverse=True)[1]

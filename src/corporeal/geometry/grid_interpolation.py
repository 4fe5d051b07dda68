"""Interpolation on regular grids."""

import numpy as np
from jaxtyping import Float
from scipy.sparse import csr_array


def bilinear_weights(place: np.ndarray, on: np.ndarray, size: tuple[int, int]) -> csr_array:
    """Interpolate bilinearly in a map that covers the unit square: places x (rows times columns).

    Args:
        place: x and y of each point, in [0, 1].
        on: Which points take part.
        size: Rows and columns of the map.
    """
    rows = np.flatnonzero(on)
    high, wide = size
    x = np.clip(place[rows, 0] * wide - 0.5, 0, wide - 1)
    y = np.clip(place[rows, 1] * high - 0.5, 0, high - 1)
    left, top = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    entries = [
        (np.minimum(top + j, high - 1) * wide + np.minimum(left + i, wide - 1), a * b)
        for i, a in ((0, 1 - (x - left)), (1, x - left))
        for j, b in ((0, 1 - (y - top)), (1, y - top))
    ]
    column, weight = (np.concatenate(part) for part in zip(*entries, strict=True))
    made = csr_array((weight, (np.tile(rows, 4), column)), shape=(len(place), high * wide))
    made.eliminate_zeros()
    return made


def trilinear_weights(place: Float[np.ndarray, "N 3"], shape: tuple[int, int, int]) -> csr_array:
    """Interpolate trilinearly between nodes at whole numbers: places x (all nodes, row by row).

    What is outside takes the value at the nearest face.

    Args:
        place: In units of the nodes' distance, from the first of them.
        shape: How many nodes there are along each axis, at least 2.
    """
    last = np.array(shape) - 1
    inside = np.clip(place, 0, last)
    first = np.minimum(inside.astype(np.int64), last - 1)
    off = inside - first
    corner = np.array([[a, b, c] for a in (0, 1) for b in (0, 1) for c in (0, 1)])
    share = np.where(corner, off[:, None], 1 - off[:, None]).prod(axis=2)
    column = np.ravel_multi_index(tuple((first[:, None] + corner).transpose(2, 0, 1)), shape)
    start = np.arange(len(place) + 1) * len(corner)
    made = csr_array((share.ravel(), column.ravel(), start), shape=(len(place), np.prod(shape)))
    made.eliminate_zeros()
    return made

"""Superpoints after SLIC.

Achanta et al., "SLIC superpixels compared to state-of-the-art superpixel methods", 2012: k-means of place and look
together in which a point only ever goes to one of the patches that began near it, so that it takes time in proportion
to the points, however many patches there are.
"""

import numpy as np
from jaxtyping import Float, Int
from numba import njit
from scipy.spatial import KDTree

ASSIGNMENT_ITERATIONS = 5
"""Of assigning points to patches and moving patches to their points."""
CANDIDATE_PATCHES = 8
"""Patches that a point may go to: those that began nearest to it."""
WIDTH_BISECTION_STEPS = 24
"""Of the interval in which the grid's width is looked for."""
MIN_COUNT_FRACTION = 0.9
"""This share of the patches asked for is enough."""
APPEARANCE_SCALE = 0.3
"""Difference of appearance that counts as much as one patch's width."""


def superpoints(
    position: Float[np.ndarray, "N 3"],
    appearance: Float[np.ndarray, "N D"] | None,
    count: int = 2000,
    alike: float = APPEARANCE_SCALE,
) -> Int[np.ndarray, " N"]:
    """Return each point's patch, 0 … M - 1; M is about ``count``, and no more than N.

    Squared distance of point and patch = |x - x_m|² / width² + |g - g_m|² / alike².

    Args:
        position: World [m].
        appearance: What points look like, unit vectors or shorter ones (``regions.reduce``);
            None: place
            alone decides.
        count: How many patches, about.
        alike: Difference of appearance that counts as much as one patch's width.
    """
    place = np.asarray(position, np.float64)
    first, width = _grid_cells(place, count)
    z = (place - place.mean(axis=0)) / width
    if appearance is not None:
        z = np.concatenate([z, np.asarray(appearance, np.float64) / alike], axis=1)
    z = z.astype(np.float32)
    patches = int(first.max()) + 1
    near = min(CANDIDATE_PATCHES, patches)
    _, candidates = KDTree(_means(place, first, patches)).query(place, k=near, workers=-1)
    candidates = np.asarray(candidates, np.int64).reshape(-1, near)
    patch = first
    for _ in range(ASSIGNMENT_ITERATIONS):
        moved = _nearest_candidate(z, candidates, _means(z, patch, patches))
        if np.array_equal(moved, patch):
            break
        patch = moved
    return np.unique(patch, return_inverse=True)[1].reshape(-1)


def _grid_cells(place: np.ndarray, count: int) -> tuple[np.ndarray, float]:
    """Return each point's cell of a grid with about so many cells, and the cells' width.

    Only cells that hold points count.
    """
    extent = float(np.ptp(place, axis=0).max())
    if extent == 0 or count < 2:
        return np.zeros(len(place), np.int64), extent or 1.0
    wanted = min(count, len(place))
    fine, coarse = extent / (4.0 * count), 2 * extent
    cell = _cells_of_width(place, coarse)
    for _ in range(WIDTH_BISECTION_STEPS):
        width = float(np.sqrt(fine * coarse))
        tried = _cells_of_width(place, width)
        made = int(tried.max()) + 1
        if made > count:
            fine = width
            continue
        cell, coarse = tried, width
        if made >= MIN_COUNT_FRACTION * wanted:
            break
    return cell, coarse


def _cells_of_width(place: np.ndarray, width: float) -> np.ndarray:
    cell = np.floor((place - place.min(axis=0)) / width).astype(np.int64)
    flat = np.ravel_multi_index(tuple(cell.T), tuple(cell.max(axis=0) + 1))
    return np.unique(flat, return_inverse=True)[1].reshape(-1)


def _means(rows: np.ndarray, patch: np.ndarray, count: int) -> np.ndarray:
    """Return every patch's mean; one without points is nowhere, and nothing goes there."""
    size = np.bincount(patch, minlength=count)
    total = np.stack([np.bincount(patch, column, count) for column in rows.T], axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(size[:, None] > 0, total / size[:, None], np.inf).astype(rows.dtype)


@njit(cache=True)
def _nearest_candidate(z, candidates, means):  # pragma: no cover (compiled)
    count, near = candidates.shape
    found = np.empty(count, np.int64)
    for i in range(count):
        best, least = candidates[i, 0], np.inf
        for k in range(near):
            m = candidates[i, k]
            apart = 0.0
            for c in range(z.shape[1]):
                step = z[i, c] - means[m, c]
                apart += step * step
                if apart >= least:
                    break
            if apart < least:
                best, least = m, apart
        found[i] = best
    return found

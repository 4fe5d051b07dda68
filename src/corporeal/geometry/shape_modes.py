"""Low-rank modes of a moving surface."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

BLOCK_VERTICES_COUNT = 8192
"""Vertices that are looked at together."""
MIN_MODE_EIGENVALUE_RATIO = 1e-14
"""Of the largest: eigenvalues below it are rounding."""


@dataclass(frozen=True)
class ShapeModes:
    """Vertices at frame f are base + Σ_k weights[f, k] targets[k]; r modes."""

    base: Float[np.ndarray, "V 3"]
    """[m]"""
    targets: Float[np.ndarray, "r V 3"]
    """[m]"""
    weights: Float[np.ndarray, "F r"]
    """In [0, 1], so that no viewer clips them."""
    error: float
    """Largest distance of any vertex at any frame from where it should be [m]."""

    @property
    def count(self) -> int:
        """Number of modes r."""
        return len(self.targets)


def fit_shape_modes(shapes: Float[np.ndarray, "F V 3"], tolerance: float, most: int) -> ShapeModes:
    """Take the fewest leading singular vectors of the shapes that keep the tolerance.

    The singular value decomposition gives the r shapes with the least sum of squares (Eckart and
    Young 1936); r grows until the largest error is small enough. It is taken of the F × F products
    of shapes, block by block, so that long videos of large meshes fit into memory.

    Args:
        shapes: Vertices at every frame [m]; may lie on the disk.
        tolerance: Largest error of any vertex [m].
        most: So many modes at most; the error may then be larger.

    """
    frames, vertices = shapes.shape[:2]
    blocks = [slice(a, a + BLOCK_VERTICES_COUNT) for a in range(0, vertices, BLOCK_VERTICES_COUNT)]
    products = np.zeros((frames, frames))
    for block in blocks:
        away = _deviations_from_mean(shapes, block)
        products += away @ away.T
    size, left = np.linalg.eigh(products)
    left = left[:, ::-1][:, size[::-1] > MIN_MODE_EIGENVALUE_RATIO * max(size[-1], 0.0)][:, :most]
    count = max(
        (_modes_needed(_deviations_from_mean(shapes, b), left, tolerance) for b in blocks),
        default=0,
    )
    left = left[:, :count]
    low, span = left.min(axis=0), np.maximum(np.ptp(left, axis=0), 1e-12)
    base, targets, error = np.empty((vertices, 3)), np.empty((count, vertices, 3)), 0.0
    for block in blocks:
        away = _deviations_from_mean(shapes, block)
        modes = left.T @ away
        mean = shapes[:, block].mean(axis=0, dtype=np.float64)
        base[block] = mean + (low @ modes).reshape(-1, 3)
        targets[:, block] = (modes * span[:, None]).reshape(count, -1, 3)
        error = max(error, _largest_distance(away - left @ modes))
    return ShapeModes(base, targets, (left - low) / span, error)


def _deviations_from_mean(shapes: np.ndarray, block: slice) -> np.ndarray:
    """Differences (F, 3 n) from the mean over time [m]."""
    own = shapes[:, block].astype(np.float64)
    return (own - own.mean(axis=0)).reshape(len(shapes), -1)


def _modes_needed(away: np.ndarray, left: np.ndarray, tolerance: float) -> int:
    """Return how many modes keep the tolerance in one block; all there are if none do."""
    rest = away.copy()
    for count in range(left.shape[1]):
        if _largest_distance(rest) <= tolerance:
            return count
        rest -= np.outer(left[:, count], left[:, count] @ away)
    return left.shape[1]


def _largest_distance(rest: np.ndarray) -> float:
    """Return the largest distance of any vertex at any frame [m]."""
    return float(np.linalg.norm(rest.reshape(len(rest), -1, 3), axis=2).max(initial=0.0))


def refit_shape_modes(
    modes: ShapeModes, values: Float[np.ndarray, "F V 3"]
) -> tuple[Float[np.ndarray, "V 3"], Float[np.ndarray, "r V 3"]]:
    """Return the base and the targets that come nearest to other values with the same weights."""
    frames = len(values)
    A = np.column_stack([np.ones(frames), modes.weights])
    found = np.einsum("kf,fvi->kvi", np.linalg.pinv(A), values, optimize=True)
    return found[0], found[1:]

"""Distance-preserving dimensionality reduction of features."""

import numpy as np
from jaxtyping import Float, Float32

ROWS_PER_BATCH = 8192
"""Rows that are worked on at a time: what bounds the memory beside the rows themselves."""
AXES_SAMPLE_ROWS = 20_000
"""Rows that the principal axes are found from; more change them little and take longer."""


def reduce_features(
    features: Float[np.ndarray, "N D"], channels: int = 64
) -> Float32[np.ndarray, "N C"]:
    """Return features at unit length on their first principal axes; C = min(D, channels).

    |x_i - x_j|² is nearly 2 (1 - cos) of the features i and j: all of it where D ≤ channels, and
    else all but what the axes left out had of it. Rows of zeros are taken as zeros. Features may be
    in half precision, and are only ever widened ``ROWS_PER_BATCH`` rows at a time.

    Args:
        features: Of any length.
        channels: How many axes are kept.

    """
    count, depth = features.shape
    every = np.linspace(0, count - 1, min(count, AXES_SAMPLE_ROWS)).astype(np.int64)
    sample = _unit(features[np.unique(every)])
    mean = sample.mean(axis=0)
    axes = _principal_axes(sample - mean, min(depth, channels))
    made = np.empty((count, axes.shape[1]), np.float32)
    for start in range(0, count, ROWS_PER_BATCH):
        rows = slice(start, start + ROWS_PER_BATCH)
        made[rows] = (_unit(features[rows]) - mean) @ axes
    return made


def _unit(rows: np.ndarray) -> np.ndarray:
    rows = np.asarray(rows, np.float32)
    length = np.linalg.norm(rows, axis=1, keepdims=True)
    return rows / np.where(length > 0, length, 1)


def _principal_axes(centred: np.ndarray, count: int) -> np.ndarray:
    """Return the directions of most spread, one a column, each with its largest entry positive."""
    _, axes = np.linalg.eigh((centred.T @ centred).astype(np.float64))
    axes = axes[:, ::-1][:, :count]
    largest = np.take_along_axis(axes, np.abs(axes).argmax(axis=0)[None], axis=0)
    return (axes * np.where(largest < 0, -1, 1)).astype(np.float32)

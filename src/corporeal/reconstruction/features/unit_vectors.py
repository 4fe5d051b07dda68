"""Unit feature vectors, compared by cosine."""

import numpy as np
from jaxtyping import Float, Float32

ROWS_PER_BATCH = 8192
"""Rows that are worked on at a time: what bounds the memory beside the rows themselves."""


def row_batches(count: int) -> list[slice]:
    """Cut 0 … count into spans of at most ``ROWS_PER_BATCH``."""
    return [slice(k, min(k + ROWS_PER_BATCH, count)) for k in range(0, count, ROWS_PER_BATCH)]


def unit_rows(rows: Float[np.ndarray, "N D"]) -> Float32[np.ndarray, "N D"]:
    """Return rows at unit length; rows of zeros stay zeros."""
    rows = np.asarray(rows, np.float32)
    length = np.linalg.norm(rows, axis=-1, keepdims=True)
    return rows / np.where(length > 0, length, 1)


def cosine_similarity(
    features: Float[np.ndarray, "N D"], words: Float[np.ndarray, "M D"]
) -> Float32[np.ndarray, "N M"]:
    """Return the cosine of every point with every name; features and words are unit vectors."""
    made = np.empty((len(features), len(words)), np.float32)
    for rows in row_batches(len(features)):
        made[rows] = features[rows].astype(np.float32) @ words.T.astype(np.float32)
    return made

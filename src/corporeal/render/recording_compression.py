"""Compression of recordings: normals in two bytes, differences in time."""

import numpy as np
from jaxtyping import Float, Int8, UInt8

MAX_SIGNED_BYTE = 127
"""Largest value of a signed byte."""


def encode_octahedral(normals: Float[np.ndarray, "N 3"]) -> Int8[np.ndarray, "N 2"]:
    """Put unit vectors into two bytes: the unit octahedron folded flat (Cigolle et al. 2014).

    The angle to the vector that is read back is about 1° at worst.
    """
    flat = normals / np.maximum(np.abs(normals).sum(axis=1, keepdims=True), 1e-12)
    corner = np.where(flat[:, :2] >= 0, 1.0, -1.0)
    folded = (1.0 - np.abs(flat[:, [1, 0]])) * corner
    return np.round(MAX_SIGNED_BYTE * np.where(flat[:, 2:] < 0, folded, flat[:, :2])).astype(
        np.int8
    )


def decode_octahedral(pairs: Int8[np.ndarray, "N 2"]) -> Float[np.ndarray, "N 3"]:
    """Return the unit vectors that ``encode_octahedral`` put into bytes, as the page does."""
    flat = pairs / MAX_SIGNED_BYTE
    height = 1.0 - np.abs(flat).sum(axis=1)
    below = np.maximum(-height, 0.0)[:, None]
    flat = flat - np.where(flat >= 0, below, -below)
    out = np.column_stack([flat, height])
    return out / np.linalg.norm(out, axis=1, keepdims=True)


def encode_time_deltas(values: np.ndarray) -> UInt8[np.ndarray, " N"]:
    """Lay out what changes little from frame to frame: (T, V, C) integers as bytes.

    Differences between frames, which wrap around; then axis by axis; then all low bytes before all
    high ones. Deflate finds long runs in the result.
    """
    change = values.copy()
    change[1:] -= values[:-1]
    planes = np.ascontiguousarray(np.moveaxis(change, -1, 0))
    return planes.view(np.uint8).reshape(-1, values.itemsize).T.ravel().copy()

"""Cropping of pictures to their content."""

import numpy as np
from jaxtyping import Bool

from corporeal.render.embree import PixelBlock


def block_around(near: Bool[np.ndarray, "h w"], block: PixelBlock, reach: int) -> PixelBlock | None:
    """Return the part of a block that holds marked pixels and those within ``reach``."""
    rows, columns = (np.flatnonzero(near.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return None
    top, left = max(rows[0] - reach, 0), max(columns[0] - reach, 0)
    bottom = min(rows[-1] + reach + 1, block.rows)
    right = min(columns[-1] + reach + 1, block.columns)
    return PixelBlock(int(block.first + top), int(bottom - top), int(right - left), int(left))


def block_window(block: PixelBlock, part: PixelBlock) -> tuple[slice, slice]:
    """Rows and columns of a block that a part of it takes."""
    top = part.first - block.first
    return slice(top, top + part.rows), slice(part.left, part.left + part.columns)


def crop_values(values: np.ndarray, block: PixelBlock, part: PixelBlock) -> np.ndarray:
    """Copy what belongs to a part from the values of a block's pixels, (P, ...) or (h, w)."""
    flat = values.ndim < 2 or values.shape != (block.rows, block.columns)
    trailing = values.shape[1:] if flat else ()
    there = values.reshape(block.rows, block.columns, *trailing)[block_window(block, part)].copy()
    return there.reshape(-1, *trailing) if flat else there

"""Detection of screen recordings of scrolled pages.

What a page shows is pushed aside as a whole, by many times the height of the screen in the end; all of it looks as it
did, so that pictures share points and COLMAP looks for depth for minutes. Who walks around an object sees near and far
move differently, from one chosen frame to the next by six degrees; and who turns a camera on the spot sees the middle
of its pictures move less than their sides. The shift is that of the phase correlation (Kuglin and Hines, "The phase
correlation image alignment method", 1975).
"""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float
from PIL import Image
from scipy.ndimage import gaussian_filter

MAX_COMPARED_FRAME_PX = 320
"""Longer side of the pictures that are compared [px]."""
FRAME_BLUR_PX = 1.0
"""Standard deviation of their blur [px]: shifts are no whole pixels of them."""
BLOCK_SIDE_PX = 16
"""Side of the blocks that must look alike after a shift [px]."""
MIN_BLOCK_CONTRAST_U8 = 6.0
"""Standard deviation of a block's greys, of 255, below which it says nothing."""
MIN_BLOCKS = 12
"""Blocks without which two pictures are not compared."""
MIN_BLOCK_CORRELATION, MIN_SHIFTED_BLOCKS_FRACTION = 0.85, 0.6
"""Correlation of a block with where it was pushed from, and share of the blocks that have it: a page has a header that
stays."""
TRIED_SHIFTS = 4
"""Shifts that are tried: what stays is one."""
MIN_SHIFTED_FRAMES_FRACTION = 0.6
"""Share of the neighbouring frames that differ by a shift alone."""
MIN_TOTAL_SCROLL_RATIO = 2.0
"""How far the page was pushed in all, in heights or widths of the picture."""


def is_screen_recording(frames: Sequence[Path]) -> bool:
    """Return whether frames in their order show a page that is scrolled."""
    greys = [_read_grey(file) for file in frames]
    moves = [page_shift(a, b) for a, b in pairwise(greys)]
    known = [move for move in moves if move is not None]
    if len(known) < MIN_SHIFTED_FRAMES_FRACTION * len(moves) or not known:
        return False
    way = np.cumsum(np.array(known), axis=0) / greys[0].shape
    return float((way.max(axis=0) - way.min(axis=0)).max()) >= MIN_TOTAL_SCROLL_RATIO


def page_shift(before: Float[np.ndarray, "H W"], after: Float[np.ndarray, "H W"]) -> tuple[int, int] | None:
    """Return by how much, down and right [px], one picture was pushed to give another; None: other.

    Args:
        before: Greys.
        after: Of the same size.
    """
    window = np.outer(np.hanning(before.shape[0]), np.hanning(before.shape[1]))
    a, b = (np.fft.rfft2((one - one.mean()) * window) for one in (before, after))
    cross = np.conj(a) * b
    peaks = np.fft.irfft2(cross / np.maximum(np.abs(cross), 1e-9), before.shape)
    for flat in np.argsort(peaks.ravel())[::-1][:TRIED_SHIFTS]:
        down, right = (
            (int(at) + side // 2) % side - side // 2
            for at, side in zip(np.unravel_index(flat, peaks.shape), before.shape, strict=True)
        )
        if (down or right) and _shifted_blocks_fraction(before, after, down, right) >= MIN_SHIFTED_BLOCKS_FRACTION:
            return down, right
    return None


def _shifted_blocks_fraction(before: np.ndarray, after: np.ndarray, down: int, right: int) -> float:
    """Return the share of blocks that look alike after a shift; 0 where there are too few."""
    height, width = before.shape
    there = after[max(down, 0) : height + min(down, 0), max(right, 0) : width + min(right, 0)]
    here = before[max(-down, 0) : height - max(down, 0), max(-right, 0) : width - max(right, 0)]
    x, y = _block_starts(here), _block_starts(there)
    spread = x.std(axis=1), y.std(axis=1)
    clear = (spread[0] > MIN_BLOCK_CONTRAST_U8) & (spread[1] > MIN_BLOCK_CONTRAST_U8)
    if np.count_nonzero(clear) < MIN_BLOCKS:
        return 0.0
    x, y = x[clear], y[clear]
    both = ((x - x.mean(axis=1, keepdims=True)) * (y - y.mean(axis=1, keepdims=True))).mean(axis=1)
    return float((both / (spread[0] * spread[1])[clear] > MIN_BLOCK_CORRELATION).mean())


def _block_starts(grey: np.ndarray) -> Float[np.ndarray, "N P"]:
    rows, columns = grey.shape[0] // BLOCK_SIDE_PX, grey.shape[1] // BLOCK_SIDE_PX
    whole = grey[: rows * BLOCK_SIDE_PX, : columns * BLOCK_SIDE_PX]
    return (
        whole.reshape(rows, BLOCK_SIDE_PX, columns, BLOCK_SIDE_PX)
        .swapaxes(1, 2)
        .reshape(-1, BLOCK_SIDE_PX * BLOCK_SIDE_PX)
    )


def _read_grey(file: Path) -> Float[np.ndarray, "H W"]:
    with Image.open(file) as opened:
        small = opened.convert("L")
        small.thumbnail((MAX_COMPARED_FRAME_PX, MAX_COMPARED_FRAME_PX), Image.Resampling.BOX)
    return gaussian_filter(np.asarray(small, float), FRAME_BLUR_PX)

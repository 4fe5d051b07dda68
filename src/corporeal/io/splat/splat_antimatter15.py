"""Gaussians as ``.splat`` (antimatter15): 32 bytes each, no header, no harmonics.

Place and scale are six floats; then come R, G, B and opacity, and w, x, y, z as bytes.
"""

from pathlib import Path

import numpy as np

from corporeal.core.errors import BadFileError
from corporeal.core.types import Gaussians
from corporeal.geometry.spherical_harmonics import SH_DC_COEFFICIENT

SPLAT_RECORD_DTYPE = np.dtype([("mean", "<f4", 3), ("scale", "<f4", 3), ("rgba", "u1", 4), ("turn", "u1", 4)])
MIN_PLAUSIBLE_RECORDS_FRACTION = 0.5
"""Share of records with positive scales and some length of rotation that tells such a file."""


def is_antimatter15(data: memoryview) -> bool:
    """Tell the format, which has no mark, by what its numbers are like."""
    if not data or len(data) % SPLAT_RECORD_DTYPE.itemsize:
        return False
    rows = np.frombuffer(data, SPLAT_RECORD_DTYPE)
    rows = rows[:: max(1, len(rows) // 10_000)]
    scale = rows["scale"]
    with np.errstate(invalid="ignore"):
        good = ((scale > 0) & (scale < 1e6)).all(axis=1)
        good &= (np.abs(rows["mean"]) < 1e6).all(axis=1)
    length = np.linalg.norm(rows["turn"] / 127.5 - 1, axis=1)
    return bool((good & (np.abs(length - 1) < 0.1)).mean() > MIN_PLAUSIBLE_RECORDS_FRACTION)


def read_antimatter15(path: Path, data: memoryview) -> Gaussians:
    """Return the Gaussians as the file says them, unchecked.

    Raises:
        BadFileError: The file's length is no multiple of 32 bytes.
    """
    if len(data) % SPLAT_RECORD_DTYPE.itemsize:
        what = f"is {len(data):,} bytes long, which is no multiple of {SPLAT_RECORD_DTYPE.itemsize}."
        raise BadFileError(path, what, "Copy or download it again.")
    rows = np.frombuffer(data, SPLAT_RECORD_DTYPE)
    rgba = rows["rgba"] / np.float32(255)
    return Gaussians(
        mean=rows["mean"].astype(np.float32),
        rotation=rows["turn"] / np.float32(127.5) - 1,
        scale=rows["scale"].astype(np.float32),
        opacity=rgba[:, 3],
        sh=((rgba[:, None, :3] - 0.5) / np.float32(SH_DC_COEFFICIENT)),
    )

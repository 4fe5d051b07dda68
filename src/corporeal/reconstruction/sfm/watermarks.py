"""Detection of watermarks: dates, names and marks at a fixed place of all pictures.

Its points are the same in every two of them, also in two that show nothing else in common. From them all pictures would
be of one place, taken from one viewpoint. What a camera that stands shows is at the same place, too, but all over the
pictures; and where the camera moves around an object, no place of the picture holds still from all sides.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from PIL import Image
from scipy.ndimage import binary_dilation

WATERMARKS_FOLDER = "stamps"
"""Of masks, beside the pictures: black where no points are to be looked for."""
WATERMARK_CELLS = 24
"""Cells along the longer side of pictures."""
MAX_STILL_SHIFT_FRACTION = 0.003
"""Shift of a point, in the longer side, up to which it did not move: points of small copies are known to a third of
that."""
MIN_STILL_PAIRS_FRACTION = 0.5
"""Share of all pairs of pictures in which a cell holds points that did not move: of these, most
are from different sides."""
MIN_PICTURES_OF_SIZE = 6
"""Pictures of one size, without which there is no result."""
MAX_STILL_CELLS_FRACTION = 0.25
"""Share of the cells that hold points, from which on the camera stood still."""
PictureSize = tuple[int, int]
"""Width and height of a picture [px]."""


class WatermarkDetector:
    """Told of all pairs of pictures, one after the other."""

    def __init__(self, sizes: Sequence[PictureSize], points: Sequence[Float[np.ndarray, "K 2"]]) -> None:
        self.sizes = sizes
        self.held = {size: np.zeros(_cell_grid(size)) for size in set(sizes)}
        self.still = {size: np.zeros(_cell_grid(size)) for size in set(sizes)}
        for size, own in zip(sizes, points, strict=True):
            self.held[size][_point_cells(own, size)] += 1

    def look(self, a: int, b: int, own: Float[np.ndarray, "M 2"], other: Float[np.ndarray, "M 2"]) -> None:
        """Take in what two pictures may share, whatever their geometry says of it.

        Args:
            a: Number of the one picture.
            b: Of the other.
            own: Points of the one [px].
            other: The same, of the other.
        """
        size = self.sizes[a]
        if size == self.sizes[b]:
            still = np.linalg.norm(own - other, axis=1) < MAX_STILL_SHIFT_FRACTION * max(size)
            self.still[size][_point_cells(own[still], size)] += 1

    def found(self) -> Mapping[PictureSize, Bool[np.ndarray, "R C"]]:
        """Return the cells about what stands in all pictures of a size; nothing of most sizes."""
        found = {}
        for size, still in self.still.items():
            count = self.sizes.count(size)
            stamped = still > MIN_STILL_PAIRS_FRACTION * count * (count - 1) / 2
            held = np.count_nonzero(self.held[size] > count / 2)
            if count >= MIN_PICTURES_OF_SIZE and 0 < np.count_nonzero(stamped) <= MAX_STILL_CELLS_FRACTION * held:
                found[size] = binary_dilation(stamped, np.ones((3, 3)))
        return found


def write_watermark_masks(
    found: Mapping[PictureSize, Bool[np.ndarray, "R C"]],
    names: Sequence[str],
    sizes: Sequence[PictureSize],
    folder: Path,
) -> str:
    """Write where no points are to be looked for, as COLMAP reads it; return messages about it.

    Args:
        found: Cells that are stamped.
        names: Of the pictures.
        sizes: Theirs [px].
        folder: Gets a picture for each.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name, size in zip(names, sizes, strict=True):
        allowed = np.full(size[::-1], 255, np.uint8)
        if size in found:
            rows, columns = (np.arange(n) * WATERMARK_CELLS // max(size) for n in size[::-1])
            allowed[found[size][np.ix_(rows, columns)]] = 0
        Image.fromarray(allowed).save(folder / f"{name}.png")
    count = sum(size in found for size in sizes)
    return (
        f"{count} photographs have a watermark, such as a date or a name: it is excluded from "
        "matching, but it is learned as part of the scene: photographs without it are better."
    )


def _cell_grid(size: PictureSize) -> tuple[int, int]:
    width, height = size
    return -(-height * WATERMARK_CELLS // max(size)), -(-width * WATERMARK_CELLS // max(size))


def _point_cells(points: Float[np.ndarray, "K 2"], size: PictureSize) -> tuple[np.ndarray, np.ndarray]:
    """Return rows and columns of the cells that hold points, each once."""
    high, wide = _cell_grid(size)
    row, column = (points[:, ::-1] * WATERMARK_CELLS / max(size)).astype(int).T
    flat = np.unique(np.clip(row, 0, high - 1) * wide + np.clip(column, 0, wide - 1))
    return flat // wide, flat % wide

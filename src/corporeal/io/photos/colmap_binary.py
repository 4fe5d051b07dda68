"""COLMAP's binary files as rows: counts first, then records, little-endian."""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from corporeal.core.errors import BadFileError
from corporeal.io.gltf.gltf_container import read_file_bytes

CAMERA_MODEL_NAMES = (
    "SIMPLE_PINHOLE",
    "PINHOLE",
    "SIMPLE_RADIAL",
    "RADIAL",
    "OPENCV",
    "OPENCV_FISHEYE",
    "FULL_OPENCV",
    "FOV",
    "SIMPLE_RADIAL_FISHEYE",
    "RADIAL_FISHEYE",
    "THIN_PRISM_FISHEYE",
)
"""Names by number."""
CAMERA_MODEL_PARAMETER_COUNTS = (3, 4, 4, 5, 8, 8, 12, 5, 4, 5, 12)
MAX_IMAGE_NAME_BYTES = 4096
"""[bytes]"""
OBSERVATION_BYTES = 24
"""Length of one point seen in an image [bytes]."""
TRACK_ELEMENT_BYTES = 8
"""Length of one image of a point [bytes]."""


class ColmapBinaryReader:
    """A file, read from front to back."""

    def __init__(self, path: Path) -> None:
        self.path, self.data, self.at = path, read_file_bytes(path), 0

    def take(self, form: str) -> tuple[Any, ...]:
        """Return the next numbers."""
        at = self.skip(struct.calcsize("<" + form))
        return struct.unpack_from("<" + form, self.data, at)

    def skip(self, size: int) -> int:
        """Go on by a number of bytes; return where it was."""
        at, self.at = self.at, self.at + size
        if self.at > len(self.data):
            raise BadFileError(self.path, "ends too early.", "Copy or export it again.")
        return at

    def count(self, least: int) -> int:
        """Return how many records follow, each of at least so many bytes."""
        (count,) = self.take("Q")
        if count * least > len(self.data) - self.at:
            what = f"claims {count:,} records, more than there is room for."
            raise BadFileError(self.path, what, "Copy or export it again.")
        return count

    def name(self) -> str:
        """Return a text that ends with a zero."""
        window = bytes(self.data[self.at : self.at + MAX_IMAGE_NAME_BYTES])
        end = window.find(b"\0")
        if end < 0:
            raise BadFileError(self.path, "the name of an image does not end.", "Export it again.")
        self.at += end + 1
        return window[:end].decode("utf-8", "replace")


def camera_rows(file: ColmapBinaryReader) -> Iterator[tuple[int, tuple]]:
    """Yield number, and model, width, height and parameters."""
    for _ in range(file.count(least=24)):
        number, model, width, height = file.take("iiQQ")
        if not 0 <= model < len(CAMERA_MODEL_NAMES):
            what = f"camera {number} is of model number {model}, which is not known."
            raise BadFileError(file.path, what, "Run COLMAP's image_undistorter first.")
        yield (
            number,
            (CAMERA_MODEL_NAMES[model], width, height, file.take(f"{CAMERA_MODEL_PARAMETER_COUNTS[model]}d")),
        )


def image_rows(file: ColmapBinaryReader) -> Iterator[tuple[int, str, int, tuple, tuple]]:
    """Yield number, name, camera, quaternion (w, x, y, z) and shift."""
    for _ in range(file.count(least=73)):
        numbers = file.take("I7dI")
        name = file.name()
        file.skip(OBSERVATION_BYTES * file.count(OBSERVATION_BYTES))
        yield numbers[0], name, numbers[8], numbers[1:5], numbers[5:8]


def point_rows(file: ColmapBinaryReader) -> Iterator[tuple[tuple[float, ...], tuple[int, ...]]]:
    """Yield x, y, z, r, g, b of every point, and the numbers of the images that it was seen in."""
    for _ in range(file.count(least=51)):
        row = tuple(float(x) for x in file.take("Q3d3Bd")[1:7])
        seen = file.count(TRACK_ELEMENT_BYTES)
        yield row, file.take(f"{2 * seen}I")[::2]

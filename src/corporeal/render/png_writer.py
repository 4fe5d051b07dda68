"""Pictures as PNG files."""

import os
from pathlib import Path

from PIL import Image

from corporeal.core.store import disk_errors

ZLIB_LEVEL = 4
"""Of zlib, 1 to 9: pictures are a sixth larger than by its usual 6, and the view of a report a twenty-fifth, in less
than half the time."""


def write_png(picture: Image.Image, path: Path) -> None:
    """Write a picture whole or not at all.

    Raises:
        DiskError: The disk refuses it.
    """
    with disk_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_name(f".{path.stem}.{os.getpid()}.part.png")
        try:
            picture.save(partial, compress_level=ZLIB_LEVEL)
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)

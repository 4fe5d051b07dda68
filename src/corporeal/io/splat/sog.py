"""Gaussians as SOG version 2 (PlayCanvas): pictures that hold numbers, and ``meta.json``.

A folder, or all of it in one ZIP file (``.sog``). Pixel i, row by row, belongs to Gaussian i. Specification:
developer.playcanvas.com/user-manual/gaussian-splatting/formats/sog.
"""

import io
import json
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from corporeal.core.errors import BadFileError
from corporeal.core.types import Gaussians
from corporeal.io.image_decoder import decode_image
from corporeal.io.ply_container import COPY_AGAIN_ADVICE
from corporeal.io.referenced_files import read_beside
from corporeal.io.splat.splat_ply import exponential

SOG_META_FILE = "meta.json"
ZIP_SIGNATURE = b"PK\x03\x04"
MAX_SOG_FILE_BYTES = 2**28
"""Of one picture or of the JSON [bytes]."""
PALETTE_ROW_ENTRIES = 64
"""Palette entries of harmonics side by side in their picture."""
SH_COEFFICIENTS_OF_DEGREE = (0, 3, 8, 15)
"""Above band 0, by degree."""
ALPHA_OF_LARGEST_W = 252
"""Alpha of a rotation whose largest component is w; then follow x, y and z."""
SOG_CONVERT_ADVICE = "Save it again as SOG version 2, or as PLY."
FileLoader = Callable[[str], bytes]


def read_sog(path: Path, data: memoryview) -> Gaussians:
    """Return the Gaussians of a bundle, or of a ``meta.json`` with its pictures, unchecked.

    Raises:
        BadFileError: It is broken, of another version, or lacks a file.
    """
    if data[:4] == ZIP_SIGNATURE:
        return read_sog_zip(path, data)
    return _SogReader(path, lambda name: read_beside(path.parent, name, MAX_SOG_FILE_BYTES)).read()


def read_sog_zip(path: Path, data: memoryview, max_file_bytes: int = MAX_SOG_FILE_BYTES) -> Gaussians:
    """Return the Gaussians of a bundle as it says them, unchecked.

    max_file_bytes: of one picture or of the JSON; larger ones are refused.

    Raises:
        BadFileError: It is broken, of another version, or lacks a file.
    """
    try:
        archive = zipfile.ZipFile(io.BytesIO(data))
    except (zipfile.BadZipFile, ValueError, OSError, RuntimeError) as problem:
        raise BadFileError(path, f"its ZIP is broken ({str(problem)[:60]}).", COPY_AGAIN_ADVICE) from None

    def source(name: str) -> bytes:
        try:
            if archive.getinfo(name).file_size > max_file_bytes:
                raise ValueError("it is too large")
            with archive.open(name) as stream:
                return stream.read(max_file_bytes)
        except KeyError:
            raise ValueError("it is not in the archive") from None
        except (zipfile.BadZipFile, OSError, EOFError, RuntimeError) as p:
            raise ValueError(str(p)[:60]) from None
        except Exception as p:  # zlib and lzma have errors of their own
            raise ValueError(f"it cannot be unpacked ({str(p)[:60]})") from None

    with archive:
        return _SogReader(path, source).read()


@dataclass(frozen=True)
class _SogReader:
    path: Path
    source: FileLoader

    def fail(self, what: str, next_step: str = COPY_AGAIN_ADVICE) -> NoReturn:
        raise BadFileError(self.path, what, next_step)

    def read(self) -> Gaussians:
        """Return everything, attribute by attribute."""
        meta = self.meta()
        count = meta.get("count")
        if not isinstance(count, int) or isinstance(count, bool) or count < 0:
            self.fail(f"{SOG_META_FILE}: 'count' is {str(count)[:40]}.")
        scale, colour = self.pixels(meta, "scales", count), self.pixels(meta, "sh0", count)
        band0 = self.book(meta, "sh0")[colour[:, :3]]
        return Gaussians(
            mean=self.means(meta, count),
            rotation=_unpack_quaternions(self.pixels(meta, "quats", count)),
            scale=exponential(self.book(meta, "scales")[scale[:, :3]]),
            opacity=colour[:, 3] / np.float32(255),
            sh=np.concatenate([band0[:, None], self.harmonics(meta, count)], axis=1),
        )

    def meta(self) -> dict[str, Any]:
        """Return what ``meta.json`` says."""
        try:
            meta = json.loads(self.source(SOG_META_FILE))
        except (ValueError, RecursionError) as problem:
            self.fail(f"{SOG_META_FILE}: {str(problem)[:80]}.")
        if not isinstance(meta, dict) or "means" not in meta:
            self.fail(f"{SOG_META_FILE} describes no Gaussians.", "Name a Gaussian splat.")
        if meta.get("version") != 2:
            version = str(meta.get("version", 1))[:20]
            self.fail(f"is SOG version {version}; only version 2 is read.", SOG_CONVERT_ADVICE)
        return meta

    def part(self, meta: dict[str, Any], key: str) -> dict[str, Any]:
        """Return what the file says of one attribute."""
        part = meta.get(key)
        if not isinstance(part, dict):
            self.fail(f"{SOG_META_FILE}: {key!r} is missing.")
        return part

    def numbers(self, meta: dict[str, Any], key: str, name: str, least: int) -> np.ndarray:
        """Return a list of numbers of one attribute."""
        try:
            values = np.array(self.part(meta, key).get(name), dtype=np.float64)
        except (TypeError, ValueError):
            values = np.zeros(0)
        if values.ndim != 1 or len(values) < least or not np.isfinite(values).all():
            self.fail(f"{SOG_META_FILE}: {key!r} has no list {name!r} of {least} numbers.")
        return values

    def book(self, meta: dict[str, Any], key: str) -> np.ndarray:
        """Return the 256 values that bytes stand for."""
        return self.numbers(meta, key, "codebook", 256).astype(np.float32)

    def picture(self, meta: dict[str, Any], key: str, k: int = 0) -> np.ndarray:
        """Return the k-th picture of an attribute, (H, W, 4)."""
        files = self.part(meta, key).get("files")
        name = files[k] if isinstance(files, list) and len(files) > k else None
        if not isinstance(name, str):
            self.fail(f"{SOG_META_FILE}: {key!r} names no file {k + 1}.")
        try:
            picture = decode_image(self.source(name), side=2**20)
        except ValueError as problem:
            self.fail(f"{name[:80]}: {problem}.")
        opaque = np.full((*picture.shape[:2], 4 - picture.shape[2]), 255, np.uint8)
        return np.concatenate([picture, opaque], axis=2)

    def pixels(self, meta: dict[str, Any], key: str, count: int, k: int = 0) -> np.ndarray:
        """Return the first ``count`` pixels, (count, 4)."""
        pixels = self.picture(meta, key, k).reshape(-1, 4)
        if len(pixels) < count:
            self.fail(f"the picture of {key!r} holds {len(pixels):,} of {count:,} Gaussians.")
        return pixels[:count]

    def means(self, meta: dict[str, Any], count: int) -> np.ndarray:
        """Return places: 16 bits between bounds of sign(x) ln(1 + |x|)."""
        low, high = (self.pixels(meta, "means", count, k)[:, :3] for k in (0, 1))
        least, most = (self.numbers(meta, "means", name, 3)[:3] for name in ("mins", "maxs"))
        logarithm = least + (low + 256.0 * high) / 65535 * (most - least)
        with np.errstate(over="ignore"):
            return (np.sign(logarithm) * np.expm1(np.abs(logarithm))).astype(np.float32)

    def harmonics(self, meta: dict[str, Any], count: int) -> np.ndarray:
        """Return the coefficients above band 0, (N, K - 1, 3), from a palette."""
        if "shN" not in meta:
            return np.zeros((count, 0, 3), np.float32)
        bands = self.part(meta, "shN").get("bands")
        if bands not in (1, 2, 3):
            self.fail(f"{SOG_META_FILE}: 'bands' is {str(bands)[:20]}, not 1, 2 or 3.")
        width = SH_COEFFICIENTS_OF_DEGREE[bands]
        palette = self.picture(meta, "shN")[..., :3]
        if palette.shape[1] != PALETTE_ROW_ENTRIES * width:
            self.fail(f"the palette is {palette.shape[1]} pixels wide, not {PALETTE_ROW_ENTRIES * width}.")
        palette = palette.reshape(-1, width, 3)
        label = self.pixels(meta, "shN", count, 1).astype(np.int64)
        entry = label[:, 0] + 256 * label[:, 1]
        if entry.max(initial=0) >= len(palette):
            self.fail(f"entry {entry.max():,} of a palette of {len(palette):,} is used.")
        return self.book(meta, "shN")[palette[entry]]


def _unpack_quaternions(pixels: np.ndarray) -> np.ndarray:
    """Return quaternions (w, x, y, z): the three smaller components over sqrt 1/2 are bytes.

    Where alpha names no largest component, the length is 0: no rotation.
    """
    others = (pixels[:, :3] / 127.5 - 1) * np.sqrt(0.5)
    largest = np.sqrt(np.maximum(0, 1 - (others**2).sum(axis=1)))
    four = np.concatenate([largest[:, None], others], axis=1)
    which = pixels[:, 3].astype(np.int64) - ALPHA_OF_LARGEST_W
    orders = np.array([[0, 1, 2, 3], [1, 0, 2, 3], [1, 2, 0, 3], [1, 2, 3, 0]])
    turned = np.take_along_axis(four, orders[np.maximum(which, 0)], axis=1)
    return np.where(which[:, None] < 0, 0, turned).astype(np.float32)

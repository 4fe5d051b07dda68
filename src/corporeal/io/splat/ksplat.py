"""Gaussians as ``.ksplat``, as GaussianSplats3D (mkkellogg) writes them, at its three levels.

A header of 4096 bytes, one of 1024 for each section, then the sections: counts of partly filled buckets, middles of
buckets, Gaussians. Levels 1 and 2 store places relative to their bucket in 16 bits and the rest in half precision;
level 2 has harmonics as bytes between two bounds.
"""

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from corporeal.core.errors import BadFileError
from corporeal.core.types import Gaussians
from corporeal.geometry.spherical_harmonics import SH_DC_COEFFICIENT
from corporeal.io.ply_container import COPY_AGAIN_ADVICE

KSPLAT_HEADER_BYTES, KSPLAT_SECTION_HEADER_BYTES = 4096, 1024
MAX_KSPLAT_SECTIONS = 4096
SH_COEFFICIENTS_OF_DEGREE = (0, 3, 8, 15)
"""Above band 0, by degree."""
DEFAULT_SH_BOUNDS = (-1.5, 1.5)
"""Of harmonics at level 2, where the file says none."""
DEFAULT_HALF_RANGE_OF_LEVEL = (1, 32767, 32767)
"""Largest number of a place, by level, where the section says none."""


@dataclass(frozen=True)
class _KsplatSection:
    count: int
    room: int
    """Gaussians there is space for."""
    capacity: int
    """Gaussians in a full bucket."""
    buckets: int
    block: float
    """Edge of the cube that a bucket covers."""
    bucket_bytes: int
    half_range: int
    full: int
    partial: int
    degree: int

    @property
    def head(self) -> int:
        """Length of what comes before the Gaussians [bytes]."""
        return 4 * self.partial + self.bucket_bytes * self.buckets


def is_ksplat(data: memoryview) -> bool:
    """Tell the format, which has no mark, by its version, its level and its first section."""
    if len(data) < KSPLAT_HEADER_BYTES + KSPLAT_SECTION_HEADER_BYTES or data[0] != 0 or data[1] < 1:
        return False
    sections, level = struct.unpack_from("<I", data, 4)[0], struct.unpack_from("<H", data, 20)[0]
    return 0 < sections <= MAX_KSPLAT_SECTIONS and level <= 2


def read_ksplat(path: Path, data: memoryview) -> Gaussians:
    """Return the Gaussians as the file says them, unchecked.

    Raises:
        BadFileError: It is cut off, or its numbers contradict each other.
    """
    sections, level = struct.unpack_from("<I", data, 4)[0], struct.unpack_from("<H", data, 20)[0]
    low, high = struct.unpack_from("<ff", data, 36)
    bounds = (low or DEFAULT_SH_BOUNDS[0], high or DEFAULT_SH_BOUNDS[1])
    at = KSPLAT_HEADER_BYTES + KSPLAT_SECTION_HEADER_BYTES * sections
    if at > len(data):
        raise BadFileError(path, f"has no room for the {sections:,} sections it claims.", COPY_AGAIN_ADVICE)
    found = []
    for k in range(sections):
        section = _read_section(path, data, KSPLAT_HEADER_BYTES + KSPLAT_SECTION_HEADER_BYTES * k, level)
        kind = _record_dtype(level, section.degree)
        end = at + section.head + kind.itemsize * section.room
        if end > len(data) or section.count > section.room:
            raise BadFileError(path, f"section {k + 1} runs past the end of the file.", COPY_AGAIN_ADVICE)
        if section.count:
            found.append(_decode_section(path, data, at, section, kind, bounds))
        at = end
    if not found:
        raise BadFileError(path, "holds no Gaussians.", COPY_AGAIN_ADVICE)
    return _concatenate_sections(found)


def _read_section(path: Path, data: memoryview, at: int, level: int) -> _KsplatSection:
    fields = struct.unpack_from("<IIIIfHxxIxxxxIIH", data, at)
    count, room, capacity, buckets, block, size, span, full, partial, degree = fields
    if degree >= len(SH_COEFFICIENTS_OF_DEGREE) or full + partial > buckets or not np.isfinite(block):
        raise BadFileError(path, "the header of a section is bad.", COPY_AGAIN_ADVICE)
    span = span or DEFAULT_HALF_RANGE_OF_LEVEL[level]
    return _KsplatSection(count, room, capacity, buckets, block, size, span, full, partial, degree)


def _record_dtype(level: int, degree: int) -> np.dtype:
    """Return how one Gaussian is stored."""
    number, place = ("<f4", "<f4") if level == 0 else ("<f2", "<u2")
    rest = ("<f4", "<f2", "u1")[level]
    return np.dtype(
        [
            ("mean", place, 3),
            ("scale", number, 3),
            ("turn", number, 4),
            ("rgba", "u1", 4),
            ("rest", rest, 3 * SH_COEFFICIENTS_OF_DEGREE[degree]),
        ]
    )


def _decode_section(
    path: Path, data: memoryview, at: int, section: _KsplatSection, kind: np.dtype, bounds: tuple[float, float]
) -> Gaussians:
    rows = np.frombuffer(data, kind, section.count, at + section.head)
    mean = rows["mean"].astype(np.float32)
    if kind["mean"].base.kind == "u":
        step = section.block / 2 / section.half_range
        mean = (mean - section.half_range) * step + _bucket_centres(path, data, at, section)
    rest = rows["rest"].astype(np.float32)
    if kind["rest"].base.kind == "u":
        rest = bounds[0] + rest / 255 * (bounds[1] - bounds[0])
    rgba = rows["rgba"] / np.float32(255)
    return Gaussians(
        mean=mean.astype(np.float32),
        rotation=rows["turn"].astype(np.float32),
        scale=rows["scale"].astype(np.float32),
        opacity=rgba[:, 3],
        sh=np.concatenate([(rgba[:, None, :3] - 0.5) / np.float32(SH_DC_COEFFICIENT), _sh_by_band(rest)], axis=1),
    )


def _bucket_centres(path: Path, data: memoryview, at: int, section: _KsplatSection) -> np.ndarray:
    """Return the middle of each Gaussian's bucket (N, 3): full ones first, then the others."""
    partial = np.frombuffer(data, "<u4", section.partial, at)
    counts = np.concatenate([np.full(section.full, section.capacity), partial]).astype(np.int64)
    ends = np.cumsum(counts)
    bucket = np.searchsorted(ends, np.arange(section.count), side="right")
    bad = section.bucket_bytes < 12 or not len(ends) or ends[-1] < section.count
    if bad:
        raise BadFileError(path, "its buckets hold fewer Gaussians than there are.", COPY_AGAIN_ADVICE)
    stride = section.bucket_bytes
    raw = np.frombuffer(data, np.uint8, stride * section.buckets, at + 4 * section.partial)
    middles = np.ascontiguousarray(raw.reshape(-1, stride)[:, :12]).view("<f4")
    return middles[bucket]


def _sh_by_band(rest: np.ndarray) -> np.ndarray:
    """Return coefficients (N, K - 1, 3), which are stored band by band, R, G, B within each."""
    bands = []
    at = 0
    while at < rest.shape[1]:
        width = 2 * len(bands) + 3
        band = rest[:, at : at + 3 * width].reshape(-1, 3, width)
        bands.append(band.swapaxes(1, 2))
        at += 3 * width
    return np.concatenate([np.zeros((len(rest), 0, 3), np.float32), *bands], axis=1)


def _concatenate_sections(found: list[Gaussians]) -> Gaussians:
    """Return all sections as one; harmonics that a section lacks are 0."""
    most = max(g.sh.shape[1] for g in found)
    padded = [np.pad(g.sh, ((0, 0), (0, most - g.sh.shape[1]), (0, 0))) for g in found]
    return Gaussians(
        *(np.concatenate([getattr(g, name) for g in found]) for name in ("mean", "rotation", "scale", "opacity")),
        sh=np.concatenate(padded),
    )

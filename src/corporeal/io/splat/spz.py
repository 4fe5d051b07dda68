"""Gaussians as SPZ, versions 2 to 4, as Niantic's tools write them (github.com/nianticlabs/spz).

After the header, attribute by attribute: places (fixed point, 24 bits), opacities, colours, scales, rotations,
harmonics. Versions 2 and 3 are one gzip stream, version 4 has one Zstandard stream per attribute behind a table of
their sizes. +Y is up, +Z is back (the others' Y and Z are opposite).
"""

import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from corporeal.core.errors import BadFileError
from corporeal.core.types import Gaussians, Note, NoteKind
from corporeal.io.ply_container import COPY_AGAIN_ADVICE
from corporeal.io.splat.splat_ply import exponential

SPZ_SIGNATURE = b"NGSP"
GZIP_SIGNATURE = b"\x1f\x8b"
SPZ_HEADER_STRUCT = struct.Struct("<4sIIBBBB")
STREAM_TABLE_OFFSET_STRUCT = struct.Struct("<I")
STREAM_SIZES_STRUCT = struct.Struct("<QQ")
EXTENSION_STRUCT = struct.Struct("<II")
MAX_SPZ_GAUSSIANS = 10_000_000
"""Gaussians, as in Niantic's own reader."""
SH_COEFFICIENTS_OF_DEGREE = (0, 3, 8, 15, 24)
"""Above band 0, by degree."""
KEPT_SH_COEFFICIENTS = 15
"""Of them: degree 3."""
EXTENSIONS_FLAG = 2
"""The flag that says that there are extensions."""
ADOBE_VENDOR_BYTES = b"\xbe\xad"
"""Who made the extensions that some files of versions 2 and 3 have before their data; others have them behind it, where
they are no matter."""
SH_BOUNDS_EXTENSION = 0xADBE0001
"""An extension with bounds of the harmonics."""
SPZ_COLOUR_SCALE = 0.15
"""Band 0 is stored as colour · this + 1/2."""
ZSTANDARD_ADVICE = 'Install what unpacks it: pip install "zstandard".'
SPZ_CONVERT_ADVICE = "Convert it to PLY with a program that reads it."


@dataclass(frozen=True)
class _SpzHeader:
    version: int
    count: int
    degree: int
    fraction_bits: int
    flags: int
    streams: int

    def sizes(self) -> list[int]:
        """Return the length of every attribute [bytes]."""
        turn = 3 if self.version == 2 else 4
        return [self.count * n for n in (9, 1, 3, 3, turn, 3 * SH_COEFFICIENTS_OF_DEGREE[self.degree])]


def read_spz(path: Path, data: memoryview) -> Gaussians:
    """Return the Gaussians as the file says them, unchecked.

    Raises:
        BadFileError: It is broken, larger than it may be, or of another version.
    """
    if data[:2] == GZIP_SIGNATURE:
        header, attributes = _one_stream(path, data)
    else:
        header = _header(path, bytes(data[: SPZ_HEADER_STRUCT.size]))
        several = header.version == 4
        attributes = _streams(path, data, header) if several else _plain(path, bytes(data), header)
    place, opacity, colour, scale, turn, rest = (np.frombuffer(a, np.uint8) for a in attributes)
    band0 = ((colour.reshape(-1, 1, 3) / 255 - 0.5) / SPZ_COLOUR_SCALE).astype(np.float32)
    higher = rest.reshape(header.count, -1, 3)[:, :KEPT_SH_COEFFICIENTS]
    lost = header.degree > 3
    return Gaussians(
        mean=(_decode_fixed_point(place) * 2.0**-header.fraction_bits).astype(np.float32),
        rotation=_decode_rotation_xyz(turn) if header.version == 2 else _decode_smallest_three(turn),
        scale=exponential(scale.reshape(-1, 3) / np.float32(16) - 10),
        opacity=(opacity / np.float32(255)),
        sh=np.concatenate([band0, (higher.astype(np.float32) - 128) / 128], axis=1),
        warnings=(Note("Colour: harmonics of degree 4 were left out; up to 3 are used.", NoteKind.LEFT_OUT),) * lost,
    )


def _header(path: Path, data: bytes) -> _SpzHeader:
    if len(data) < SPZ_HEADER_STRUCT.size or data[:4] != SPZ_SIGNATURE:
        raise BadFileError(path, "is no SPZ file.", COPY_AGAIN_ADVICE)
    _, version, count, degree, bits, flags, streams = SPZ_HEADER_STRUCT.unpack_from(data)
    if version not in (2, 3, 4):
        raise BadFileError(path, f"is SPZ version {version}; 2, 3 and 4 are read.", SPZ_CONVERT_ADVICE)
    if degree >= len(SH_COEFFICIENTS_OF_DEGREE) or bits > 24:
        raise BadFileError(path, "its SPZ header is bad.", COPY_AGAIN_ADVICE)
    if count > MAX_SPZ_GAUSSIANS:
        raise BadFileError(
            path, f"claims {count:,} Gaussians; at most {MAX_SPZ_GAUSSIANS:,} are read.", SPZ_CONVERT_ADVICE
        )
    return _SpzHeader(version, count, degree, bits, flags, streams)


def _one_stream(path: Path, data: memoryview) -> tuple[_SpzHeader, list[bytes]]:
    """Unpack no more than the header calls for, whatever else the stream holds."""
    stream = zlib.decompressobj(wbits=31)
    try:
        start = stream.decompress(data, SPZ_HEADER_STRUCT.size)
        header = _header(path, start)
        body = stream.decompress(stream.unconsumed_tail, max(1, sum(header.sizes())))
    except zlib.error as problem:
        raise BadFileError(path, f"its gzip stream is broken ({problem}).", COPY_AGAIN_ADVICE) from None
    return header, _plain(path, start + body, header)


def _plain(path: Path, data: bytes, header: _SpzHeader) -> list[bytes]:
    at = SPZ_HEADER_STRUCT.size
    if header.flags & EXTENSIONS_FLAG and data[at + 2 : at + 4] == ADOBE_VENDOR_BYTES:
        what = f"is SPZ version {header.version} with extensions before its data."
        raise BadFileError(path, what, SPZ_CONVERT_ADVICE)
    attributes = []
    for size in header.sizes():
        attributes.append(data[at : at + size])
        at += size
    if at > len(data):
        what = f"ends {at - len(data):,} bytes before its {header.count:,} Gaussians do."
        raise BadFileError(path, what, COPY_AGAIN_ADVICE)
    return attributes


def _streams(path: Path, data: memoryview, header: _SpzHeader) -> list[bytes]:
    """Return the attributes of version 4."""
    sizes = [size for size in header.sizes() if size]
    (table,) = STREAM_TABLE_OFFSET_STRUCT.unpack_from(bytes(data[16:20]).ljust(4, b"\0"))
    at = table + STREAM_SIZES_STRUCT.size * header.streams
    if table < 32 or at > len(data) or header.streams != len(sizes):
        raise BadFileError(path, "its table of streams is bad.", COPY_AGAIN_ADVICE)
    _refuse_bounds(path, data, header, table)
    attributes = []
    for k, size in enumerate(sizes):
        packed, unpacked = STREAM_SIZES_STRUCT.unpack_from(data, table + STREAM_SIZES_STRUCT.size * k)
        if unpacked != size or packed > len(data) - at:
            raise BadFileError(path, "its streams are not as long as its table says.", COPY_AGAIN_ADVICE)
        attributes.append(_unpacked(path, data[at : at + packed], size))
        at += packed
    return attributes + [b""] * (6 - len(attributes))


def _unpacked(path: Path, data: memoryview, size: int) -> bytes:
    try:
        import zstandard
    except ImportError:
        raise BadFileError(path, "is packed with Zstandard (SPZ version 4).", ZSTANDARD_ADVICE) from None
    try:
        with zstandard.ZstdDecompressor(max_window_size=2**27).stream_reader(data) as stream:
            found = stream.read(size)
    except zstandard.ZstdError as problem:
        raise BadFileError(path, f"a stream is broken ({str(problem)[:60]}).", COPY_AGAIN_ADVICE) from None
    if len(found) != size:
        raise BadFileError(path, "a stream ends too early.", COPY_AGAIN_ADVICE)
    return found


def _refuse_bounds(path: Path, data: memoryview, header: _SpzHeader, end: int) -> None:
    """Reject a version 4 whose extensions change what its harmonics mean."""
    at = 32
    while header.flags & EXTENSIONS_FLAG and at + EXTENSION_STRUCT.size <= end:
        kind, length = EXTENSION_STRUCT.unpack_from(data, at)
        if kind == SH_BOUNDS_EXTENSION:
            raise BadFileError(path, "its harmonics have bounds of their own.", SPZ_CONVERT_ADVICE)
        at += EXTENSION_STRUCT.size + length


def _decode_fixed_point(place: np.ndarray) -> np.ndarray:
    """Return signed numbers (N, 3) of 24 bits."""
    low, middle, high = np.moveaxis(place.reshape(-1, 3, 3).astype(np.int32), -1, 0)
    number = low | middle << 8 | high << 16
    return number - ((number & 0x800000) << 1)


def _decode_rotation_xyz(turn: np.ndarray) -> np.ndarray:
    """Return quaternions (w, x, y, z) of bytes for x, y and z; w ≥ 0 makes up their length."""
    xyz = turn.reshape(-1, 3) / 127.5 - 1
    w = np.sqrt(np.maximum(0, 1 - (xyz**2).sum(axis=1)))
    return np.concatenate([w[:, None], xyz], axis=1).astype(np.float32)


def _decode_smallest_three(turn: np.ndarray) -> np.ndarray:
    """Return quaternions (w, x, y, z) of numbers of 2 bits and 3 times a sign and 9 bits.

    The first says which of x, y, z, w is the largest; then come the others over sqrt 1/2.
    """
    number = turn.view("<u4") if len(turn) else np.zeros(0, np.uint32)
    parts = np.stack([(number >> shift) & 0x3FF for shift in (20, 10, 0)], axis=1)
    size = (parts & 0x1FF) / 0x1FF * np.sqrt(0.5)
    others = np.where(parts & 0x200, -size, size)
    largest = np.sqrt(np.maximum(0, 1 - (others**2).sum(axis=1)))
    four = np.concatenate([largest[:, None], others], axis=1)
    # For each largest one (x, y, z, w), where among (largest, a, b, c) are w, x, y, z.
    orders = np.array([[3, 0, 1, 2], [3, 1, 0, 2], [3, 1, 2, 0], [0, 1, 2, 3]])
    return np.take_along_axis(four, orders[number >> 30], axis=1).astype(np.float32)

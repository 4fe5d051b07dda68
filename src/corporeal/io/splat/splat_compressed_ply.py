"""Gaussians as compressed PLY, as PlayCanvas' tools (SuperSplat, SplatTransform) write it.

Chunks of 256 Gaussians share bounds of place, of the logarithm of scale, and, in newer files, of colour. Within them a
Gaussian is four numbers of 32 bits: place 11-10-11 bits, rotation 2-10-10-10 (which component is the largest, then the
three others over sqrt 2, in the order w x y z), scale 11-10-11, and colour with opacity 8-8-8-8. The element "sh" has
f_rest_* as bytes over -4 … 4.
"""

from pathlib import Path

import numpy as np

from corporeal.core.errors import BadFileError
from corporeal.core.types import Gaussians
from corporeal.geometry.spherical_harmonics import SH_DC_COEFFICIENT
from corporeal.io.ply_container import COPY_AGAIN_ADVICE, PlyColumns, read_ply_elements
from corporeal.io.splat.splat_ply import exponential, gaussians_from_vertices, sh_rest_coefficients, stack_columns

GAUSSIANS_PER_CHUNK = 256
PACKED_PROPERTIES = ["packed_position", "packed_rotation", "packed_scale", "packed_color"]
MAX_SH_REST_COEFFICIENT = 4.0
"""Largest coefficient above band 0."""
COMPONENT_ORDER_OF_LARGEST = np.array([[0, 1, 2, 3], [1, 0, 2, 3], [1, 2, 0, 3], [1, 2, 3, 0]])
"""For each largest component (w, x, y, z), where among (largest, a, b, c) each component stands."""


def read_splat_ply(path: Path, data: memoryview) -> Gaussians:
    """Return the Gaussians of a PLY as it says them, compressed or in INRIA's layout, unchecked.

    Raises:
        BadFileError: It is broken, or its vertices are no Gaussians.
    """
    elements = read_ply_elements(path, data)
    if is_compressed_ply(elements):
        return gaussians_from_chunks(path, elements)
    return gaussians_from_vertices(path, elements.get("vertex", {}))


def is_compressed_ply(elements: dict[str, PlyColumns]) -> bool:
    """Tell a compressed file by its elements."""
    return "chunk" in elements and PACKED_PROPERTIES[0] in elements.get("vertex", {})


def gaussians_from_chunks(path: Path, elements: dict[str, PlyColumns]) -> Gaussians:
    """Return the Gaussians as the file says them, unchecked.

    Raises:
        BadFileError: A property is missing, or chunks and Gaussians don't fit together.
    """
    chunks, vertices = elements["chunk"], elements["vertex"]
    sides = [f"{end}_{axis}" for end in ("min", "max") for axis in "xyz"]
    sizes = [f"{end}_scale_{axis}" for end in ("min", "max") for axis in "xyz"]
    missing = [n for n in (*sides, *sizes) if n not in chunks]
    missing += [n for n in PACKED_PROPERTIES if n not in vertices]
    if missing:
        raise BadFileError(path, f"is a compressed splat that lacks {', '.join(missing)}.", COPY_AGAIN_ADVICE)
    count = len(vertices[PACKED_PROPERTIES[0]])
    if len(chunks["min_x"]) != -(-count // GAUSSIANS_PER_CHUNK):
        what = f"has {len(chunks['min_x'])} chunks of {GAUSSIANS_PER_CHUNK} for {count:,} Gaussians."
        raise BadFileError(path, what, COPY_AGAIN_ADVICE)
    place, turn, size, colour = (vertices[n].astype(np.uint32) for n in PACKED_PROPERTIES)
    shades = _bit_fields(colour, (8, 8, 8, 8))
    return Gaussians(
        mean=_interpolate_in_chunks(chunks, sides, _bit_fields(place, (11, 10, 11))),
        rotation=unpacked_rotation(turn),
        scale=exponential(_interpolate_in_chunks(chunks, sizes, _bit_fields(size, (11, 10, 11)))),
        opacity=shades[:, 3].astype(np.float32),
        sh=np.concatenate(
            [
                ((_chunk_colours(chunks, shades[:, :3]) - 0.5) / SH_DC_COEFFICIENT)[:, None],
                _sh_rest_coefficients(path, elements, count),
            ],
            axis=1,
        ).astype(np.float32),
    )


def unpacked_rotation(turn: np.ndarray) -> np.ndarray:
    """Return quaternions (w, x, y, z) of numbers of 2-10-10-10 bits."""
    others = (_bit_fields(turn & 0x3FFFFFFF, (2, 10, 10, 10))[:, 1:] - 0.5) * np.sqrt(2)
    largest = np.sqrt(np.maximum(0, 1 - (others**2).sum(axis=1)))
    four = np.concatenate([largest[:, None], others], axis=1)
    return np.take_along_axis(four, COMPONENT_ORDER_OF_LARGEST[turn >> 30], axis=1).astype(np.float32)


def _bit_fields(numbers: np.ndarray, bits: tuple[int, ...]) -> np.ndarray:
    """Return the parts of each number, the highest first, as shares of their range in [0, 1]."""
    shift = 32
    parts = []
    for width in bits:
        shift -= width
        top = (1 << width) - 1
        parts.append(((numbers >> shift) & top) / top)
    return np.stack(parts, axis=-1)


def _interpolate_in_chunks(chunks: PlyColumns, names: list[str], shares: np.ndarray) -> np.ndarray:
    """Return values at shares of the way between the bounds of their chunks (N, 3)."""
    bounds = stack_columns(chunks, names).astype(np.float64)
    bounds = np.repeat(bounds, GAUSSIANS_PER_CHUNK, axis=0)[: len(shares)]
    low, high = np.split(bounds, 2, axis=1)
    return (low * (1 - shares) + high * shares).astype(np.float32)


def _chunk_colours(chunks: PlyColumns, shares: np.ndarray) -> np.ndarray:
    names = [f"{end}_{channel}" for end in ("min", "max") for channel in "rgb"]
    return _interpolate_in_chunks(chunks, names, shares) if all(n in chunks for n in names) else shares


def _sh_rest_coefficients(path: Path, elements: dict[str, PlyColumns], count: int) -> np.ndarray:
    """Return the coefficients above band 0: the middles of 256 steps, the outer ones at the ends.

    The middle of step b is (b + 1/2) / 256 of the way.
    """
    if "sh" not in elements:
        return np.zeros((count, 0, 3), np.float32)
    values = sh_rest_coefficients(path, elements["sh"])
    if len(values) != count:
        raise BadFileError(path, f"has harmonics for {len(values):,} of {count:,}.", COPY_AGAIN_ADVICE)
    share = np.where(values == 0, 0, np.where(values == 255, 1, (values + 0.5) / 256))
    return (share - 0.5) * 2 * MAX_SH_REST_COEFFICIENT

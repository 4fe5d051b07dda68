"""Triangulation of binary PLY faces of mixed size.

Blender, MeshLab and others write such files; the reader of meshes takes all faces of a file to have as many corners as
the first. Turk, "The PLY Polygon File Format" (1994).
"""

import itertools
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Int

from corporeal.core.errors import BadFileError
from corporeal.io.ply_container import (
    BYTE_ORDER_OF_PLY_FORMAT,
    COPY_AGAIN_ADVICE,
    DTYPE_OF_PLY_TYPE,
    MAX_PLY_HEADER_BYTES,
)

FACE_INDEX_PROPERTIES = ("vertex_indices", "vertex_index")
BYTE_ORDER_NAMES: dict[str, Literal["little", "big"]] = {"<": "little", ">": "big"}


@dataclass(frozen=True)
class FaceProperty:
    """A number of each face, or a list of them."""

    name: str
    kind: str
    """Of the number, or of those in the list: NumPy's, with its byte order."""
    counted: str = ""
    """Kind of a list's length; empty: it is no list."""


@dataclass(frozen=True)
class FaceLayout:
    """Where the faces of a file stand."""

    head: tuple[str, ...]
    """Lines of the header before them."""
    body: int
    """Where the header ends [bytes]."""
    start: int
    """Where they begin [bytes]."""
    count: int
    properties: tuple[FaceProperty, ...]


def triangulate_mixed_faces(path: Path, data: memoryview) -> tuple[bytes, tuple[str, ...]]:
    """Return the file with triangles in place of faces that differ, and what it loses by that.

    Files in text, and those whose faces are all alike, are returned as they are.

    Raises:
        BadFileError: It ends within its faces.
    """
    faces = _find_faces(data)
    if faces is None or _are_rows_equal(data, faces):
        return bytes(data), ()
    at, long = _corner_places(path, data, faces)
    corners = next(p for p in faces.properties if p.name in FACE_INDEX_PROPERTIES)
    triangles = _fan_triangles(data, corners.kind, at, long).astype(corners.kind[0] + "i4")
    words = [*faces.head, f"element face {len(triangles)}"]
    words += ["property list uchar int vertex_indices", "end_header\n"]
    rows = np.zeros(len(triangles), [("long", "u1"), ("corners", triangles.dtype, 3)])
    rows["long"], rows["corners"] = 3, triangles
    places = bytes(data[faces.body : faces.start])
    lost = [p.name for p in faces.properties if p is not corners]
    said = (f"what faces state beside their corners ({', '.join(lost)})",) if lost else ()
    return "\n".join(words).encode("latin-1") + places + rows.tobytes(), said


def _find_faces(data: memoryview) -> FaceLayout | None:
    """Return where faces stand; None where it is in text, has none, or is for others to refuse."""
    head = bytes(data[:MAX_PLY_HEADER_BYTES])
    end = re.search(rb"^end_header[ \t]*\r?\n", head, re.MULTILINE)
    lines = head[: end.start()].decode("latin-1").splitlines() if end else []
    words = [line.split() for line in lines]
    order = next((BYTE_ORDER_OF_PLY_FORMAT.get(w[1], "") for w in words if w[:1] == ["format"] and len(w) > 1), "")
    begins = [k for k, w in enumerate(words) if w[:1] == ["element"]] + [len(words)]
    at = end.end() if end else 0
    for k, following in itertools.pairwise(begins if order else []):
        properties = [_parse_property(w, order) for w in words[k + 1 : following] if w[:1] == ["property"]]
        known = [p for p in properties if p is not None]
        if len(known) < len(properties) or len(words[k]) != 3 or not words[k][2].isdecimal():
            return None
        count = int(words[k][2])
        if words[k][1] == "face":
            there = any(p.counted and p.name in FACE_INDEX_PROPERTIES for p in known)
            there = there and 0 < count <= len(data) - at
            body = end.end() if end else 0
            return FaceLayout(tuple(lines[:k]), body, at, count, tuple(known)) if there else None
        if any(p.counted for p in known):
            return None
        at += count * sum(np.dtype(p.kind).itemsize for p in known)
    return None


def _parse_property(words: list[str], order: str) -> FaceProperty | None:
    """Return what a line of the header states; None where it states nothing that is known."""
    match words:
        case [_, "list", counted, kind, name] if {counted, kind} <= DTYPE_OF_PLY_TYPE.keys():
            return FaceProperty(name, order + DTYPE_OF_PLY_TYPE[kind], order + DTYPE_OF_PLY_TYPE[counted])
        case [_, kind, name] if kind in DTYPE_OF_PLY_TYPE:
            return FaceProperty(name, order + DTYPE_OF_PLY_TYPE[kind])
    return None


def _are_rows_equal(data: memoryview, faces: FaceLayout) -> bool:
    """Return whether all rows are as long as the first, list by list."""
    row, at = [], faces.start
    for k, p in enumerate(faces.properties):
        long = 1
        if p.counted:
            ahead = data[at : at + np.dtype(p.counted).itemsize]
            long = int.from_bytes(ahead, BYTE_ORDER_NAMES[p.counted[0]])
            row.append((f"long {k}", p.counted))
            at += len(ahead)
        if long * np.dtype(p.kind).itemsize > len(data):
            return False
        row.append((f"of {k}", p.kind, (long,)))
        at += long * np.dtype(p.kind).itemsize
    kind = np.dtype(row)
    if faces.start + faces.count * kind.itemsize > len(data):
        return False
    rows = np.frombuffer(data, kind, faces.count, faces.start)
    return all((rows[n] == rows[n][0]).all() for n in kind.names or () if n.startswith("long"))


def _corner_places(
    path: Path, data: memoryview, faces: FaceLayout
) -> tuple[Int[np.ndarray, " F"], Int[np.ndarray, " F"]]:
    """Return for each face where its corners stand [bytes], and how many they are."""
    steps = [
        (p.name in FACE_INDEX_PROPERTIES, np.dtype(p.kind).itemsize, np.dtype(p.counted or "u1").itemsize, p)
        for p in faces.properties
    ]
    at, places, longs = faces.start, [], []
    for _ in range(faces.count):
        for corners, size, width, p in steps:
            long = 1
            if p.counted:
                long = int.from_bytes(data[at : at + width], BYTE_ORDER_NAMES[p.counted[0]])
                at += width
            if corners:
                places.append(at)
                longs.append(long)
            at += long * size
        if at > len(data):
            raise BadFileError(path, "cannot be read as PLY (it ends within its faces).", COPY_AGAIN_ADVICE)
    return np.array(places), np.array(longs)


def _fan_triangles(
    data: memoryview, kind: str, at: Int[np.ndarray, " F"], long: Int[np.ndarray, " F"]
) -> Int[np.ndarray, "T 3"]:
    """Return triangles about the first corner of each face."""
    raw, size, fans = np.frombuffer(data, np.uint8), np.dtype(kind).itemsize, []
    for n in np.unique(long[long >= 3]):
        places = at[long == n][:, None] + np.arange(n * size)
        corners = np.ascontiguousarray(raw[places]).view(kind).astype(np.int64)
        ring = [corners[:, [0, k, k + 1]] for k in range(1, n - 1)]
        fans.append(np.stack(ring, axis=1).reshape(-1, 3))
    return np.concatenate(fans) if fans else np.zeros((0, 3), np.int64)

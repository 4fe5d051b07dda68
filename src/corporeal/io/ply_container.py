"""PLY as a container: elements with columns of numbers, in text or in bytes of either order.

Turk, "The PLY Polygon File Format" (1994). Lists (the faces of meshes) are not read, nor is what comes after them.
"""

import io
import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NoReturn

import numpy as np

from corporeal.core.errors import BadFileError

PlyColumns = dict[str, np.ndarray]
"""The properties of one element, by name, (count,) each."""

DTYPE_OF_PLY_TYPE = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "i2",
    "int16": "i2",
    "ushort": "u2",
    "uint16": "u2",
    "int": "i4",
    "int32": "i4",
    "uint": "u4",
    "uint32": "u4",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}
BYTE_ORDER_OF_PLY_FORMAT = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
MAX_PLY_HEADER_BYTES = 2**16
"""[bytes]"""
PlyKind = Literal["splat", "mesh", "points"]
SPLAT_PLY_PROPERTIES = frozenset((b"f_dc_0", b"opacity", b"scale_0", b"rot_0"))
"""Properties of a vertex that make it a Gaussian (INRIA's layout)."""
COPY_AGAIN_ADVICE = "Copy or download it again."
PLY_EXPORT_ADVICE = "Export it again."


@dataclass(frozen=True)
class PlyElement:
    """Header of one element."""

    name: str
    count: int
    properties: tuple[tuple[str, str], ...]
    """Name and type of each, in order; a list has the type "list"."""

    @property
    def flat(self) -> bool:
        """Whether it holds no lists."""
        return all(kind != "list" for _, kind in self.properties)


def read_ply_elements(path: Path, data: memoryview) -> dict[str, PlyColumns]:
    """Return the elements before the first one that holds lists, by name.

    Raises:
        BadFileError: It is no PLY, or it ends before its header says.
    """
    order, elements, start = _parse_header(path, data)
    body = _TextBody(path, data[start:]) if not order else _BinaryBody(path, data[start:], order)
    found: dict[str, PlyColumns] = {}
    for element in elements:
        if not element.flat:
            break
        found[element.name] = body.take(element)
    return found


def kind_of_ply(data: bytes | memoryview) -> PlyKind:
    """Tell by its header what a PLY file holds; one that cannot be read is taken for a splat."""
    head, complete, _ = bytes(data[:MAX_PLY_HEADER_BYTES]).partition(b"end_header")
    if not complete:
        return "splat"
    rows = [line.split() for line in head.splitlines()]
    counts = {r[1]: r[2] for r in rows if len(r) == 3 and r[0] == b"element"}
    if b"chunk" in counts or SPLAT_PLY_PROPERTIES <= {r[-1] for r in rows if r[:1] == [b"property"]}:
        return "splat"
    filled = any(counts.get(name, b"0") != b"0" for name in (b"face", b"tristrips"))
    return "mesh" if filled else "points"


def is_mesh_ply(data: bytes | memoryview) -> bool:
    """Whether a PLY file holds faces."""
    return kind_of_ply(data) == "mesh"


def is_splat_ply(data: bytes | memoryview) -> bool:
    """Whether a PLY file holds Gaussians, or has no complete header."""
    return kind_of_ply(data) == "splat"


def format_ply_header(properties: list[str], count: int, comment: str) -> bytes:
    """Return the header of a little-endian file of one element of floats, "vertex"."""
    lines = ["ply", "format binary_little_endian 1.0", f"comment {comment}"]
    lines += [f"element vertex {count}", *(f"property float {p}" for p in properties)]
    return ("\n".join([*lines, "end_header"]) + "\n").encode("ascii")


def _parse_header(path: Path, data: memoryview) -> tuple[str, list[PlyElement], int]:
    """Return byte order ("": text), elements, and where the body begins."""
    head = bytes(data[:MAX_PLY_HEADER_BYTES])
    end = re.search(rb"^end_header[ \t]*\r?\n", head, re.MULTILINE)
    if not head.startswith(b"ply") or end is None:
        raise BadFileError(path, "has no complete PLY header.", PLY_EXPORT_ADVICE)
    lines = head[: end.start()].decode("latin-1").splitlines()
    words = [line.split() for line in lines[1:]]
    words = [w for w in words if w and w[0] not in ("comment", "obj_info")]
    order = next((BYTE_ORDER_OF_PLY_FORMAT.get(w[1]) for w in words if w[0] == "format" and len(w) > 1), None)
    if order is None:
        raise BadFileError(path, "its PLY header states no known format.", PLY_EXPORT_ADVICE)
    elements: list[PlyElement] = []
    for line in words:
        if line[0] == "element":
            elements.append(_parse_element(path, line))
        elif line[0] == "property" and elements:
            elements[-1] = _with_property(path, elements[-1], line)
    return order, elements, end.end()


def _parse_element(path: Path, words: list[str]) -> PlyElement:
    if len(words) != 3 or not re.fullmatch(r"\d{1,18}", words[2]):
        raise BadFileError(path, f"its header is bad: {' '.join(words)[:80]!r}.", PLY_EXPORT_ADVICE)
    return PlyElement(words[1], int(words[2]), ())


def _with_property(path: Path, element: PlyElement, words: list[str]) -> PlyElement:
    kind = "list" if words[1:2] == ["list"] else DTYPE_OF_PLY_TYPE.get(words[1]) if len(words) == 3 else None
    if kind is None or words[-1] in dict(element.properties):
        raise BadFileError(path, f"its header is bad: {' '.join(words)[:80]!r}.", PLY_EXPORT_ADVICE)
    return PlyElement(element.name, element.count, (*element.properties, (words[-1], kind)))


class _BinaryBody:
    """Elements one after the other, as bytes."""

    def __init__(self, path: Path, data: memoryview, order: str) -> None:
        self.path, self.data, self.order, self.at = path, data, order, 0

    def take(self, element: PlyElement) -> PlyColumns:
        kind = np.dtype([(name, self.order + code) for name, code in element.properties])
        size = element.count * kind.itemsize
        left = len(self.data) - self.at
        if size > left:
            there = left // max(kind.itemsize, 1)
            _truncated_error(self.path, element, there)
        rows = np.frombuffer(self.data, kind, element.count if size else 0, self.at)
        self.at += size
        return {name: rows[name].astype(code) for name, code in element.properties}


class _TextBody:
    """Elements one after the other, as numbers between white space."""

    def __init__(self, path: Path, data: memoryview) -> None:
        self.path, self.stream = path, io.BytesIO(data)

    def take(self, element: PlyElement) -> PlyColumns:
        width = len(element.properties)
        if element.count * width > len(self.stream.getbuffer()):
            _truncated_error(self.path, element, None)
        lines = b" ".join(self._line() for _ in range(element.count))
        numbers = _numbers(lines) if width else np.zeros(0)
        if len(numbers) != element.count * width:
            _truncated_error(self.path, element, len(numbers) // max(width, 1))
        rows = numbers.reshape(element.count, width)
        with np.errstate(invalid="ignore", over="ignore"):
            return {n: rows[:, k].astype(code) for k, (n, code) in enumerate(element.properties)}

    def _line(self) -> bytes:
        """Return the next line that isn't empty; at the end of the file, an empty one."""
        for line in self.stream:
            if line.strip():
                return line.strip()
        return b""


def _numbers(text: bytes) -> np.ndarray:
    """Return the numbers; none or some of them, where a word is none."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # older NumPy stops with a warning
        try:
            return np.fromstring(text, sep=" ", dtype=np.float64)
        except ValueError:
            return np.zeros(0)


def _truncated_error(path: Path, element: PlyElement, there: int | None) -> NoReturn:
    count = "fewer" if there is None else f"{there:,}"
    what = f"{count} of the {element.count:,} rows of {element.name!r} are there."
    raise BadFileError(path, what, COPY_AGAIN_ADVICE)

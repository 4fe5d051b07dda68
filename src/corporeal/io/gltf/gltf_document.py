"""Validated access to the JSON of a glTF file.

Every look-up goes through an ``GltfEntry``, which knows its place in the JSON, so that any
complaint names it ("/meshes/0/primitives/1"). Nothing is allocated by a size that the file merely
claims.
Facts: glTF 2.0 specification, section 3 (concepts), Khronos Group 2021.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NoReturn

from corporeal.core.errors import BadFileError
from corporeal.core.types import Note, NoteKind
from corporeal.io.gltf.gltf_container import (
    GLTF_EXPORT_ADVICE,
    MAX_MODEL_FILE_BYTES,
    parse_strict_json,
    read_file_bytes,
    split_glb,
)
from corporeal.io.referenced_files import decode_data_uri, path_beside, read_beside

MAX_UNPACKED_ROWS = 60_000_000
"""Indices, vertices and triangles together that are unpacked from one file, copies included;
about 10 million triangles, or 4 GB while it is read."""


@dataclass(frozen=True)
class GltfEntry:
    """One JSON object and where it stands."""

    document: "GltfDocument"
    value: dict
    pointer: str

    def fail(self, what: str, next_step: str = GLTF_EXPORT_ADVICE) -> NoReturn:
        """Reject the file because of this entry."""
        where = f"at {self.pointer}: " if self.pointer else ""
        raise BadFileError(self.document.path, where + what, next_step)

    def has(self, key: str) -> bool:
        """Return whether the file says anything under the key."""
        return key in self.value

    def whole(self, key: str, default: int | None = None, most: int = 2**32) -> int:
        """Return a whole number in [0, most]."""
        x = self.value.get(key, default)
        if x is None:
            self.fail(f"{key!r} is missing.")
        if isinstance(x, float) and x.is_integer():
            x = int(x)
        if not isinstance(x, int) or isinstance(x, bool) or not 0 <= x <= most:
            self.fail(f"{key!r} is {_shown(x)}, not a whole number from 0 to {most}.")
        return x

    def number(self, key: str, default: float) -> float:
        """Return a finite number."""
        return self._finite(key, self.value.get(key, default))

    def numbers(self, key: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """Return as many finite numbers as the default has."""
        x = self.value.get(key, default)
        if not isinstance(x, list | tuple) or len(x) != len(default):
            self.fail(f"{key!r} is not a list of {len(default)} numbers.")
        return tuple(self._finite(key, v) for v in x)

    def _finite(self, key: str, x: Any) -> float:
        number = isinstance(x, int | float) and not isinstance(x, bool)
        if not number or abs(x) > 1e300 or not math.isfinite(x):
            self.fail(f"{key!r} holds {_shown(x)}, not a finite number.")
        return float(x)

    def flag(self, key: str) -> bool:
        """Return whether the file says a plain true."""
        return self.value.get(key) is True

    def text(self, key: str, default: str = "") -> str:
        """Return a word or sentence; what is no text counts as absent, as names carry no shape."""
        x = self.value.get(key, default)
        return x if isinstance(x, str) else default

    def child(self, key: str) -> "GltfEntry | None":
        """Return the JSON object under the key, or None where there is none."""
        if key not in self.value:
            return None
        x = self.value[key]
        if not isinstance(x, dict):
            self.fail(f"{key!r} is {_shown(x)}, not a JSON object.")
        return GltfEntry(self.document, x, f"{self.pointer}/{key}")

    def needed(self, key: str) -> "GltfEntry":
        """Return the JSON object under the key, which must be there."""
        return self.child(key) or self.fail(f"{key!r} is missing.")

    def children(self, key: str) -> "list[GltfEntry]":
        """Return the list of JSON objects under the key."""
        items = self.sequence(key)
        place = f"{self.pointer}/{key}"
        for k, x in enumerate(items):
            if not isinstance(x, dict):
                self.fail(f"{key}/{k} is {_shown(x)}, not a JSON object.")
        return [GltfEntry(self.document, x, f"{place}/{k}") for k, x in enumerate(items)]

    def sequence(self, key: str) -> list:
        """Return the list under the key, empty where there is none."""
        x = self.value.get(key, [])
        if not isinstance(x, list):
            self.fail(f"{key!r} is {_shown(x)}, not a list.")
        return x

    def extension(self, name: str) -> "GltfEntry | None":
        """Return what an extension adds to this entry."""
        extensions = self.child("extensions")
        return extensions.child(name) if extensions else None

    def refer(self, key: str, group: str) -> "GltfEntry | None":
        """Follow an index into one of the file's lists; None where the key is absent."""
        if key not in self.value:
            return None
        k = self.whole(key)
        entries = self.document.entries(group)
        if k >= len(entries):
            self.fail(f"{key!r} points to {group}/{k}, but there are only {len(entries)}.")
        return entries[k]


def _shown(x: Any) -> str:
    text = "an object" if isinstance(x, dict) else repr(x)
    return text if len(text) <= 40 else text[:37] + "…"


class GltfDocument:
    """An opened file: its JSON, its binary chunk, and what was found odd on the way."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.warnings: list[str] = []
        self.rows_left = MAX_UNPACKED_ROWS
        data = read_file_bytes(path)
        text, self.chunk = split_glb(path, data) if data[:4] == b"glTF" else (data, None)
        self.root = GltfEntry(self, parse_strict_json(path, bytes(text)), "")
        self._lists: dict[str, list[GltfEntry]] = {}
        self._buffers: dict[str, memoryview] = {}
        self._check_version()

    @property
    def folder(self) -> Path:
        """Where the file's companions may lie."""
        return self.path.parent

    def warn(self, sentence: str, kind: NoteKind = NoteKind.DOUBT) -> None:
        """Remember, once, something a reader of the report should know."""
        warning = Note(f"{self.path.name}: {sentence}", kind)
        if warning not in self.warnings:
            self.warnings.append(warning)

    def warn_of(self, what: str, problem: BadFileError) -> None:
        """Remember that something was left out, and the problem behind it."""
        reason = str(problem).removeprefix(f"{self.path}: ").removesuffix(GLTF_EXPORT_ADVICE).strip()
        self.warn(f"{what} is left out: {reason}", NoteKind.LEFT_OUT)

    def spend(self, entry: GltfEntry, rows: int) -> None:
        """Count the rows to be unpacked: a small file can ask for the same ones a million times."""
        self.rows_left -= rows
        if self.rows_left < 0:
            entry.fail(
                f"the file asks for more than {MAX_UNPACKED_ROWS // 10**6} million vertices and indices.",
                "Simplify the model first.",
            )

    def entries(self, group: str) -> list[GltfEntry]:
        """Return one of the top-level lists."""
        if group not in self._lists:
            self._lists[group] = self.root.children(group)
        return self._lists[group]

    @cached_property
    def required(self) -> list[str]:
        """Names of the extensions without which the file means something else."""
        return [x for x in self.root.sequence("extensionsRequired") if isinstance(x, str)]

    def view(self, entry: GltfEntry) -> memoryview:
        """Return the bytes of a buffer view."""
        if entry.extension("EXT_meshopt_compression"):
            entry.fail(
                "the mesh is compressed with EXT_meshopt_compression, which is not supported.",
                "Unpack it first, for example with: gltf-transform copy in.glb out.glb.",
            )
        buffer = entry.refer("buffer", "buffers") or entry.fail("'buffer' is missing.")
        data = self.buffer(buffer)
        start, length = entry.whole("byteOffset", 0), entry.whole("byteLength")
        if start + length > len(data):
            entry.fail(f"needs bytes {start} to {start + length}, but there are only {len(data)}.")
        return data[start : start + length]

    def buffer(self, entry: GltfEntry) -> memoryview:
        """Return the bytes of a buffer: of the file itself, beside it, or within the JSON."""
        if entry.pointer not in self._buffers:
            self._buffers[entry.pointer] = self._load_buffer(entry)
        return self._buffers[entry.pointer]

    def _load_buffer(self, entry: GltfEntry) -> memoryview:
        length = entry.whole("byteLength")
        if entry.has("uri"):
            data = self.resource(entry)
        elif self.chunk is not None and entry.pointer == "/buffers/0":
            data = self.chunk
        else:
            entry.fail("has no 'uri', and the file has no binary chunk for it.")
        if length > len(data):
            entry.fail(f"claims {length} bytes, but there are only {len(data)}.")
        return data[:length]

    def resource(self, entry: GltfEntry) -> memoryview:
        """Return the bytes that an entry's ``uri`` names; never from outside the folder."""
        uri = entry.value["uri"]
        if not isinstance(uri, str):
            entry.fail("'uri' is not a text.")
        try:
            if uri[:5].lower() == "data:":
                return memoryview(decode_data_uri(uri))
            return memoryview(read_beside(self.folder, uri, MAX_MODEL_FILE_BYTES))
        except ValueError as problem:
            entry.fail(f"{problem}.", "Keep the file's companions beside it, or use a .glb.")

    def _check_version(self) -> None:
        asset = self.root.child("asset")
        version = asset.text("version") if asset else ""
        if version and not version.startswith("2."):
            self.root.fail(
                f"the file is glTF {version[:8]}; glTF 2.0 is needed.",
                "Convert it, for example with Blender or gltf-pipeline.",
            )
        if not version:
            self.warn("does not state its glTF version; read as 2.0.")
        least = asset.text("minVersion") if asset else ""
        if least and least != "2.0":
            self.root.fail(f"the file asks for a reader of glTF {least[:8]}; this one reads 2.0.")


def gltf_companions(path: Path) -> list[Path]:
    """Return the buffers and pictures beside a glTF file.

    Raises:
        BadFileError: Its JSON cannot be read.
    """
    if path.suffix.lower() == ".glb":
        return []
    document = GltfDocument(path)
    uris = [e.text("uri") for e in document.entries("buffers") + document.entries("images")]
    files = [path_beside(path.parent, u) for u in uris if u and u[:5].lower() != "data:"]
    return [f for f in files if f is not None]

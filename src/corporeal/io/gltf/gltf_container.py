"""The JSON and the binary chunk of a glTF file. glTF 2.0, section 4 (GLB)."""

import json
import struct
from pathlib import Path
from typing import NoReturn

from corporeal.core.errors import BadFileError

MAX_MODEL_FILE_BYTES = 2**30
"""Largest file that is opened [bytes]."""
MAX_GLTF_JSON_BYTES = 2**27
"""Largest JSON text [bytes]: Python objects take some thirty times as much memory."""
GLTF_EXPORT_ADVICE = "Export the model again, or check it with the Khronos glTF validator."


def split_glb(path: Path, data: memoryview) -> tuple[memoryview, memoryview | None]:
    """Return the JSON chunk of a GLB and its binary chunk, if any; other chunks are skipped."""
    if len(data) < 20:
        raise BadFileError(path, "the file ends within the GLB header.", GLTF_EXPORT_ADVICE)
    version, length = struct.unpack("<II", data[4:12])
    if version != 2:
        raise BadFileError(path, f"is GLB version {version}, not 2.", GLTF_EXPORT_ADVICE)
    if length > len(data):
        lost = f"the file is cut off: {len(data)} of {length} bytes are there."
        raise BadFileError(path, lost, "Copy or download it again.")
    chunks: dict[bytes, memoryview] = {}
    at = 12
    while at + 8 <= length:
        size, kind = struct.unpack("<I4s", data[at : at + 8])
        if at + 8 + size > length:
            lost = f"the chunk at byte {at} runs past the end."
            raise BadFileError(path, lost, GLTF_EXPORT_ADVICE)
        chunks.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size + (-size % 4)
    if b"JSON" not in chunks:
        raise BadFileError(path, "the GLB has no JSON chunk.", GLTF_EXPORT_ADVICE)
    return chunks[b"JSON"], chunks.get(b"BIN\0")


def pack_glb(document: dict, binary: bytes | bytearray) -> bytes:
    """Return the bytes of a GLB; ``document`` gets its one buffer by the way.

    Raises:
        ValueError: A number in the document is NaN or infinite, which JSON cannot say.
    """
    chunk = bytes(binary) + b"\0" * (-len(binary) % 4)
    if chunk:
        document["buffers"] = [{"byteLength": len(chunk)}]
    text = json.dumps(document, allow_nan=False, separators=(",", ":")).encode()
    chunks = [(b"JSON", text + b" " * (-len(text) % 4))]
    if chunk:
        chunks.append((b"BIN\0", chunk))
    body = b"".join(struct.pack("<I4s", len(data), kind) + data for kind, data in chunks)
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def read_file_bytes(path: Path) -> memoryview:
    """Return a file's bytes, or say why they can't be had."""
    if not path.exists():
        raise BadFileError(path, "there is no such file.", "Check the path.")
    if not path.is_file():
        raise BadFileError(path, "is not a file.", "Name a .glb or .gltf file.")
    try:
        size = path.stat().st_size
        if size > MAX_MODEL_FILE_BYTES:
            raise BadFileError(path, f"is {size / 2**30:.1f} GiB large.", "At most 1 GiB is read.")
        data = path.read_bytes()
    except OSError as problem:
        raise BadFileError(path, f"cannot be read ({problem.strerror}).") from problem
    if not data:
        raise BadFileError(path, "the file is empty (0 bytes).", "Copy or download it again.")
    return memoryview(data)


def parse_strict_json(path: Path, text: bytes) -> dict:
    """Return the JSON object; NaN and Infinity, which JSON doesn't know, are refused."""
    if len(text) > MAX_GLTF_JSON_BYTES:
        step = "Save the model as .glb, which keeps its arrays outside the JSON."
        raise BadFileError(path, f"its JSON is {len(text) >> 20} MiB large.", step)
    try:
        value = json.loads(text.decode("utf-8-sig"), parse_constant=_refuse_constant)
    except _NotANumberError as problem:
        step = "glTF forbids it: find the broken value in the program that wrote the file."
        raise BadFileError(path, f"its JSON holds a bare {problem}.", step) from None
    except (ValueError, RecursionError) as problem:
        kind = "its JSON cannot be read" if _looks_like_json(text) else "is neither GLB nor glTF"
        step = "Name a .glb or .gltf file."
        raise BadFileError(path, f"{kind} ({_brief(problem)}).", step) from None
    if not isinstance(value, dict):
        raise BadFileError(path, "its JSON is not an object.", GLTF_EXPORT_ADVICE)
    return value


class _NotANumberError(Exception):
    """NaN or Infinity, which JSON doesn't know."""


def _refuse_constant(word: str) -> NoReturn:
    raise _NotANumberError(word)


def _looks_like_json(text: bytes) -> bool:
    return text.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] == b"{"


def _brief(problem: Exception) -> str:
    if isinstance(problem, UnicodeDecodeError):
        return "it is not UTF-8 text"
    if isinstance(problem, RecursionError):
        return "it is nested too deeply"
    return str(problem)[:80]

"""Data that a file refers to: in itself or beside itself, never elsewhere."""

import base64
import binascii
import re
from pathlib import Path
from urllib.parse import unquote, unquote_to_bytes

ABSOLUTE_URI_PATTERN = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:|[/\\]")


def decode_data_uri(uri: str) -> bytes:
    """Return the content of a ``data:`` URI (RFC 2397).

    Raises:
        ValueError: It is broken.
    """
    head, comma, body = uri.partition(",")
    if not comma:
        raise ValueError("the data URI has no content")
    if not head.endswith(";base64"):
        return unquote_to_bytes(body)
    try:
        return base64.b64decode(unquote(body))
    except (binascii.Error, ValueError):
        raise ValueError("the data URI is not valid base64") from None


def path_beside(folder: Path, uri: str) -> Path | None:
    """Return the file that a URI names, if it is one in ``folder`` or below it."""
    if ABSOLUTE_URI_PATTERN.match(uri):
        return None
    try:
        root = folder.resolve()
        path = (root / unquote(uri).replace("\\", "/")).resolve()
        return path if path.is_relative_to(root) and path.is_file() else None
    except (OSError, ValueError):
        return None


def read_beside(folder: Path, uri: str, most: int) -> bytes:
    """Return the content of a file that lies in ``folder`` or below it.

    Raises:
        ValueError: It leads elsewhere, is missing, or is larger than ``most`` bytes.
    """
    path = path_beside(folder, uri)
    if path is None:
        raise ValueError(f"{_shown(uri)} is not there, or leads outside the file's folder")
    try:
        if path.stat().st_size > most:
            raise ValueError(f"{_shown(uri)} is larger than {most >> 20} MiB")
        return path.read_bytes()
    except OSError as problem:
        raise ValueError(f"{_shown(uri)} cannot be read ({problem.strerror})") from None


def _shown(uri: str) -> str:
    return repr(uri if len(uri) <= 80 else uri[:77] + "…")

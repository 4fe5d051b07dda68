"""Unpacking of untrusted zip files of photographs, with limits on the inflated size."""

import re
import stat
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from corporeal.core.errors import BadFileError

MAX_ZIP_ENTRIES = 2_000
"""Most files in a zip."""
MAX_UNPACKED_BYTES = 4 << 30
"""Most bytes that all of them may have."""
MAX_COMPRESSION_RATIO = 100
"""Most times a file may be larger than it is in the zip."""
UNCHECKED_RATIO_BYTES = 1 << 20
"""A file that unpacks to no more is not measured by its ratio [bytes]."""
MAX_FOLDER_DEPTH = 4
"""Most folders in one another."""
ALLOWED_SUFFIXES = (".jpg", ".jpeg", ".png", ".webp", ".tif", ".tiff", ".json", ".txt", ".bin", ".ply")
"""Photographs, and what says where they were taken from."""
NAME_PATTERN = re.compile(r"[\w][\w .()+,=-]{0,118}")
BLOCK_BYTES = 1 << 20
ARCHIVE_ERRORS = (zipfile.BadZipFile, zlib.error, RuntimeError, EOFError, OSError, ValueError)
"""What a damaged archive raises; a packing that ``zipfile`` does not know is a RuntimeError."""


@dataclass
class _UnpackBudget:
    """What may still be unpacked [bytes]."""

    bytes: int


def unpack_zip(source: Path, folder: Path, most: int = MAX_UNPACKED_BYTES) -> int:
    """Unpack photographs with their poses into a new folder; return how many files there are.

    Args:
        source: A zip.
        folder: It must not exist yet; where something is refused it may be left half filled.
        most: Bytes that all files together may have.

    Raises:
        BadFileError: It is no zip, or holds what no set of photographs needs: links, paths that lead out, other
            archives, too many files, or too much in them.
    """
    left = _UnpackBudget(most)
    try:
        with zipfile.ZipFile(source) as archive:
            files = [entry for entry in archive.infolist() if not entry.is_dir()]
            if len(archive.infolist()) > MAX_ZIP_ENTRIES:
                raise BadFileError(source.name, f"has more than {MAX_ZIP_ENTRIES:,} entries.")
            folder.mkdir()
            for entry in files:
                _unpack_one(archive, entry, folder, left, source.name)
    except ARCHIVE_ERRORS as error:
        raise BadFileError(source.name, f"cannot be unpacked ({error}).", "Pack it again.") from error
    if not files:
        raise BadFileError(source.name, "is empty.")
    return len(files)


def _unpack_one(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, folder: Path, left: _UnpackBudget, of: str) -> None:
    path = folder.joinpath(*_places(entry, of))
    if path.exists():
        raise BadFileError(of, "has two files of one name.")
    path.parent.mkdir(parents=True, exist_ok=True)
    allowed = max(MAX_COMPRESSION_RATIO * entry.compress_size, UNCHECKED_RATIO_BYTES)
    written = 0
    with archive.open(entry) as packed, path.open("xb") as file:
        while block := packed.read(BLOCK_BYTES):
            written += len(block)
            left.bytes -= len(block)
            if written > allowed or left.bytes < 0:
                raise BadFileError(of, "unpacks to far more than photographs would.")
            file.write(block)


def _places(entry: zipfile.ZipInfo, of: str) -> tuple[str, ...]:
    """Return an entry's folders and name, which lie below where it is unpacked.

    Raises:
        BadFileError: They don't, or it is nothing that belongs to photographs.
    """
    kind = stat.S_IFMT(entry.external_attr >> 16)
    if kind not in (0, stat.S_IFREG):
        raise BadFileError(of, "holds a link or another special file.")
    if entry.flag_bits & 1:
        raise BadFileError(of, "is encrypted.")
    path = PurePosixPath(entry.filename)
    parts = path.parts
    if "\\" in entry.filename or not parts or len(parts) > MAX_FOLDER_DEPTH:
        raise BadFileError(of, "holds a path that is not understood.")
    if not all(NAME_PATTERN.fullmatch(part) and not part.endswith((" ", ".")) for part in parts):
        raise BadFileError(of, "holds a path that leads elsewhere, or a strange name.")
    if path.suffix.lower() not in ALLOWED_SUFFIXES:
        raise BadFileError(of, f"holds {path.suffix or 'a file without a suffix'}.", "Pack photographs only.")
    return parts

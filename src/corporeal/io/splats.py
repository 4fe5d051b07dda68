"""Trained Gaussian splats of any kind, recognised by what is in the file."""

from dataclasses import replace
from pathlib import Path

from corporeal.core.errors import BadFileError
from corporeal.core.types import Gaussians, Note, NoteKind
from corporeal.geometry.gaussians import Up, placed, sound, upright
from corporeal.io.gltf_container import read_whole
from corporeal.io.ksplat import looks_like_ksplat, read_ksplat
from corporeal.io.ply import AGAIN, read_ply
from corporeal.io.sog import META, ZIP, sog_in_folder, sog_in_zip
from corporeal.io.splat_packed_ply import from_chunks, is_packed
from corporeal.io.splat_ply import from_vertices
from corporeal.io.splat_records import looks_like_records, read_records
from corporeal.io.spz import GZIP, MAGIC, read_spz

KINDS = "PLY (INRIA's layout or compressed), SPZ, SOG, .splat and .ksplat are read."
MOST_BAD = 0.5
"""Share of Gaussians that may be unusable."""


def read_splat(path: Path, up: Up | None = None) -> Gaussians:
    """Read a trained splat.

    Args:
        path: A file, or the folder of an unpacked SOG.
        up: Which axis of the file points up; the result is turned so that +z does. None: it keeps
            the file's own frame. INRIA's layout and all but SPZ usually have "-y", SPZ "+y".

    Raises:
        BadFileError: It is no splat, it is broken, or most of it cannot be used.

    """
    path = Path(path)
    if path.is_dir() and (path / META).is_file():
        path = path / META
    if path.is_dir():
        raise BadFileError(path, "is a folder without the meta.json of a splat.", KINDS)
    raw = _raw(path)
    if not raw.count:
        raise BadFileError(path, "holds no Gaussians.", AGAIN)
    gaussians, left_out = sound(raw)
    lost = raw.count - gaussians.count
    reasons = "; ".join(f"{count:,} {why}" for why, count in left_out.items())
    if lost > MOST_BAD * raw.count:
        what = f"{lost:,} of {raw.count:,} Gaussians cannot be used: {reasons}."
        raise BadFileError(path, what, "Train or export it again.")
    if lost:
        words = Note(
            f"{path.name}: {lost:,} of {raw.count:,} Gaussians were left out: {reasons}.",
            NoteKind.LEFT_OUT,
        )
        gaussians = replace(gaussians, warnings=(*gaussians.warnings, words))
    return gaussians if up is None else placed(gaussians, upright(up))


def _raw(path: Path) -> Gaussians:
    data = read_whole(path)
    if data[:3] == b"ply":
        elements = read_ply(path, data)
        if is_packed(elements):
            return from_chunks(path, elements)
        return from_vertices(path, elements.get("vertex", {}))
    if data[:4] == MAGIC or data[:2] == GZIP:
        return read_spz(path, data)
    if data[:4] == ZIP:
        return sog_in_zip(path, data)
    if bytes(data[:64]).lstrip()[:1] == b"{":
        return sog_in_folder(path)
    return _unmarked(path, data)


def _unmarked(path: Path, data: memoryview) -> Gaussians:
    """Read a kind of file that begins with nothing to know it by."""
    if looks_like_ksplat(data):
        return read_ksplat(path, data)
    if looks_like_records(data):
        return read_records(path, data)
    raise BadFileError(path, "is no Gaussian splat.", KINDS)

"""Trained Gaussian splats of any kind, recognised by what is in the file."""

from dataclasses import replace
from pathlib import Path

from corporeal.core.errors import BadFileError
from corporeal.core.types import Gaussians, Note, NoteKind
from corporeal.geometry.gaussian_transforms import (
    UpAxis,
    drop_invalid_gaussians,
    rotation_to_z_up,
    transform_gaussians,
)
from corporeal.io.gltf.gltf_container import read_file_bytes
from corporeal.io.ply_container import COPY_AGAIN_ADVICE, read_ply_elements
from corporeal.io.splat.ksplat import is_ksplat, read_ksplat
from corporeal.io.splat.sog import SOG_META_FILE, ZIP_SIGNATURE, read_sog_folder, read_sog_zip
from corporeal.io.splat.splat_antimatter15 import is_antimatter15, read_antimatter15
from corporeal.io.splat.splat_compressed_ply import gaussians_from_chunks, is_compressed_ply
from corporeal.io.splat.splat_ply import gaussians_from_vertices
from corporeal.io.splat.spz import GZIP_SIGNATURE, SPZ_SIGNATURE, read_spz

SPLAT_FORMATS_ADVICE = "PLY (INRIA's layout or compressed), SPZ, SOG, .splat and .ksplat are read."
MAX_UNUSABLE_GAUSSIANS_FRACTION = 0.5
"""Share of Gaussians that may be unusable."""


def load_splat(path: Path, up: UpAxis | None = None) -> Gaussians:
    """Read a trained splat.

    Args:
        path: A file, or the folder of an unpacked SOG.
        up: Which axis of the file points up; the result is turned so that +z does. None: it keeps
            the file's own frame. INRIA's layout and all but SPZ usually have "-y", SPZ "+y".

    Raises:
        BadFileError: It is no splat, it is broken, or most of it cannot be used.

    """
    path = Path(path)
    if path.is_dir() and (path / SOG_META_FILE).is_file():
        path = path / SOG_META_FILE
    if path.is_dir():
        raise BadFileError(
            path, "is a folder without the meta.json of a splat.", SPLAT_FORMATS_ADVICE
        )
    raw = _read_by_content(path)
    if not raw.count:
        raise BadFileError(path, "holds no Gaussians.", COPY_AGAIN_ADVICE)
    gaussians, left_out = drop_invalid_gaussians(raw)
    lost = raw.count - gaussians.count
    reasons = "; ".join(f"{count:,} {why}" for why, count in left_out.items())
    if lost > MAX_UNUSABLE_GAUSSIANS_FRACTION * raw.count:
        what = f"{lost:,} of {raw.count:,} Gaussians cannot be used: {reasons}."
        raise BadFileError(path, what, "Train or export it again.")
    if lost:
        words = Note(
            f"{path.name}: {lost:,} of {raw.count:,} Gaussians were left out: {reasons}.",
            NoteKind.LEFT_OUT,
        )
        gaussians = replace(gaussians, warnings=(*gaussians.warnings, words))
    return gaussians if up is None else transform_gaussians(gaussians, rotation_to_z_up(up))


def _read_by_content(path: Path) -> Gaussians:
    data = read_file_bytes(path)
    if data[:3] == b"ply":
        elements = read_ply_elements(path, data)
        if is_compressed_ply(elements):
            return gaussians_from_chunks(path, elements)
        return gaussians_from_vertices(path, elements.get("vertex", {}))
    if data[:4] == SPZ_SIGNATURE or data[:2] == GZIP_SIGNATURE:
        return read_spz(path, data)
    if data[:4] == ZIP_SIGNATURE:
        return read_sog_zip(path, data)
    if bytes(data[:64]).lstrip()[:1] == b"{":
        return read_sog_folder(path)
    return _read_without_signature(path, data)


def _read_without_signature(path: Path, data: memoryview) -> Gaussians:
    """Read a kind of file that begins with nothing to know it by."""
    if is_ksplat(data):
        return read_ksplat(path, data)
    if is_antimatter15(data):
        return read_antimatter15(path, data)
    raise BadFileError(path, "is no Gaussian splat.", SPLAT_FORMATS_ADVICE)

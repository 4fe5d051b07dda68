"""Trained Gaussian splats of any kind, recognised by what is in the file."""

from dataclasses import replace
from pathlib import Path

from corporeal.core.errors import BadFileError
from corporeal.core.registry import load_function
from corporeal.core.types import Gaussians, Note, NoteKind
from corporeal.geometry.gaussian_transforms import UpAxis, drop_invalid_gaussians, rotation_to_z_up, transform_gaussians
from corporeal.io.gltf.gltf_container import read_file_bytes
from corporeal.io.ply_container import COPY_AGAIN_ADVICE
from corporeal.io.registry import reader_of_content, readers_of

MAX_UNUSABLE_GAUSSIANS_FRACTION = 0.5
"""Share of Gaussians that may be unusable."""


def load_splat(path: Path, up: UpAxis | None = None) -> Gaussians:
    """Read a trained splat.

    Args:
        path: A file, or the folder of an unpacked SOG.
        up: Which axis of the file points up; the result is turned so that +z does. None: it keeps the file's own frame.
            INRIA's layout and all but SPZ usually have "-y", SPZ "+y".

    Raises:
        BadFileError: It is no splat, it is broken, or most of it cannot be used.
    """
    path = Path(path)
    path = _file_to_read(path) if path.is_dir() else path
    data = read_file_bytes(path)
    reader = reader_of_content(data, "splat")
    if reader is None:
        raise BadFileError(path, "is no Gaussian splat.", _formats_advice())
    raw = load_function(reader.read)(path, data)
    if not raw.count:
        raise BadFileError(path, "holds no Gaussians.", COPY_AGAIN_ADVICE)
    gaussians, left_out = drop_invalid_gaussians(raw)
    lost = raw.count - gaussians.count
    reasons = "; ".join(f"{count:,} {why}" for why, count in left_out.items())
    if lost > MAX_UNUSABLE_GAUSSIANS_FRACTION * raw.count:
        what = f"{lost:,} of {raw.count:,} Gaussians cannot be used: {reasons}."
        raise BadFileError(path, what, "Train or export it again.")
    if lost:
        words = Note(f"{path.name}: {lost:,} of {raw.count:,} Gaussians were left out: {reasons}.", NoteKind.LEFT_OUT)
        gaussians = replace(gaussians, warnings=(*gaussians.warnings, words))
    return gaussians if up is None else transform_gaussians(gaussians, rotation_to_z_up(up))


def _file_to_read(folder: Path) -> Path:
    """Return the file of an unpacked splat that the others are named in."""
    names = [name for reader in readers_of("splat") for name in reader.folder_files[:1]]
    for name in names:
        if (folder / name).is_file():
            return folder / name
    what = f"is a folder without the {' or '.join(names)} of a splat."
    raise BadFileError(folder, what, _formats_advice())


def _formats_advice() -> str:
    *names, last = (reader.name for reader in readers_of("splat"))
    return f"{', '.join(names)} and {last} are read."

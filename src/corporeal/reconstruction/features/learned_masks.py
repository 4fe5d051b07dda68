"""Masks and instances of photographs by a learned segmentation model."""

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Int, UInt8

from corporeal.core import store
from corporeal.core.errors import BadFileError, UserError
from corporeal.core.progress import Progress, no_progress
from corporeal.io.image_decoder import decode_image
from corporeal.io.photos.image_loader import PosedPhotoFile, exif_quarter_turns_of_file, stored_size
from corporeal.io.photos.mask_files import (
    MASK_RECORD_FILE,
    edited_masks,
    mask_file_names,
    read_mask_record,
    write_instances,
    write_mask,
    write_mask_record,
)
from corporeal.io.photos.posed_photos import INSTANCE_FOLDERS, MASK_FOLDERS, list_posed_photos, read_posed_photos
from corporeal.multiview.epipolar import projection_matrix
from corporeal.multiview.viewed_region import find_viewed_region
from corporeal.reconstruction.features.mask_models import MaskInstance, MaskModel

CAMERA_PICTURE_PX = 64
"""Pictures from which only cameras are wanted are read so small [px]."""
MAX_MODEL_PICTURE_PX = 2048
"""Larger photographs are halved before the model sees them [px]."""


@dataclass(frozen=True)
class LearnedMasks:
    """What came of it."""

    folder: Path
    """Holds ``masks``, and ``instances`` where there are several objects."""
    said: tuple[str, ...]


def learned_masks(
    source: Path,
    folder: Path,
    masker: MaskModel,
    words: Sequence[str],
    progress: Progress = no_progress,
) -> LearnedMasks:
    """Ask a model for masks of posed photographs, and write them where people can correct them.

    Args:
        source: A folder of photographs with poses.
        folder: Gets ``masks``, ``instances`` and ``masks.json``. Those that lie there by the same model are kept, with
            their corrections.
        masker: The model.
        words: What is looked for.
        progress: Called with the fraction done and a description.

    Raises:
        UserError: The photographs or the weights cannot be used, words are missing, or most photographs show nothing
            that was looked for.
    """
    if masker.needs_words and not words:
        raise UserError("These masks are found by words: name the objects with --object-names.")
    made_by = store.result_key("learned masks", masker.name(), [store.path_digest(source), *words])
    record = read_mask_record(folder)
    if record is not None and record.made_by == made_by:
        count = len(edited_masks(folder))
        more = [f"{count} of the masks were corrected manually."] * bool(count)
        return LearnedMasks(folder, (*record.said, *more))
    for name in (MASK_FOLDERS[0], INSTANCE_FOLDERS[0]):
        shutil.rmtree(folder / name, ignore_errors=True)
    (folder / MASK_RECORD_FILE).unlink(missing_ok=True)
    counts = _ask_for_masks(source, folder, masker, words, progress)
    found = np.count_nonzero(counts)
    if found <= len(counts) / 2:
        what = f"{masker.name()} found nothing in {len(counts) - found} of {len(counts)} of them."
        raise BadFileError(source, what, "Choose other words, or other weights.")
    said = (f"Masks of {found} of {len(counts)} photographs were found by {masker.name()}.",)
    write_mask_record(folder, made_by, said)
    return LearnedMasks(folder, said)


def _ask_for_masks(
    source: Path, folder: Path, masker: MaskModel, words: Sequence[str], progress: Progress
) -> list[int]:
    """Ask for every photograph; return how many objects were found in each."""
    shots, middles = list_posed_photos(source).shots, _gaze_points(source)
    counts, several = [], {}
    with store.disk_errors(folder):
        for k, (shot, name) in enumerate(zip(shots, mask_file_names(shots), strict=True)):
            progress(k / len(shots), f"finding objects in photograph {k + 1} of {len(shots)}")
            if shot.name not in middles:
                continue  # whoever reads the photographs says why it cannot be used
            picture = _read_picture(shot)
            column, row = middles[shot.name]
            at = column * picture.shape[1], row * picture.shape[0]
            found = masker.instances(picture, words, at)
            number = number_instances(found, picture.shape[:2])
            counts.append(len(np.unique(number[number > 0])))
            write_mask(folder, name, (number > 0).astype(np.float32))
            several[name] = number
        if max(counts, default=0) > 1:
            for name, number in several.items():
                write_instances(folder, name, number)
    return counts


def number_instances(found: Sequence[MaskInstance], size: tuple[int, int]) -> Int[np.ndarray, "H W"]:
    """Return which object each pixel shows, 1 for the surest; 0: none. Surer ones are in front."""
    number = np.zeros(size, np.int64)
    for k, instance in reversed([*enumerate(found)]):
        number[instance.mask] = k + 1
    return number


def _gaze_points(source: Path) -> dict[str, tuple[float, float]]:
    """Return where each photograph shows what all look at, in shares of width and height."""
    seen = read_posed_photos(source, CAMERA_PICTURE_PX, bare=True)
    centre = np.array([*find_viewed_region(seen.views.cameras).centre, 1.0])
    made = {}
    for name, camera in zip(seen.names, seen.views.cameras, strict=True):
        x, y, depth = projection_matrix(camera) @ centre
        place = np.array([x / depth / camera.width, y / depth / camera.height])
        inside = depth > 0 and bool(((place >= 0) & (place < 1)).all())
        made[name] = (float(place[0]), float(place[1])) if inside else (0.5, 0.5)
    return made


def _read_picture(shot: PosedPhotoFile) -> UInt8[np.ndarray, "H W 3"]:
    assert shot.picture is not None, "it was read"
    picture = decode_image(shot.picture.read_bytes(), MAX_MODEL_PICTURE_PX)[..., :3]
    size = stored_size(shot)
    turned = size is not None and (size[0] > size[1]) != (picture.shape[1] > picture.shape[0])
    return np.ascontiguousarray(np.rot90(picture, exif_quarter_turns_of_file(shot.picture)) if turned else picture)

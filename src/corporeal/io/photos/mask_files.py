"""Mask files: one PNG for each photograph, in its own pixels, editable.

A folder gets ``masks`` (white where objects are), ``instances`` where objects have numbers, and ``masks.json``, which
says what they were made by and what they were when they were made. Edited masks are never overwritten by the same
means.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath

import numpy as np
from jaxtyping import Float32, Int
from PIL import Image

from corporeal.core import store
from corporeal.core.deserialize import from_plain
from corporeal.io.photos.image_loader import PosedPhotoFile, stored_size
from corporeal.io.photos.posed_photos import INSTANCE_FOLDERS, MASK_FOLDERS
from corporeal.multiview.lens_distortion import redistort_image

MASK_RECORD_FILE = "masks.json"
MASK_INSIDE_THRESHOLD_FRACTION = 0.5
"""Of a pixel: from here on it belongs to an object."""
MASK_WHITE_U8 = 255
MAX_INSTANCES = 255
"""Instances that a picture of 8 bits can number."""


@dataclass(frozen=True)
class MaskRecord:
    """What ``masks.json`` holds."""

    made_by: str
    """Names all that the masks depend on."""
    said: tuple[str, ...]
    """How they came about, in sentences."""
    digest_of: dict[str, str]
    """Of every file, as it was written."""
    incomplete: str = ""
    """Why they are not of all that the photographs are of, in a clause; empty: they are."""
    beside: str = ""
    """Objects beside what they show, in sentences; empty: nothing is known of it."""
    contradict: bool = False
    """Whether they are rejected because their outlines contradict each other."""


def mask_file_names(shots: Sequence[PosedPhotoFile]) -> list[str]:
    """Name the mask of each photograph: as the photograph, with its folder where that is needed."""
    stems = Counter(PurePath(shot.name).stem for shot in shots)
    alone = [stems[PurePath(shot.name).stem] == 1 for shot in shots]
    paths = [PurePath(shot.name.lstrip("./")) for shot in shots]
    return [f"{p.stem}.png" if a else f"{p}.png" for p, a in zip(paths, alone, strict=True)]


def mask_in_photo_pixels(inside: Float32[np.ndarray, "H W"], shot: PosedPhotoFile) -> Float32[np.ndarray, "h w"] | None:
    """Return a mask of a straightened, reduced photograph as one of the photograph itself.

    None: the photograph cannot be read.
    """
    size = stored_size(shot)
    if size is None:
        return None
    height, width = inside.shape
    bent = redistort_image(inside, shot.lens(*size).resized(width, height))
    return np.asarray(Image.fromarray(bent).resize(size, Image.Resampling.BILINEAR))


def write_mask(folder: Path, name: str, inside: Float32[np.ndarray, "H W"]) -> None:
    """Write a mask: white where at least half of a pixel is inside."""
    path = folder / MASK_FOLDERS[0] / name
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.uint8(MASK_WHITE_U8) * (inside >= MASK_INSIDE_THRESHOLD_FRACTION)).save(path)


def write_instances(folder: Path, name: str, number: Int[np.ndarray, "H W"]) -> None:
    """Write which instance each pixel shows; 0: none."""
    path = folder / INSTANCE_FOLDERS[0] / name
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(np.minimum(number, MAX_INSTANCES).astype(np.uint8)).save(path)


def write_mask_record(
    folder: Path, made_by: str, said: Sequence[str], incomplete: str = "", beside: str = "", contradict: bool = False
) -> None:
    """Note what lies in the folder now; until then nothing in it counts as made."""
    digests = {str(p.relative_to(folder)): store.path_digest(p) for p in _mask_files(folder)}
    made = MaskRecord(made_by, tuple(said), digests, incomplete, beside, contradict)
    store.write_json(folder / MASK_RECORD_FILE, made)


def read_mask_record(folder: Path) -> MaskRecord | None:
    """Return what was noted; None: nothing."""
    path = folder / MASK_RECORD_FILE
    return from_plain(MaskRecord, store.read_json(path)) if path.exists() else None


def edited_masks(folder: Path) -> dict[str, str]:
    """Return which masks were edited, added or removed since they were made, and digests."""
    record = read_mask_record(folder)
    if record is None:
        return {}
    now = {str(p.relative_to(folder)): store.path_digest(p) for p in _mask_files(folder)}
    gone = {name: "" for name in record.digest_of if name not in now}
    return gone | {n: digest for n, digest in now.items() if record.digest_of.get(n) != digest}


def _mask_files(folder: Path) -> list[Path]:
    return [p for n in (MASK_FOLDERS[0], INSTANCE_FOLDERS[0]) for p in sorted((folder / n).rglob("*.png"))]

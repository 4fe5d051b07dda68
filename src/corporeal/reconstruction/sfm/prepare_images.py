"""Preparation of photographs for pose estimation: orientation, size, duplicates, masks."""

import numbers
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageOps

from corporeal.core import store
from corporeal.core.errors import BadFileError
from corporeal.core.progress import Progress
from corporeal.io.image_decoder import IMAGE_FORMATS, MAX_IMAGE_PIXELS, as_eight_bit_image
from corporeal.io.input_files import nested_images, photos_in_folder, unread_images_note, unused_nested_images_note
from corporeal.io.photos.image_loader import (
    MIN_PHOTOS,
    UnusablePhoto,
    rotated_mask_problem,
    unreadable_reason,
    unusable_photos_notes,
)
from corporeal.io.photos.posed_photos import INSTANCE_FOLDERS, MASK_FOLDERS, find_companion_image, unused_masks_note
from corporeal.recognition.readable_names import safe_name, single_line_text

MAX_PICTURE_PX = 1600
"""Longer side of what points are looked for in [px]."""
MAX_PHOTOGRAPHS = 120
"""Photographs; of more, one is taken of each so many."""
GOLDEN_RATIO_FRACTION = (5**0.5 - 1) / 2
"""Multiples of it, less their whole numbers, fill 0 to 1 evenly and never repeat."""
DUPLICATE_THUMBNAIL_PX = (24, 24)
MAX_DUPLICATE_DIFFERENCE_U8 = 0.5
"""Mean difference of thumbnails, of 255, below which two show the same from the same place."""
MIN_CONTRAST_U8 = 2.0
"""Standard deviation of a thumbnail, of 255, below which there is nothing on it."""
EXIF_IFD_TAG, FOCAL_35MM_TAG = 0x8769, 0xA405
"""Tags of EXIF: where its own tags lie; the focal length as on 35 mm video."""
CAMERA_MAKER_TAGS = (0x010F, 0x0110)
"""Tags of who made a camera, and of its model."""
LENS_TAGS = (FOCAL_35MM_TAG, 0x920A, 0xA20E, 0xA210, 0xA002, 0xA003)
"""Its own tags that say how long a lens is: in mm, and in pixels of a picture so wide and high."""
MAX_TAG_LETTERS = 64
"""Of a tag that is copied, in letters: a camera's name has no more."""
OPAQUE_ALPHA_U8 = 255
"""Alpha of what is not transparent."""
ALPHA_THRESHOLD_U8 = 127
"""Alpha above which it is rather seen than not."""
MAX_ASPECT_RATIO = 2.4
"""Longer side over the shorter, above which a picture is no camera's: videos have 21 : 9. For one of 1600 × 120 a lens
was found that does not exist, and 24 good photographs were refused with it.
"""
JPEG_QUALITY = 95
"""Of JPEG copies."""
IMAGES_FOLDER = "images"
PHOTOGRAPHS_HINT = "Take 40 to 80 photographs of the object from all around."


@dataclass(frozen=True)
class PreparedImages:
    """Photographs as they lie in the folder ``images``."""

    names: tuple[str, ...]
    sizes: tuple[tuple[int, int], ...]
    """Width and height of each [px]."""
    said: tuple[str, ...]
    """What was left out, and why, in sentences."""
    doubled: bool = True
    """Whether points are looked for in pictures of twice their size, too, where small ones are."""
    pairs: tuple[tuple[int, int], ...] | None = None
    """Numbers of pictures that are matched with one another; None: as many as time allows."""
    reduced: tuple[float, ...] = ()
    """Length of each over that of its photograph [-]; none: all were as large."""


def prepare_images(source: Path, folder: Path, progress: Progress) -> PreparedImages:
    """Copy the photographs of a folder, turned as their EXIF says, with their masks.

    Args:
        source: The folder.
        folder: Gets ``images``, and ``masks`` and ``instances`` where there are some.
        progress: Called with the fraction done and a description.

    Raises:
        BadFileError: Too few can be used.
    """
    found = photos_in_folder(source)
    step = max(1, -(-len(found) // MAX_PHOTOGRAPHS))
    taken, bad, twins = spread_selection(found, step), [], 0
    names: dict[str, tuple[int, int]] = {}
    reduced: list[float] = []
    cut_out: dict[str, Image.Image] = {}
    strips = _strip_pictures(taken)
    known = np.zeros((0, *DUPLICATE_THUMBNAIL_PX))
    for number, file in enumerate(taken):
        progress(number / len(taken), "reading photographs")
        try:
            picture, alpha = _read_upright(file, file in strips)
            thumbnail = _thumbnail(picture)
            _check_thumbnail(thumbnail, known, list(names))
            masks = [_find_mask(file, source, kinds, picture.size) for kinds in (MASK_FOLDERS, INSTANCE_FOLDERS)]
        except _UnusablePhotographError as problem:
            bad.append((single_line_text(file.name), str(problem)))
            twins += isinstance(problem, _DuplicatePhotographError)
            continue
        known = np.concatenate([known, thumbnail[None]])
        name = _unique_name(file, set(names))
        names[name] = picture.size
        reduced.append(picture.info["reduced"])
        _write_picture(picture, folder / IMAGES_FOLDER / name)
        for kinds, mask in zip((MASK_FOLDERS, INSTANCE_FOLDERS), masks, strict=True):
            if mask is not None:
                _write_mask(mask, folder / kinds[0] / f"{Path(name).stem}.png")
        if alpha is not None:
            cut_out[name] = alpha
    said = [
        *([f"Of {len(found)} photographs, one in {step} was used."] if step > 1 else []),
        *unusable_photos_notes(len(taken), bad),
        *unread_images_note(found),
        *unused_nested_images_note(source, found),
        *unused_masks_note(source, found),
        *_cropping_note(tuple(names.values())),
        *_write_alphas(cut_out, len(names), folder),
    ]
    _refuse_few(source, len(names), len(taken), bad, twins)
    return PreparedImages(tuple(names), tuple(names.values()), tuple(said), reduced=tuple(reduced))


def spread_selection(found: Sequence[Path], step: int) -> list[Path]:
    """Return one of each so many that follow one another, at no fixed place among them.

    Two cameras, or two objects by turns, would lie at equal steps, and one of them at all places.
    """
    firsts = range(0, len(found), step)
    offsets = (int(step * (k * GOLDEN_RATIO_FRACTION % 1)) for k in range(len(firsts)))
    ends = (min(first + k, len(found) - 1) for first, k in zip(firsts, offsets, strict=True))
    return [found[k] for k in ends]


def _strip_pictures(files: Sequence[Path]) -> set[Path]:
    """Return the pictures that are too long for a camera's, if most are not."""
    long, known = set(), 0
    for file in files:
        if not file.is_file():  # a pipe would be waited for
            continue
        try:
            with Image.open(file, formats=IMAGE_FORMATS) as opened:
                size = opened.size
        except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
            continue  # whoever reads it says why
        known += 1
        if max(size) > MAX_ASPECT_RATIO * min(size):
            long.add(file)
    return long if len(long) < known / 2 else set()


def load_prepared_images(folder: Path) -> PreparedImages:
    """Return what was gathered into a folder before."""
    sizes = {}
    for file in sorted((folder / IMAGES_FOLDER).iterdir()):
        with Image.open(file, formats=IMAGE_FORMATS) as picture:
            sizes[file.name] = picture.size
    return PreparedImages(tuple(sizes), tuple(sizes.values()), ())


def focal_from_exif(picture: Path) -> float:
    """Return the focal length that a picture's EXIF states, as on 35 mm film [mm]; 0: none."""
    with Image.open(picture, formats=IMAGE_FORMATS) as opened:
        stated = opened.getexif().get_ifd(EXIF_IFD_TAG).get(FOCAL_35MM_TAG, 0)
    try:
        return float(stated)
    except (TypeError, ValueError, ZeroDivisionError):
        return 0.0


def count_single_sizes(sizes: Sequence[tuple[int, int]]) -> int:
    """Return how many pictures have a size of their own, if they are most; 0: cameras made them.

    Args:
        sizes: Width and height of each; held upright or level is one size.
    """
    counts = Counter((min(size), max(size)) for size in sizes)
    alone = sum(count == 1 for count in counts.values())
    return alone if alone >= MIN_PHOTOS and alone > len(sizes) / 2 else 0


def _cropping_note(sizes: Sequence[tuple[int, int]]) -> list[str]:
    """Describe what sizes say of how pictures were cropped, if they do."""
    if not (alone := count_single_sizes(sizes)):
        return []
    what = f"{alone} of {len(sizes)} photographs have a size that no other has"
    why = "of a picture that was cropped the middle is not where its lens looked"
    return [f"{what}: {why}, and poses are found less well."]


def _refuse_few(source: Path, good: int, asked: int, bad: list[UnusablePhoto], twins: int) -> None:
    """Reject what shows too little; that some show the same as others says nothing against these.

    Raises:
        BadFileError: Too few are left, or most are broken or blank.
    """
    if good >= max(MIN_PHOTOS, (asked - twins) / 2):
        return
    if not bad:
        count = "1 photograph is" if good == 1 else f"{good} photographs are"
        raise BadFileError(source, f"{count} too few to show an object.", _elsewhere_hint(source) or PHOTOGRAPHS_HINT)
    why = f" The first of the others, {bad[0][0]}, {bad[0][1]}."
    count = f"only {good}" if good else "none"
    what = f"{count} of {asked} photographs can be used.{why}"
    raise BadFileError(source, what, PHOTOGRAPHS_HINT)


def _elsewhere_hint(source: Path) -> str:
    """Return where more pictures lie than in the folder itself; empty: nowhere."""
    own = photos_in_folder(source)
    more = nested_images(source, own)
    if len(more) <= len(own):
        return ""
    return f"{len(more)} more lie in folders of it: name the one that is meant: {more[0].parent}."


class _UnusablePhotographError(Exception):
    """Why one photograph cannot be used, in a clause."""


class _DuplicatePhotographError(_UnusablePhotographError):
    """It shows the same as another, which is used."""


def _read_upright(file: Path, strip: bool = False) -> tuple[Image.Image, Image.Image | None]:
    """Return a photograph turned as it says, reduced, with what it says of its lens; its alpha."""
    if not file.is_file():
        raise _UnusablePhotographError("is no file, or a link to none")
    if strip:
        raise _UnusablePhotographError("is a strip, as a panorama is, which no one lens takes")
    why = unreadable_reason(file)
    try:
        with Image.open(file, formats=IMAGE_FORMATS) as opened:
            why = "is damaged: its pixels cannot be read to the end"
            if opened.width * opened.height > MAX_IMAGE_PIXELS:
                raise _UnusablePhotographError(f"claims {opened.width} × {opened.height} pixels")
            longest = max(opened.size)
            opened.draft("RGB", (MAX_PICTURE_PX, MAX_PICTURE_PX))
            turned = ImageOps.exif_transpose(opened)
            exif = _lens_exif(turned.getexif())
            picture = as_eight_bit_image(turned)
    except _UnusablePhotographError:
        raise
    except Exception as problem:  # Pillow's decoders raise almost anything on broken input
        raise _UnusablePhotographError(why) from problem
    picture.thumbnail((MAX_PICTURE_PX, MAX_PICTURE_PX), Image.Resampling.LANCZOS)
    alpha = picture.getchannel("A") if picture.mode == "RGBA" else None
    picture = picture.convert("RGB")
    # Nothing else that the file says: Pillow would copy comments.
    picture.info = {"exif": exif, "reduced": max(picture.size) / longest}
    return picture, alpha


def _lens_exif(exif: Image.Exif) -> bytes:
    """Return what EXIF says of camera and lens, as EXIF; b"" where it says nothing.

    The rest is left out: it may be longer than a JPEG can hold, broken, or say where a person lives.
    """
    kept = Image.Exif()
    own, of_lens = exif.get_ifd(EXIF_IFD_TAG), kept.get_ifd(EXIF_IFD_TAG)
    for tags, stated, copy in ((CAMERA_MAKER_TAGS, exif, kept), (LENS_TAGS, own, of_lens)):
        copy.update({t: stated[t] for t in tags if t in stated and _is_short_value(stated[t])})
    return kept.tobytes() if len(kept) or of_lens else b""


def _is_short_value(stated: object) -> bool:
    return isinstance(stated, numbers.Number) or (isinstance(stated, str) and len(stated) <= MAX_TAG_LETTERS)


def _thumbnail(picture: Image.Image) -> np.ndarray:
    small = picture.convert("L").resize(DUPLICATE_THUMBNAIL_PX, Image.Resampling.BOX)
    return np.asarray(small, float)


def _check_thumbnail(thumbnail: np.ndarray, known: np.ndarray, names: list[str]) -> None:
    if thumbnail.std() < MIN_CONTRAST_U8:
        raise _UnusablePhotographError("shows nothing but one colour")
    apart = np.abs(known - thumbnail).mean(axis=(1, 2))
    if len(apart) and apart.min() < MAX_DUPLICATE_DIFFERENCE_U8:
        raise _DuplicatePhotographError(f"shows the same as {names[int(apart.argmin())]}")


def _unique_name(file: Path, taken: set[str]) -> str:
    """Return a name that occurs once and holds no blanks, which end names in COLMAP's lists."""
    stem, k = re.sub(r"\s", "_", safe_name(file.stem)) or "photograph", 1
    name = f"{stem}.jpg"
    while name in taken:
        name, k = f"{stem}_{k}.jpg", k + 1
    return name


def _write_picture(picture: Image.Image, path: Path) -> None:
    with store.disk_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        exif = picture.info["exif"]
        more = {"exif": exif} if exif else {}
        picture.save(path, "JPEG", quality=JPEG_QUALITY, subsampling=0, **more)


def _write_mask(mask: Image.Image, path: Path) -> None:
    with store.disk_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        mask.save(path, "PNG")


def _write_alphas(alphas: dict[str, Image.Image], total: int, folder: Path) -> list[str]:
    """Write masks of photographs that were cut out, if most were; say so where few are.

    Of an alpha that hides all, or nothing, the meaning is unknown.
    """
    opaque = {name: np.asarray(alpha) for name, alpha in alphas.items()}
    clear = [name for name, own in opaque.items() if own.min() == OPAQUE_ALPHA_U8]
    parted = [name for name, own in opaque.items() if own.min() <= ALPHA_THRESHOLD_U8 < own.max()]
    if len(clear) == len(alphas):
        return []
    if len(parted) <= total / 2:
        return [
            f"{len(alphas) - len(clear)} of {total} photographs are transparent in parts or all "
            "over, and most were not cut out: this was not used as masks. Cut out all of them, "
            "or none."
        ]
    for name, alpha in alphas.items():
        place = folder / MASK_FOLDERS[0] / f"{Path(name).stem}.png"
        if not place.exists():
            _write_mask(alpha, place)
    return []


def _find_mask(file: Path, source: Path, kinds: tuple[str, ...], size: tuple[int, int]) -> Image.Image | None:
    """Return what goes with a photograph, turned with it where it is as the camera stored it.

    Raises:
        _UnusableError: It lies across the photograph.
    """
    mask = find_companion_image(file, source, kinds)
    if mask is None:
        return None
    try:
        with Image.open(file, formats=IMAGE_FORMATS) as stored, Image.open(mask, formats=IMAGE_FORMATS) as own:
            wide = stored.width > stored.height
            same = (own.width > own.height) == wide
            turn = stored.getexif() if same else Image.Exif()
            copy = own.copy()
        copy.getexif().clear()
        copy.getexif().update({0x0112: turn.get(0x0112, 1)})
        upright = ImageOps.exif_transpose(copy)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None  # a photograph without its mask is left out where the others have one
    if wrong := rotated_mask_problem(upright.size, size):
        raise _UnusablePhotographError(wrong)
    return upright

"""Loading of photographs: decoded, undistorted and scaled to one size, with cameras.

A few bad ones among many are left out and named.
"""

import warnings
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int32, UInt8
from PIL import Image

from corporeal.core.errors import BadFileError
from corporeal.core.types import Camera, Note, NoteKind
from corporeal.io.image_decoder import IMAGE_FORMATS, MAX_IMAGE_PIXELS, decode_image, decode_instances
from corporeal.io.photos.crop_to_masks import CropWindow, mask_box_fractions, plan_crop
from corporeal.io.photos.photo_file_names import UNREAD_IMAGE_SUFFIXES
from corporeal.multiview.lens_distortion import Lens, undistort_image

MIN_PHOTOS = 3
"""Pictures: two show no more than one depth per pixel, and nothing checks it."""
MAX_UNUSABLE_PHOTOS_FRACTION = 0.5
"""Share of pictures that may be unusable."""
MAX_PHOTO_BYTES = 2**28
"""Of one picture [bytes]."""
MAX_PHOTO_PIXELS_TOTAL = 2**28
"""Pixels of all pictures together."""
MAX_NAMED_PHOTOS = 5
"""So many bad pictures are named."""
ASPECT_TOLERANCE_FRACTION = 0.01
"""Pictures may differ that much in proportion from what the camera is stated to take."""
MAX_GREY_CHANNEL_SPREAD_U8 = 2
"""Largest difference between channels of a picture without colours."""
MIN_MASK_PEAK_U8 = 128
"""Of 255: a mask that nowhere has as much shows nothing."""
MASK_NUMBERS_HINT = " (white is what counts; numbers of instances go into a folder 'instances')"
HEIC_SIGNATURES = (b"ftypheic", b"ftypheix", b"ftypmif1", b"ftyphevc")
"""Bytes 4 to 11 of pictures that phones take."""
EXIF_ORIENTATION_TAG = 0x0112
"""EXIF's tag of how a picture is to be turned; 1: not at all."""
QUARTER_TURNS_OF_ORIENTATION = {3: 2, 6: 3, 8: 1}
"""Its values that turn → quarter turns to the left."""

UnusablePhoto = tuple[str, str]
"""The name of a picture, and why it cannot be used, in a clause."""


@dataclass(frozen=True)
class PosedPhotoFile:
    """One photograph as a file of poses has it."""

    name: str
    picture: Path | None
    """None: it is not there."""
    lens: Callable[[int, int], Lens]
    """Its lens, given the picture's width and height, for files that don't state them."""
    world_from_camera: np.ndarray
    """(4, 4), the camera's axes as OpenCV has them."""
    mask: Path | None = None
    """A picture that is white where the objects are; None: the photograph's own alpha, if any."""
    instances: Path | None = None
    """A picture that has a number or colour for every object, and is black elsewhere."""


@dataclass(frozen=True)
class LoadedPhotos:
    """Photographs ready to use."""

    rgb: UInt8[np.ndarray, "V H W 3"]
    cameras: tuple[Camera, ...]
    masks: UInt8[np.ndarray, "V H W"] | None
    """Share of each pixel that belongs to the objects, 255: all; None: unknown."""
    object_of_pixel: Int32[np.ndarray, "V H W"] | None
    """What each view takes each pixel for; -1: nothing. Numbers may mean other objects elsewhere."""
    names: tuple[str, ...]
    warnings: tuple[str, ...]
    done: tuple[str, ...] = ()
    """Those of the warnings that say what was done to pictures of which none is wrong."""


class _UnusablePhotoError(Exception):
    """Why one photograph cannot be used, in a clause."""


@dataclass(frozen=True)
class _LoadedPhoto:
    """One photograph in its final size."""

    name: str
    rgba: np.ndarray
    numbers: np.ndarray | None
    """Of instances; 0: none."""
    masked: bool
    camera: Camera
    straightened: bool
    asks: bool
    """Whether it says that it is to be turned, and was not."""


def load_photos(source: Path, shots: list[PosedPhotoFile], longest: int, close: bool = False) -> LoadedPhotos:
    """Read all photographs.

    Args:
        source: The file or folder to name in errors.
        shots: What to read.
        longest: Larger pictures are reduced until their longer side has that many pixels.
        close: Whether what is larger is cut out about what masks show, before it is reduced.

    Raises:
        BadFileError: Fewer than three can be used, or most cannot, or all are too large together.
    """
    bad: list[UnusablePhoto] = []
    sizes = [_size(shot, bad) for shot in shots]
    known = [size for size in sizes if size is not None]
    counts = Counter(_reduced_size(*size, longest) for size in known)
    size = min(counts, key=lambda s: (-counts[s], s)) if counts else (1, 1)
    if len(known) * size[0] * size[1] > MAX_PHOTO_PIXELS_TOTAL:
        what = f"{len(known)} pictures of {size[0]} × {size[1]} pixels do not fit into memory."
        raise BadFileError(source, what, "Take fewer, or reduce them.")
    frame = CropWindow(size, size)
    if close and known and size not in known:
        alike = Counter(own for own in known if _reduced_size(*own, longest) == size)
        frame = plan_crop(_mask_boxes(shots), size, alike.most_common(1)[0][0])
    prints = []
    for shot, found in zip(shots, sizes, strict=True):
        if found is not None:
            try:
                prints.append(_load_photo(shot, frame))
            except _UnusablePhotoError as problem:
                bad.append((shot.name, str(problem)))
    prints = _keep_consistently_masked(prints, bad)
    _refuse_if_most_unusable(source, len(shots), bad)
    done = tuple(_change_notes(prints, Counter(known), frame))
    warnings = (*unusable_photos_notes(len(shots), bad), *done, *_oddity_notes(prints))
    return replace(_stack_photos(prints), warnings=warnings, done=done)


def _stack_photos(prints: list[_LoadedPhoto]) -> LoadedPhotos:
    rgba = np.stack([p.rgba for p in prints])
    masked = bool(prints[0].masked and (rgba[..., 3] < 255).any())
    nobody = np.zeros(rgba.shape[1:3], np.int32)
    known = [p.numbers for p in prints if p.numbers is not None]
    numbers = [nobody if p.numbers is None else p.numbers for p in prints]
    return LoadedPhotos(
        rgb=np.ascontiguousarray(rgba[..., :3]),
        cameras=tuple(p.camera for p in prints),
        masks=np.ascontiguousarray(rgba[..., 3]) if masked else None,
        object_of_pixel=np.stack(numbers) - 1 if known else None,
        names=tuple(p.name for p in prints),
        warnings=(),
    )


def _size(shot: PosedPhotoFile, bad: list[UnusablePhoto]) -> tuple[int, int] | None:
    """Return width and height without unpacking; None where it is bad."""
    if shot.picture is None or not shot.picture.is_file():  # a pipe would be waited for
        bad.append((shot.name, "is not there"))
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Pillow's of large pictures; ours is the limit below
            with Image.open(shot.picture, formats=IMAGE_FORMATS) as picture:
                (width, height), asked = picture.size, _exif_quarter_turns(picture)
    except Exception:  # Pillow's decoders raise almost anything on broken input
        bad.append((shot.name, unreadable_reason(shot.picture)))
        return None
    if width * height > MAX_IMAGE_PIXELS or not width or not height:
        bad.append((shot.name, f"claims {width} × {height} pixels"))
        return None
    return (height, width) if _is_to_be_turned(shot, width, height, asked) else (width, height)


def stored_size(shot: PosedPhotoFile) -> tuple[int, int] | None:
    """Return width and height of a photograph as its camera took it [px]; None: it is bad."""
    return _size(shot, [])


def unreadable_reason(path: Path) -> str:
    """Return in a clause why a file is no picture that can be read."""
    with suppress(OSError), path.open("rb") as file:
        if file.read(12)[4:] in HEIC_SIGNATURES:
            return "is a HEIC picture: convert it to JPEG"
    if path.suffix.lower() in UNREAD_IMAGE_SUFFIXES:
        kind = path.suffix[1:].upper()
        return f"is {'an' if kind[:1] == 'A' else 'a'} {kind} picture: convert it to JPEG"
    return "is no PNG, JPEG or WebP picture"


def _mask_boxes(shots: list[PosedPhotoFile]) -> Float[np.ndarray, "V 2"]:
    """Return the sides of the boxes about masks, in those of the pictures; what is bad has none."""
    found = []
    for shot in shots:
        with suppress(_UnusablePhotoError):
            found.append(mask_box_fractions(_visible_mask(shot) >= MIN_MASK_PEAK_U8))
    return np.array([box for box in found if box is not None]).reshape(-1, 2)


def _visible_mask(shot: PosedPhotoFile) -> UInt8[np.ndarray, "H W"]:
    """Return what belongs to objects, as ``_object_alpha`` has it, without more than it takes."""
    if shot.mask is not None:
        return _decode_file(shot.mask)[..., 0]
    picture = _decode_file(shot.picture)
    if _is_to_be_turned(shot, picture.shape[1], picture.shape[0], asked := exif_quarter_turns_of_file(shot.picture)):
        picture = np.rot90(picture, asked)
    return _object_alpha(shot, picture, _instance_numbers(shot.instances, picture.shape[1::-1]))


def _load_photo(shot: PosedPhotoFile, frame: CropWindow) -> _LoadedPhoto:
    picture = _decode_file(shot.picture)
    height, width = picture.shape[:2]
    asked = exif_quarter_turns_of_file(shot.picture)
    turned = _is_to_be_turned(shot, width, height, asked)
    if turned:
        picture = np.ascontiguousarray(np.rot90(picture, asked))
        height, width = width, height
    lens = shot.lens(width, height)
    if not _fits_camera_aspect(width, height, lens):
        stated = f"{lens.width} × {lens.height}"
        raise _UnusablePhotoError(f"has {width} × {height} pixels, but its camera takes {stated}")
    numbers = _instance_numbers(shot.instances, (width, height))
    masked = shot.mask is not None or picture.shape[2] == 4 or numbers is not None
    alpha = _object_alpha(shot, picture, numbers)
    if masked and alpha.max() < MIN_MASK_PEAK_U8:
        raise _UnusablePhotoError("has a mask that shows nothing" + (MASK_NUMBERS_HINT if shot.mask else ""))
    rgba = np.dstack([_on_white(picture[..., :3], alpha), alpha])
    rgba, numbers, camera = _straighten_and_crop(rgba, numbers, lens, shot.world_from_camera, frame)
    ignored = asked > 0 and not turned
    return _LoadedPhoto(shot.name, rgba, numbers, masked, camera, not lens.straight, ignored)


def _straighten_and_crop(
    rgba: UInt8[np.ndarray, "H W 4"],
    numbers: Int32[np.ndarray, "H W"] | None,
    lens: Lens,
    pose: np.ndarray,
    frame: CropWindow,
) -> tuple[UInt8[np.ndarray, "h w 4"], Int32[np.ndarray, "h w"] | None, Camera]:
    """Reduce a picture and its instances, straighten them, and cut out what is used."""
    size, (wide, high) = frame.whole, frame.window
    small = np.dstack([_resize_image(rgba[..., :3], size), _resize_image(rgba[..., 3], size)])
    lens = lens.resized(*size)
    try:
        straight, K = undistort_image(small, lens)
    except ValueError as problem:
        raise _UnusablePhotoError(f"cannot be straightened: {problem}") from None
    left, top = frame.corner(straight[..., 3] >= MIN_MASK_PEAK_U8)
    cut = slice(top, top + high), slice(left, left + wide)
    if numbers is not None:
        few = np.asarray(Image.fromarray(numbers).resize(size, Image.Resampling.NEAREST))
        numbers = undistort_image(few[..., None], lens)[0][..., 0][cut]
    K = K - np.array([[0, 0, left], [0, 0, top], [0, 0, 0]])
    return straight[cut], numbers, Camera(K, pose, wide, high)


def _fits_camera_aspect(width: int, height: int, lens: Lens) -> bool:
    return abs(width * lens.height / (height * lens.width) - 1) <= ASPECT_TOLERANCE_FRACTION


def rotated_mask_problem(mask: tuple[int, int], picture: tuple[int, int]) -> str | None:
    """Return what is wrong with a mask that lies across its picture; None: it does not.

    Args:
        mask: Width and height [px]; of other proportions it is stretched, as some models have it.
        picture: Likewise.
    """
    (width, height), (wide, high) = mask, picture
    ratio, swapped = width * high / (height * wide), width * wide / (height * high)
    if abs(swapped - 1) > ASPECT_TOLERANCE_FRACTION or abs(ratio - 1) <= ASPECT_TOLERANCE_FRACTION:
        return None
    return f"has a mask of {width} × {height} pixels, which lies across its {wide} × {high}: turn it"


def _is_to_be_turned(shot: PosedPhotoFile, width: int, height: int, asked: int) -> bool:
    """Return whether a picture is to be turned: it asks for it, and only then fits its camera."""
    if asked % 2 == 0 or not width or not height:
        return False
    lens = shot.lens(width, height)
    return not _fits_camera_aspect(width, height, lens) and _fits_camera_aspect(height, width, lens)


def _exif_quarter_turns(picture: Image.Image) -> int:
    """Return by how many quarter turns to the left a picture says that it is to be shown."""
    return QUARTER_TURNS_OF_ORIENTATION.get(picture.getexif().get(EXIF_ORIENTATION_TAG, 1), 0)


def exif_quarter_turns_of_file(path: Path | None) -> int:
    """Return by how many quarter turns to the left a file says that it is to be shown."""
    assert path is not None
    with Image.open(path, formats=IMAGE_FORMATS) as picture:
        return _exif_quarter_turns(picture)


def _decode_file(path: Path | None) -> np.ndarray:
    assert path is not None
    try:
        return decode_image(_read(path), side=2**20)
    except ValueError as problem:
        raise _UnusablePhotoError(str(problem).removeprefix("the picture ")) from None


def _instance_numbers(path: Path | None, size: tuple[int, int]) -> np.ndarray | None:
    """Return which instance each pixel shows (H, W); 0: none. None: unknown."""
    if path is None:
        return None
    try:
        numbers = decode_instances(_read(path))
    except ValueError as problem:
        reason = str(problem).removeprefix("the picture ")
        raise _UnusablePhotoError(f"has instances of which the picture {reason}") from None
    if numbers.shape == size[::-1]:
        return numbers
    return np.asarray(Image.fromarray(numbers).resize(size, Image.Resampling.NEAREST))


def _read(path: Path) -> bytes:
    try:
        if path.stat().st_size > MAX_PHOTO_BYTES:
            raise _UnusablePhotoError(f"is larger than {MAX_PHOTO_BYTES >> 20} MiB")
        return path.read_bytes()
    except OSError as problem:
        raise _UnusablePhotoError(f"cannot be read ({problem.strerror})") from None


def _object_alpha(shot: PosedPhotoFile, picture: np.ndarray, numbers: np.ndarray | None) -> np.ndarray:
    """Return what belongs to the objects (H, W): the mask, else the alpha, else all instances."""
    if shot.mask is None and picture.shape[2] == 4:
        return picture[..., 3]
    if shot.mask is None and numbers is not None:
        return np.uint8(255) * (numbers > 0)
    if shot.mask is None:
        return np.full(picture.shape[:2], 255, np.uint8)
    try:
        mask = _decode_file(shot.mask)[..., 0]
    except _UnusablePhotoError as problem:
        raise _UnusablePhotoError(f"has a mask that {problem}") from None
    if wrong := rotated_mask_problem(mask.shape[1::-1], picture.shape[1::-1]):
        raise _UnusablePhotoError(wrong)
    return mask if mask.shape == picture.shape[:2] else _resize_image(mask, picture.shape[1::-1])


def _on_white(rgb: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    if alpha.min() == 255:
        return rgb
    share = alpha[..., None] / np.float32(255)
    return np.round(rgb * share + 255 * (1 - share)).astype(np.uint8)


def _resize_image(picture: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    if picture.shape[1::-1] == size:
        return picture
    return np.asarray(Image.fromarray(picture).resize(size, Image.Resampling.LANCZOS))


def _reduced_size(width: int, height: int, longest: int) -> tuple[int, int]:
    share = min(1.0, longest / max(width, height))
    return max(1, round(width * share)), max(1, round(height * share))


def _keep_consistently_masked(prints: list[_LoadedPhoto], bad: list[UnusablePhoto]) -> list[_LoadedPhoto]:
    """Leave out the few without a mask where others have one, or ignore that there are none."""
    masked = [p for p in prints if p.masked]
    if not masked or len(masked) == len(prints):
        return prints
    bad += [(p.name, "has no mask, but others have one") for p in prints if not p.masked]
    return masked


def _refuse_if_most_unusable(source: Path, total: int, bad: list[UnusablePhoto]) -> None:
    good = total - len(bad)
    if len(bad) > MAX_UNUSABLE_PHOTOS_FRACTION * total:
        what = f"{len(bad)} of {total} pictures cannot be used: {_list_reasons(bad)}."
        raise BadFileError(source, what, "Move them there, or correct the file.")
    if good < MIN_PHOTOS:
        what = f"{good} of {total} pictures can be used, but at least {MIN_PHOTOS} are needed."
        step = "Photograph the scene from all sides: 20 to 50 pictures are good."
        raise BadFileError(source, what, step)


def unusable_photos_notes(total: int, bad: list[UnusablePhoto]) -> list[str]:
    """Return which of so many pictures were left out, and why; nothing where all are used."""
    return [Note(f"{len(bad)} of {total} pictures were left out: {_list_reasons(bad)}.", NoteKind.LEFT_OUT)] * bool(bad)


def _list_reasons(bad: list[UnusablePhoto]) -> str:
    names = [f"{name[-60:]} {why}" for name, why in bad[:MAX_NAMED_PHOTOS]]
    more = len(bad) - len(names)
    return "; ".join(names) + (f"; and {more} more" if more else "")


def _change_notes(prints: list[_LoadedPhoto], sizes: Counter[tuple[int, int]], frame: CropWindow) -> list[str]:
    """Return what was done to the pictures, in sentences."""
    changes, size = [], frame.whole
    if len(sizes) > 1:
        kinds = ", ".join(f"{n} of {w} × {h}" for (w, h), n in sizes.most_common(MAX_NAMED_PHOTOS))
        changes.append(f"Pictures of several sizes ({kinds}) were brought to {_size_text(size)}.")
    elif size not in sizes:
        changes.append(f"Pictures were reduced to {_size_text(size)}.")
    if frame.window != size:
        wide, high = frame.window
        changes.append(f"Of each, {wide} × {high} pixels about what its mask shows were used.")
    bent = sum(p.straightened for p in prints)
    if bent:
        changes.append(f"{bent} pictures were straightened: their lenses bend straight lines.")
    return changes


def _oddity_notes(prints: list[_LoadedPhoto]) -> list[str]:
    """Return what is odd about the pictures themselves, in sentences."""
    odd = []
    grey = sum(int(np.ptp(p.rgba[..., :3], axis=-1).max()) <= MAX_GREY_CHANNEL_SPREAD_U8 for p in prints)
    if 0 < grey < len(prints):
        odd.append(f"{grey} of {len(prints)} pictures are grey: colours will be paler.")
    asking = sum(p.asks for p in prints)
    if asking:
        odd.append(
            f"{asking} pictures note in their EXIF data that they are to be turned. Their pixels "
            "were taken as they are stored, as COLMAP takes them; if the poses belong to turned "
            "pictures, turn the files."
        )
    return odd


def _size_text(size: tuple[int, int]) -> str:
    return f"{size[0]} × {size[1]} pixels, and their cameras with them"

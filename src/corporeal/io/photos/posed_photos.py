"""Posed photographs of any format, detected by the content of the folder."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path, PurePath

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image

from corporeal.core.errors import BadFileError
from corporeal.core.types import Views
from corporeal.io.image_decoder import IMAGE_FORMATS
from corporeal.io.photos.colmap import ColmapModel, is_colmap, read_colmap
from corporeal.io.photos.image_loader import PosedPhotoFile, load_photos
from corporeal.io.photos.photo_file_names import IMAGE_FOLDERS, INSTANCE_FOLDERS, MASK_FOLDERS, READABLE_IMAGE_SUFFIXES
from corporeal.io.photos.projection_matrices import check_focal, find_projections, read_projection, split_projection
from corporeal.io.photos.transforms_frame import TRANSFORMS_FILE, TransformsFrame, read_transforms_frames
from corporeal.io.referenced_files import path_beside
from corporeal.multiview.lens_distortion import Lens
from corporeal.multiview.lines_of_sight import LinesOfSight
from corporeal.recognition.readable_names import single_line_text

TRANSFORMS_FILES = (TRANSFORMS_FILE, "transforms_train.json")
COLMAP_MODEL_FOLDERS = ("", "sparse/0", "sparse", "colmap/sparse/0", "model", "dense/sparse", "undistorted/sparse")
IMAGE_NAME_SUFFIXES = ("", ".png", ".jpg", ".jpeg", ".webp", ".PNG", ".JPG", ".JPEG")
DEFAULT_LONGEST_SIDE_PX = 1024
"""Of a picture's sides, unless more is asked for [px]."""
NO_INSTANCES_MESSAGE = (
    "There are no instance masks. Name them by object_file_path in transforms.json, or put them "
    "into a folder 'instances' with the names of the pictures; or leave --apart out."
)
POSED_PHOTOS_ADVICE = "Name a folder with transforms.json, a COLMAP model, or 3 × 4 projection matrices."


@dataclass(frozen=True)
class PosedPhotos:
    """Posed pictures, with further scene data of the file."""

    views: Views
    """Where there is a mask, all outside it is white. ``object_of_pixel``: what instance masks say, whose numbers need
    not mean the same from view to view; None: there are none."""
    names: tuple[str, ...]
    """Of the pictures, as the file has them."""
    z_up: bool
    """Whether the file's kind says that the world's +z is up."""
    masks: UInt8[np.ndarray, "V H W"] | None = None
    """Share of each pixel that belongs to the objects, 255: all; None: unknown."""
    points: Float[np.ndarray, "N 3"] | None = None
    """Sparse points of the scene, where the file holds some, in the unit of the poses."""
    colours: UInt8[np.ndarray, "N 3"] | None = None
    """Of the points, sRGB."""
    lines: LinesOfSight | None = None
    """Which pictures show which points; None: unknown."""
    warnings: tuple[str, ...] = ()
    """What a reader of the report should know about the input, in sentences."""
    done: tuple[str, ...] = ()
    """Those of the warnings that say what was done to pictures of which none is wrong."""

    def only(self, which: Sequence[int]) -> "PosedPhotos":
        """Return some of the pictures, by number, with all points."""
        own, chosen = self.views.object_of_pixel, list(which)
        views = Views(
            self.views.rgb[chosen],
            tuple(self.views.cameras[k] for k in chosen),
            object_of_pixel=None if own is None else own[chosen],
        )
        masks = None if self.masks is None else self.masks[chosen]
        lines = None if self.lines is None else self.lines.only(chosen)
        names = tuple(self.names[k] for k in chosen)
        return replace(self, views=views, names=names, masks=masks, lines=lines)


@dataclass(frozen=True)
class PhotoListing:
    """Listing of a folder's photographs, before any is read."""

    source: Path
    """Named in errors."""
    shots: list[PosedPhotoFile]
    z_up: bool
    """As in ``PosedPhotos``."""
    model: ColmapModel | None = None


def read_posed_photos(
    path: Path,
    longest: int = DEFAULT_LONGEST_SIDE_PX,
    masks: Path | None = None,
    bare: bool = False,
    close: bool = False,
    most: int | None = None,
) -> PosedPhotos:
    """Read a folder of posed photographs, or the ``transforms.json`` of one.

    All come out at one size, the most frequent one, at most ``longest`` pixels long, with lenses straightened. A
    minority of pictures that are missing or broken is left out and named.

    Args:
        path: The folder or file.
        longest: Of a picture's sides [px].
        masks: A folder of masks instead of the photographs' own, or one that holds ``masks``, ``instances`` or both.
        bare: Whether masks and instances beside the photographs are ignored.
        close: Whether larger pictures are cut out about what masks show, before they are reduced.
        most: How many are read, at equal steps; None: all.

    Raises:
        BadFileError: There are no poses, a pose or camera is bad, or too few pictures can be used; or no mask has the
            name of a photograph.
    """
    found = list_posed_photos(path)
    shots = found.shots
    if bare or masks is not None:
        shots = [replace(shot, mask=None, instances=None) for shot in shots]
    if masks is not None:
        shots = _with_masks_from(masks, shots)
    if most is not None:
        steps = np.linspace(0, len(shots) - 1, min(most, len(shots))).round()
        shots = [shots[k] for k in steps.astype(int)]
    own = found.source.parent if found.source.is_file() else found.source
    pictures = [shot.picture for shot in shots if shot.picture is not None]
    unused = [] if bare or masks is not None else unused_masks_note(own, pictures)
    done = load_photos(found.source, shots, longest, close)
    seen = found.model if found.model is not None and len(found.model.points) else None
    return PosedPhotos(
        views=Views(done.rgb, done.cameras, object_of_pixel=done.object_of_pixel),
        names=done.names,
        z_up=found.z_up,
        masks=done.masks,
        points=seen.points if seen else None,
        colours=seen.colours if seen else None,
        lines=None if seen is None else _lines_of(seen, done.names),
        warnings=(*unused, *done.warnings),
        done=done.done,
    )


def _lines_of(model: ColmapModel, names: tuple[str, ...]) -> LinesOfSight | None:
    """Return which of the named pictures show which points."""
    number = {image.name: k for k, image in enumerate(model.images)}
    image, point = model.sightings.T
    lines = LinesOfSight(model.points, image, point).only([number[name] for name in names])
    return lines if len(lines.view) else None


def list_posed_photos(path: Path) -> PhotoListing:
    """List the photographs of a folder, or of a ``transforms.json``, with their poses.

    Raises:
        BadFileError: There are no poses, or one of them is bad.
    """
    path = Path(path)
    if not path.exists():
        raise BadFileError(path, "there is no such file or folder.", POSED_PHOTOS_ADVICE)
    if path.is_file():
        return _list_transforms(path)
    file = next((path / name for name in TRANSFORMS_FILES if (path / name).is_file()), None)
    if file is not None:
        return _list_transforms(file)
    model = next((path / name for name in COLMAP_MODEL_FOLDERS if is_colmap(path / name)), None)
    if model is not None:
        return _list_colmap(path, model)
    pairs = find_projections(path) if path.is_dir() else []
    if pairs:
        return PhotoListing(path, _list_projections(path, pairs), False)
    raise BadFileError(path, "holds no photographs with poses.", POSED_PHOTOS_ADVICE)


def has_masks(shots: list[PosedPhotoFile]) -> bool:
    """Return whether there are masks, instances or an alpha channel, by names and headers."""
    return any(s.mask or s.instances or _has_alpha(s.picture) for s in shots)


def _has_alpha(path: Path | None) -> bool:
    try:
        with Image.open(path or "", formats=IMAGE_FORMATS) as picture:
            return picture.has_transparency_data
    except Exception:  # Pillow's decoders raise almost anything; who reads the picture says why
        return False


def _with_masks_from(folder: Path, shots: list[PosedPhotoFile]) -> list[PosedPhotoFile]:
    """Return the photographs with masks and instances of another folder."""
    folder = folder.expanduser()
    if not folder.is_dir():
        raise BadFileError(folder, "there is no such folder.", "Name a folder of masks.")
    parted = any((folder / name).is_dir() for name in (*MASK_FOLDERS, *INSTANCE_FOLDERS))
    masks, instances = (
        [folder / name for name in names if (folder / name).is_dir()] for names in (MASK_FOLDERS, INSTANCE_FOLDERS)
    )
    made = [
        replace(
            shot, mask=_image_named_as(shot, masks if parted else [folder]), instances=_image_named_as(shot, instances)
        )
        for shot in shots
    ]
    if not any(shot.mask or shot.instances for shot in made):
        step = "Masks are PNG pictures with the names of the photographs, white where objects are."
        raise BadFileError(folder, "holds no mask with the name of a photograph.", step)
    return made


def _image_named_as(shot: PosedPhotoFile, folders: list[Path]) -> Path | None:
    """Return the picture in folders that is named as a photograph, with its folder or without."""
    if shot.picture is None:
        return None
    name = PurePath(shot.name.lstrip("./"))
    files = [name.as_posix(), name.with_suffix("").as_posix(), f"{name.as_posix()}.png"]
    files += _companion_names(shot.picture)
    return next((p for base in folders for f in files if (p := _find_image(base, f)) is not None), None)


def has_posed_photos(folder: Path) -> bool:
    """Tell a folder of photographs with poses by its files, without reading them."""
    posed = any((folder / name).is_file() for name in TRANSFORMS_FILES)
    return posed or any(is_colmap(folder / m) for m in COLMAP_MODEL_FOLDERS) or bool(find_projections(folder))


def _list_transforms(path: Path) -> PhotoListing:
    return PhotoListing(path, [_photo_of_frame(frame) for frame in read_transforms_frames(path)], z_up=True)


def _photo_of_frame(frame: TransformsFrame) -> PosedPhotoFile:
    name, folder = frame.text("file_path"), frame.path.parent
    picture = _find_image(folder, name)
    mask = None
    if frame.value.get("mask_path") is not None:
        mask = _find_image(folder, frame.text("mask_path"))
        if mask is None:
            frame.fail(f"its mask {frame.text('mask_path')[:60]!r} is not there.", "Correct it.")
    frame.lens(1, 1)  # refuse a bad lens even where the picture is bad too
    mask = mask or find_companion_image(picture, folder, MASK_FOLDERS)
    instances = find_companion_image(picture, folder, INSTANCE_FOLDERS)
    if frame.value.get("object_file_path") is not None:
        instances = _find_image(folder, frame.text("object_file_path"))
    return PosedPhotoFile(name, picture, frame.lens, frame.pose(), mask, instances)


def _find_image(folder: Path, name: str) -> Path | None:
    """Return a picture in or below the folder; the suffix of its name may be missing."""
    return next((p for s in IMAGE_NAME_SUFFIXES if (p := path_beside(folder, name + s)) is not None), None)


def find_companion_image(picture: Path | None, folder: Path, names: tuple[str, ...]) -> Path | None:
    """Return what goes with a picture, in a folder beside it, above it, or in the whole's."""
    if picture is None:
        return None
    for base in dict.fromkeys((picture.parent, picture.parent.parent, folder)):
        for name in names:
            for file in _companion_names(picture):
                found = _find_image(base / name, file) if (base / name).is_dir() else None
                if found is not None and found != picture:
                    return found
    return None


def _companion_names(picture: Path) -> tuple[str, ...]:
    """Return the names that masks of a picture have, Metashape's last; suffixes may be missing."""
    return (picture.name, picture.stem, f"{picture.name}.png", f"{picture.stem}_mask")


def unused_masks_note(folder: Path, pictures: Sequence[Path]) -> list[str]:
    """State that a folder has masks whose names fit none of its photographs, if it has such."""
    for place in (folder / name for name in MASK_FOLDERS):
        held = [p for p in sorted(place.rglob("*")) if p.suffix.lower() in READABLE_IMAGE_SUFFIXES]
        if held and pictures and not any(find_companion_image(p, folder, (place.name,)) for p in pictures):
            return [
                f"None of the {len(held)} pictures in {place.name} has the name of a photograph, "
                f"so that they are no masks: {single_line_text(held[0].name)} is the first of them, where "
                f"{single_line_text(pictures[0].stem)}.png would be one. Rename them."
            ]
    return []


def _list_colmap(folder: Path, place: Path) -> PhotoListing:
    model = read_colmap(place)
    root = _images_folder(folder, model)
    shots = []
    for image in model.images:
        picture = path_beside(root, image.name)
        lens = partial(_as_stated, model.lens(image))
        more = (find_companion_image(picture, folder, names) for names in (MASK_FOLDERS, INSTANCE_FOLDERS))
        shots.append(PosedPhotoFile(image.name, picture, lens, image.world_from_camera, *more))
    shots.sort(key=lambda shot: shot.name)
    return PhotoListing(folder, shots, False, model)


def _images_folder(folder: Path, model: ColmapModel) -> Path:
    """Return the folder that holds most of the model's images."""
    bases = [folder, model.folder, model.folder.parent, model.folder.parent.parent]
    places = [base / name for base in bases for name in IMAGE_FOLDERS if (base / name).is_dir()]
    names = [image.name for image in model.images]
    return max(places, key=lambda p: sum(path_beside(p, name) is not None for name in names))


def _as_stated(lens: Lens, width: int, height: int) -> Lens:
    return lens


def _list_projections(folder: Path, pairs: list[tuple[Path, Path]]) -> list[PosedPhotoFile]:
    shots = []
    for picture, file in pairs:
        K, pose = split_projection(file, read_projection(file))
        more = (find_companion_image(picture, folder, names) for names in (MASK_FOLDERS, INSTANCE_FOLDERS))
        shots.append(PosedPhotoFile(picture.name, picture, partial(_pinhole, file, K), pose, *more))
    return shots


def _pinhole(path: Path, K: np.ndarray, width: int, height: int) -> Lens:
    check_focal(path, K, width, height)
    return Lens(K, width, height)

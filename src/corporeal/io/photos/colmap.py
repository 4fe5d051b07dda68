"""COLMAP's models: cameras, images and points, as text or in binary.

Poses are camera from world; the middle of the upper left pixel is (0.5, 0.5), as here. The world's frame and size are
the model's own: unless they were set, up is unknown and lengths mean nothing. Format: colmap.github.io/format.html.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from corporeal.core.errors import BadFileError
from corporeal.geometry.rotation import matrix_from_quaternion
from corporeal.io.photos.colmap_binary import ColmapBinaryReader, camera_rows, image_rows, point_rows
from corporeal.multiview.lens_distortion import Lens

COLMAP_EXPORT_ADVICE = "Export the model again."
PARAMETER_COUNT_OF_CAMERA_MODEL = {"SIMPLE_PINHOLE": 3, "PINHOLE": 4, "SIMPLE_RADIAL": 4, "RADIAL": 5, "OPENCV": 8}
"""How many numbers each model has that is read."""
COLMAP_UNDISTORT_ADVICE = "Run COLMAP's image_undistorter first."


@dataclass(frozen=True)
class ColmapCamera:
    """An intrinsic camera: COLMAP's name of its model, and its numbers."""

    model: str
    width: int
    height: int
    parameters: tuple[float, ...]


@dataclass(frozen=True)
class ColmapImage:
    """A posed image."""

    name: str
    camera: int
    world_from_camera: Float[np.ndarray, "4 4"]


@dataclass(frozen=True)
class ColmapModel:
    """What a model holds."""

    folder: Path
    cameras: dict[int, ColmapCamera]
    images: tuple[ColmapImage, ...]
    points: Float[np.ndarray, "N 3"]
    colours: UInt8[np.ndarray, "N 3"]
    sightings: Int[np.ndarray, "S 2"]
    """Which of the images shows which of the points; none, where the file does not list them."""

    def lens(self, image: ColmapImage) -> Lens:
        """Return the lens of an image.

        Raises:
            BadFileError: Its camera is missing, or of a model that is not read.
        """
        camera = self.cameras.get(image.camera)
        if camera is None:
            what = f"image {image.name[:60]} has camera {image.camera}, which is not there."
            raise BadFileError(self.folder, what, COLMAP_EXPORT_ADVICE)
        return lens_of_camera(self.folder, camera)


def is_colmap(folder: Path) -> bool:
    """Tell a model's folder by its files."""
    return any(all((folder / f"{name}{kind}").is_file() for name in ("cameras", "images")) for kind in (".bin", ".txt"))


def read_colmap(folder: Path) -> ColmapModel:
    """Read a model, in binary where there is both.

    Raises:
        BadFileError: A file is missing or broken, or it holds no images.
    """
    folder = Path(folder)
    binary = (folder / "images.bin").is_file() and (folder / "cameras.bin").is_file()
    if not is_colmap(folder):
        raise BadFileError(folder, "holds no cameras and images of a COLMAP model.", COLMAP_EXPORT_ADVICE)
    rows = _read_binary(folder) if binary else _read_text(folder)
    if not rows.images:
        raise BadFileError(folder, "the COLMAP model holds no images.", COLMAP_EXPORT_ADVICE)
    places = np.array([p.row[:3] for p in rows.points], np.float64).reshape(-1, 3)
    colours = np.array([p.row[3:] for p in rows.points], np.float64).reshape(-1, 3)
    good = np.asarray(np.isfinite(places).all(axis=1))
    return ColmapModel(
        folder,
        rows.cameras,
        tuple(image for _, image in rows.images),
        places[good],
        np.clip(colours[good], 0, 255).astype("u1"),
        _point_observations(rows, good),
    )


def _point_observations(rows: "_ModelRows", good: Bool[np.ndarray, " N"]) -> Int[np.ndarray, "S 2"]:
    """Return which image shows which of the good points; images that are not there show none."""
    image_of = {number: k for k, (number, _) in enumerate(rows.images)}
    kept = np.cumsum(good) - 1
    pairs = {
        (image_of[number], int(kept[k]))
        for k, point in enumerate(rows.points)
        if good[k]
        for number in point.seen_in
        if number in image_of
    }
    return np.array(sorted(pairs), np.int64).reshape(-1, 2)


def lens_of_camera(folder: Path, camera: ColmapCamera) -> Lens:
    """Return the lens of a camera.

    Raises:
        BadFileError: It is of a model that is not read, or a number is bad.
    """
    if camera.model not in PARAMETER_COUNT_OF_CAMERA_MODEL:
        known = ", ".join(PARAMETER_COUNT_OF_CAMERA_MODEL)
        what = f"a camera is {camera.model[:40]}; {known} are read."
        raise BadFileError(folder, what, COLMAP_UNDISTORT_ADVICE)
    p = camera.parameters
    good = len(p) == PARAMETER_COUNT_OF_CAMERA_MODEL[camera.model] and np.isfinite(p).all() and p[0] > 0
    if not good or min(camera.width, camera.height) < 1:
        raise BadFileError(folder, f"a {camera.model} camera has bad numbers.", COLMAP_EXPORT_ADVICE)
    two = camera.model in ("PINHOLE", "OPENCV")
    fx, fy, cx, cy = p[:4] if two else (p[0], p[0], p[1], p[2])
    rest = p[4:] if two else p[3:]
    K = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
    tangential = (rest[2], rest[3]) if camera.model == "OPENCV" else (0.0, 0.0)
    return Lens(K, camera.width, camera.height, tuple(rest[:2]), tangential)


def world_from_camera(
    path: Path, name: str, turn: tuple[float, ...], shift: tuple[float, ...]
) -> Float[np.ndarray, "4 4"]:
    """Return the pose of an image of its quaternion (w, x, y, z) and shift, camera from world.

    Raises:
        BadFileError: They are not finite, or the quaternion's length is 0.
    """
    length = np.linalg.norm(turn)
    if not np.isfinite([*turn, *shift]).all() or length < 1e-6:
        raise BadFileError(path, f"the pose of image {name[:60]} is bad.", COLMAP_EXPORT_ADVICE)
    R = matrix_from_quaternion(np.array(turn))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = R.T, -R.T @ np.array(shift)
    return pose


@dataclass(frozen=True)
class _ModelRows:
    """What the three files of a model list."""

    cameras: dict[int, ColmapCamera]
    images: list[tuple[int, ColmapImage]]
    """With their numbers in the file."""
    points: "list[_PointRow]"


@dataclass(frozen=True)
class _PointRow:
    row: tuple[float, ...]
    """x, y, z [the model's unit], red, green, blue [0–255]."""
    seen_in: tuple[int, ...]
    """Numbers of images."""


def _read_binary(folder: Path) -> _ModelRows:
    path = folder / "images.bin"
    cameras = {k: ColmapCamera(*row) for k, row in camera_rows(ColmapBinaryReader(folder / "cameras.bin"))}
    images = [
        (number, ColmapImage(name, camera, world_from_camera(path, name, turn, shift)))
        for number, name, camera, turn, shift in image_rows(ColmapBinaryReader(path))
    ]
    file = folder / "points3D.bin"
    points = [_PointRow(*row) for row in point_rows(ColmapBinaryReader(file))] if file.is_file() else []
    return _ModelRows(cameras, images, points)


def _read_text(folder: Path) -> _ModelRows:
    path = folder / "cameras.txt"
    cameras = {}
    for words in _word_lines(path):
        if words:
            numbers = _parse_numbers(path, words, [0, *range(2, len(words))], least=4)
            size = int(numbers[1]), int(numbers[2])
            cameras[int(numbers[0])] = ColmapCamera(words[1], *size, tuple(numbers[3:]))
    path = folder / "points3D.txt"
    lines = _word_lines(path) if path.is_file() else iter(())
    points = [
        _PointRow(tuple(_parse_numbers(path, w, range(1, 7), least=7)), _track_image_numbers(path, w))
        for w in lines
        if w
    ]
    return _ModelRows(cameras, list(_image_lines(folder / "images.txt")), points)


def _track_image_numbers(path: Path, words: list[str]) -> tuple[int, ...]:
    """Return the images of a point's track: after its error, every other number."""
    return tuple(int(n) for n in _parse_numbers(path, words, range(8, len(words) - 1, 2), least=7))


def _image_lines(path: Path) -> Iterator[tuple[int, ColmapImage]]:
    """Yield images and their numbers.

    Of every two lines the first; the second lists points and may be empty.
    """
    lines = _word_lines(path)
    for words in lines:
        if not words:
            continue
        n = _parse_numbers(path, words, range(9), least=10)
        name = " ".join(words[9:])
        pose = world_from_camera(path, name, tuple(n[1:5]), tuple(n[5:8]))
        yield int(n[0]), ColmapImage(name, int(n[8]), pose)
        next(lines, None)


def _word_lines(path: Path) -> Iterator[list[str]]:
    """Yield the words of every line that is no comment; empty lines too."""
    try:
        with path.open(encoding="utf-8", errors="replace") as stream:
            for line in stream:
                if not line.startswith("#"):
                    yield line.split()
    except OSError as problem:
        raise BadFileError(path, f"cannot be read ({problem.strerror}).") from problem


def _parse_numbers(path: Path, words: list[str], which: range | list[int], least: int) -> list[float]:
    """Return some words of a line as numbers."""
    try:
        if len(words) < least:
            raise ValueError
        numbers = [float(words[k]) for k in which]
        [int(x) for x in numbers]
        return numbers
    except (ValueError, OverflowError):
        _bad_line(path, words)


def _bad_line(path: Path, words: list[str]) -> NoReturn:
    raise BadFileError(path, f"cannot read the line {' '.join(words)[:60]!r}.", COLMAP_EXPORT_ADVICE)

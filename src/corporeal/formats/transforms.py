"""Posed pictures as a folder: ``transforms.json`` and pictures, as instant-ngp and nerfstudio do.

The matrix of a frame leads from camera to world, both as OpenGL has them (x right, y up, z back;
the world's z up); ours looks along +z with y down, so the second and the third column change sign.
The folder also holds what these tools don't know (normals, who is where), under names of its own;
they leave that alone.

    rgb/0000.png       sRGB
    depth/0000.png     16 bits: z-depth in units of integer_depth_scale [m]; 0: nothing, or farther
    normals/0000.png   (n + 1) / 2 in 8 bits, in the world; black: nothing
    objects/0000.png   16 bits: 1 + object; 0: none
    parts/0000.png     16 bits: 1 + part; 0: none
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from PIL import Image

from corporeal import store
from corporeal.errors import BadFileError, UserError
from corporeal.formats.images import decode_image, decode_numbers
from corporeal.formats.resources import read_beside
from corporeal.types import Camera, Views

FILE = "transforms.json"
OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
"""Between the axes of an OpenCV camera and an OpenGL one."""
MOST = 2**16 - 1
"""Largest number in a picture of 16 bits."""
UNIT = 1e-3
"""Of depth, as these tools take it by default [m]; finer where things are nearer."""
STEPS = 1000
"""Units of depth to the nearest thing, at least."""
LARGEST_FILE = 2**28
"""Of one picture [bytes]."""
LARGEST = 2**30
"""Pixels of all views together."""
BENT = ("k1", "k2", "k3", "k4", "p1", "p2")
STRAIGHT = ("", "OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "perspective")


# ---------------------------------------------------------------- writing


def write_views(folder: Path, views: Views) -> Path:
    """Write the folder; ``transforms.json`` comes last, so that it names only what is there.

    Returns:
        The path of ``transforms.json``.

    Raises:
        UserError: A camera is skewed, which the format cannot say; more than 65534 objects or
            parts; the disk refuses it.

    """
    path = folder / FILE
    unit = _unit(views)
    frames = [{"transform_matrix": (c.world_from_camera @ OPENGL).tolist()} for c in views.cameras]
    with store.writing(folder):
        path.unlink(missing_ok=True)
        for key, name, pictures in _layers(views, unit):
            (folder / name).mkdir(parents=True, exist_ok=True)
            for k, frame in enumerate(frames):
                frame[key] = f"{name}/{k:04}.png"
                Image.fromarray(pictures(k)).save(folder / frame[key])
    lenses = [_said_of(c) for c in views.cameras]
    shared = lenses[0] if all(x == lenses[0] for x in lenses) else {}
    if not shared:
        frames = [frame | lens for frame, lens in zip(frames, lenses, strict=True)]
    scale = {} if views.depth is None else {"integer_depth_scale": unit}
    store.write_json(path, {"camera_model": "OPENCV"} | shared | scale | {"frames": frames})
    return path


def _layers(views: Views, unit: float) -> list[tuple[str, str, Callable[[int], np.ndarray]]]:
    """Return key, folder and k-th picture of everything that the views have."""
    layers: list[tuple[str, str, Callable[[int], np.ndarray]]]
    layers = [("file_path", "rgb", lambda k: views.rgb[k])]
    depth, normals = views.depth, views.normals
    if depth is not None:
        layers.append(("depth_file_path", "depth", lambda k: _in_units(depth[k], unit)))
    if normals is not None:
        layers.append(("normal_file_path", "normals", lambda k: _coloured(normals[k])))
    for key, name, numbers in (
        ("object_file_path", "objects", views.object_of_pixel),
        ("part_file_path", "parts", views.part_of_pixel),
    ):
        if numbers is None:
            continue
        if numbers.max(initial=0) >= MOST:
            raise UserError(f"More than {MOST - 1} {name} do not fit into a picture.")
        layers.append((key, name, lambda k, n=numbers: (n[k] + 1).astype(np.uint16)))
    return layers


def _said_of(camera: Camera) -> dict[str, float]:
    K = camera.K
    if K[0, 1] or K[1, 0] or not np.array_equal(K[2], (0, 0, 1)):
        raise UserError("A camera's K is skewed, which transforms.json cannot say.")
    fx, fy = float(K[0, 0]), float(K[1, 1])
    return {
        "camera_angle_x": 2 * math.atan(camera.width / 2 / fx),
        "camera_angle_y": 2 * math.atan(camera.height / 2 / fy),
        "fl_x": fx,
        "fl_y": fy,
        "cx": float(K[0, 2]),
        "cy": float(K[1, 2]),
        "w": camera.width,
        "h": camera.height,
    }


def _unit(views: Views) -> float:
    """Return the unit of depth: 1 mm, or a power of ten that suits smaller and larger scenes."""
    if views.depth is None:
        return UNIT
    seen = np.isfinite(views.depth)
    if views.object_of_pixel is not None and (views.object_of_pixel >= 0).any():
        seen &= views.object_of_pixel >= 0
    near, far = np.min(views.depth, where=seen, initial=np.inf), views.depth[seen].max(initial=0)
    if not 0 < near <= far:
        return UNIT
    if far > UNIT * MOST:
        return 10.0 ** math.ceil(math.log10(far / MOST))
    return min(UNIT, 10.0 ** math.floor(math.log10(near / STEPS)))


def _in_units(depth: np.ndarray, unit: float) -> np.ndarray:
    steps = np.round(depth / unit)
    return np.where(steps <= MOST, steps, 0).astype(np.uint16)


def _coloured(normals: np.ndarray) -> np.ndarray:
    there = normals.any(axis=-1, keepdims=True)
    return np.where(there, np.round((normals + 1) * 127.5), 0).astype(np.uint8)


# ---------------------------------------------------------------- reading


def read_views(folder: Path) -> Views:
    """Read a folder of posed pictures: ours, or anybody's photographs in the same form.

    Pictures may be PNG, JPEG or WebP; transparent ones are laid on white. What a frame says of its
    camera goes before what the file says. All but colours and cameras is optional.

    Raises:
        BadFileError: It is no such folder, a number or picture in it is bad, the pictures are not
            all of one size, or a lens bends straight lines.

    """
    path = folder / FILE
    if not path.is_file():
        raise BadFileError(path, "there is no such file.", "Name a folder that holds one.")
    said = store.read_json(path)
    frames = said.get("frames") if isinstance(said, dict) else None
    if not isinstance(frames, list) or not frames or not all(isinstance(f, dict) for f in frames):
        raise BadFileError(path, "it has no list of frames.", "Each needs its file_path.")
    shots = [_Shot(path, f"frame {k + 1}: ", said | frame) for k, frame in enumerate(frames)]
    rgb = _stacked(shots, "file_path", _flat)
    if rgb is None:
        raise BadFileError(path, "frame 1: 'file_path' is missing.", "Name its picture.")
    height, width = rgb.shape[1:3]
    depth, normals, objects, parts = (
        _stacked(shots, key, decode, rgb.shape[:3])
        for key, decode in (
            ("depth_file_path", decode_numbers),
            ("normal_file_path", _normals),
            ("object_file_path", decode_numbers),
            ("part_file_path", decode_numbers),
        )
    )
    unit = shots[0].number("integer_depth_scale", UNIT)
    return Views(
        rgb=rgb,
        cameras=tuple(s.camera(width, height) for s in shots),
        depth=None if depth is None else _metres(depth, unit),
        normals=normals,
        object_of_pixel=_numbered(objects),
        part_of_pixel=_numbered(parts),
    )


@dataclass(frozen=True)
class _Shot:
    """What is said of one frame, by itself or for all."""

    path: Path
    where: str
    value: dict[str, Any]

    def fail(self, what: str, next_step: str) -> NoReturn:
        raise BadFileError(self.path, f"{self.where}{what}", next_step)

    def number(self, key: str, default: float | None = None) -> float:
        x = self.value.get(key, default)
        good = isinstance(x, int | float) and not isinstance(x, bool) and math.isfinite(x)
        if not good or (x == 0 and key not in BENT):
            self.fail(f"{key!r} is {str(x)[:40]}.", "Give a finite number other than 0.")
        return float(x)

    def camera(self, width: int, height: int) -> Camera:
        """Return the camera of a picture of this size."""
        model = str(self.value.get("camera_model", ""))
        if model not in STRAIGHT or any(self.number(k, 0.0) for k in BENT):
            self.fail("its lens bends straight lines.", "Undistort the pictures first.")
        for key, size in (("w", width), ("h", height)):
            if self.number(key, float(size)) != size:
                self.fail(
                    f"{key!r} is {self.value[key]}, but its picture has {size}.", "Correct it."
                )
        if "fl_x" not in self.value and "camera_angle_x" not in self.value:
            self.fail("it states no focal length.", "Give fl_x [px] or camera_angle_x [rad].")
        angle = self.value.get("camera_angle_x") and self.number("camera_angle_x")
        fx = self.number("fl_x", width / 2 / math.tan(angle / 2) if angle else None)
        fy = self.number("fl_y", fx)
        if min(fx, fy) < 0:
            self.fail("its focal length is negative.", "Correct it.")
        cx, cy = self.number("cx", width / 2), self.number("cy", height / 2)
        K = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
        return Camera(K, self.pose() @ OPENGL, width, height)

    def pose(self) -> np.ndarray:
        """Return world from camera (4, 4), both as OpenGL has them."""
        try:
            matrix = np.array(self.value.get("transform_matrix"), dtype=float)
        except (ValueError, TypeError):
            matrix = np.zeros(0)
        if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
            self.fail("'transform_matrix' is no 4 × 4 matrix.", "Give it row by row.")
        turn = matrix[:3, :3]
        rigid = np.allclose(turn @ turn.T, np.eye(3), atol=1e-3) and np.linalg.det(turn) > 0
        if not rigid or not np.allclose(matrix[3], (0, 0, 0, 1)):
            self.fail("'transform_matrix' is no rotation and place.", "It must neither scale.")
        return matrix

    def picture(self, key: str, decode: Callable[[bytes], np.ndarray]) -> np.ndarray:
        """Return a picture of this frame."""
        name = self.value[key]
        if not isinstance(name, str) or not name:
            self.fail(f"{key!r} is {str(name)[:40]!r}.", "Name a picture.")
        if not Path(name).suffix:
            name += ".png"
        try:
            return decode(read_beside(self.path.parent, name, LARGEST_FILE))
        except ValueError as problem:
            self.fail(f"{name[:80]}: {problem}.", "Keep the pictures in the folder.")


def _stacked(
    shots: list[_Shot],
    key: str,
    decode: Callable[[bytes], np.ndarray],
    shape: tuple[int, ...] | None = None,
) -> np.ndarray | None:
    """Return one kind of picture of all frames, (V, H, W, …); None where no frame has it."""
    lacking = [s for s in shots if key not in s.value]
    if len(lacking) == len(shots):
        return None
    if lacking:
        lacking[0].fail(f"{key!r} is missing, but others have it.", "Add it, or leave all out.")
    first = shots[0].picture(key, decode)
    if len(shots) * first.shape[0] * first.shape[1] > LARGEST:
        shots[0].fail(f"{len(shots)} pictures of this size are too many.", "Shrink them first.")
    if shape is not None and first.shape[:2] != shape[1:]:
        shots[0].fail(f"{shots[0].value[key]} is not as large as its colours.", "Bring it to size.")
    whole = np.empty((len(shots), *first.shape), first.dtype)
    for k, shot in enumerate(shots):
        picture = shot.picture(key, decode) if k else first
        if picture.shape != first.shape:
            step = "Bring all to one size, or take pictures of one camera."
            shot.fail(f"{shot.value[key]} is of another size than that of frame 1.", step)
        whole[k] = picture
    return whole


def _flat(data: bytes) -> np.ndarray:
    """Return a picture's colours (H, W, 3), laid on white."""
    picture = decode_image(data, side=2**20)
    if picture.shape[2] == 3:
        return picture
    alpha = picture[..., 3:] / 255.0
    return np.round(picture[..., :3] * alpha + 255.0 * (1 - alpha)).astype(np.uint8)


def _metres(depth: np.ndarray, unit: float) -> np.ndarray:
    return np.where(depth == 0, np.inf, depth * unit).astype(np.float32)


def _normals(data: bytes) -> np.ndarray:
    picture = decode_image(data, side=2**20)[..., :3]
    vectors = picture / np.float32(127.5) - 1
    vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(picture.any(axis=-1, keepdims=True), vectors, 0).astype(np.float32)


def _numbered(pictures: np.ndarray | None) -> np.ndarray | None:
    return None if pictures is None else pictures.astype(np.int32) - 1

"""Posed pictures as ``transforms.json``, as in instant-ngp and nerfstudio.

The matrix of a frame leads from camera to world, both as OpenGL has them (x right, y up, z back; the world's z up);
ours looks along +z with y down, so the second and the third column change sign. The folder also holds what these tools
don't know (normals, who is where), under names of its own; they leave that alone.

    rgb/0000.png       sRGB
    depth/0000.png     16 bits: z-depth in units of integer_depth_scale [m]; 0: nothing, or farther
    normals/0000.png   (n + 1) / 2 in 8 bits, in the world; black: nothing
    objects/0000.png   16 bits: 1 + object; 0: none
    parts/0000.png     16 bits: 1 + part; 0: none
    masks/0000.png     8 bits: white where objects are, for tools that learn only what is there
"""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

from corporeal.core import store
from corporeal.core.errors import BadFileError, UserError
from corporeal.core.types import Camera, Views
from corporeal.io.image_decoder import decode_grey_numbers, decode_image
from corporeal.io.photos.transforms_frame import (
    OPENCV_FROM_OPENGL,
    TRANSFORMS_FILE,
    TransformsFrame,
    read_transforms_frames,
)
from corporeal.io.referenced_files import read_beside

MAX_DEPTH_U16 = 2**16 - 1
"""Largest number in a picture of 16 bits."""
DEFAULT_DEPTH_UNIT_M = 1e-3
"""Of depth, as these tools take it by default [m]; finer where objects are nearer."""
MIN_DEPTH_STEPS_TO_NEAREST = 1000
"""Units of depth to the nearest object, at least."""
MAX_VIEW_IMAGE_BYTES = 2**28
"""Of one picture [bytes]."""
MAX_VIEW_PIXELS_TOTAL = 2**30
"""Pixels of all views together."""


def write_views(folder: Path, views: Views) -> Path:
    """Write the folder; ``transforms.json`` comes last, so that it names only what is there.

    Returns:
        The path of ``transforms.json``.

    Raises:
        UserError: A camera is skewed, which the format cannot say; more than 65534 objects or parts; the disk refuses
            it.
    """
    path = folder / TRANSFORMS_FILE
    unit = _depth_unit(views)
    frames = [{"transform_matrix": (c.world_from_camera @ OPENCV_FROM_OPENGL).tolist()} for c in views.cameras]
    with store.disk_errors(folder):
        path.unlink(missing_ok=True)
        for key, name, pictures in _layers(views, unit):
            (folder / name).mkdir(parents=True, exist_ok=True)
            for k, frame in enumerate(frames):
                frame[key] = f"{name}/{k:04}.png"
                Image.fromarray(pictures(k)).save(folder / frame[key])
    lenses = [_members_of(c) for c in views.cameras]
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
        layers.append(("depth_file_path", "depth", lambda k: _depth_in_units(depth[k], unit)))
    if normals is not None:
        layers.append(("normal_file_path", "normals", lambda k: _normals_as_colours(normals[k])))
    for key, name, numbers in (
        ("object_file_path", "objects", views.object_of_pixel),
        ("part_file_path", "parts", views.part_of_pixel),
    ):
        if numbers is None:
            continue
        if numbers.max(initial=0) >= MAX_DEPTH_U16:
            raise UserError(f"More than {MAX_DEPTH_U16 - 1} {name} do not fit into a picture.")
        layers.append((key, name, lambda k, n=numbers: (n[k] + 1).astype(np.uint16)))
    owners = views.object_of_pixel
    if owners is not None:
        layers.append(("mask_path", "masks", lambda k: np.uint8(255) * (owners[k] >= 0)))
    return layers


def _members_of(camera: Camera) -> dict[str, float]:
    K = camera.K
    if K[0, 1] or K[1, 0] or not np.array_equal(K[2], (0, 0, 1)):
        raise UserError("A camera's K is skewed, which transforms.json does not support.")
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


def _depth_unit(views: Views) -> float:
    """Return the unit of depth: 1 mm, or a power of ten that suits smaller and larger scenes."""
    if views.depth is None:
        return DEFAULT_DEPTH_UNIT_M
    seen = np.isfinite(views.depth)
    if views.object_of_pixel is not None and (views.object_of_pixel >= 0).any():
        seen &= views.object_of_pixel >= 0
    near, far = np.min(views.depth, where=seen, initial=np.inf), views.depth[seen].max(initial=0)
    if not 0 < near <= far:
        return DEFAULT_DEPTH_UNIT_M
    if far > DEFAULT_DEPTH_UNIT_M * MAX_DEPTH_U16:
        return 10.0 ** math.ceil(math.log10(far / MAX_DEPTH_U16))
    return min(DEFAULT_DEPTH_UNIT_M, 10.0 ** math.floor(math.log10(near / MIN_DEPTH_STEPS_TO_NEAREST)))


def _depth_in_units(depth: np.ndarray, unit: float) -> np.ndarray:
    steps = np.round(depth / unit)
    return np.where(steps <= MAX_DEPTH_U16, steps, 0).astype(np.uint16)


def _normals_as_colours(normals: np.ndarray) -> np.ndarray:
    there = normals.any(axis=-1, keepdims=True)
    return np.where(there, np.round((normals + 1) * 127.5), 0).astype(np.uint8)


def read_views(folder: Path) -> Views:
    """Read a folder of posed pictures with all that was measured with them, as it was written.

    What a frame says of its camera goes before what the file says. All but colours and cameras is optional.
    ``photographs.read_photographs`` reads what others took, and is more patient.

    Raises:
        BadFileError: It is no such folder, a number or picture in it is bad, the pictures are not all of one size, or a
            lens bends straight lines.
    """
    path = folder / TRANSFORMS_FILE
    shots = read_transforms_frames(path)
    rgb = _stack_images(shots, "file_path", _colours_on_white)
    if rgb is None:
        raise BadFileError(path, "frame 1: 'file_path' is missing.", "Name its picture.")
    height, width = rgb.shape[1:3]
    depth, normals, objects, parts = (
        _stack_images(shots, key, decode, rgb.shape[:3])
        for key, decode in (
            ("depth_file_path", decode_grey_numbers),
            ("normal_file_path", _normals),
            ("object_file_path", decode_grey_numbers),
            ("part_file_path", decode_grey_numbers),
        )
    )
    unit = shots[0].number("integer_depth_scale", DEFAULT_DEPTH_UNIT_M)
    return Views(
        rgb=rgb,
        cameras=tuple(_camera(s, width, height) for s in shots),
        depth=None if depth is None else _depth_in_metres(depth, unit),
        normals=normals,
        object_of_pixel=_numbered(objects),
        part_of_pixel=_numbered(parts),
    )


def _camera(frame: TransformsFrame, width: int, height: int) -> Camera:
    """Return the camera of a picture of this size."""
    lens = frame.lens(width, height)
    if not lens.straight:
        frame.fail("its lens bends straight lines.", "Undistort the pictures first.")
    for key, stated, size in (("w", lens.width, width), ("h", lens.height, height)):
        if stated != size:
            frame.fail(f"{key!r} is {stated}, but its picture has {size}.", "Correct it.")
    return Camera(lens.K, frame.pose(), width, height)


def _picture(frame: TransformsFrame, key: str, decode: Callable[[bytes], np.ndarray]) -> np.ndarray:
    """Return a picture of one frame."""
    name = frame.text(key)
    if not Path(name).suffix:
        name += ".png"
    try:
        return decode(read_beside(frame.path.parent, name, MAX_VIEW_IMAGE_BYTES))
    except ValueError as problem:
        frame.fail(f"{name[:80]}: {problem}.", "Keep the pictures in the folder.")


def _stack_images(
    shots: list[TransformsFrame], key: str, decode: Callable[[bytes], np.ndarray], shape: tuple[int, ...] | None = None
) -> np.ndarray | None:
    """Return one kind of picture of all frames, (V, H, W, …); None where no frame has it."""
    lacking = [s for s in shots if key not in s.value]
    if len(lacking) == len(shots):
        return None
    if lacking:
        lacking[0].fail(f"{key!r} is missing, but others have it.", "Add it, or leave all out.")
    first = _picture(shots[0], key, decode)
    if len(shots) * first.shape[0] * first.shape[1] > MAX_VIEW_PIXELS_TOTAL:
        shots[0].fail(f"{len(shots)} pictures of this size are too many.", "Shrink them first.")
    if shape is not None and first.shape[:2] != shape[1:]:
        shots[0].fail(f"{shots[0].value[key]} is not as large as its colours.", "Bring it to size.")
    whole = np.empty((len(shots), *first.shape), first.dtype)
    for k, shot in enumerate(shots):
        picture = _picture(shot, key, decode) if k else first
        if picture.shape != first.shape:
            step = "Bring all to one size, or take pictures of one camera."
            shot.fail(f"{shot.value[key]} is of another size than that of frame 1.", step)
        whole[k] = picture
    return whole


def _colours_on_white(data: bytes) -> np.ndarray:
    """Return a picture's colours (H, W, 3), laid on white."""
    picture = decode_image(data, side=2**20)
    if picture.shape[2] == 3:
        return picture
    alpha = picture[..., 3:] / 255.0
    return np.round(picture[..., :3] * alpha + 255.0 * (1 - alpha)).astype(np.uint8)


def _depth_in_metres(depth: np.ndarray, unit: float) -> np.ndarray:
    return np.where(depth == 0, np.inf, depth * unit).astype(np.float32)


def _normals(data: bytes) -> np.ndarray:
    picture = decode_image(data, side=2**20)[..., :3]
    vectors = picture / np.float32(127.5) - 1
    vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(picture.any(axis=-1, keepdims=True), vectors, 0).astype(np.float32)


def _numbered(pictures: np.ndarray | None) -> np.ndarray | None:
    return None if pictures is None else pictures.astype(np.int32) - 1

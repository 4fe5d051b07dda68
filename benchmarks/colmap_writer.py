"""Writer of COLMAP models as text, for sets of made photographs."""

from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt8

from corporeal.core import store
from corporeal.core.types import Camera
from corporeal.geometry.rotation import quaternion_from_matrix


def write_colmap(
    folder: Path,
    cameras: tuple[Camera, ...],
    names: tuple[str, ...],
    points: Float[np.ndarray, "N 3"] | None = None,
    colours: UInt8[np.ndarray, "N 3"] | None = None,
) -> Path:
    """Write a model as text; every camera is a PINHOLE of its own (skew is lost: there is none).

    Raises:
        DiskError: The disk refuses it.

    """
    lenses, images = [], []
    for k, (camera, name) in enumerate(zip(cameras, names, strict=True)):
        K, pose = camera.K, camera.world_from_camera
        numbers = _format_numbers([K[0, 0], K[1, 1], K[0, 2], K[1, 2]])
        lenses.append(f"{k + 1} PINHOLE {camera.width} {camera.height} {numbers}")
        turn = quaternion_from_matrix(pose[:3, :3].T)
        shift = -pose[:3, :3].T @ pose[:3, 3]
        images += [f"{k + 1} {_format_numbers([*turn, *shift])} {k + 1} {name}", ""]
    there = np.zeros((0, 3)) if points is None else points
    shades = np.full(there.shape, 128, np.uint8) if colours is None else colours
    rows = zip(there, shades, strict=True)
    marks = [f"{k + 1} {_format_numbers(x)} {' '.join(str(c) for c in rgb)} 0" for k, (x, rgb) in enumerate(rows)]
    with store.disk_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
        for file, lines in (("cameras", lenses), ("images", images), ("points3D", marks)):
            (folder / f"{file}.txt").write_text("\n".join([*lines, ""]), encoding="utf-8")
    return folder


def _format_numbers(numbers: list[float] | np.ndarray) -> str:
    return " ".join(repr(float(x)) for x in numbers)

"""One frame of a ``transforms.json``, in any of the dialects that tools write.

Blender and NeRF's synthetic scenes state ``camera_angle_x`` alone and leave out the suffix of the picture; instant-ngp
and nerfstudio state ``fl_x``, ``cx``, ``w`` … for all frames or for each, and the coefficients of a lens (OPENCV).
"""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from corporeal.core.errors import BadFileError
from corporeal.geometry.rotation import nearest_rotation
from corporeal.multiview.lens_distortion import Lens

TRANSFORMS_FILE = "transforms.json"
OPENCV_FROM_OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
"""Between the axes of an OpenCV camera and an OpenGL one."""
MAX_TRANSFORMS_FILE_BYTES = 2**27
"""[bytes]"""
TRANSFORMS_ADVICE = "Name a folder of photographs with their transforms.json, or write the file again."
RADIAL_KEYS = ("k1", "k2", "k3", "k4")
TANGENTIAL_KEYS = ("p1", "p2")
READABLE_CAMERA_MODELS = ("", "OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "PERSPECTIVE")
FISHEYE_KEYS = ("is_fisheye", "ftheta_p0", "latlong")
"""Lens parameters of instant-ngp that are not of pinhole cameras."""


@dataclass(frozen=True)
class TransformsFrame:
    """What is stated of one frame, by itself or for all."""

    path: Path
    where: str
    value: dict[str, Any]

    def fail(self, what: str, next_step: str) -> NoReturn:
        """Reject the file because of this frame."""
        raise BadFileError(self.path, f"{self.where}{what}", next_step)

    def number(self, key: str, default: float | None = None, zero: bool = False) -> float:
        """Return a number; 0 only where it makes sense."""
        x = self.value.get(key, default)
        good = isinstance(x, int | float) and not isinstance(x, bool) and math.isfinite(x)
        if not good or (x == 0 and not zero):
            self.fail(f"{key!r} is {str(x)[:40]}.", "Give a finite number other than 0.")
        return float(x)

    def text(self, key: str) -> str:
        """Return the name of a picture."""
        name = self.value.get(key)
        if not isinstance(name, str) or not name:
            self.fail(f"{key!r} is {str(name)[:40]!r}.", "Name a picture.")
        return name

    def lens(self, width: int, height: int) -> Lens:
        """Return the lens before a picture of this size, or of the size that the file states."""
        model = str(self.value.get("camera_model", ""))
        if model.upper() not in READABLE_CAMERA_MODELS or any(self.value.get(key) for key in FISHEYE_KEYS):
            kind = model if model.upper() not in READABLE_CAMERA_MODELS else "fisheye"
            step = "Undistort the pictures, best with the program that wrote the file."
            self.fail(f"its lens bends straight lines in a way not known ({kind[:40]}).", step)
        if "fl_x" not in self.value and "camera_angle_x" not in self.value:
            self.fail("it states no focal length.", "Give fl_x [px] or camera_angle_x [rad].")
        width, height = int(self.number("w", float(width))), int(self.number("h", float(height)))
        fx = self.number("fl_x", self._focal("camera_angle_x", width))
        upright = None if "fl_x" in self.value else self._focal("camera_angle_y", height)
        fy = self.number("fl_y", upright or fx)
        if min(fx, fy, width, height) < 0:
            self.fail("its focal length is negative.", "Correct it, and its size.")
        cx, cy = self.number("cx", width / 2), self.number("cy", height / 2)
        K = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
        radial = tuple(self.number(key, 0.0, zero=True) for key in RADIAL_KEYS)
        p1, p2 = (self.number(key, 0.0, zero=True) for key in TANGENTIAL_KEYS)
        return Lens(K, width, height, radial, (p1, p2))

    def pose(self) -> np.ndarray:
        """Return world from camera (4, 4), the camera's axes as OpenCV has them."""
        try:
            matrix = np.array(self.value.get("transform_matrix"), dtype=float)
        except (ValueError, TypeError):
            matrix = np.zeros(0)
        if matrix.shape == (3, 4):
            matrix = np.vstack([matrix, [0, 0, 0, 1]])
        if matrix.shape != (4, 4):
            self.fail("'transform_matrix' is no 4 × 4 matrix.", "Give it row by row.")
        if not np.isfinite(matrix).all():
            step = "Pose it again, or leave the frame out of the file."
            self.fail("'transform_matrix' holds numbers that are not finite.", step)
        turn = matrix[:3, :3]
        rigid = np.allclose(turn @ turn.T, np.eye(3), atol=1e-3) and np.linalg.det(turn) > 0
        if not rigid or not np.allclose(matrix[3], (0, 0, 0, 1)):
            self.fail("'transform_matrix' is not a rigid transform.", "It must neither scale, shear nor mirror.")
        if not np.allclose(turn @ turn.T, np.eye(3), atol=1e-9):
            matrix[:3, :3] = nearest_rotation(turn)
        return matrix @ OPENCV_FROM_OPENGL

    def _focal(self, key: str, size: int) -> float | None:
        """Return the focal length of an angle of view [px], if one is stated."""
        if self.value.get(key) is None:
            return None
        angle = self.number(key)
        if not 0 < angle < math.pi:
            self.fail(f"{key!r} is {angle:.4g}.", "Give an angle between 0 and π [rad].")
        return size / 2 / math.tan(angle / 2)


def read_transforms_frames(path: Path) -> list[TransformsFrame]:
    """Return the frames of a file.

    Raises:
        BadFileError: It is no such file.
    """
    if not path.is_file():
        raise BadFileError(path, "there is no such file.", "Name a folder that holds one.")
    parsed = _parsed(path)
    frames = parsed.get("frames") if isinstance(parsed, dict) else None
    if not isinstance(frames, list) or not frames or not all(isinstance(f, dict) for f in frames):
        raise BadFileError(path, "it has no list of frames.", "Each needs its file_path.")
    return [TransformsFrame(path, f"frame {k + 1}: ", parsed | frame) for k, frame in enumerate(frames)]


def _parsed(path: Path) -> Any:
    try:
        if path.stat().st_size > MAX_TRANSFORMS_FILE_BYTES:
            raise BadFileError(path, f"is larger than {MAX_TRANSFORMS_FILE_BYTES >> 20} MiB.", TRANSFORMS_ADVICE)
        return json.loads(path.read_bytes())
    except OSError as problem:
        raise BadFileError(path, f"cannot be read ({problem.strerror}).") from problem
    except (ValueError, RecursionError) as problem:
        raise BadFileError(path, f"is no JSON ({str(problem)[:80]}).", TRANSFORMS_ADVICE) from None

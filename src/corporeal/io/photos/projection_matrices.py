"""Cameras as 3 × 4 projection matrices P = K [R | t], one file per image.

``name.txt`` or ``name.npy`` belongs to ``name.jpg`` (or .png …), beside it or in a folder of its own: ``projections``,
``cameras``, ``calib``, ``txt``. Texts may begin with the line CONTOUR. P maps a point of the world to (u, v, 1) times
its depth; the upper left corner of a picture is (0, 0). Hartley & Zisserman, "Multiple View Geometry", 2nd ed., section
6.2.4.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.linalg import rq

from corporeal.core.errors import BadFileError
from corporeal.io.photos.photo_file_names import READABLE_IMAGE_SUFFIXES

MATRIX_FOLDERS = ("", "projections", "cameras", "calib", "txt")
MATRIX_IMAGE_FOLDERS = ("", "images", "rgb", "image", "visualize")
MATRIX_SUFFIXES = (".txt", ".npy")
MAX_MATRIX_FILE_BYTES = 2**16
"""[bytes]"""
MAX_FOCAL_SIDE_RATIO, MIN_FOCAL_SIDE_RATIO = 50.0, 0.1
"""Focal lengths, in lengths of the picture's longer side, that lenses have."""
MATRIX_FORMAT_ADVICE = "Each must hold 3 lines of 4 numbers: K [R | t] in pixels."


def find_projections(folder: Path) -> list[tuple[Path, Path]]:
    """Return pictures and the files of their matrices, by name; empty: there are none."""
    for at in MATRIX_FOLDERS:
        files = {p.stem: p for p in _files(folder / at, MATRIX_SUFFIXES)}
        for shown in MATRIX_IMAGE_FOLDERS:
            pairs = [(p, files.get(p.stem)) for p in _files(folder / shown, READABLE_IMAGE_SUFFIXES)]
            found = [(p, file) for p, file in pairs if file is not None]
            if found:
                return found
    return []


def read_projection(path: Path) -> Float[np.ndarray, "3 4"]:
    """Read one matrix.

    Raises:
        BadFileError: It is none, or it is not finite.
    """
    try:
        if path.stat().st_size > MAX_MATRIX_FILE_BYTES:
            raise ValueError
        P = np.load(path, allow_pickle=False) if path.suffix == ".npy" else _text(path)
        P = np.asarray(P, dtype=np.float64)
    except (OSError, ValueError, TypeError, EOFError):
        P = np.zeros(0)
    if P.shape != (3, 4) or not np.isfinite(P).all():
        raise BadFileError(path, "holds no projection matrix.", MATRIX_FORMAT_ADVICE)
    return P


def split_projection(
    path: Path, P: Float[np.ndarray, "3 4"]
) -> tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "4 4"]]:
    """Return K and world from camera of a projection matrix of any scale and sign.

    The left 3 × 3 part is K R up to a factor. Its sign is such that the determinant is positive (then +z is ahead); K
    has a positive diagonal and ends in 1.

    Raises:
        BadFileError: The left part is singular: no finite camera.
    """
    M = P[:, :3]
    size = np.linalg.norm(M)
    determinant = np.linalg.det(M / size) if size > 0 else 0.0
    if abs(determinant) < 1e-12:
        raise BadFileError(path, "is not the matrix of a finite camera.", MATRIX_FORMAT_ADVICE)
    sign = 1.0 if determinant > 0 else -1.0
    K, R = rq(sign * M)
    flip = np.diag(np.sign(np.diag(K)))
    K, R = K @ flip, flip @ R
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = R.T, -np.linalg.solve(M, P[:, 3])
    return K / K[2, 2], pose


def check_focal(path: Path, K: Float[np.ndarray, "3 3"], width: int, height: int) -> None:
    """Reject a K that cannot be this picture's, as of matrices [R | t] without one.

    Raises:
        BadFileError: The focal length or the principal point is absurd.
    """
    side = max(width, height)
    focal = K[0, 0] / side, K[1, 1] / side
    middle = K[0, 2] / width, K[1, 2] / height
    plausible = MIN_FOCAL_SIDE_RATIO < min(focal) and max(focal) < MAX_FOCAL_SIDE_RATIO
    if not (plausible and min(middle) > -1 and max(middle) < 2):
        words = f"states a focal length of {K[0, 0]:.4g} and {K[1, 1]:.4g} pixels and a middle at "
        words += f"({K[0, 2]:.4g}, {K[1, 2]:.4g}) of a picture of {width} × {height}."
        raise BadFileError(path, words, MATRIX_FORMAT_ADVICE)


def _text(path: Path) -> np.ndarray:
    words = path.read_text(encoding="utf-8", errors="replace").split()
    if words[:1] == ["CONTOUR"]:
        words = words[1:]
    return np.array([float(w) for w in words]).reshape(3, 4)


def _files(folder: Path, suffixes: tuple[str, ...]) -> list[Path]:
    if not folder.is_dir():
        return []
    found = (p for p in folder.iterdir() if p.suffix.lower() in suffixes and p.is_file())
    return sorted(found)

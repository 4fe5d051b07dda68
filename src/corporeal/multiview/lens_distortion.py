"""Lens distortion, and undistortion of pictures.

Brown's model as OpenCV and COLMAP have it: at x, y = the direction over its depth, r² = x² + y²,

    x' = x (1 + k1 r² + k2 r⁴ + k3 r⁶ + k4 r⁸) + 2 p1 x y + p2 (r² + 2 x²)
    y' = y (1 + k1 r² + k2 r⁴ + k3 r⁶ + k4 r⁸) + p1 (r² + 2 y²) + 2 p2 x y
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Float32, Int32, UInt8
from scipy.ndimage import map_coordinates

FOCAL_LENGTH_CHANGE_RANGE = (0.5, 4.0)
"""How much the focal length may change so that a straightened picture has no empty border."""

UNDISTORT_ITERATIONS = 20
"""Rounds in which directions are found that a lens bends to given ones."""


@dataclass(frozen=True)
class Lens:
    """How a camera maps directions to a picture of a certain size."""

    K: Float[np.ndarray, "3 3"]
    """Picture from camera coordinates [px]."""
    width: int
    """[px]"""
    height: int
    """[px]"""
    radial: tuple[float, ...] = ()
    """k1, k2, k3, k4, as many as there are."""
    tangential: tuple[float, float] = (0.0, 0.0)
    """p1, p2."""

    @property
    def straight(self) -> bool:
        """Whether straight lines stay straight."""
        return not any(self.radial) and not any(self.tangential)

    def resized(self, width: int, height: int) -> "Lens":
        """Return the same lens in front of a picture of another size."""
        stretch = np.diag([width / self.width, height / self.height, 1.0])
        return replace(self, K=stretch @ self.K, width=width, height=height)


def distort_directions(lens: Lens, xy: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, "N 2"]:
    """Return where directions x, y appear to lie."""
    x, y = xy[:, 0], xy[:, 1]
    r2 = x * x + y * y
    scale = 1 + sum(k * r2 ** (n + 1) for n, k in enumerate(lens.radial))
    p1, p2 = lens.tangential
    return np.stack(
        [x * scale + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * scale + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y],
        axis=-1,
    )


def undistort_points(lens: Lens, points: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, "N 2"]:
    """Return the directions x, y that a photograph shows at points [px]: undo ``distort_directions``."""
    seen = _pixel_directions(lens.K, points)
    xy = seen
    for _ in range(UNDISTORT_ITERATIONS):
        xy = seen - (distort_directions(lens, xy) - xy)
    return xy


def undistort_image(
    picture: UInt8[np.ndarray, "H W C"] | Int32[np.ndarray, "H W C"], lens: Lens
) -> tuple[np.ndarray, Float[np.ndarray, "3 3"]]:
    """Return the picture as a pinhole camera would have taken it, and that camera's K.

    It has the same size and principal point, and shows as much as it can without an empty border. Colours (8 bits) are
    interpolated, numbers (32 bits) are not.

    Raises:
        ValueError: The lens bends more than that allows.
    """
    if lens.straight:
        return picture, lens.K
    K = _intrinsics_without_border(lens)
    source = _distorted_place(lens, K, _pixel_centres(lens.width, lens.height))
    order = 1 if picture.dtype == np.uint8 else 0
    rows, columns = (source[:, k].reshape(lens.height, lens.width) - 0.5 for k in (1, 0))
    planes = [
        map_coordinates(picture[..., c], [rows, columns], np.float64, order=order, mode="nearest")
        for c in range(picture.shape[2])
    ]
    return np.round(np.stack(planes, axis=-1)).astype(picture.dtype), K


def redistort_image(picture: Float32[np.ndarray, "H W"], lens: Lens) -> Float32[np.ndarray, "H W"]:
    """Return what a straightened picture shows as the lens shows it: undo ``undistort_image``.

    Beyond the edge of the straightened picture its edge goes on.

    Raises:
        ValueError: The lens bends more than that allows.
    """
    if lens.straight:
        return picture
    K = _intrinsics_without_border(lens)
    xy = undistort_points(lens, _pixel_centres(lens.width, lens.height))
    source = xy @ K[:2, :2].T + K[:2, 2]
    rows, columns = (source[:, k].reshape(picture.shape) - 0.5 for k in (1, 0))
    return map_coordinates(picture, [rows, columns], np.float32, order=1, mode="nearest")


def _intrinsics_without_border(lens: Lens) -> np.ndarray:
    """Return the K of least focal length at which every pixel was photographed."""
    edge = _edge_points(lens.width, lens.height)
    low, high = FOCAL_LENGTH_CHANGE_RANGE
    if not _is_covered(lens, _zoomed_intrinsics(lens.K, high), edge):
        raise ValueError("its lens bends too much")
    if _is_covered(lens, _zoomed_intrinsics(lens.K, low), edge):
        return _zoomed_intrinsics(lens.K, low)
    while high - low > 1e-4:
        middle = (low + high) / 2
        if _is_covered(lens, _zoomed_intrinsics(lens.K, middle), edge):
            high = middle
        else:
            low = middle
    return _zoomed_intrinsics(lens.K, high)


def _is_covered(lens: Lens, K: np.ndarray, edge: np.ndarray) -> bool:
    """Return whether the edge of the picture, and so all of it, lies within the photograph."""
    with np.errstate(over="ignore", invalid="ignore"):
        xy = _pixel_directions(K, edge)
        r = np.linspace(0, np.sqrt((xy**2).sum(axis=1).max()), 64)
        slope = 1 + sum((2 * n + 3) * k * r ** (2 * n + 2) for n, k in enumerate(lens.radial))
        seen = _distorted_place(lens, K, edge)
        good = (seen >= 0).all() and (seen <= (lens.width, lens.height)).all()
        return bool(good and np.min(slope) > 0)


def _distorted_place(lens: Lens, K: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return where the photograph shows what a pinhole camera K shows at points [px]."""
    xy = distort_directions(lens, _pixel_directions(K, points))
    return xy @ lens.K[:2, :2].T + lens.K[:2, 2]


def _pixel_directions(K: np.ndarray, points: np.ndarray) -> np.ndarray:
    return (points - K[:2, 2]) @ np.linalg.inv(K[:2, :2]).T


def _zoomed_intrinsics(K: np.ndarray, zoom: float) -> np.ndarray:
    zoomed = K.copy()
    zoomed[:2, :2] *= zoom
    return zoomed


def _pixel_centres(width: int, height: int) -> np.ndarray:
    v, u = np.mgrid[:height, :width] + 0.5
    return np.stack([u.ravel(), v.ravel()], axis=-1)


def _edge_points(width: int, height: int) -> np.ndarray:
    u, v = np.linspace(0.5, width - 0.5, 65), np.linspace(0.5, height - 0.5, 65)
    sides = [(u, v[0] + 0 * u), (u, v[-1] + 0 * u), (u[0] + 0 * v, v), (u[-1] + 0 * v, v)]
    return np.concatenate([np.stack(side, axis=-1) for side in sides])

"""Silhouette coherence of the visual hull.

Under the right poses the part of space that all silhouettes allow fills each of them. After Hernández, Schmitt &
Cipolla, "Silhouette coherence for camera calibration under circular motion" (2007).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from PIL import Image
from scipy.ndimage import binary_dilation

from corporeal.core.types import Camera
from corporeal.multiview.epipolar import projection_matrix

COHERENCE_IMAGE_SIDE_PX = 48
"""Longer side at which silhouettes are compared [px]."""
HULL_GRID_POINTS_PER_EDGE = 64
"""Points along each edge of the cube that is searched."""
HULL_HALF_EDGE_RADII = 1.3
"""Half edge of that cube, in radii of the object as the cameras see it."""
MIN_MASK_FILLED_FRACTION = 0.9
"""Share of a mask that one solid must fill, the median of all views. Visual hulls: 1.00 under right poses of two real
sets, .85 under those of the card that an axe head lay on before and after it was turned over. Closed surfaces: .94 and
more, .84 of a helmet whose masks hold pieces of the wall."""
MASK_THRESHOLD_U8 = 127
"""What a mask must exceed."""
MIN_OUTSIDE_VIEWS, MIN_OUTSIDE_VIEWS_FRACTION = 2, 0.1
"""So many views, and so large a share of those that look, must see a place beside their masks for it to be outside,
where outlines are off by some pixels. Half of that share eats objects (12 % of four balls where outlines err by 10 of
640 px, against 5 %), twice of it leaves a fifth too much."""


@dataclass(frozen=True)
class SilhouetteComparison:
    """Masks beside silhouettes of a shape; NaN: a mask is empty."""

    overlap: Float[np.ndarray, " V"]
    """Intersection over union."""
    filled: Float[np.ndarray, " V"]
    """Share of the mask that the shape fills."""


def mask_overlap_and_fill(shown: Bool[np.ndarray, "h w"], mask: Bool[np.ndarray, "h w"]) -> tuple[float, float]:
    """Return the overlap of a shape with a mask, and how much of the mask it fills; NaN: empty."""
    if not mask.any():
        return float("nan"), float("nan")
    common = float((shown & mask).sum())
    return common / float((shown | mask).sum()), common / float(mask.sum())


def is_outside_silhouettes(
    beside: Int[np.ndarray, " N"] | Float[np.ndarray, " N"], looking: Int[np.ndarray, " N"] | Float[np.ndarray, " N"]
) -> Bool[np.ndarray, " N"]:
    """Return which places are outside, by how many views look there and see them beside masks."""
    return (beside >= MIN_OUTSIDE_VIEWS) & (beside >= MIN_OUTSIDE_VIEWS_FRACTION * looking)


def silhouette_coherence(masks: UInt8[np.ndarray, "V H W"], cameras: tuple[Camera, ...]) -> float:
    """Return which share of a silhouette the visual hull fills, the median of all views."""
    points = hull_grid_points(masks, cameras)
    coarse = [shrink_mask(mask) for mask in masks]
    allowed = np.ones(len(points), bool)
    cells = []
    for mask, camera in zip(coarse, cameras, strict=True):
        cell = pixels_of_points(points, camera, mask.shape)
        cells.append(cell)
        near = np.asarray(binary_dilation(mask), bool)  # nothing is lost for being thin
        allowed &= (cell < 0) | near.ravel()[cell]
    return float(np.median([_filled_fraction(m, c[allowed]) for m, c in zip(coarse, cells, strict=True)]))


def hull_grid_points(masks: UInt8[np.ndarray, "V H W"], cameras: tuple[Camera, ...]) -> Float[np.ndarray, "N 3"]:
    """Return points of a cubic grid that holds what silhouettes show."""
    aims = [_silhouette_aim(mask, camera) for mask, camera in zip(masks, cameras, strict=True)]
    centre = _nearest_to_rays(aims)
    radius = float(np.median([np.linalg.norm(centre - a.eye) * a.half_angle for a in aims]))
    line = np.linspace(-1, 1, HULL_GRID_POINTS_PER_EDGE) * radius * HULL_HALF_EDGE_RADII
    return centre + np.stack(np.meshgrid(line, line, line), axis=-1).reshape(-1, 3)


def pixels_of_points(points: Float[np.ndarray, "N 3"], camera: Camera, shape: tuple[int, ...]) -> Int[np.ndarray, " N"]:
    """Return which pixel of a small picture shows each point; -1: none."""
    P = projection_matrix(camera)
    u, v, depth = P[:, :3] @ points.T + P[:, 3:]
    with np.errstate(divide="ignore", invalid="ignore"):
        column = np.floor(u / depth * shape[1] / camera.width)
        row = np.floor(v / depth * shape[0] / camera.height)
    seen = (depth > 0) & (column >= 0) & (column < shape[1]) & (row >= 0) & (row < shape[0])
    return np.where(seen, row * shape[1] + column, -1).astype(np.int64)


def shrink_mask(mask: UInt8[np.ndarray, "H W"], side: int = COHERENCE_IMAGE_SIDE_PX) -> Bool[np.ndarray, "h w"]:
    """Return a mask as silhouettes are compared, no side longer than ``side``."""
    share = min(1.0, side / max(mask.shape))
    size = (max(1, round(mask.shape[1] * share)), max(1, round(mask.shape[0] * share)))
    return np.asarray(Image.fromarray(mask).resize(size, Image.Resampling.BOX)) > MASK_THRESHOLD_U8


def _filled_fraction(mask: np.ndarray, cells: np.ndarray) -> float:
    covered = np.zeros(mask.size, bool)
    covered[cells[cells >= 0]] = True
    return float((covered & mask.ravel()).sum() / max(mask.sum(), 1))


@dataclass(frozen=True)
class _SilhouetteAim:
    """From a camera to the middle of its silhouette."""

    eye: Float[np.ndarray, "3"]
    """[m]"""
    ray: Float[np.ndarray, "3"]
    """Unit."""
    half_angle: float
    """Of the silhouette [rad]."""


def _silhouette_aim(mask: np.ndarray, camera: Camera) -> _SilhouetteAim:
    rows, columns = np.nonzero(mask > MASK_THRESHOLD_U8)
    if not len(rows):
        rows, columns = np.indices(mask.shape).reshape(2, -1)
    middle = np.array([(columns.min() + columns.max() + 1) / 2, (rows.min() + rows.max() + 1) / 2])
    size = max(np.ptp(columns), np.ptp(rows)) / 2 / min(camera.K[0, 0], camera.K[1, 1])
    ray = camera.world_from_camera[:3, :3] @ np.linalg.solve(camera.K, [*middle, 1.0])
    return _SilhouetteAim(camera.world_from_camera[:3, 3], ray / np.linalg.norm(ray), float(size))


def _nearest_to_rays(aims: list[_SilhouetteAim]) -> np.ndarray:
    """Return the point nearest to all rays, in least squares."""
    across = [np.eye(3) - np.outer(a.ray, a.ray) for a in aims]
    right = np.sum([m @ a.eye for m, a in zip(across, aims, strict=True)], axis=0)
    return np.linalg.lstsq(np.sum(across, axis=0), right, rcond=None)[0]

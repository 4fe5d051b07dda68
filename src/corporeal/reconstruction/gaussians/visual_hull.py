"""The visual hull: the part of space that all masks allow."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import label

from corporeal.core.errors import UserError
from corporeal.core.types import Camera, Views
from corporeal.multiview.silhouette_coherence import (
    COHERENCE_IMAGE_SIDE_PX,
    MIN_OUTSIDE_VIEWS,
    MIN_OUTSIDE_VIEWS_FRACTION,
    is_outside_silhouettes,
    pixels_of_points,
    shrink_mask,
)
from corporeal.multiview.viewed_region import find_viewed_region
from corporeal.reconstruction.gaussians.hull_config import DEFAULT_HULL, HullConfig
from corporeal.reconstruction.gaussians.kernels_training import count_mask_votes
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool

ASTRAY_VIEWS_FRACTION = 0.05
"""Share of the views that may see a point of the hull beside objects: masks err at edges."""
COMPARED_PX_PER_CELL = 0.4
"""Pixels of the pictures in which that is compared, per cell along the box: a cell is smaller."""
MANY_VIEWS = 8
"""Views from which on some may err more: of fewer, each is needed."""
NEEDED_PIXELS_FRACTION = 0.2
"""Share of the pixels of a piece of the hull that only it must fill for it to stand there."""


@dataclass(frozen=True)
class VisualHull:
    """Cubes that fill a box, and which of them are inside all masks."""

    cells: Float[np.ndarray, "X Y Z 3"]
    """Their middles [m]."""
    side: float
    """[m]"""
    inside: Bool[np.ndarray, "X Y Z"]


@dataclass(frozen=True)
class CarvedVolume:
    """What masks and lines of sight say of where objects are."""

    views: Views
    masks: Bool[np.ndarray, "V H W"]
    hull: VisualHull
    """Without what lines of sight pass through, and what stereo sees past."""
    empty: Bool[np.ndarray, "X Y Z"]
    """Which of its cells lines of sight pass through."""

    def emptied(self, places: Float[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
        """Return which places are where lines of sight say that nothing is."""
        if not self.empty.any():
            return np.zeros(len(places), np.bool_)
        cell = np.round((places - self.hull.cells[0, 0, 0]) / self.hull.side)
        near = ((cell >= 0) & (cell < self.empty.shape)).all(axis=1)
        cell = np.where(near[:, None], cell, 0).astype(np.int64)
        return near & self.empty[*cell.T]


def carve_tight_hull(
    views: Views, masks: Bool[np.ndarray, "V H W"], pool: ThreadPool, config: HullConfig = DEFAULT_HULL
) -> VisualHull:
    """Return the visual hull in a box that hardly holds more.

    Raises:
        UserError: Nothing is inside all masks.
    """
    around = find_viewed_region(views.cameras)
    middle, reach = np.array(around.centre), 1.5 * around.radius
    rough = carve_hull(middle - reach, middle + reach, views, masks, pool, config)
    found = rough.cells[rough.inside]
    low, high = found.min(axis=0) - 2 * rough.side, found.max(axis=0) + 2 * rough.side
    return carve_hull(low, high, views, masks, pool, config)


def carve_hull(
    low: np.ndarray,
    high: np.ndarray,
    views: Views,
    masks: np.ndarray,
    pool: ThreadPool,
    config: HullConfig = DEFAULT_HULL,
) -> VisualHull:
    """Carve a box: what is left is on objects in all views that see it, but for a few.

    Where that eats what masks show, more views may err: ``geometry.silhouettes.outside``.

    Raises:
        UserError: Nothing is left.
    """
    side = float(np.cbrt(np.prod(high - low) / config.grid_cells))
    axes = [np.arange(a + side / 2, b, side) for a, b in zip(low, high, strict=True)]
    cells = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    points, count = cells.reshape(-1, 3), len(views.cameras)
    patience = max(MIN_OUTSIDE_VIEWS, MIN_OUTSIDE_VIEWS_FRACTION * count)
    seen = mask_votes_at_points(points, views, masks, pool, patience)
    enough = seen[:, 0] >= max(1, count / 4)
    inside = enough & (seen[:, 1] <= ASTRAY_VIEWS_FRACTION * count)
    compared = min(COHERENCE_IMAGE_SIDE_PX, int(COMPARED_PX_PER_CELL * max(cells.shape[:3])))
    if (
        count >= MANY_VIEWS
        and mask_fill_fraction(points[inside], views.cameras, masks, compared) < config.min_mask_fill_fraction
    ):
        inside = enough & ~is_outside_silhouettes(seen[:, 1], seen[:, 0] + seen[:, 1])
    if not inside.any():
        raise UserError(
            "No place in space is inside all masks. Check that cameras, pictures and masks "
            "belong together, and the convention of the camera poses."
        )
    found = VisualHull(cells, side, inside.reshape(cells.shape[:3]))
    return _without_phantoms(found, seen[:, 0].reshape(cells.shape[:3]), views, masks, config)


def _without_phantoms(
    hull: VisualHull,
    seen: Float[np.ndarray, "X Y Z"],
    views: Views,
    masks: np.ndarray,
    config: HullConfig = DEFAULT_HULL,
) -> VisualHull:
    """Drop pieces that few views see and that fill little of the masks that others do not fill.

    A piece that stands for an object fills all of its silhouettes, one where silhouettes cross by chance only what they
    share: those that fill most are taken first.
    """
    piece = np.empty(hull.inside.shape, np.int32)
    label(hull.inside, np.ones((3, 3, 3)), piece)
    count = int(piece.max())
    most = np.zeros(count + 1)
    np.maximum.at(most, piece[hull.inside], seen[hull.inside])
    kept = most > config.phantom_max_views
    kept[0] = True
    if count < 2 or kept.all():
        return hull
    pixel, owner = _shown_pixels(hull.cells[hull.inside], piece[hull.inside], views.cameras, masks)
    own = np.bincount(owner, minlength=count + 1)
    bare = ~np.isin(pixel, pixel[kept[owner]])
    while True:
        gain = np.bincount(owner[bare], minlength=count + 1)
        best = np.argmax(np.where(gain >= NEEDED_PIXELS_FRACTION * own, gain, 0))
        if gain[best] == 0:
            return replace(hull, inside=hull.inside & kept[piece])
        kept[best] = True
        bare &= ~np.isin(pixel, pixel[owner == best])


def _shown_pixels(
    places: np.ndarray, owner: np.ndarray, cameras: tuple[Camera, ...], masks: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return which pixels of all small pictures show whom; each pair once."""
    pairs = []
    for k, (camera, mask) in enumerate(zip(cameras, masks, strict=True)):
        on = shrink_mask(255 * mask.astype(np.uint8))
        pixel = pixels_of_points(places, camera, on.shape)
        good = (pixel >= 0) & on.ravel()[pixel]
        pairs.append(np.stack([pixel[good] + k * on.size, owner[good]], axis=1))
    pixel, who = np.unique(np.concatenate(pairs), axis=0).T
    return pixel, who


def mask_fill_fraction(
    points: Float[np.ndarray, "N 3"], cameras: tuple[Camera, ...], masks: np.ndarray, side: int
) -> float:
    """Return which share of masks points fill in pictures of ``side`` pixels: the median view."""
    shares = []
    for camera, mask in zip(cameras, masks, strict=True):
        on = shrink_mask(255 * mask.astype(np.uint8), side)
        pixel = pixels_of_points(points, camera, on.shape)
        met = np.zeros(on.size, bool)
        met[pixel[pixel >= 0]] = True
        shares.append((met & on.ravel()).sum() / max(on.sum(), 1))
    return float(np.median(shares))


def mask_votes_at_points(
    points: np.ndarray, views: Views, masks: np.ndarray, pool: ThreadPool, patience: float | None = None
) -> Float[np.ndarray, "N 5"]:
    """Return what views say of points, as ``kernels_learn.witness`` has it.

    patience: after more views that see a point beside objects no other view is read; None: as many as ASTRAY forgives.
    """
    out = np.empty((len(points), 5))
    patience = ASTRAY_VIEWS_FRACTION * len(views.cameras) if patience is None else float(patience)
    rest = camera_rows(views.cameras), views.rgb, masks, patience, out
    points = np.ascontiguousarray(points, dtype=np.float64)
    pool.each(count_mask_votes, [(points, *span, *rest) for span in pool.spans(len(points))])
    return out


def camera_rows(cameras: tuple[Camera, ...]) -> Float[np.ndarray, "V 16"]:
    """Return cameras as kernels read many: camera from world (3 × 4), then fx, fy, cx, cy."""
    rows = np.empty((len(cameras), 16))
    for row, camera in zip(rows, cameras, strict=True):
        row[:12] = np.linalg.inv(camera.world_from_camera)[:3].ravel()
        K = camera.K
        row[12:] = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    return rows


def pixel_width(rows: Float[np.ndarray, "V _"], place: Float[np.ndarray, "3"]) -> float:
    """Return how wide a pixel is at a place, in the middle view [m].

    Args:
        rows: Cameras as ``camera_rows`` gives them; more may follow in each row.
        place: [m]
    """
    pose = rows[:, :12].reshape(-1, 3, 4)
    ahead = pose[:, 2, :3] @ place + pose[:, 2, 3]
    return float(np.median(np.abs(ahead) / rows[:, 12]))

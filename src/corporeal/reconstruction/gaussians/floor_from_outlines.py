"""Height of the floor from the outlines of objects.

Gaussians show it badly: undersides are not seen, and what all masks allow bulges below them. But where an object
touches the floor its lower outlines all meet: a ray through an outline touches what all masks allow in a short stretch
there, and that lies on the object. Of what stands on a flat foot most rays say the same height but for noise, and the
floor is there: the lowest of them are wrong by twice their noise. What is round below touches no outline where it
touches the floor, and its rays say many heights.
"""

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import gaussian_filter1d, shift

from corporeal.core.types import Camera, Views
from corporeal.multiview.viewed_region import find_viewed_region
from corporeal.reconstruction.gaussians.hull_config import DEFAULT_HULL, HullConfig
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.gaussians.visual_hull import VisualHull, camera_rows, carve_tight_hull, pixel_width

MIN_DOWN_IN_PICTURE = 0.3
"""Length of a unit vector down in a picture, below which the view is too steep to show it."""
MAX_HEIGHT_STRETCH_RADII = 0.04
"""Longest stretch in height that still says where an object is, in radii of the region."""
LOWEST_PERCENTILE = 5
"""Percentile of heights below which nothing is: of rays through rims, all but a few."""
OUTLINE_ERROR_PX, MAX_HEIGHT_SPREAD_PX = 0.5, 2.0
"""Error of outlines [px], by which heights are smoothed; and how far below the height at which most rays touch
something the lowest may lie for these to be one height and its noise [px]."""
BINS_PER_OUTLINE_ERROR = 8
"""Steps of height in one such error: so finely heights are counted."""
MIN_FLOOR_RAYS = 20
"""Rays that must say it."""


def floor_height_from_outlines(
    views: Views, masks: Bool[np.ndarray, "V H W"], threads: int | None = None, config: HullConfig = DEFAULT_HULL
) -> float | None:
    """Return the height that objects stand on [m], +z up; None: outlines do not tell.

    Raises:
        UserError: Nothing is inside all masks.
    """
    with ThreadPool(threads) as pool:
        hull = carve_tight_hull(views, masks, pool, config)
    around = find_viewed_region(views.cameras)
    pairs = zip(views.cameras, masks, strict=True)
    found = [_touched_heights(hull, c, m, np.array(around.centre), around.radius) for c, m in pairs]
    low, high = np.concatenate(found).T
    good = high - low < MAX_HEIGHT_STRETCH_RADII * around.radius
    if np.count_nonzero(good) < MIN_FLOOR_RAYS:
        return None
    pixel = pixel_width(camera_rows(views.cameras), np.array(around.centre))
    return _foot_height((low + high)[good] / 2, pixel)


def _foot_height(height: Float[np.ndarray, " N"], pixel: float) -> float:
    """Return where the floor is, by the heights at which rays touch something [m]."""
    least = float(np.percentile(height, LOWEST_PERCENTILE))
    near = height[height < least + 2 * MAX_HEIGHT_SPREAD_PX * pixel]
    step = OUTLINE_ERROR_PX * pixel / BINS_PER_OUTLINE_ERROR
    counts = np.bincount(((near - near.min()) / step).astype(int)).astype(float)
    most = float(near.min() + (gaussian_filter1d(counts, BINS_PER_OUTLINE_ERROR).argmax() + 0.5) * step)
    return most if most - least < MAX_HEIGHT_SPREAD_PX * pixel else least


def _touched_heights(
    hull: VisualHull, camera: Camera, mask: np.ndarray, centre: np.ndarray, radius: float
) -> Float[np.ndarray, "N 2"]:
    """Return between which heights rays through the lower outline are within the hull [m]."""
    pose = camera.world_from_camera
    down = -pose[2, :2]
    if np.linalg.norm(down) < MIN_DOWN_IN_PICTURE:
        return np.empty((0, 2))
    right, below = np.round(down / np.linalg.norm(down)).astype(int)
    rim = mask & np.logical_not(shift(mask, (-below, -right), order=0, mode="nearest"))
    y, x = np.nonzero(rim)
    local = np.linalg.solve(camera.K, np.stack([x + 0.5, y + 0.5, np.ones(len(x))]))
    rays = local.T @ pose[:3, :3].T
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    middle = np.linalg.norm(centre - pose[:3, 3])
    far = np.arange(middle - 2 * radius, middle + 2 * radius, hull.side / 2)
    places = pose[:3, 3] + far[:, None] * rays[:, None]
    at = np.round((places - hull.cells[0, 0, 0]) / hull.side).astype(int)
    fits = ((at >= 0) & (at < hull.inside.shape)).all(axis=-1)
    at[~fits] = 0
    within = fits & hull.inside[tuple(np.moveaxis(at, -1, 0))]
    low = np.where(within, places[..., 2], np.inf).min(axis=1)
    high = np.where(within, places[..., 2], -np.inf).max(axis=1)
    met = within.any(axis=1)
    return np.stack([low[met], high[met]], axis=1)

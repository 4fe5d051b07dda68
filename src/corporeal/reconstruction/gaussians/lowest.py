"""How low objects reach, as their outlines tell: the height of a floor that masks hide.

Gaussians say it badly: nobody sees undersides, and what all masks allow bulges below them. But
where an object touches the floor its lower outlines all meet: a ray through an outline touches what
all masks allow in a short stretch there, and that lies on the object. Of what stands on a flat
foot most rays say the same height but for noise, and the floor is there: the lowest of them are
wrong by twice their noise. What is round below touches no outline where it touches the floor, and
its rays say many heights.
"""

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import gaussian_filter1d, shift

from corporeal.core.types import Camera, Views
from corporeal.multiview.region import region
from corporeal.reconstruction.gaussians.hull import Carved, camera_rows, pixel_width, tight
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool

STEEP = 0.3
"""Length of a unit vector down in a picture, below which the view is too steep to show it."""
SHORT = 0.04
"""Longest stretch in height that still says where an object is, in radii of the region."""
LOWEST = 5
"""Percentile of heights below which nothing is: of rays through rims, all but a few."""
ERROR, WIDE = 0.5, 2.0
"""Error of outlines [px], by which heights are smoothed; and how far below the height at which most
rays touch something the lowest may lie for these to be one height and its noise [px]."""
FINE = 8
"""Steps of height in one such error: so finely heights are counted."""
FEWEST = 20
"""Rays that must say it."""


def lowest(
    views: Views, masks: Bool[np.ndarray, "V H W"], threads: int | None = None
) -> float | None:
    """Return the height that objects stand on [m], +z up; None: outlines do not tell.

    Raises:
        UserError: Nothing is inside all masks.

    """
    with ThreadPool(threads) as pool:
        hull = tight(views, masks, pool)
    around = region(views.cameras)
    pairs = zip(views.cameras, masks, strict=True)
    found = [_touched(hull, c, m, np.array(around.centre), around.radius) for c, m in pairs]
    low, high = np.concatenate(found).T
    good = high - low < SHORT * around.radius
    if np.count_nonzero(good) < FEWEST:
        return None
    pixel = pixel_width(camera_rows(views.cameras), np.array(around.centre))
    return _foot((low + high)[good] / 2, pixel)


def _foot(height: Float[np.ndarray, " N"], pixel: float) -> float:
    """Return where the floor is, by the heights at which rays touch something [m]."""
    least = float(np.percentile(height, LOWEST))
    near = height[height < least + 2 * WIDE * pixel]
    step = ERROR * pixel / FINE
    counts = np.bincount(((near - near.min()) / step).astype(int)).astype(float)
    most = float(near.min() + (gaussian_filter1d(counts, FINE).argmax() + 0.5) * step)
    return most if most - least < WIDE * pixel else least


def _touched(
    hull: Carved, camera: Camera, mask: np.ndarray, centre: np.ndarray, radius: float
) -> Float[np.ndarray, "N 2"]:
    """Return between which heights rays through the lower outline are within the hull [m]."""
    pose = camera.world_from_camera
    down = -pose[2, :2]
    if np.linalg.norm(down) < STEEP:
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

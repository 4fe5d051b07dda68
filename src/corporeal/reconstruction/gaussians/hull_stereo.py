"""Stereo inside the visual hull, for concavities.

No silhouette shows the mouth of a vessel seen from above: the hull closes it. For pixels of every view, the depth is
looked for between the front and the back of the hull at which patches of neighbouring views correlate best, as Goesele,
Curless and Seitz (2006) do, and those kept that other views do not contradict. What lies on the way there is empty
where two views see past it, and more of them than see something there.
"""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import minimum_filter, uniform_filter

from corporeal.core.types import Views
from corporeal.reconstruction.gaussians.kernels_hull_stereo import (
    PATCH_RADIUS_PX,
    count_past_votes,
    hull_chords,
    search_depths,
)
from corporeal.reconstruction.gaussians.kernels_plane_sweep import count_support
from corporeal.reconstruction.gaussians.plane_sweep import neighbouring_views
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.gaussians.training_schedule import shrink_picture
from corporeal.reconstruction.gaussians.visual_hull import VisualHull, camera_rows

MAX_STEREO_PICTURE_PX = 256
"""Of the pictures looked at [px]; larger ones are shrunk."""
MAX_STEREO_DEPTHS = 40_000
"""Depths that are looked for in all views together, about."""
MIN_STEREO_PATCH_DEVIATION, MIN_STEREO_CORRELATION, MIN_STEREO_CORRELATION_GAIN = 0.01, 0.7, 0.1
"""Least deviation of a patch [0–1]; least correlation of what is the same; by how much that must exceed the correlation
at the hull's front for something deeper to be accepted.
"""
STEREO_DEPTH_TOLERANCE = 0.015
"""Relative difference of depths that agree."""
DEPTH_ERROR_CELLS = 2.0
"""Error of depths [cells]."""
MIN_CONFIRMING_VIEWS = 2
"""Views that must see past a cell before it is emptied. As many must confirm a depth that is used without such a
vote."""


def hull_cells_seen_past(
    views: Views, masks: Bool[np.ndarray, "V H W"], hull: VisualHull, pool: ThreadPool
) -> Bool[np.ndarray, "X Y Z"]:
    """Return which cells of a hull more views see past than see something in."""
    looks = HullStereoImages(views, masks)
    # Of plain faces few views know a depth. One without support stays, since what it empties is voted on once more,
    # cell by cell.
    depths = looks.depths(hull, 0, pool)
    points = hull.cells[hull.inside]
    votes = np.empty((len(points), 2))
    rest = looks.rows, depths, float(looks.pace), DEPTH_ERROR_CELLS * hull.side, votes
    pool.each(count_past_votes, [(points, *span, *rest) for span in pool.spans(len(points))])
    empty = np.zeros(hull.inside.shape, np.bool_)
    empty[hull.inside] = (votes[:, 1] >= MIN_CONFIRMING_VIEWS) & (votes[:, 1] > votes[:, 0])
    return empty


class HullStereoImages:
    """Pictures, and the pixels of each that are looked at."""

    def __init__(self, views: Views, masks: Bool[np.ndarray, "V H W"]) -> None:
        factor = -(-max(views.rgb.shape[1:3]) // MAX_STEREO_PICTURE_PX)
        self.cameras = views.cameras
        self.pictures = np.stack([shrink_picture(p, factor) for p in views.rgb]).astype(np.float32) / 255
        self.rows = camera_rows(views.cameras)
        self.rows[:, 12:] /= factor
        self.lenses = self.rows[:, 12:].copy()
        self.pace = max(1, round(np.sqrt(masks.sum() / factor**2 / MAX_STEREO_DEPTHS)))
        height, width = (n // self.pace for n in self.pictures.shape[1:3])
        self.every = factor * self.pace
        self.grid = height, width
        # A patch that is partly beside the object moves with the outline, which is no place.
        patch = (2 * PATCH_RADIUS_PX + 1) * factor
        masks = minimum_filter(masks, (1, patch, patch))
        self.on = self._at_looks(masks, self.every)

    def depths(self, hull: VisualHull, confirmed: int, pool: ThreadPool) -> Float[np.ndarray, "V h w"]:
        """Return how deep views see within a hull [m]; inf: unknown or contradicted."""
        found = np.full((len(self.cameras), *self.grid), np.inf)
        for k, depth in enumerate(found):
            self.fill(k, depth, hull, pool)
        found[~self.stands(found, confirmed, pool)] = np.inf
        return found

    def fill(self, k: int, depth: Float[np.ndarray, "h w"], hull: VisualHull, pool: ThreadPool) -> None:
        """Fill in how deep a view sees where its mask is."""
        rows, columns = np.nonzero(self.on[k])
        places = self.places(k)
        eye, rays = self.cameras[k].world_from_camera[:3, 3].copy(), self.rays(k, places)
        chord, low = np.empty((len(places), 2)), hull.cells[0, 0, 0].copy()
        rest = eye, rays, low, hull.side, hull.inside, chord
        pool.each(hull_chords, [(*span, *rest) for span in pool.spans(len(places))])
        found, rule = (
            np.full(len(places), np.inf),
            np.array([MIN_STEREO_PATCH_DEVIATION, MIN_STEREO_CORRELATION, MIN_STEREO_CORRELATION_GAIN]),
        )
        rest = places, self.pictures, self.lenses, *self.mates(k), chord, rule, found
        pool.each(search_depths, [(k, *span, *rest) for span in pool.spans(len(places))])
        depth[rows, columns] = found

    def stands(self, depths: Float[np.ndarray, "V h w"], confirmed: int, pool: ThreadPool) -> Bool[np.ndarray, "V h w"]:
        """Return which depths so many of the other views confirm, and no more of them deny."""
        known = np.isfinite(depths)
        points, view = self.points(depths), np.nonzero(self.on)[0]
        good = known[self.on]
        points, view = points[good], view[good]
        votes = np.empty((len(points), 2))
        rest = self.rows, depths, float(self.pace), STEREO_DEPTH_TOLERANCE, votes
        pool.each(count_support, [(points, view, *span, *rest) for span in pool.spans(len(points))])
        known[known] = (votes[:, 0] >= confirmed) & (votes[:, 0] >= votes[:, 1])
        return known

    def plain(self, k: int) -> Bool[np.ndarray, "h w"]:
        """Return where a view's patches are too plain for their depth to be looked for."""
        side, channels = 2 * PATCH_RADIUS_PX + 1, np.moveaxis(self.pictures[k], -1, 0)
        variance = np.zeros(channels.shape[1:])
        for one in channels:
            mean = uniform_filter(one, side)
            variance += (uniform_filter(one * one, side) - mean * mean) / len(channels)
        return self._at_looks(np.sqrt(np.maximum(variance, 0)) < MIN_STEREO_PATCH_DEVIATION, self.pace)

    def _at_looks(self, pixels: Bool[np.ndarray, "*V H W"], every: int) -> Bool[np.ndarray, "*V h w"]:
        """Return what is so at the pixels that are looked at."""
        height, width = self.grid
        return pixels[..., every // 2 :: every, every // 2 :: every][..., :height, :width]

    def places(self, k: int) -> Int[np.ndarray, "N 2"]:
        """Return column and row of the looks of a view."""
        rows, columns = np.nonzero(self.on[k])
        return np.stack([columns, rows], axis=1) * self.pace + self.pace // 2

    def rays(self, k: int, places: np.ndarray) -> Float[np.ndarray, "N 3"]:
        """Return where a view's pixels look, in the world, with depth 1."""
        fx, fy, cx, cy = self.lenses[k]
        u, v = (places + 0.5 - [cx, cy]).T / np.array([[fx], [fy]])
        local = np.stack([u, v, np.ones(len(u))], axis=1)
        return local @ self.cameras[k].world_from_camera[:3, :3].T

    def mates(self, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the neighbours of a view, and the way to each."""
        mates = neighbouring_views(self.cameras, k)
        here = self.cameras[k].world_from_camera
        ways = np.stack([np.linalg.inv(self.cameras[n].world_from_camera) @ here for n in mates])
        return mates, ways[:, :3, :3].copy(), ways[:, :3, 3].copy()

    def points(self, depths: Float[np.ndarray, "V h w"]) -> Float[np.ndarray, "N 3"]:
        """Return what all looks see, view by view; nan or inf where that is unknown."""
        found = []
        for k, camera in enumerate(self.cameras):
            along = self.rays(k, self.places(k)) * depths[k][self.on[k]][:, None]
            found.append(camera.world_from_camera[:3, 3] + along)
        return np.concatenate(found)

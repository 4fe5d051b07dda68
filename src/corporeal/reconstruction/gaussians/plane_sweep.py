"""Points by plane-sweep stereo of posed pictures (Collins 1996).

For pixels of every view, the depth at which the views beside it show the same; kept is what other views confirm. No
mask and no mesh is needed. Where pictures are too smooth to say, objects are taken to be as far away as the background
model.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.core.errors import UserError
from corporeal.core.types import Camera, Views
from corporeal.multiview.viewed_region import find_viewed_region
from corporeal.reconstruction.gaussians.background_model import background_model, cover_background
from corporeal.reconstruction.gaussians.gaussian_initialisation import StartPoints, free_depths, join_points
from corporeal.reconstruction.gaussians.kernels_plane_sweep import count_support, prefer_depths, sweep_rows
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.gaussians.view_depths import ViewDepths
from corporeal.reconstruction.gaussians.visual_hull import camera_rows

MAX_SWEEP_PICTURE_PX = 160
"""Of the pictures looked at [px]; larger ones are shrunk."""
MATES_PER_VIEW = 4
"""Neighbours that a view is compared with."""
MAX_MATE_COSINE = np.cos(np.radians(5))
"""Neighbours see the region from directions that differ by more: else depth changes nothing."""
SWEEP_PLANES = 80
"""Evenly spaced in inverse depth."""
LAST_PLANE_RADII = 12.0
"""Last plane, in radii of the region behind it."""
SWEEP_DEPTH_TOLERANCE = 0.04
"""Relative difference of depths that agree."""
MIN_SWEEP_POINTS = 50
"""Points that must be found."""
OBJECT_POINTS_WEIGHT, BACKGROUND_POINTS_WEIGHT, COVER_POINTS_WEIGHT = 9, 2, 1
"""Shares of the points: on objects, on the background where views see it, and all over it."""


@dataclass(frozen=True)
class PlaneSweepConfig:
    """How densely pictures are swept."""

    max_depths: int = 50_000
    """Depths that are looked for in all views together, about [1]."""


DEFAULT_SWEEP = PlaneSweepConfig()


@dataclass(frozen=True)
class SweepResult:
    """What a sweep finds."""

    points: StartPoints
    surfaces: ViewDepths


def sweep_planes(
    views: Views, count: int, rng: np.random.Generator, pool: ThreadPool, config: PlaneSweepConfig = DEFAULT_SWEEP
) -> SweepResult:
    """Find points on what the pictures show, at most so many.

    Raises:
        UserError: The pictures agree nowhere.
    """
    looks = _SweepImages(views, config.max_depths)
    depths = looks.depths(pool)
    good = looks.confirmed(depths, pool)
    if np.count_nonzero(good) < MIN_SWEEP_POINTS:
        raise UserError(
            "The pictures agree on no place in space. Check that cameras and pictures belong "
            "together, and the convention of the camera poses; or give masks."
        )
    about = background_model(looks.points(depths)[good.ravel()], views.cameras, rng)
    behind = about.reach(looks.eyes, looks.rays).reshape(depths.shape)
    depths = looks.preferred(depths, behind, pool)
    good = looks.confirmed(depths, pool)
    unit = count // (OBJECT_POINTS_WEIGHT + BACKGROUND_POINTS_WEIGHT + COVER_POINTS_WEIGHT)
    own = _sample_pixels(np.flatnonzero(good & (depths != behind)), OBJECT_POINTS_WEIGHT * unit, rng)
    beyond = _sample_pixels(np.arange(depths.size), BACKGROUND_POINTS_WEIGHT * unit, rng)
    hit = looks.points(behind)
    smooth = np.flatnonzero(np.logical_not(good) | (depths == behind))
    smooth = smooth if len(smooth) else beyond
    points = join_points(
        StartPoints(looks.points(depths)[own], looks.colours[own]),
        StartPoints(hit[beyond], looks.colours[beyond], normal=about.normals(hit[beyond])),
        cover_background(about, views.cameras, COVER_POINTS_WEIGHT * unit, hit[smooth], looks.colours[smooth]),
    )
    known = np.where(good, depths, np.inf)
    clear = free_depths(views.cameras)
    return SweepResult(points, ViewDepths(looks.rows, float(looks.pace), clear, known, behind))


class _SweepImages:
    """Small pictures, and the pixels of each that are looked at: V views of h × w."""

    def __init__(self, views: Views, max_depths: int) -> None:
        factor = -(-max(views.rgb.shape[1:3]) // MAX_SWEEP_PICTURE_PX)
        self.cameras = views.cameras
        self.pictures = np.stack([_shrink_sweep_picture(p, factor) for p in views.rgb])
        self.rows = camera_rows(views.cameras)
        self.rows[:, 12:] /= factor
        self.lenses = self.rows[:, 12:].copy()
        count, height, width = self.pictures.shape[:3]
        self.pace = max(1, round(np.sqrt(count * height * width / max_depths)))
        self.grid = count, height // self.pace, width // self.pace
        self.view, y, x = (i.ravel() for i in np.indices(self.grid))
        y, x = (i * self.pace + self.pace // 2 for i in (y, x))
        self.colours = self.pictures[self.view, y, x].astype(np.float64)
        lens = self.lenses[self.view]
        u, v = ((np.stack([x, y], axis=1) + 0.5 - lens[:, 2:]) / lens[:, :2]).T
        poses = np.stack([c.world_from_camera for c in self.cameras])[self.view]
        self.eyes = poses[:, :3, 3]
        self.rays = np.einsum("nij,nj->ni", poses[:, :3, :3], np.stack([u, v, u**0], axis=1))

    def points(self, depths: Float[np.ndarray, "V h w"]) -> Float[np.ndarray, "N 3"]:
        """Return what every pixel shows; nan where it has no depth."""
        with np.errstate(invalid="ignore"):
            return np.where(np.isfinite(z := depths.reshape(-1, 1)), self.eyes + z * self.rays, np.nan)

    def depths(self, pool: ThreadPool) -> Float[np.ndarray, "V h w"]:
        """Sweep every view."""
        around = find_viewed_region(self.cameras)
        depths = np.full(self.grid, np.inf)
        for k, camera in enumerate(self.cameras):
            middle = float(np.linalg.norm(camera.world_from_camera[:3, 3] - around.centre))
            near = max(0.1 * middle, middle - 1.5 * around.radius)
            planes = np.linspace(1 / (middle + LAST_PLANE_RADII * around.radius), 1 / near, SWEEP_PLANES)
            rest = *self._mates(k), planes, depths[k]
            pool.each(sweep_rows, [(k, *span, *rest) for span in pool.spans(self.grid[1])])
        return depths

    def preferred(
        self, depths: Float[np.ndarray, "V h w"], wanted: Float[np.ndarray, "V h w"], pool: ThreadPool
    ) -> Float[np.ndarray, "V h w"]:
        """Return other depths where they look as good."""
        depths = depths.copy()
        for k in range(len(self.cameras)):
            rest = *self._mates(k), wanted[k], depths[k]
            pool.each(prefer_depths, [(k, *span, *rest) for span in pool.spans(self.grid[1])])
        return depths

    def confirmed(self, depths: Float[np.ndarray, "V h w"], pool: ThreadPool) -> Bool[np.ndarray, "V h w"]:
        """Return which depths more of the other views confirm than deny, and enough of them."""
        found = np.flatnonzero(np.isfinite(depths))
        points, view = self.points(depths)[found], self.view[found]
        votes = np.empty((len(points), 2))
        rest = self.rows, depths, float(self.pace), SWEEP_DEPTH_TOLERANCE, votes
        pool.each(count_support, [(points, view, *span, *rest) for span in pool.spans(len(points))])
        wanted = 1 if len(self.cameras) < 6 else 2
        good = np.zeros(depths.size, np.bool_)
        good[found] = (votes[:, 0] >= wanted) & (votes[:, 0] > votes[:, 1])
        return good.reshape(depths.shape)

    def _mates(self, k: int) -> tuple:
        """Return what a sweep of view k looks at: its neighbours, and the way to each."""
        mates = neighbouring_views(self.cameras, k)
        here = self.cameras[k].world_from_camera
        ways = np.stack([np.linalg.inv(self.cameras[n].world_from_camera) @ here for n in mates])
        shared = self.pace, self.pictures, self.lenses, mates
        return *shared, ways[:, :3, :3].copy(), ways[:, :3, 3].copy()


def _sample_pixels(which: np.ndarray, count: int, rng: np.random.Generator) -> Int[np.ndarray, " n"]:
    return rng.choice(which, min(count, len(which)), replace=False)


def neighbouring_views(cameras: tuple[Camera, ...], k: int) -> Int[np.ndarray, " mates"]:
    """Return the views that see the region from directions nearest to view k's, but not its own."""
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras]) - find_viewed_region(cameras).centre
    directions = eyes / np.linalg.norm(eyes, axis=1, keepdims=True)
    alike = directions @ directions[k]
    alike[alike > MAX_MATE_COSINE] = -2 - np.arange(len(cameras))[alike > MAX_MATE_COSINE]
    alike[k] = -np.inf
    return np.argsort(-alike, kind="stable")[: min(MATES_PER_VIEW, len(cameras) - 1)]


def _shrink_sweep_picture(picture: np.ndarray, factor: int) -> Float[np.ndarray, "h w 3"]:
    h, w = picture.shape[0] // factor, picture.shape[1] // factor
    cut = picture[: h * factor, : w * factor].reshape(h, factor, w, factor, 3)
    return (cut.mean(axis=(1, 3)) / 255).astype(np.float32)

"""Points on what posed pictures show, found by sweeping planes through space (Collins 1996).

For pixels of every view, the depth at which the views beside it show the same; kept is what other
views confirm. No mask and no mesh is needed. Where pictures are too smooth to say, objects are
taken to be as far away as the background model.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.core.errors import UserError
from corporeal.core.types import Camera, Views
from corporeal.multiview.region import region
from corporeal.reconstruction.gaussians.background_model import background_model, cover
from corporeal.reconstruction.gaussians.hull import camera_rows
from corporeal.reconstruction.gaussians.kernels_sweep import prefer, support, sweep
from corporeal.reconstruction.gaussians.start import Points, clearance, joined
from corporeal.reconstruction.gaussians.surfaces import Surfaces
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool

LONGEST = 160
"""Of the pictures looked at [px]; larger ones are shrunk."""
PIXELS = 50_000
"""Depths that are looked for in all views together, about."""
MATES = 4
"""Neighbours that a view is compared with."""
TOO_NEAR = np.cos(np.radians(5))
"""Neighbours see the region from directions that differ by more: else depth changes nothing."""
PLANES = 80
"""Evenly spaced in inverse depth."""
FARTHEST = 12.0
"""Last plane, in radii of the region behind it."""
NEAR = 0.04
"""Relative difference of depths that agree."""
FEWEST = 50
"""Points that must be found."""
OWN, BEHIND, COVER = 9, 2, 1
"""Shares of the points: on objects, on the background where views see it, and all over it."""


@dataclass(frozen=True)
class Swept:
    """What a sweep finds."""

    points: Points
    surfaces: Surfaces


def swept(views: Views, count: int, rng: np.random.Generator, pool: ThreadPool) -> Swept:
    """Find points on what the pictures show, at most so many.

    Raises:
        UserError: The pictures agree nowhere.

    """
    looks = _Looks(views)
    depths = looks.depths(pool)
    good = looks.confirmed(depths, pool)
    if np.count_nonzero(good) < FEWEST:
        raise UserError(
            "The pictures agree on no place in space. Check that cameras and pictures belong "
            "together, and the convention of the camera poses; or give masks."
        )
    about = background_model(looks.points(depths)[good.ravel()], views.cameras, rng)
    behind = about.reach(looks.eyes, looks.rays).reshape(depths.shape)
    depths = looks.preferred(depths, behind, pool)
    good = looks.confirmed(depths, pool)
    unit = count // (OWN + BEHIND + COVER)
    own = _some(np.flatnonzero(good & (depths != behind)), OWN * unit, rng)
    beyond = _some(np.arange(depths.size), BEHIND * unit, rng)
    hit = looks.points(behind)
    smooth = np.flatnonzero(np.logical_not(good) | (depths == behind))
    smooth = smooth if len(smooth) else beyond
    points = joined(
        Points(looks.points(depths)[own], looks.colours[own]),
        Points(hit[beyond], looks.colours[beyond], normal=about.normals(hit[beyond])),
        cover(about, views.cameras, COVER * unit, hit[smooth], looks.colours[smooth]),
    )
    known = np.where(good, depths, np.inf)
    clear = clearance(views.cameras)
    return Swept(points, Surfaces(looks.rows, float(looks.pace), clear, known, behind))


class _Looks:
    """Small pictures, and the pixels of each that are looked at: V views of h × w."""

    def __init__(self, views: Views) -> None:
        factor = -(-max(views.rgb.shape[1:3]) // LONGEST)
        self.cameras = views.cameras
        self.pictures = np.stack([_shrunk(p, factor) for p in views.rgb])
        self.rows = camera_rows(views.cameras)
        self.rows[:, 12:] /= factor
        self.lenses = self.rows[:, 12:].copy()
        count, height, width = self.pictures.shape[:3]
        self.pace = max(1, round(np.sqrt(count * height * width / PIXELS)))
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
            return np.where(
                np.isfinite(z := depths.reshape(-1, 1)), self.eyes + z * self.rays, np.nan
            )

    def depths(self, pool: ThreadPool) -> Float[np.ndarray, "V h w"]:
        """Sweep every view."""
        around = region(self.cameras)
        depths = np.full(self.grid, np.inf)
        for k, camera in enumerate(self.cameras):
            middle = float(np.linalg.norm(camera.world_from_camera[:3, 3] - around.centre))
            near = max(0.1 * middle, middle - 1.5 * around.radius)
            planes = np.linspace(1 / (middle + FARTHEST * around.radius), 1 / near, PLANES)
            rest = *self._mates(k), planes, depths[k]
            pool.each(sweep, [(k, *span, *rest) for span in pool.spans(self.grid[1])])
        return depths

    def preferred(
        self,
        depths: Float[np.ndarray, "V h w"],
        wanted: Float[np.ndarray, "V h w"],
        pool: ThreadPool,
    ) -> Float[np.ndarray, "V h w"]:
        """Return other depths where they look as good."""
        depths = depths.copy()
        for k in range(len(self.cameras)):
            rest = *self._mates(k), wanted[k], depths[k]
            pool.each(prefer, [(k, *span, *rest) for span in pool.spans(self.grid[1])])
        return depths

    def confirmed(
        self, depths: Float[np.ndarray, "V h w"], pool: ThreadPool
    ) -> Bool[np.ndarray, "V h w"]:
        """Return which depths more of the other views confirm than deny, and enough of them."""
        found = np.flatnonzero(np.isfinite(depths))
        points, view = self.points(depths)[found], self.view[found]
        votes = np.empty((len(points), 2))
        rest = self.rows, depths, float(self.pace), NEAR, votes
        pool.each(support, [(points, view, *span, *rest) for span in pool.spans(len(points))])
        wanted = 1 if len(self.cameras) < 6 else 2
        good = np.zeros(depths.size, np.bool_)
        good[found] = (votes[:, 0] >= wanted) & (votes[:, 0] > votes[:, 1])
        return good.reshape(depths.shape)

    def _mates(self, k: int) -> tuple:
        """Return what a sweep of view k looks at: its neighbours, and the way to each."""
        mates = neighbours(self.cameras, k)
        here = self.cameras[k].world_from_camera
        ways = np.stack([np.linalg.inv(self.cameras[n].world_from_camera) @ here for n in mates])
        shared = self.pace, self.pictures, self.lenses, mates
        return *shared, ways[:, :3, :3].copy(), ways[:, :3, 3].copy()


def _some(which: np.ndarray, count: int, rng: np.random.Generator) -> Int[np.ndarray, " n"]:
    return rng.choice(which, min(count, len(which)), replace=False)


def neighbours(cameras: tuple[Camera, ...], k: int) -> Int[np.ndarray, " mates"]:
    """Return the views that see the region from directions nearest to view k's, but not its own."""
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras]) - region(cameras).centre
    directions = eyes / np.linalg.norm(eyes, axis=1, keepdims=True)
    alike = directions @ directions[k]
    alike[alike > TOO_NEAR] = -2 - np.arange(len(cameras))[alike > TOO_NEAR]
    alike[k] = -np.inf
    return np.argsort(-alike, kind="stable")[: min(MATES, len(cameras) - 1)]


def _shrunk(picture: np.ndarray, factor: int) -> Float[np.ndarray, "h w 3"]:
    h, w = picture.shape[0] // factor, picture.shape[1] // factor
    cut = picture[: h * factor, : w * factor].reshape(h, factor, w, factor, 3)
    return (cut.mean(axis=(1, 3)) / 255).astype(np.float32)

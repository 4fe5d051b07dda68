"""Points on what posed pictures show, found by sweeping planes through space (Collins 1996).

For pixels of every view, the depth at which the views beside it show the same; kept is what other
views confirm. No mask and no mesh is needed; smooth surfaces come out rough, which training mends.
"""

import numpy as np
from jaxtyping import Float, Int

from corporeal.errors import UserError
from corporeal.geometry.region import region
from corporeal.splats.crew import Crew
from corporeal.splats.kernels_sweep import support, sweep
from corporeal.splats.start import Points, camera_rows
from corporeal.types import Camera, Views

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


def swept(views: Views, count: int, rng: np.random.Generator, crew: Crew) -> Points:
    """Return points on what the pictures show, at most so many.

    Raises:
        UserError: The pictures agree nowhere.

    """
    factor = -(-max(views.rgb.shape[1:3]) // LONGEST)
    pictures = np.stack([_shrunk(p, factor) for p in views.rgb])
    rows = camera_rows(views.cameras)
    rows[:, 12:] /= factor
    area = pictures.shape[0] * pictures.shape[1] * pictures.shape[2]
    pace = max(1, round(np.sqrt(area / PIXELS)))
    depths = _depths(views.cameras, pictures, rows, pace, crew)
    view, y, x = np.nonzero(np.isfinite(depths))
    pixel = np.stack([x, y], axis=1) * pace + pace // 2
    points = _unprojected(views.cameras, view, pixel + 0.5, depths[view, y, x], rows)
    votes = np.empty((len(points), 2))
    rest = rows, depths, float(pace), NEAR, votes
    crew.each(support, [(points, view, *span, *rest) for span in crew.spans(len(points))])
    wanted = 1 if len(views.cameras) < 6 else 2
    good = np.flatnonzero((votes[:, 0] >= wanted) & (votes[:, 0] > votes[:, 1]))
    if len(good) < FEWEST:
        raise UserError(
            "The pictures agree on no place in space. Check that cameras and pictures belong "
            "together, and the convention of the camera poses; or give masks."
        )
    chosen = rng.choice(good, min(count, len(good)), replace=False)
    colour = pictures[view[chosen], pixel[chosen, 1], pixel[chosen, 0]]
    return Points(points[chosen], colour.astype(np.float64))


def _depths(
    cameras: tuple[Camera, ...], pictures: np.ndarray, rows: np.ndarray, pace: int, crew: Crew
) -> Float[np.ndarray, "V h w"]:
    """Sweep every view."""
    around = region(cameras)
    lenses = rows[:, 12:].copy()
    grid = tuple(size // pace for size in pictures.shape[1:3])
    depths = np.full((len(cameras), *grid), np.inf)
    for k, camera in enumerate(cameras):
        mates = neighbours(cameras, k)
        from_k = np.stack(
            [np.linalg.inv(cameras[n].world_from_camera) @ camera.world_from_camera for n in mates]
        )
        turns, shifts = from_k[:, :3, :3].copy(), from_k[:, :3, 3].copy()
        middle = float(np.linalg.norm(camera.world_from_camera[:3, 3] - around.centre))
        near = max(0.1 * middle, middle - 1.5 * around.radius)
        planes = np.linspace(1 / (middle + FARTHEST * around.radius), 1 / near, PLANES)
        rest = pace, pictures, lenses, mates, turns, shifts, planes, depths[k]
        crew.each(sweep, [(k, *span, *rest) for span in crew.spans(grid[0])])
    return depths


def neighbours(cameras: tuple[Camera, ...], k: int) -> Int[np.ndarray, " mates"]:
    """Return the views that see the region from directions nearest to view k's, but not its own."""
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras]) - region(cameras).centre
    directions = eyes / np.linalg.norm(eyes, axis=1, keepdims=True)
    alike = directions @ directions[k]
    alike[alike > TOO_NEAR] = -2 - np.arange(len(cameras))[alike > TOO_NEAR]
    alike[k] = -np.inf
    return np.argsort(-alike, kind="stable")[: min(MATES, len(cameras) - 1)]


def _unprojected(
    cameras: tuple[Camera, ...],
    view: np.ndarray,
    pixel: np.ndarray,
    z: np.ndarray,
    rows: np.ndarray,
) -> Float[np.ndarray, "N 3"]:
    lens = rows[view, 12:]
    local = np.stack([*((pixel - lens[:, 2:]) / lens[:, :2]).T, np.ones(len(z))], axis=1)
    poses = np.stack([c.world_from_camera for c in cameras])[view]
    return (poses[:, :3, :3] @ (z[:, None] * local)[:, :, None])[..., 0] + poses[:, :3, 3]


def _shrunk(picture: np.ndarray, factor: int) -> Float[np.ndarray, "h w 3"]:
    h, w = picture.shape[0] // factor, picture.shape[1] // factor
    cut = picture[: h * factor, : w * factor].reshape(h, factor, w, factor, 3)
    return (cut.mean(axis=(1, 3)) / 255).astype(np.float32)

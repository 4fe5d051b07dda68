"""Pixels that show the floor for certain: other views see the same pattern at that place of it.

Where an object stands its contact shadow may have the colours of the object, and an outline that is
found by colour spreads over the floor. But a pattern on the floor is one plane's: taken to that
plane by its homography, views from different sides agree about it, and about nothing that stands
above it. Patches are compared by normalised cross-correlation, which shadows leave as it is.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import map_coordinates, minimum_filter, uniform_filter

from corporeal.geometry.epipolar import projection
from corporeal.geometry.ground_plane import Plane
from corporeal.geometry.region import Region
from corporeal.types import Camera, Views

ACROSS = 400
"""Most cells along the square of the floor that is looked at."""
PATCH = 7
"""Cells along a patch that is compared."""
CONTRAST = 3.0
"""Standard deviation of the greys of a patch, of 255, below which it has no pattern."""
AGREE = 0.8
"""Correlation from which on two patches are one pattern."""
APART = 1.0
"""What is h above the floor is seen at places of the floor at least that many h apart by views that
are compared. Steep views from opposite sides do not do: both see a pot's floor where it is."""
PARTNERS, WITNESSES = 6, 3
"""Views that each is compared with, and how many of them must agree: two may by chance, along an
edge."""


@dataclass(frozen=True)
class _Square:
    """Cells of the floor under the ball that cameras look at; n × n."""

    corner: Float[np.ndarray, "3"]
    along: Float[np.ndarray, "2 3"]
    """Unit vectors of rows and columns."""
    side: float
    """Of a cell."""
    count: int

    def places(self) -> Float[np.ndarray, "M 3"]:
        """Middles of the cells, row by row."""
        steps = self.side * (np.arange(self.count) + 0.5)
        rows, columns = (x.ravel() for x in np.meshgrid(steps, steps, indexing="ij"))
        return self.corner + rows[:, None] * self.along[0] + columns[:, None] * self.along[1]

    def cells(self, places: Float[np.ndarray, "N 3"]) -> Int[np.ndarray, " N"]:
        """Return in which cell places on the floor are; -1: beside the square."""
        away = np.where(np.isfinite(places), places - self.corner, -1.0)
        row, column = np.floor(self.along @ away.T / self.side).astype(np.int64)
        within = np.isfinite(places).all(axis=1)
        for cell in (row, column):
            within &= (cell >= 0) & (cell < self.count)
        row, column = np.where(within, row, 0), np.where(within, column, 0)
        return np.where(within, row * self.count + column, -1)


def shows_floor(views: Views, floor: Plane | None, around: Region) -> Bool[np.ndarray, "V H W"]:
    """Tell which pixels show a pattern that lies on the floor; none where nobody knows the floor.

    Args:
        views: The pictures; a patch is PATCH of their pixels wide.
        floor: The plane that objects stand on, its normal up.
        around: The ball that all look at.

    """
    made = np.zeros(views.rgb.shape[:3], np.bool_)
    if floor is None or len(views.cameras) <= WITNESSES:
        return made
    square = _square(views.cameras, floor, around)
    places = square.places()
    seen = [
        _seen(rgb, c, places, square.count) for rgb, c in zip(views.rgb, views.cameras, strict=True)
    ]
    slant = _slants(views.cameras, floor, around)
    for k, camera in enumerate(views.cameras):
        apart = np.linalg.norm(slant - slant[k], axis=1)
        enough = np.flatnonzero(apart >= APART)
        partners = enough[np.argsort(apart[enough], kind="stable")][:PARTNERS]
        if len(partners) < WITNESSES:
            continue
        agreed = [_correlation(seen[k], seen[p]) > AGREE for p in partners]
        on_floor = np.sum(agreed, axis=0) >= WITNESSES
        cell = square.cells(_met(camera, floor)).reshape(made.shape[1:])
        made[k] = (cell >= 0) & on_floor.ravel()[cell]
    return made


def _square(cameras: tuple[Camera, ...], floor: Plane, around: Region) -> _Square:
    """Lay cells that are about a pixel wide in the middle view."""
    middle = np.array(around.centre)
    foot = middle - (middle @ floor.normal - floor.offset) * floor.normal
    away = [np.linalg.norm(c.world_from_camera[:3, 3] - middle) / c.K[0, 0] for c in cameras]
    side = max(float(np.median(away)), 2 * around.radius / ACROSS)
    count = int(np.ceil(2 * around.radius / side))
    along = np.linalg.svd(floor.normal[None])[2][1:]
    return _Square(foot - count * side / 2 * along.sum(axis=0), along, side, count)


@dataclass(frozen=True)
class _Seen:
    """The floor as one view has it; black where it is not in its picture."""

    grey: Float[np.ndarray, "n n"]
    mean: Float[np.ndarray, "n n"]
    """Of the patch around each cell."""
    deviation: Float[np.ndarray, "n n"]
    """0: a part of the patch is not in the picture."""


def _seen(rgb: np.ndarray, camera: Camera, places: np.ndarray, count: int) -> _Seen:
    P = projection(camera)
    u, v, depth = (places @ P[:, :3].T + P[:, 3]).T
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.stack([v / depth, u / depth]) - 0.5
    at[:, depth <= 0] = -9
    whole = rgb.mean(axis=-1)
    grey = map_coordinates(whole, at, order=1, cval=np.nan).reshape(count, count)
    shown = minimum_filter(np.isfinite(grey), PATCH)
    grey = np.nan_to_num(grey)  # running sums would carry what is no number along
    mean = uniform_filter(grey, PATCH)
    square = uniform_filter(grey * grey, PATCH) - mean * mean
    return _Seen(grey, mean, np.where(shown, np.sqrt(np.maximum(square, 0)), 0.0))


def _correlation(a: _Seen, b: _Seen) -> Float[np.ndarray, "n n"]:
    """Return the normalised cross-correlation of patches; -1 where there is no pattern."""
    product = uniform_filter(a.grey * b.grey, PATCH) - a.mean * b.mean
    with np.errstate(divide="ignore", invalid="ignore"):
        found = product / (a.deviation * b.deviation)
    clear = (a.deviation > CONTRAST) & (b.deviation > CONTRAST)
    return np.where(clear, found, -1.0)


def _slants(cameras: tuple[Camera, ...], floor: Plane, around: Region) -> Float[np.ndarray, "V 2"]:
    """Return how far along the floor a ray to the middle goes for each unit that it goes down."""
    along = np.linalg.svd(floor.normal[None])[2][1:]
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras]) - np.array(around.centre)
    height = np.maximum(eyes @ floor.normal, np.finfo(float).tiny)
    return eyes @ along.T / height[:, None]


def _met(camera: Camera, floor: Plane) -> Float[np.ndarray, "N 3"]:
    """Return where the rays of all pixels meet the floor, row by row; inf: nowhere."""
    v, u = np.mgrid[: camera.height, : camera.width] + 0.5
    local = np.stack([u, v, np.ones_like(u)], axis=-1).reshape(-1, 3)
    rays = local @ (camera.world_from_camera[:3, :3] @ np.linalg.inv(camera.K)).T
    eye = camera.world_from_camera[:3, 3]
    down = rays @ floor.normal
    height = float(eye @ floor.normal) - floor.offset
    with np.errstate(divide="ignore", invalid="ignore"):
        far = np.where(down < 0, -height / down, np.inf)
        return np.where(np.isfinite(far)[:, None], eye + far[:, None] * rays, np.inf)

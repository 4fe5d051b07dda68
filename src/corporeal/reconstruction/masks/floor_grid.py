"""Grid on the floor under the objects, and its intersections with rays."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.core.types import Camera
from corporeal.multiview.epipolar import projection_matrix
from corporeal.multiview.ground_plane import GroundPlane
from corporeal.multiview.viewed_region import ViewedRegion

MAX_CELLS_ACROSS = 400
"""Most cells along the square."""
MIN_PARALLAX_RATIO = 1.0
"""What is h above the floor is seen at places of the floor at least that many h apart by views that are compared. Steep
views from opposite sides do not do: both see a pot's floor where it is."""
PARTNERS_PER_VIEW, MIN_AGREEING_PARTNERS = 6, 3
"""Views that each is compared with, and how many of them must agree: two may by chance, along an edge."""
MIN_CAMERA_HEIGHT_RATIO = 1e-3
"""Height over the floor of a camera that is not above it, in distances from the middle."""


@dataclass(frozen=True)
class FloorGrid:
    """Cells of the floor under the ball that cameras look at; n × n."""

    corner: Float[np.ndarray, "3"]
    along: Float[np.ndarray, "2 3"]
    """Unit vectors of rows and columns."""
    side: float
    """Of a cell."""
    count: int

    @cached_property
    def places(self) -> Float[np.ndarray, "M 3"]:
        """Middles of the cells, row by row."""
        steps = self.side * (np.arange(self.count) + 0.5)
        rows, columns = (x.ravel() for x in np.meshgrid(steps, steps, indexing="ij"))
        return self.corner + rows[:, None] * self.along[0] + columns[:, None] * self.along[1]

    def seen_by(self, camera: Camera) -> Float[np.ndarray, "2 M"]:
        """Row and column of a picture at which the middles of the cells are; -9: behind it."""
        P = projection_matrix(camera)
        u, v, depth = P[:, :3] @ self.places.T + P[:, 3:]
        with np.errstate(divide="ignore", invalid="ignore"):
            at = np.stack([v / depth, u / depth]) - 0.5
        at[:, depth <= 0] = -9
        return at

    def at(self, places: Float[np.ndarray, "*N 3"]) -> Float[np.ndarray, "*N 2"]:
        """Return at which row and column places on the floor are; cells begin at whole ones."""
        return (places - self.corner) @ self.along.T / self.side

    def cells(self, places: Float[np.ndarray, "N 3"]) -> Int[np.ndarray, " N"]:
        """Return in which cell places on the floor are; -1: beside the square."""
        away = np.where(np.isfinite(places), places - self.corner, -1.0)
        row, column = np.floor(self.along @ away.T / self.side).astype(np.int64)
        within = np.isfinite(places).all(axis=1)
        for cell in (row, column):
            within &= (cell >= 0) & (cell < self.count)
        row, column = np.where(within, row, 0), np.where(within, column, 0)
        return np.where(within, row * self.count + column, -1)


def floor_grid(cameras: tuple[Camera, ...], floor: GroundPlane, around: ViewedRegion) -> FloorGrid:
    """Lay cells that are about a pixel wide in the middle view."""
    middle = np.array(around.centre)
    foot = middle - (middle @ floor.normal - floor.offset) * floor.normal
    away = [np.linalg.norm(c.world_from_camera[:3, 3] - middle) / c.K[0, 0] for c in cameras]
    side = max(float(np.median(away)), 2 * around.radius / MAX_CELLS_ACROSS)
    count = int(np.ceil(2 * around.radius / side))
    along = np.linalg.svd(floor.normal[None])[2][1:]
    return FloorGrid(foot - count * side / 2 * along.sum(axis=0), along, side, count)


def pixels_on_agreed_floor(
    cameras: tuple[Camera, ...],
    floor: GroundPlane,
    around: ViewedRegion,
    agreeing: Callable[[int, Int[np.ndarray, " P"]], Bool[np.ndarray, "P n n"]],
    wide: bool = False,
) -> Bool[np.ndarray, "V H W"]:
    """Return which pixels show a place of the floor about which enough views agree.

    Args:
        cameras: All of one size.
        floor: The plane that objects stand on, its normal up.
        around: The ball that all look at.
        agreeing: Says of a view in which cells of the square others agree with it.
        wide: Whether as many views are asked, too, that look from any other side.
    """
    made = np.zeros((len(cameras), cameras[0].height, cameras[0].width), np.bool_)
    ground, slant = floor_grid(cameras, floor, around), ray_slants(cameras, floor, around)
    for k, camera in enumerate(cameras):
        others = comparison_partners(slant, k, wide)
        if len(others) < MIN_AGREEING_PARTNERS:
            continue
        on_floor = np.sum(agreeing(k, others), axis=0) >= MIN_AGREEING_PARTNERS
        cell = ground.cells(floor_intersections(camera, floor)).reshape(made.shape[1:])
        made[k] = (cell >= 0) & on_floor.ravel()[cell]
    return made


def ray_slants(cameras: tuple[Camera, ...], floor: GroundPlane, around: ViewedRegion) -> Float[np.ndarray, "V 2"]:
    """Return how far along the floor a ray to the middle goes for each unit that it goes down."""
    along = np.linalg.svd(floor.normal[None])[2][1:]
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras]) - np.array(around.centre)
    height = np.maximum(eyes @ floor.normal, MIN_CAMERA_HEIGHT_RATIO * np.linalg.norm(eyes, axis=1))
    return eyes @ along.T / height[:, None]


def floor_intersections(camera: Camera, floor: GroundPlane) -> Float[np.ndarray, "N 3"]:
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


def comparison_partners(slant: Float[np.ndarray, "V 2"], k: int, wide: bool = False) -> Int[np.ndarray, " P"]:
    """Return the views that view k is compared with: those that look the least otherwise.

    With ``wide`` as many of the rest, from the nearest to the farthest, come to these.
    """
    apart = np.linalg.norm(slant - slant[k], axis=1)
    enough = np.flatnonzero(apart >= MIN_PARALLAX_RATIO)
    enough = enough[np.argsort(apart[enough], kind="stable")]
    near, rest = enough[:PARTNERS_PER_VIEW], enough[PARTNERS_PER_VIEW:]
    if not wide or not len(rest):
        return near
    spread = np.linspace(0, len(rest) - 1, min(PARTNERS_PER_VIEW, len(rest))).round().astype(int)
    return np.concatenate([near, rest[spread]])

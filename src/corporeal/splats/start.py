"""Where Gaussians start: on the visual hull of masks, or on given points."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import binary_erosion
from scipy.spatial import KDTree

from corporeal.errors import UserError
from corporeal.geometry.harmonics import DC
from corporeal.geometry.region import region
from corporeal.splats.crew import Crew
from corporeal.splats.kernels_learn import witness
from corporeal.splats.parameters import COLOUR, MEAN, OPACITY, ROTATION, SCALE, Parameters
from corporeal.types import Camera, Views

CELLS = 2_000_000
"""Of the grid that the visual hull is carved from."""
ASTRAY = 0.05
"""Share of the views that may see a point of the hull beside things: masks err at edges."""


ROOM = 0.3
"""Depth of the free space before a camera, in its distances from what all look at."""


@dataclass(frozen=True)
class Points:
    """Coloured points to start from."""

    position: Float[np.ndarray, "N 3"]
    """[m]"""
    colour: Float[np.ndarray, "N 3"]
    """sRGB in [0, 1]."""
    opacity: float = 0.5
    """Of the Gaussians that begin there."""


def clearance(cameras: tuple[Camera, ...]) -> Float[np.ndarray, " V"]:
    """Return the depth before each camera where nothing is drawn [m].

    Photographers keep a distance. What a training puts there helps one picture and spoils others.
    """
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras])
    return ROOM * np.linalg.norm(eyes - region(cameras).centre, axis=1)


def hull(
    views: Views, masks: Bool[np.ndarray, "V H W"], count: int, rng: np.random.Generator, crew: Crew
) -> Points:
    """Return points on the visual hull: the surface of what all masks allow.

    Raises:
        UserError: Nothing is inside all masks.

    """
    around = region(views.cameras)
    middle, reach = np.array(around.centre), 1.5 * around.radius
    rough = carved(middle - reach, middle + reach, views, masks, crew)
    found = rough.cells[rough.inside]
    low, high = found.min(axis=0) - 2 * rough.side, found.max(axis=0) + 2 * rough.side
    fine = carved(low, high, views, masks, crew)
    shell = fine.cells[fine.inside & np.logical_not(binary_erosion(fine.inside))]
    chosen = shell[rng.choice(len(shell), count, replace=len(shell) < count)]
    position = chosen + fine.side * rng.uniform(-0.5, 0.5, chosen.shape)
    seen = _witnessed(position, views, masks, crew)
    return Points(position, seen[:, 2:5] / np.maximum(seen[:, :1], 1))


def seeded(points: Points, count: int, degree: int, rng: np.random.Generator) -> Parameters:
    """Return round Gaussians on some of the points, as wide as these are apart."""
    if len(points.position) > count:
        chosen = rng.choice(len(points.position), count, replace=False)
        points = replace(points, position=points.position[chosen], colour=points.colour[chosen])
    n = len(points.position)
    theta = np.zeros((n, COLOUR + 3 * (degree + 1) ** 2), np.float32)
    theta[:, MEAN:ROTATION] = points.position
    theta[:, ROTATION:SCALE] = rng.normal(size=(n, 4))
    theta[:, ROTATION:SCALE] /= np.linalg.norm(theta[:, ROTATION:SCALE], axis=1, keepdims=True)
    near, _ = KDTree(points.position).query(points.position, k=min(4, n))
    apart = np.atleast_2d(near.T).T[:, 1:].mean(axis=1) if n > 1 else np.ones(1)
    middle = float(np.median(apart)) or 1.0
    theta[:, SCALE:OPACITY] = np.log(np.clip(apart, 0.1 * middle, 10 * middle))[:, None]
    theta[:, OPACITY] = np.log(points.opacity / (1 - points.opacity))
    theta[:, COLOUR : COLOUR + 3] = (points.colour - 0.5) / DC
    return theta


@dataclass(frozen=True)
class Carved:
    """Cubes that fill a box, and which of them are inside all masks."""

    cells: Float[np.ndarray, "X Y Z 3"]
    """Their middles [m]."""
    side: float
    """[m]"""
    inside: Bool[np.ndarray, "X Y Z"]


def carved(
    low: np.ndarray,
    high: np.ndarray,
    views: Views,
    masks: np.ndarray,
    crew: Crew,
    astray: float = ASTRAY,
) -> Carved:
    """Carve a box: what is left is on things in all views that see it, but for a few.

    astray: the share of the views that these may be.

    Raises:
        UserError: Nothing is left.

    """
    side = float(np.cbrt(np.prod(high - low) / CELLS))
    axes = [np.arange(a + side / 2, b, side) for a, b in zip(low, high, strict=True)]
    cells = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    seen = _witnessed(cells.reshape(-1, 3), views, masks, crew, astray)
    count = len(views.cameras)
    inside = (seen[:, 1] <= astray * count) & (seen[:, 0] >= max(1, count / 4))
    if not inside.any():
        raise UserError(
            "No place in space is inside all masks. Check that cameras, pictures and masks "
            "belong together, and the convention of the camera poses."
        )
    return Carved(cells, side, inside.reshape(cells.shape[:3]))


def _witnessed(
    points: np.ndarray, views: Views, masks: np.ndarray, crew: Crew, astray: float = ASTRAY
) -> np.ndarray:
    out = np.empty((len(points), 5))
    patience = astray * len(views.cameras)
    rest = camera_rows(views.cameras), views.rgb, masks, patience, out
    points = np.ascontiguousarray(points, dtype=np.float64)
    crew.each(witness, [(points, *span, *rest) for span in crew.spans(len(points))])
    return out


def camera_rows(cameras: tuple[Camera, ...]) -> Float[np.ndarray, "V 16"]:
    """Return cameras as kernels read many: camera from world (3 × 4), then fx, fy, cx, cy."""
    rows = np.empty((len(cameras), 16))
    for row, camera in zip(rows, cameras, strict=True):
        row[:12] = np.linalg.inv(camera.world_from_camera)[:3].ravel()
        K = camera.K
        row[12:] = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    return rows

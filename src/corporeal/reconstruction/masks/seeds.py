"""Where growing begins: at what all cameras look at, or at what a person points at."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32
from scipy.ndimage import gaussian_filter

from corporeal.core.types import Camera, Views
from corporeal.multiview.epipolar import projection
from corporeal.multiview.ground_plane import Plane, Search, ground_plane
from corporeal.multiview.region import Region, region
from corporeal.reconstruction.masks.swept_floor import swept_floor
from corporeal.reconstruction.masks.volume import pixels_of

TILT = np.radians(60)
"""Largest angle between the floor's normal and up in the mean picture, as many look down."""
ABOUT = 2.0
"""The floor is looked for among points that near, in radii of the ball that cameras look at."""
ABOVE, ON = 0.03, 0.01
"""Points higher than the one are above the floor, lower than the other on it, in these radii."""
WITHIN = 0.9
"""Points on objects are within that share of the ball."""
FEWEST = 30
"""Points above the floor that say where objects are."""
SPREAD = 2.0
"""Standard deviation of what one point says of the pixels around it [px]."""
CENTRAL = 0.35
"""Standard deviation of where objects are, where no points say it, in radii of the ball."""
ANYWHERE = 0.02
"""Weight as background of a pixel within the ball, against one beside it."""


@dataclass(frozen=True)
class Seeds:
    """What is known of the pictures before anything is grown; V views of H × W."""

    around: Region
    """Where objects are looked for."""
    floor: Plane | None
    inside: Float32[np.ndarray, "V H W"]
    """Weight of each pixel as an example of what objects look like."""
    outside: Float32[np.ndarray, "V H W"]
    """The same, of what is around them."""
    never: Bool[np.ndarray, "V H W"]
    """Pixels that show no object."""
    cone: Bool[np.ndarray, "V H W"] | None = None
    """Pixels in which objects must be seen; None: any."""
    piece: float | None = None
    """Smaller pieces of the hull, as shares of the largest, are chance; None: as ever."""


def looked_at(views: Views, points: Float[np.ndarray, "N 3"] | None) -> Seeds:
    """Take for an object what all cameras look at (Campbell et al., volumetric graph cuts, 2010).

    Where points say where the floor is, or a pattern that is seen on a level plane, points above it
    are on objects and those on it are not; otherwise the middle of the ball that all look at is,
    and what is beside it is not.

    Args:
        views: The pictures.
        points: On all that they show, such as COLMAP's; None: there are none.

    """
    around = region(views.cameras)
    far = beyond(views, around)
    inside = np.exp(-np.square(far / CENTRAL))
    outside = np.where(far > 1, 1.0, ANYWHERE)
    known = np.zeros((0, 3)) if points is None else near(points, around, ABOUT)
    floor = floor_of(views.cameras, known, around) or swept_floor(views, around)
    if floor is not None:
        height = (known @ floor.normal - floor.offset) / around.radius
        above = near(known[height > ABOVE], around, WITHIN)
        if len(above) >= FEWEST:
            inside = _shown(above, views) * (far < 1)
        outside = outside + _shown(known[np.abs(height) < ON], views)
    return Seeds(around, floor, inside.astype(np.float32), outside.astype(np.float32), far > 1)


def floor_of(
    cameras: tuple[Camera, ...], known: Float[np.ndarray, "N 3"], around: Region
) -> Plane | None:
    """Return the plane that things stand on, if points show one."""
    ups = np.stack([-c.world_from_camera[:3, 1] for c in cameras])
    up = ups.mean(axis=0)
    length = float(np.linalg.norm(up))
    if not length:
        return None
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras])
    search = Search(up / length, float(TILT), around.radius, eyes, np.array(around.centre))
    return ground_plane(known, search, np.random.default_rng(0))


def near(
    points: Float[np.ndarray, "N 3"], around: Region, radii: float
) -> Float[np.ndarray, "M 3"]:
    """Return the points within so many radii of a ball's middle."""
    away = np.linalg.norm(points - np.array(around.centre), axis=1)
    return points[away < radii * around.radius]


def beyond(views: Views, around: Region) -> Float[np.ndarray, "V H W"]:
    """Return how far pixels are from the ball's middle, in radii of the ball as it is seen."""
    height, width = views.rgb.shape[1:3]
    v, u = np.mgrid[:height, :width] + 0.5
    made = np.empty(views.rgb.shape[:3])
    for one, camera in zip(made, views.cameras, strict=True):
        x, y, depth = projection(camera) @ [*around.centre, 1.0]
        eye = camera.world_from_camera[:3, 3]
        seen = around.radius * camera.K[0, 0] / np.linalg.norm(eye - np.array(around.centre))
        one[:] = np.hypot(u - x / depth, v - y / depth) / seen if depth > 0 else np.inf
    return made


def _shown(points: np.ndarray, views: Views) -> Float[np.ndarray, "V H W"]:
    """Return how many points are seen around each pixel."""
    made = np.empty(views.rgb.shape[:3])
    for one, camera in zip(made, views.cameras, strict=True):
        pixel = pixels_of(points, camera)
        counts = np.bincount(pixel[pixel >= 0], minlength=one.size)
        one[:] = gaussian_filter(counts.reshape(one.shape).astype(float), SPREAD)
    return made

"""Seeds of growing: the cameras' common focus, or a point given by the user."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32
from scipy.ndimage import gaussian_filter

from corporeal.core.types import Camera, Views
from corporeal.multiview.epipolar import projection_matrix
from corporeal.multiview.ground_plane import GroundPlane, GroundSearch, find_ground_plane
from corporeal.multiview.viewed_region import ViewedRegion, find_viewed_region
from corporeal.reconstruction.masks.floor_sweep import sweep_floor_plane
from corporeal.reconstruction.masks.voxel_volume import pixels_of

MAX_FLOOR_TILT_RAD = np.radians(60)
"""Largest angle between the floor's normal and up in the mean picture, as many look down."""
FLOOR_SEARCH_RADII = 2.0
"""The floor is looked for among points that near, in radii of the ball that cameras look at."""
ABOVE_FLOOR_RADII, ON_FLOOR_RADII = 0.03, 0.01
"""Points higher than the one are above the floor, lower than the other on it, in these radii."""
OBJECT_BALL_FRACTION = 0.9
"""Points on objects are within that share of the ball."""
MIN_POINTS_ABOVE_FLOOR = 30
"""Points above the floor that say where objects are."""
POINT_SIGMA_PX = 2.0
"""Standard deviation of what one point says of the pixels around it [px]."""
CENTRAL_SIGMA_RADII = 0.35
"""Standard deviation of where objects are, where no points say it, in radii of the ball."""
IN_BALL_BACKGROUND_WEIGHT = 0.02
"""Weight as background of a pixel within the ball, against one beside it."""


@dataclass(frozen=True)
class MaskSeeds:
    """What is known of the pictures before anything is grown; V views of H × W."""

    around: ViewedRegion
    """Where objects are looked for."""
    floor: GroundPlane | None
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


def seeds_from_cameras(views: Views, points: Float[np.ndarray, "N 3"] | None) -> MaskSeeds:
    """Take for an object what all cameras look at (Campbell et al., volumetric graph cuts, 2010).

    Where points say where the floor is, or a pattern that is seen on a level plane, points above it are on objects and
    those on it are not; otherwise the middle of the ball that all look at is, and what is beside it is not.

    Args:
        views: The pictures.
        points: On all that they show, such as COLMAP's; None: there are none.
    """
    around = find_viewed_region(views.cameras)
    far = picture_distance_radii(views, around)
    inside = np.exp(-np.square(far / CENTRAL_SIGMA_RADII))
    outside = np.where(far > 1, 1.0, IN_BALL_BACKGROUND_WEIGHT)
    known = np.zeros((0, 3)) if points is None else points_near(points, around, FLOOR_SEARCH_RADII)
    floor = floor_from_points(views.cameras, known, around) or sweep_floor_plane(views, around)
    if floor is not None:
        height = (known @ floor.normal - floor.offset) / around.radius
        above = points_near(known[height > ABOVE_FLOOR_RADII], around, OBJECT_BALL_FRACTION)
        if len(above) >= MIN_POINTS_ABOVE_FLOOR:
            inside = _points_around_pixels(above, views) * (far < 1)
        outside = outside + _points_around_pixels(known[np.abs(height) < ON_FLOOR_RADII], views)
    return MaskSeeds(around, floor, inside.astype(np.float32), outside.astype(np.float32), far > 1)


def floor_from_points(
    cameras: tuple[Camera, ...], known: Float[np.ndarray, "N 3"], around: ViewedRegion
) -> GroundPlane | None:
    """Return the plane that objects stand on, if points show one."""
    ups = np.stack([-c.world_from_camera[:3, 1] for c in cameras])
    up = ups.mean(axis=0)
    length = float(np.linalg.norm(up))
    if not length:
        return None
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras])
    search = GroundSearch(up / length, float(MAX_FLOOR_TILT_RAD), around.radius, eyes, np.array(around.centre))
    return find_ground_plane(known, search, np.random.default_rng(0))


def points_near(points: Float[np.ndarray, "N 3"], around: ViewedRegion, radii: float) -> Float[np.ndarray, "M 3"]:
    """Return the points within so many radii of a ball's middle."""
    away = np.linalg.norm(points - np.array(around.centre), axis=1)
    return points[away < radii * around.radius]


def picture_distance_radii(views: Views, around: ViewedRegion) -> Float[np.ndarray, "V H W"]:
    """Return how far pixels are from the ball's middle, in radii of the ball as it is seen."""
    height, width = views.rgb.shape[1:3]
    v, u = np.mgrid[:height, :width] + 0.5
    made = np.empty(views.rgb.shape[:3])
    for one, camera in zip(made, views.cameras, strict=True):
        x, y, depth = projection_matrix(camera) @ [*around.centre, 1.0]
        eye = camera.world_from_camera[:3, 3]
        seen = around.radius * camera.K[0, 0] / np.linalg.norm(eye - np.array(around.centre))
        one[:] = np.hypot(u - x / depth, v - y / depth) / seen if depth > 0 else np.inf
    return made


def _points_around_pixels(points: np.ndarray, views: Views) -> Float[np.ndarray, "V H W"]:
    """Return how many points are seen around each pixel."""
    made = np.empty(views.rgb.shape[:3])
    for one, camera in zip(made, views.cameras, strict=True):
        pixel = pixels_of(points, camera)
        counts = np.bincount(pixel[pixel >= 0], minlength=one.size)
        one[:] = gaussian_filter(counts.reshape(one.shape).astype(float), POINT_SIGMA_PX)
    return made

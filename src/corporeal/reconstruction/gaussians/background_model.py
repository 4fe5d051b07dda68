"""Background model for textureless surroundings: a floor under a dome.

A floor without texture agrees with itself at any depth. Were nothing known of it, Gaussians would float before single
cameras; a plane that the rest of the floor is on says where it belongs.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial import KDTree

from corporeal.core.types import Camera
from corporeal.multiview.ground_plane import GroundPlane, GroundSearch, find_ground_plane
from corporeal.multiview.viewed_region import find_viewed_region
from corporeal.reconstruction.gaussians.gaussian_initialisation import StartPoints

FLOOR_SEARCH_RADII = 2.0
"""The floor is looked for among points that near, in radii of what the cameras look at."""
DOME_RADIUS_RADII = 8.0
"""Radius of the dome, in the same radii, ..."""
MIN_DOME_TO_CAMERA_RATIO = 1.5
"""... but at least that many times as far as the farthest camera."""
BACKGROUND_FLOOR_RADII = 0.02
"""Distance from the floor of what is on it, in these radii."""
BACKGROUND_COLOUR_PIXELS = 30
"""Pixels whose mean is the colour of a place that no view shows, maybe."""
BACKGROUND_OPACITY = 0.95
BACKGROUND_SCALE_RATIO = 1.2
"""Scale of what covers floor and dome, over the distance from one to the next."""


@dataclass(frozen=True)
class BackgroundModel:
    """A ball about everything, cut off by a floor."""

    centre: Float[np.ndarray, "3"]
    radius: float
    """Of the dome [m]."""
    ground: GroundPlane | None
    thick: float
    """Distance from the floor of what is on it [m]."""

    def reach(self, eye: Float[np.ndarray, "N 3"], ray: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
        """Return how far along rays from within floor or dome are, in lengths of the ray."""
        out = eye - self.centre
        a, b = (ray * ray).sum(axis=1), (ray * out).sum(axis=1)
        c = (out * out).sum(axis=1) - self.radius**2
        far = (np.sqrt(np.maximum(b * b - a * c, 0)) - b) / a
        if self.ground is None:
            return far
        with np.errstate(divide="ignore", invalid="ignore"):
            hit = (self.ground.offset - eye @ self.ground.normal) / (ray @ self.ground.normal)
        return np.where((hit > 0) & (hit < far), hit, far)

    def normals(self, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """Return the unit normals, to the inside, of floor or dome at points on them."""
        inward = self.centre - points
        inward /= np.linalg.norm(inward, axis=1, keepdims=True)
        if self.ground is not None:
            inward[self.on_ground(points)] = self.ground.normal
        return inward

    def on_ground(self, points: Float[np.ndarray, "N 3"]) -> np.ndarray:
        """Return which points are on the floor (N,)."""
        if self.ground is None:
            return np.zeros(len(points), np.bool_)
        return np.abs(points @ self.ground.normal - self.ground.offset) < self.thick


def background_model(
    points: Float[np.ndarray, "N 3"], cameras: tuple[Camera, ...], rng: np.random.Generator
) -> BackgroundModel:
    """Fit floor and dome to a scene; points: on what is in it, some of them on its floor."""
    around = find_viewed_region(cameras)
    centre = np.array(around.centre)
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras])
    near = points[np.linalg.norm(points - centre, axis=1) < FLOOR_SEARCH_RADII * around.radius]
    search = GroundSearch(np.array([0.0, 0.0, 1.0]), np.pi, around.radius, eyes)
    farthest = float(np.linalg.norm(eyes - centre, axis=1).max())
    return BackgroundModel(
        centre,
        max(DOME_RADIUS_RADII * around.radius, MIN_DOME_TO_CAMERA_RATIO * farthest),
        find_ground_plane(near, search, rng),
        BACKGROUND_FLOOR_RADII * around.radius,
    )


def cover_background(
    about: BackgroundModel,
    cameras: tuple[Camera, ...],
    count: int,
    seen: Float[np.ndarray, "M 3"],
    colour: Float[np.ndarray, "M 3"],
) -> StartPoints:
    """Return points all over floor and dome, wide enough to leave no gap, as seen nearby.

    seen, colour: places on floor or dome, and the colours that views show there.
    """
    middle = np.mean([c.world_from_camera[:3, 3] for c in cameras], axis=0)
    ray = fibonacci_directions(count)
    far = about.reach(np.tile(middle, (count, 1)), ray)
    position = middle + far[:, None] * ray
    towards = (seen - middle) / np.linalg.norm(seen - middle, axis=1, keepdims=True)
    _, near = KDTree(towards).query(ray, k=min(BACKGROUND_COLOUR_PIXELS, len(seen)))
    return StartPoints(
        position,
        colour[near.reshape(count, -1)].mean(axis=1),
        np.full(count, BACKGROUND_OPACITY),
        about.normals(position),
        BACKGROUND_SCALE_RATIO * far * np.sqrt(4 * np.pi / count),
    )


def fibonacci_directions(count: int) -> Float[np.ndarray, "N 3"]:
    """Return unit vectors to all sides: a spiral of equal areas (Fibonacci lattice)."""
    z = 1 - 2 * (np.arange(count) + 0.5) / count
    turn = np.pi * (3 - np.sqrt(5)) * np.arange(count)
    flat = np.sqrt(1 - z * z)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)

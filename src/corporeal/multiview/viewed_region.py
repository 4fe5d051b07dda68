"""Region viewed by a set of cameras."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from corporeal.core.types import Camera, Vector

MIN_AXIS_CROSSING_SIN2 = 0.01
"""Least mean square of the sine between optical axes and their main direction, for the place where they cross to be
known: 6°."""


@dataclass(frozen=True)
class ViewedRegion:
    """The ball that the cameras look at."""

    centre: Vector
    radius: float
    """[m]"""


def find_viewed_region(cameras: tuple[Camera, ...], points: Float[np.ndarray, "N 3"] | None = None) -> ViewedRegion:
    """Return the ball about the point nearest to the rays through the middles of all pictures.

    Its radius is the largest that fits into the pictures of half of the cameras.

    Args:
        cameras: One or more.
        points: On what is in the pictures. Where all cameras look the same way, so that their axes do not cross, the
            middle of those that most of them see is the ball's.
    """
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras])
    axes, sines = (np.stack(each) for each in zip(*map(_centre_ray, cameras), strict=True))
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    # Where axes hardly cross, a weak pull keeps the point near the cameras.
    weak = 1e-3 * len(cameras) * np.eye(3)
    wanted = (across @ eyes[:, :, None]).sum(axis=0)[:, 0] + weak @ eyes.mean(axis=0)
    centre = np.linalg.solve(across.sum(axis=0) + weak, wanted)
    crossing = np.linalg.eigvalsh(across.mean(axis=0))[0] > MIN_AXIS_CROSSING_SIN2
    if points is not None and not crossing:
        votes = np.sum([_is_in_image(c, points) for c in cameras], axis=0)
        if votes.any():
            centre = np.median(points[votes >= 0.75 * votes.max()], axis=0)
    radius = float(np.median(np.linalg.norm(eyes - centre, axis=1) * sines))
    return ViewedRegion((float(centre[0]), float(centre[1]), float(centre[2])), radius)


def _centre_ray(camera: Camera) -> tuple[Float[np.ndarray, "3"], float]:
    """Return the ray through the middle of a picture, and the sine of half the angle that it shows.

    A picture that was cut out of a larger one has its middle beside the optical axis.
    """
    f, c = np.diag(camera.K)[:2], camera.K[:2, 2]
    size = np.array([camera.width, camera.height])
    ray = np.append((size / 2 - c) / f, 1.0)
    away = float(np.linalg.norm(ray))
    half = (size / f).min() / 2 / away**2
    return camera.world_from_camera[:3, :3] @ ray / away, float(np.sin(np.arctan(half)))


def _is_in_image(camera: Camera, points: np.ndarray) -> Bool[np.ndarray, " N"]:
    """Return which points are within a camera's picture."""
    turn, eye = camera.world_from_camera[:3, :3], camera.world_from_camera[:3, 3]
    x, y, depth = camera.K @ ((points - eye) @ turn).T
    inside = (x >= 0) & (x < camera.width * depth) & (y >= 0) & (y < camera.height * depth)
    return inside & (depth > 0)

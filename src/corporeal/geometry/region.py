"""What a set of cameras looks at."""

from dataclasses import dataclass

import numpy as np

from corporeal.types import Camera, Vector


@dataclass(frozen=True)
class Region:
    """The ball that the cameras look at."""

    centre: Vector
    radius: float
    """[m]"""


def region(cameras: tuple[Camera, ...]) -> Region:
    """Return the ball about the point nearest to all optical axes.

    Its radius is the largest that fits into the pictures of half of the cameras.
    """
    eyes = np.stack([c.world_from_camera[:3, 3] for c in cameras])
    axes = np.stack([c.world_from_camera[:3, 2] for c in cameras])
    across = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    # Where axes hardly cross, a weak pull keeps the point near the cameras.
    weak = 1e-3 * len(cameras) * np.eye(3)
    wanted = (across @ eyes[:, :, None]).sum(axis=0)[:, 0] + weak @ eyes.mean(axis=0)
    centre = np.linalg.solve(across.sum(axis=0) + weak, wanted)
    sines = [np.sin(np.arctan(min(c.width / c.K[0, 0], c.height / c.K[1, 1]) / 2)) for c in cameras]
    radius = float(np.median(np.linalg.norm(eyes - centre, axis=1) * sines))
    return Region((float(centre[0]), float(centre[1]), float(centre[2])), radius)

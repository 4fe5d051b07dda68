"""The floor under what cameras look at, where no points show it.

A table top of smooth wood has no corners that pictures could be matched by, and yet has a grain.
Where level cameras say what up is, a level plane is moved through the ball that all look at
(Collins, "A space-sweep approach to true multi-image matching", CVPR 1996): where it is the floor,
views from different sides see one pattern on it, and anywhere else they do not.
"""

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Views
from corporeal.multiview.ground_plane import Plane
from corporeal.multiview.level import level
from corporeal.multiview.region import Region
from corporeal.reconstruction.masks.floor_pattern import shows_floor
from corporeal.reconstruction.masks.left_over import before_the_floor

SURE = 0.8
"""How well level cameras must agree about up."""
HEIGHTS = np.linspace(-0.75, 0.1, 35)
"""Of planes that are tried, over the middle of the ball, in its radii."""
FINER = 0.01
"""How far beside the best others are tried, in the same radii."""
SHOWN = 0.12
"""Share of the pixels before a plane that must show its pattern: tables have .24 to .30, a bed with
folds, which is no plane, has .07."""
SHARP = 5.0
"""The same, over the median of all heights that are tried: tables have 50 to 80, a bed 2."""


def swept_floor(views: Views, around: Region) -> Plane | None:
    """Return the level plane on which views see one pattern; None: there is none, or no up.

    Args:
        views: The pictures.
        around: The ball that all look at.

    """
    found = level(views.cameras)
    if found.sure < SURE:
        return None

    def shares(heights: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
        return np.array([_shown(views, level_plane(found.up, h, around), around) for h in heights])

    coarse = shares(HEIGHTS)
    near = HEIGHTS[coarse.argmax()] + FINER * np.array([-1, 0, 1])
    fine = shares(near)
    if fine.max() < max(SHOWN, SHARP * np.median(coarse)):
        return None
    return level_plane(found.up, float(near[fine.argmax()]), around)


def level_plane(up: Float[np.ndarray, "3"], height: float, around: Region) -> Plane:
    """Return the level plane that is so high over the middle of a ball, in its radii."""
    return Plane(up, float(up @ np.array(around.centre)) + height * around.radius, 0.0, 0.0)


def _shown(views: Views, plane: Plane, around: Region) -> float:
    """Return the share of the pixels before a plane that show its pattern."""
    before = before_the_floor(views.cameras, plane, around)
    return float((shows_floor(views, plane, around) & before).sum() / max(before.sum(), 1))

"""Floor height by plane sweep, where no points show it.

A table top of smooth wood has no corners that pictures could be matched by, and yet has a grain. Where level cameras
say what up is, a level plane is moved through the ball that all look at (Collins, "A space-sweep approach to true
multi-image matching", CVPR 1996): where it is the floor, views from different sides see one pattern on it, and anywhere
else they do not.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Views
from corporeal.multiview.ground_plane import GroundPlane
from corporeal.multiview.up_direction import estimate_up_direction
from corporeal.multiview.viewed_region import ViewedRegion
from corporeal.reconstruction.masks.floor_pattern import shows_floor_pattern
from corporeal.reconstruction.masks.residual_pixels import pixels_before_floor

MIN_UP_AGREEMENT = 0.8
"""How well level cameras must agree about up."""
FINE_HEIGHT_STEP_RADII = 0.01
"""How far beside the best others are tried, in the same radii."""
MIN_PATTERN_TO_MEDIAN = 5.0
"""The same, over the median of all heights that are tried: tables have 50 to 80, a bed 2."""


@dataclass(frozen=True)
class FloorSweepConfig:
    """Which level planes are tried, and when one of them is the floor."""

    lowest_radii: float = -0.75
    """Height of the lowest plane over the middle of the ball that all look at, in its radii [-]."""
    highest_radii: float = 0.1
    """Height of the highest [-]."""
    planes: int = 35
    """Planes that are tried, evenly spaced [1]."""
    min_pattern_fraction: float = 0.12
    """Fraction of the pixels before a plane that must show its pattern [1]: tables have .24 to .30, a bed with folds,
    which is no plane, has .07."""


DEFAULT_FLOOR_SWEEP = FloorSweepConfig()


def sweep_floor_plane(
    views: Views, around: ViewedRegion, config: FloorSweepConfig = DEFAULT_FLOOR_SWEEP
) -> GroundPlane | None:
    """Return the level plane on which views see one pattern; None: there is none, or no up."""
    found = estimate_up_direction(views.cameras)
    if found.sure < MIN_UP_AGREEMENT:
        return None

    def shares(heights: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
        return np.array([_pattern_fraction(views, level_plane(found.up, h, around), around) for h in heights])

    tried = np.linspace(config.lowest_radii, config.highest_radii, config.planes)
    coarse = shares(tried)
    near = tried[coarse.argmax()] + FINE_HEIGHT_STEP_RADII * np.array([-1, 0, 1])
    fine = shares(near)
    if fine.max() < max(config.min_pattern_fraction, MIN_PATTERN_TO_MEDIAN * np.median(coarse)):
        return None
    return level_plane(found.up, float(near[fine.argmax()]), around)


def level_plane(up: Float[np.ndarray, "3"], height: float, around: ViewedRegion) -> GroundPlane:
    """Return the level plane that is so high over the middle of a ball, in its radii."""
    return GroundPlane(up, float(up @ np.array(around.centre)) + height * around.radius, 0.0, 0.0)


def _pattern_fraction(views: Views, plane: GroundPlane, around: ViewedRegion) -> float:
    """Return the share of the pixels before a plane that show its pattern."""
    before = pixels_before_floor(views.cameras, plane, around)
    return float((shows_floor_pattern(views, plane, around) & before).sum() / max(before.sum(), 1))

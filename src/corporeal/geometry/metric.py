"""How large a reconstruction is in metres, and who said so."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from corporeal.errors import UserError
from corporeal.types import Vector


@dataclass(frozen=True)
class MetricScale:
    """What one unit of a file is, for the report to state."""

    metres_per_unit: float
    """[m]"""
    source: Literal["file", "distance", "extent"]
    """The file's kind is in metres; two points whose distance is known; how large such a thing is
    as a rule, which somebody or a model said."""
    reason: str
    """In one sentence."""


def of_file(kind: str) -> MetricScale:
    """Take the file's unit for a metre, as formats of measured scenes have it.

    Poses from pictures alone (COLMAP, and most splats trained on them) have no such unit.
    """
    return MetricScale(1.0, "file", f"{kind}: its unit was taken for one metre.")


def of_distance(a: Vector, b: Vector, metres: float) -> MetricScale:
    """Return the scale at which two points of the file are so far apart.

    Raises:
        UserError: The points are one, or the distance is not positive and finite.

    """
    units = math.dist(a, b)
    scale = _ratio(metres, units, "The distance of the two points")
    words = f"Two points {units:.4g} units apart are {metres:.4g} m apart."
    return MetricScale(scale, "distance", words)


def of_extent(low: Vector, high: Vector, metres: float, who: str) -> MetricScale:
    """Return the scale at which the longest edge of a box is so long.

    Args:
        low: One corner of the box.
        high: The opposite corner.
        metres: How long the edge is in reality [m].
        who: Who said so, for the report ("a model", "the command line").

    Raises:
        UserError: The box is a point, or the length is not positive and finite.

    """
    units = float(np.ptp([low, high], axis=0).max())
    scale = _ratio(metres, units, "The extent of the thing")
    words = f"It is {units:.4g} units large in the file and {metres:.4g} m in reality, {who} said."
    return MetricScale(scale, "extent", words)


def _ratio(metres: float, units: float, what: str) -> float:
    scale = metres / units if units > 0 else math.nan
    if not (0 < scale < math.inf and metres < math.inf):
        raise UserError(f"{what} is {units:.4g} units and {metres:.4g} m. Both must be positive.")
    return scale

"""Baselines of mass prediction without materials.

The fits leave the object out that they predict.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

WATER_DENSITY_KG_M3 = 1000.0
"""[kg/m³]"""


def solid_water_mass(volume: Sequence[float]) -> list[float]:
    """Mass of each object if it were water through and through [kg]."""
    return [WATER_DENSITY_KG_M3 * v for v in volume]


def mean_mass(measured: Sequence[float]) -> list[float | None]:
    """Geometric mean of the other objects' measured masses [kg]; None: there is no other."""
    logs = np.log(np.asarray(measured, dtype=float))
    if len(logs) < 2:
        return [None] * len(logs)
    return [float(np.exp(np.delete(logs, k).mean())) for k in range(len(logs))]


def hull_volume_mass(hull: Sequence[float], measured: Sequence[float]) -> list[float | None]:
    """Mass [kg] by a straight line through the others, ln m = a + b ln V_hull.

    None: fewer than two others, or others of one size.

    Args:
        hull: Volume of each object's convex hull [m³].
        measured: [kg]

    """
    x, y = np.log(np.asarray(hull, dtype=float)), np.log(np.asarray(measured, dtype=float))
    return [_without(k, x, y) for k in range(len(x))]


def _without(k: int, x: Float[np.ndarray, " N"], y: Float[np.ndarray, " N"]) -> float | None:
    others, known = np.delete(x, k), np.delete(y, k)
    if len(others) < 2 or np.ptp(others) == 0:
        return None
    slope, offset = np.polyfit(others, known, 1)
    return float(np.exp(offset + slope * x[k]))

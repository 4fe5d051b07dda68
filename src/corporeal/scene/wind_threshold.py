"""Threshold wind speed at which an object at rest slides or topples.

Wind pressure on objects at rest.

With u the velocity of the air and θ the angle between u and a face's inward normal, the pressure is ½ ρ_air C u² cos³θ
where cos θ > 0, and nothing in the lee (Hoerner 1965; see ``mpm/physics/wind_pressure.py``, which does the same for
faces in motion and imports nothing of the project: a test holds the two equal).
"""

from dataclasses import dataclass
from math import inf, sqrt

import numpy as np
from jaxtyping import Float

from corporeal.core.types import GRAVITY_M_S2
from corporeal.geometry.convex_hull import WEIGHT_BEARING_HEIGHT_FRACTION
from corporeal.scene.arrange_bodies import pose_standing_alone
from corporeal.scene.settling_body import BodyPose, SettlingBody

AIR_DENSITY_KG_M3 = 1.2
"""ρ_air at 20 °C and sea level [kg/m³]."""
FLAT_PLATE_DRAG_COEFFICIENT = 1.17
"""C: pressure on a plate that faces the wind, over ½ ρ u² [-]."""


def drag_areas(area: Float[np.ndarray, "A 3"], heading: Float[np.ndarray, "3"]) -> Float[np.ndarray, "A 3"]:
    """Force on each face over ½ ρ_air u² [m²]: along its inward normal, C A cos³θ large.

    Args:
        area: Outward area vectors of faces at rest [m²].
        heading: Where the air goes, unit.
    """
    size = np.linalg.norm(area, axis=1)
    inward = -area / np.maximum(size, 1e-30)[:, None]
    return (FLAT_PLATE_DRAG_COEFFICIENT * size * np.maximum(inward @ heading, 0.0) ** 3)[:, None] * inward


ROUND_FOOT_SIZE_FRACTION = 0.1
"""What is round hardly rolls on a grid: it stands as on a foot that reaches this share of its size beyond its centre
(two cells of a draft)."""
WIND_DIRECTIONS_COUNT = 8
"""Directions from which wind is tried."""


@dataclass(frozen=True)
class WindDrag:
    """What wind from one side does to an object, over ½ ρ_air u²."""

    along: float
    """Force with the wind [m²]."""
    lift: float
    """Force upwards [m²]."""
    overturning: float
    """Moment about the edge of the foot that is farthest in the lee [m³]."""


def wind_threshold(body: SettlingBody, pose: BodyPose, heading: Float[np.ndarray, "2"]) -> float:
    """Return the slowest wind that moves an object [m/s]; inf: none does.

    It slides where the drag exceeds friction, D q > μ (m g - L q) with q = ½ ρ_air u², and falls over where the moment
    of the air about the edge of its foot exceeds that of its weight. What leans on something, its centre of mass not
    above its foot, can only slide.

    Args:
        body: What; its material says how rough it is.
        pose: How it stands.
        heading: Where the wind goes, along the floor, unit.
    """
    weight = body.mass * GRAVITY_M_S2
    points = pose.world(body.hull.vertices)
    bottom = float(points[:, 2].min())
    foot = points[points[:, 2] < bottom + WEIGHT_BEARING_HEIGHT_FRACTION * body.extent, :2] @ heading
    lee = float(foot.max())
    drag = wind_drag_of(body, pose, heading, np.array([*(lee * heading), bottom]))
    held = lee - float(pose.world(body.centre[None])[0, :2] @ heading)
    held = max(held, ROUND_FOOT_SIZE_FRACTION * body.extent) if held > 0 else held
    slide = _overcoming_pressure(body.friction * weight, drag.along + body.friction * drag.lift)
    fall = _overcoming_pressure(weight * held, drag.overturning) if held > 0 else inf
    return sqrt(2 * min(slide, fall) / AIR_DENSITY_KG_M3)


def lowest_wind_threshold(body: SettlingBody) -> float:
    """Return the slowest wind from any side that moves an object standing alone [m/s]."""
    pose = pose_standing_alone(body)
    return min(wind_threshold(body, pose, heading) for heading in wind_headings(0.0))


def wind_headings(first: float) -> Float[np.ndarray, "H 2"]:
    """Return where winds go that come from all sides alike.

    Args:
        first: Bearing of the first [rad].
    """
    bearing = first + 2 * np.pi * np.arange(WIND_DIRECTIONS_COUNT) / WIND_DIRECTIONS_COUNT
    return np.stack([np.cos(bearing), np.sin(bearing)], axis=1)


def wind_drag_of(
    body: SettlingBody, pose: BodyPose, heading: Float[np.ndarray, "2"], pivot: Float[np.ndarray, "3"]
) -> WindDrag:
    """Add up the air's force on every face of an object, and its moment about a point of an edge.

    Args:
        body: What.
        pose: How it stands.
        heading: Where the wind goes, along the floor, unit.
        pivot: Any point of the edge, which is level and across the wind [m].
    """
    mesh = body.shape.mesh
    corners = pose.world(mesh.vertices)[mesh.triangles]
    a, b, c = np.swapaxes(corners, 0, 1)
    force = drag_areas(0.5 * np.cross(b - a, c - a), np.array([*heading, 0.0]))
    arm = corners.mean(axis=1) - pivot
    along = force[:, :2] @ heading
    turning = along * arm[:, 2] - force[:, 2] * (arm[:, :2] @ heading)
    return WindDrag(float(along.sum()), float(force[:, 2].sum()), float(turning.sum()))


def _overcoming_pressure(load: float, area: float) -> float:
    """Return the dynamic pressure at which a load is overcome [Pa]."""
    return load / area if area > 0 else inf

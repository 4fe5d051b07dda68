"""Contact of a rigid body's rounded surface points with planes: twin of ``Round`` in surfaces.h."""

import numpy as np
from jaxtyping import Bool, Float

from corporeal.mpm.constants import MAX_ARC_ANGLE_RAD, MIN_ARC_COMPONENT, TINY_DOUBLE


def support_point_shift(
    curvature: Float[np.ndarray, "N 12"], towards: Float[np.ndarray, "N 3"]
) -> tuple[Float[np.ndarray, "N 3"], Bool[np.ndarray, " N"]]:
    """How far from its point each rounded surface goes on in a direction [m].

    The surface around a point is that of a ball moved along an arc, whose support in the direction
    d is p + ρ (d - n) + δ (d' - n), with d' the direction of d in the plane of the arc. Angles from
    n are bounded by what the point stands for.

    Args:
        curvature: See ``types.CURVATURE_COLUMNS``; what is not round is not shifted.
        towards: Unit, in the frame of the curvature.

    Returns:
        The shifts, and whether each point is the surface in that direction at all, and not its
        neighbours.

    """
    normal, along = curvature[:, :3], curvature[:, 3:6]
    ball, arc, reach = curvature[:, 6], curvature[:, 7], curvature[:, 8]
    outward, ahead = np.sum(towards * normal, axis=1), np.sum(towards * along, axis=1)
    moved = np.where(np.hypot(outward, ahead) > MIN_ARC_COMPONENT, arc, 0.0)
    angle = np.where(moved > 0.0, np.arctan2(ahead, outward), 0.0)
    turned = _bounded_angle(angle, reach, ball + arc)
    shift = _arc_offset(moved, turned, along, normal)
    aside = towards - outward[:, None] * normal
    size = np.linalg.norm(aside, axis=1)
    tilt = np.where((ball > 0.0) & (size > 0.0), np.arctan2(size, outward), 0.0)
    tilted = _bounded_angle(tilt, reach, ball)
    shift = shift + _arc_offset(
        ball, tilted, aside / np.maximum(size, TINY_DOUBLE)[:, None], normal
    )
    beyond = (turned != angle) | (tilted != tilt)
    return shift, ~beyond | (curvature[:, 9] == 0.0)


def _bounded_angle(angle: np.ndarray, reach: np.ndarray, radius: np.ndarray) -> np.ndarray:
    limit = np.minimum(reach / np.maximum(radius, TINY_DOUBLE), MAX_ARC_ANGLE_RAD)
    return np.clip(angle, -limit, limit)


def _arc_offset(
    radius: np.ndarray, angle: np.ndarray, along: np.ndarray, normal: np.ndarray
) -> np.ndarray:
    """Way from the top of an arc to where it looks so far aside [m]."""
    aside, down = radius * np.sin(angle), radius * (np.cos(angle) - 1.0)
    return aside[:, None] * along + down[:, None] * normal

"""Contact of round bodies with convex or concave surfaces.

Twin of ``Curved`` in surfaces.h. Rows are those of ``types.CURVATURE_COLUMNS``.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from corporeal.mpm.constants import (
    CURVED_GAP_ERROR_DX2,
    FACET_REPLACES_NODES_DX,
    MAX_ARC_ANGLE_RAD,
    MIN_ARC_COMPONENT,
    MIN_CENTRE_DISTANCE_RATIO,
    TINY,
    TINY_DOUBLE,
)


def support_point_shift(
    curvature: Float[np.ndarray, "N 12"], towards: Float[np.ndarray, "N 3"]
) -> tuple[Float[np.ndarray, "N 3"], Bool[np.ndarray, " N"]]:
    """How far from its point each rounded surface goes on in a direction [m].

    The surface around a point is that of a ball moved along an arc, whose support in the direction d is p + ρ (d - n) +
    δ (d' - n), with d' the direction of d in the plane of the arc. Angles from n are bounded by what the point stands
    for.

    Args:
        curvature: See ``types.CURVATURE_COLUMNS``; what is not round is not shifted.
        towards: Unit, in the frame of the curvature.

    Returns:
        The shifts, and whether each point is the surface in that direction at all, and not its neighbours.
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
    shift = shift + _arc_offset(ball, tilted, aside / np.maximum(size, TINY_DOUBLE)[:, None], normal)
    beyond = (turned != angle) | (tilted != tilt)
    return shift, ~beyond | (curvature[:, 9] == 0.0)


def _bounded_angle(angle: np.ndarray, reach: np.ndarray, radius: np.ndarray) -> np.ndarray:
    limit = np.minimum(reach / np.maximum(radius, TINY_DOUBLE), MAX_ARC_ANGLE_RAD)
    return np.clip(angle, -limit, limit)


def _arc_offset(radius: np.ndarray, angle: np.ndarray, along: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Way from the top of an arc to where it looks so far aside [m]."""
    aside, down = radius * np.sin(angle), radius * (np.cos(angle) - 1.0)
    return aside[:, None] * along + down[:, None] * normal


Rows = Float[np.ndarray, "N R"]
Scalars = Float[np.ndarray, " N"]
Vectors = Float[np.ndarray, "N 3"]


class HeightsOverCurve(NamedTuple):
    """Where places lie over a curved surface."""

    height: Scalars
    """[m]"""
    normal: Vectors
    """Of the surface below each."""
    aside: Scalars
    """How far from its point that is, squared [m²]."""
    there: Bool[np.ndarray, " N"]
    """Whether each lies on the near side of what the surface curves around."""


def ball_radius(rows: Rows) -> Scalars:
    """Radius of the ball that lies under each round point [m]; 0 where it is not round."""
    return np.where(rows[:, 6] > 0.0, rows[:, 6], np.maximum(rows[:, 7], 0.0))


def is_curved(rows: Rows) -> Bool[np.ndarray, " N"]:
    """Whether the surface curves at each point."""
    return np.any(rows[:, 10:] != 0.0, axis=1)


def is_hollow(rows: Rows) -> Bool[np.ndarray, " N"]:
    """Whether it curves inwards."""
    return np.any(rows[:, 10:] < 0.0, axis=1)


def height_over(rows: Rows, place: Vectors) -> HeightsOverCurve:
    """Height of places over the surfaces around points: an arc that is moved along an arc.

    Exact for balls and cylinders, from inside and from outside, and for a torus where its ring runs in the plane of the
    normal; of third order elsewhere.

    Args:
        rows: One for each place.
        place: Seen from its point [m].
    """
    normal, along = rows[:, :3], rows[:, 3:6]
    across = np.cross(normal, along)
    s, t, h = (np.sum(place * way, axis=1) for way in (along, across, normal))
    h, way, sine, cosine, one = _over(rows[:, 10], s, h)
    h, aside, leans, stands, two = _over(rows[:, 11], t, h)
    ahead = sine[:, None] * along + cosine[:, None] * normal
    out = leans[:, None] * across + stands[:, None] * ahead
    return HeightsOverCurve(h, out, way**2 + aside**2, one & two)


def _over(k: Scalars, s: Scalars, h: Scalars) -> tuple[np.ndarray, ...]:
    """Height over a curve through the origin, the way along it, its turn, and whether it is there.

    Args:
        k: Its curvature [1/m].
        s: How far along its tangent a place lies [m].
        h: How far over its tangent [m].
    """
    down, turn = 1.0 + k * h, k * s
    size = np.hypot(turn, down)
    height = (2.0 * h + k * (s * s + h * h)) / (size + 1.0)
    bent = turn**2 > TINY
    flat = s / np.where(down == 0.0, 1.0, down)
    way = np.where(bent, np.arctan2(turn, down) / np.where(bent, k, 1.0), flat)
    safe = np.maximum(size, TINY_DOUBLE)
    return height, way, turn / safe, down / safe, down > MIN_CENTRE_DISTANCE_RATIO


def ball_centre(rows: Rows, towards: Vectors) -> Vectors:
    """Middle of the ball under each round point that looks in a direction, from the point [m].

    Args:
        rows: Of round points.
        towards: Unit, in the frame of the rows.
    """
    normal, along = rows[:, :3], rows[:, 3:6]
    radius, moved = ball_radius(rows), np.where(rows[:, 6] > 0.0, rows[:, 7], 0.0)
    outward, ahead = np.sum(towards * normal, axis=1), np.sum(towards * along, axis=1)
    moved = np.where(np.hypot(outward, ahead) > MIN_ARC_COMPONENT, moved, 0.0)
    limit = np.minimum(rows[:, 8] / np.maximum(radius + moved, TINY_DOUBLE), MAX_ARC_ANGLE_RAD)
    angle = np.clip(np.arctan2(ahead, outward), -limit, limit)
    aside, down = moved * np.sin(angle), moved * (np.cos(angle) - 1.0)
    return aside[:, None] * along + (down - radius)[:, None] * normal


def node_gap_error_reach(round_rows: Rows, rows: Rows, cell: float) -> Scalars:
    """How far from there nodes misjudge the gap by more than it is [m].

    They take both surfaces for planes.
    """
    own, least = 1.0 / ball_radius(round_rows), rows[:, 10:].min(axis=1)
    bent = own + np.abs(rows[:, 10:]).max(axis=1)
    return FACET_REPLACES_NODES_DX * cell + np.sqrt((0.5 + CURVED_GAP_ERROR_DX2 * bent * cell) * cell / (own + least))


def speed_into_hollow(round_rows: Rows, rows: Rows, square: Scalars, dt: float) -> Scalars:
    """Speed at which a way straight ahead leads into a hollow within a step [m/s].

    Args:
        round_rows: Of what is round.
        rows: Of what it meets.
        square: Of the speed at which its middle moves along the surface [m²/s²].
        dt: [s]
    """
    least = np.minimum(rows[:, 10:].min(axis=1), 0.0)
    return -0.5 * least / (1.0 + least * ball_radius(round_rows)) * square * dt

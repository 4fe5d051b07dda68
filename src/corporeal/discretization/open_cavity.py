"""Volume of open cavities up to the rim."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh

HORIZONTAL_DIRECTIONS_COUNT = 12
"""Level directions that are looked into."""
CAVITY_SAMPLES_COUNT = 5000
"""Points thrown into a box to measure how much of it is hollow; the error of half is 1 %."""


def is_below_rim(
    matter: QueryMesh | None, faces: Sequence[Mesh], points: Float[np.ndarray, "N 3"]
) -> Bool[np.ndarray, " N"]:
    """Whether a level liquid could reach each point without running over the rim.

    That is outside the material with faces below and, but for one crack, all around.

    Args:
        matter: What no liquid is in; None: only sheets.
        faces: What holds it.
        points: [m]
    """
    found = np.ones(len(points), dtype=bool)
    if matter is not None:
        found = ~matter.inside(points)
    shapes = [QueryMesh(m) for m in faces if len(m.triangles)]
    found[found] = is_blocked(shapes, points[found], np.array([0.0, 0.0, -1.0]))
    found[found] = blocked_direction_count(shapes, points[found]) >= HORIZONTAL_DIRECTIONS_COUNT - 1
    return found


def blocked_direction_count(shapes: Sequence[QueryMesh], points: Float[np.ndarray, "N 3"]) -> Int[np.ndarray, " N"]:
    """In how many of ``HORIZONTAL_DIRECTIONS_COUNT`` level directions something lies."""
    found = np.zeros(len(points), dtype=np.int64)
    for turn in 2 * np.pi * np.arange(HORIZONTAL_DIRECTIONS_COUNT) / HORIZONTAL_DIRECTIONS_COUNT:
        found += is_blocked(shapes, points, np.array([np.cos(turn), np.sin(turn), 0.0]))
    return found


def is_blocked(
    shapes: Sequence[QueryMesh], points: Float[np.ndarray, "N 3"], direction: Float[np.ndarray, "3"]
) -> Bool[np.ndarray, " N"]:
    """Whether something lies that way."""
    found = np.zeros(len(points), dtype=bool)
    for shape in shapes:
        found |= shape.hit(points, np.tile(direction, (len(points), 1))) >= 0
    return found


def volume_below_rim(matter: QueryMesh | None, body: Mesh, rng: np.random.Generator) -> float:
    """Volume that a level liquid could fill of a closed shape's open hollow [m³]."""
    corners = body.corners.reshape(-1, 3)
    low, high = corners.min(axis=0), corners.max(axis=0)
    points = low + rng.uniform(0, 1, (CAVITY_SAMPLES_COUNT, 3)) * (high - low)
    return float(np.prod(high - low)) * float(is_below_rim(matter, (body,), points).mean())

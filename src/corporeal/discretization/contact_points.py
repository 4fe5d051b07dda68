"""Points on the outside of a rigid object, through which it touches planes exactly."""

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull, QhullError

from corporeal.discretization.roundness import rounded
from corporeal.discretization.survey import Anatomy
from corporeal.geometry.mesh import joined
from corporeal.geometry.shape import sphere_directions
from corporeal.geometry.spread import sample_surface, thin_out

MOST, EXTREMES, LOWEST = 5000, 600, 2000
CAP = 0.02
"""Every corner of the hull up to this high over the lowest counts [of its height]: what is round
stands on small faces, and it would roll on if some of their corners were missing."""


def contact_points(
    anatomy: Anatomy, spacing: float, rng: np.random.Generator
) -> tuple[Float[np.ndarray, "S 3"], Float[np.ndarray, "S 12"]]:
    """Cover the outside evenly, at most ``MOST`` points, the farthest corners first [m].

    The corners in ``EXTREMES`` directions and the lowest make the object rest exactly.

    Args:
        anatomy: The object.
        spacing: Wanted between points [m]; larger where it takes too many.
        rng: Source of the samples.

    Returns:
        The points, on the round surface that the mesh stands for, and how it curves there: see
        ``geometry.roundness``.

    """
    corners = extremes(anatomy.vertices)
    faces = [m.sheet for m in anatomy.members if len(m.sheet.triangles)]
    if anatomy.skin is not None and len(anatomy.skin.numbers):
        faces.append(anatomy.skin.shape.mesh)
    area = sum(float(f.areas.sum()) for f in faces)
    distance = max(0.83 * spacing, np.sqrt(0.69 * area / (MOST - len(corners))))
    count = int(np.clip(8 * area / distance**2, 500, 60_000))
    samples = [sample_surface(f, max(1, int(count * f.areas.sum() / area)), rng)[0] for f in faces]
    points = np.concatenate(samples) if samples else np.zeros((0, 3))
    points = points[rng.permutation(len(points))]
    points = points[thin_out(points, distance, corners)]
    points, rounding = rounded(joined(faces), np.concatenate([corners, points])[:MOST])
    return points[:MOST], rounding[:MOST]


def extremes(vertices: Float[np.ndarray, "V 3"]) -> Float[np.ndarray, "E 3"]:
    """Corners that lie farthest in some direction [m], and the lowest, at most ``LOWEST``."""
    try:
        hull = vertices[ConvexHull(vertices).vertices]
    except QhullError:  # flat
        hull = vertices
    directions = np.concatenate([sphere_directions(EXTREMES), np.eye(3), -np.eye(3)])
    chosen = np.unique(np.argmax(hull @ directions.T, axis=0))
    height = hull[:, 2] - hull[:, 2].min()
    lowest = np.flatnonzero(height <= CAP * height.max())
    if len(lowest) > LOWEST:
        lowest = lowest[:: len(lowest) // LOWEST + 1]
    return hull[np.union1d(chosen, lowest)]

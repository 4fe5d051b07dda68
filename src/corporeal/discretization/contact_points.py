"""Contact points on the outside of rigid objects, for exact contact with planes."""

import numpy as np
from jaxtyping import Float
from scipy.spatial import ConvexHull, QhullError

from corporeal.discretization.mesh_measures import MeasuredObject
from corporeal.discretization.surface_curvature import curve_points
from corporeal.geometry.mesh import join_meshes
from corporeal.geometry.mesh_queries import sphere_directions
from corporeal.geometry.point_sampling import poisson_disk_subset, sample_surface

MAX_CONTACT_POINTS, EXTREME_DIRECTIONS_COUNT, MAX_LOWEST_CORNERS = 5000, 600, 2000
LOWEST_CAP_HEIGHT_FRACTION = 0.02
"""Every corner of the hull up to this high over the lowest counts [of its height]: what is round stands on small faces,
and it would roll on if some of their corners were missing."""


def sample_contact_points(
    anatomy: MeasuredObject, spacing: float, rng: np.random.Generator
) -> tuple[Float[np.ndarray, "S 3"], Float[np.ndarray, "S 12"]]:
    """Cover the outside evenly, at most ``MAX_CONTACT_POINTS`` points, the farthest corners first [m].

    The corners in ``EXTREME_DIRECTIONS_COUNT`` directions and the lowest make the object rest exactly.

    Args:
        anatomy: The object.
        spacing: Wanted between points [m]; larger where it takes too many.
        rng: Source of the samples.

    Returns:
        The points, on the round surface that the mesh stands for, and how it curves there: see ``geometry.roundness``.
    """
    corners = extreme_corners(anatomy.vertices)
    faces = [m.sheet for m in anatomy.members if len(m.sheet.triangles)]
    if anatomy.skin is not None and len(anatomy.skin.numbers):
        faces.append(anatomy.skin.shape.mesh)
    area = sum(float(f.areas.sum()) for f in faces)
    distance = max(0.83 * spacing, np.sqrt(0.69 * area / (MAX_CONTACT_POINTS - len(corners))))
    count = int(np.clip(8 * area / distance**2, 500, 60_000))
    samples = [sample_surface(f, max(1, int(count * f.areas.sum() / area)), rng)[0] for f in faces]
    points = np.concatenate(samples) if samples else np.zeros((0, 3))
    points = points[rng.permutation(len(points))]
    points = points[poisson_disk_subset(points, distance, corners)]
    points, curvature = curve_points(join_meshes(faces), np.concatenate([corners, points])[:MAX_CONTACT_POINTS])
    return points[:MAX_CONTACT_POINTS], curvature[:MAX_CONTACT_POINTS]


def extreme_corners(vertices: Float[np.ndarray, "V 3"]) -> Float[np.ndarray, "E 3"]:
    """Corners that lie farthest in some direction [m], and the lowest, at most ``MAX_LOWEST_CORNERS``."""
    try:
        hull = vertices[ConvexHull(vertices).vertices]
    except QhullError:  # flat
        hull = vertices
    directions = np.concatenate([sphere_directions(EXTREME_DIRECTIONS_COUNT), np.eye(3), -np.eye(3)])
    chosen = np.unique(np.argmax(hull @ directions.T, axis=0))
    height = hull[:, 2] - hull[:, 2].min()
    lowest = np.flatnonzero(height <= LOWEST_CAP_HEIGHT_FRACTION * height.max())
    if len(lowest) > MAX_LOWEST_CORNERS:
        lowest = lowest[:: len(lowest) // MAX_LOWEST_CORNERS + 1]
    return hull[np.union1d(chosen, lowest)]

"""Shape of loose contents: the hollow of a vessel up to the fill level."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import distance_transform_edt
from skimage.measure import marching_cubes

from corporeal.discretization.cavity import is_reachable_by_liquid, is_vessel, part_corners
from corporeal.discretization.mesh_measures import MeasuredObject, MeasuredPart
from corporeal.geometry.mesh import Mesh, signed_volume
from corporeal.geometry.mesh_queries import QueryMesh

VESSEL_SAMPLES_ALONG_SIDE = 48
"""Samples along the longest side of the vessel."""
LEVEL_CORRECTIONS_COUNT = 3
"""Of the level, by the volume of the mesh below it."""
LEVEL_BISECTIONS_COUNT = 40
"""Of the interval that the level is looked for in."""


@dataclass(frozen=True)
class PouredBody:
    """What lies in a vessel, as a body."""

    mesh: Mesh
    """Closed; normals outward."""
    volume: float
    """That it is to have [m³]."""
    level: float
    """Height of its surface [m]."""


def fill_to_volume(anatomy: MeasuredObject, member: MeasuredPart, thickness: float, volume: float) -> PouredBody | None:
    """Fill a vessel's hollow from its bottom; None: it has no room for so much.

    The hollow is sampled as a signed distance from the vessel's material, cut off at the level, and meshed where it
    changes its sign (marching cubes: Lorensen and Cline 1987). What lies nearer to the wall than the last sample is
    outside.

    Args:
        anatomy: The object.
        member: The part whose wall holds it.
        thickness: Of the wall where the mesh shows its outside only [m].
        volume: Of what is in it [m³].
    """
    corners = part_corners(member)
    low, high = corners.min(axis=0), corners.max(axis=0)
    step = float((high - low).max()) / VESSEL_SAMPLES_ALONG_SIDE
    axes = [np.arange(a - 1.5 * step, b + 2 * step, step) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    depth = hollow_distance(anatomy, member, thickness, points.reshape(-1, 3)).reshape(points.shape[:3])
    depth = limit_to_thin_wall(depth, depth > 0.0, step)
    height = points[..., 2]
    if volume <= 0.0 or positive_volume(depth, step) < volume:
        return None
    level = level_of_volume(depth, height, step, volume)
    first = np.array([axis[0] for axis in axes])
    for _ in range(LEVEL_CORRECTIONS_COUNT):
        # Corners of the samples' cubes are cut off by the mesh: its level makes up for them.
        mesh = sample_isosurface(np.minimum(depth, level - height), step, first)
        wide = positive_volume(np.minimum(depth, level + step - height), step) - volume
        level += step * (volume - signed_volume(mesh)) / wide if wide > 0.0 else 0.0
    mesh = sample_isosurface(np.minimum(depth, level - height), step, first)
    return PouredBody(mesh, volume, level)


def limit_to_thin_wall(
    depth: Float[np.ndarray, "X Y Z"], inside: Bool[np.ndarray, "X Y Z"], step: float
) -> Float[np.ndarray, "X Y Z"]:
    """Keep the other face of a thin wall out of a hollow, however near it is to a sample.

    Args:
        depth: Distance from the wall [m]; negative outside of the hollow.
        inside: Which samples are in the hollow.
        step: Between samples [m].
    """
    away = np.asarray(distance_transform_edt(~inside)) - 1.0
    return np.where(inside, depth, np.minimum(depth, -step * away))


def sample_isosurface(inside: np.ndarray, step: float, first: Float[np.ndarray, "3"]) -> Mesh:
    """Surface where samples change their sign, ``step`` [m] apart from ``first`` [m] on."""
    vertices, triangles, _, _ = marching_cubes(inside, 0.0, spacing=(step,) * 3, gradient_direction="ascent")
    return Mesh(np.asarray(vertices, np.float64) + first, np.asarray(triangles, np.int64))


def hollow_distance(
    anatomy: MeasuredObject, member: MeasuredPart, thickness: float, points: Float[np.ndarray, "N 3"]
) -> Float[np.ndarray, " N"]:
    """Distance of points in the hollow from its wall [m]; negative outside of it."""
    if not is_vessel(member):
        distance = member.shape.closest(points)[0]
        return np.where(member.shape.inside(points), distance, -distance) - thickness
    faces = [m for m in (member.body, member.sheet) if len(m.triangles)]
    distance = np.min([QueryMesh(m).closest(points)[0] for m in faces], axis=0)
    return np.where(is_reachable_by_liquid(anatomy, member, points), distance, -distance)


def positive_volume(depth: np.ndarray, step: float) -> float:
    """Volume of where a signed distance is positive [m³]; cells at its surface count in part."""
    return float(np.clip(0.5 + depth / step, 0.0, 1.0).sum()) * step**3


def level_of_volume(depth: np.ndarray, height: np.ndarray, step: float, volume: float) -> float:
    """Height below which a volume [m³] of the hollow lies [m]."""
    low, high = float(height.min()), float(height.max())
    for _ in range(LEVEL_BISECTIONS_COUNT):
        middle = 0.5 * (low + high)
        if positive_volume(np.minimum(depth, middle - height), step) < volume:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)

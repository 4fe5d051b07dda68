"""Surface reconstruction of liquids from particles, per frame.

Its particles part and join, so no mesh follows them. The surface is where the distance from the weighted mean of the
particles around a point is their radius (Zhu and Bridson 2005, "Animating sand as a fluid", eq. 7): flat where they lie
side by side, a ball around one alone.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree
from skimage.measure import marching_cubes

MAX_NEIGHBOURS = 20
"""Particles that count at a point."""
REACH_SPACINGS = 2.0
"""They count up to this distance [spacings]."""
PARTICLE_RADIUS_SPACINGS = 0.6
"""Of a particle: half a spacing, and what makes a flat surface lie half a spacing outside of its first layer
[spacings]."""
SAMPLE_STEP_SPACINGS = 0.6
"""Between samples [spacings]."""
MAX_GRID_SAMPLES = 3_000_000
"""In the box around it; where it needs more, they lie farther apart."""


@dataclass(frozen=True)
class LiquidSurface:
    """Triangles of one picture."""

    vertices: Float[np.ndarray, "V 3"]
    """[m]"""
    normals: Float[np.ndarray, "V 3"]
    """Unit, outward."""
    triangles: Int[np.ndarray, "T 3"]
    finish: int = 0
    """Index into the scene's finishes."""


EMPTY_SURFACE = LiquidSurface(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3), np.int64))


def liquid_surface(points: Float[np.ndarray, "N 3"], spacing: float) -> LiquidSurface:
    """Wrap particles in a surface.

    Args:
        points: Places of the particles; what is not finite is left out [m].
        spacing: Between particles at rest [m].
    """
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) < 2:
        return EMPTY_SURFACE
    low, high = points.min(axis=0), points.max(axis=0)
    step = SAMPLE_STEP_SPACINGS * spacing
    margin = (REACH_SPACINGS + 1.0) * spacing
    while np.prod((high - low + 2 * margin) / step) > MAX_GRID_SAMPLES:
        step *= 1.1
    shape = np.ceil((high - low + 2 * margin) / step).astype(int) + 1
    origin = low - margin
    field = np.full(shape, -spacing)
    near = _near(points, origin, step, shape, REACH_SPACINGS * spacing)
    field[tuple(near.T)] = _depth(origin + step * near, points, spacing)
    vertices, triangles, normals, _ = marching_cubes(field, 0.0, spacing=(step,) * 3, gradient_direction="ascent")
    # Normals point to where the field falls, as triangles do.
    return LiquidSurface(
        np.asarray(vertices, np.float64) + origin,
        -np.asarray(normals, np.float64) * _sign(vertices, triangles, normals),
        np.asarray(triangles, np.int64),
    )


def _near(
    points: np.ndarray, origin: np.ndarray, step: float, shape: np.ndarray, reach: float
) -> Int[np.ndarray, "M 3"]:
    """Find samples that have a particle within reach, or nearly so."""
    wide = int(np.ceil(reach / step))
    around = np.zeros(shape, dtype=bool)
    cell = np.clip(np.round((points - origin) / step).astype(int), 0, shape - 1)
    around[tuple(cell.T)] = True
    for axis in range(3):
        grown = around.copy()
        for shift in range(1, wide + 1):
            one = [slice(None)] * 3
            other = [slice(None)] * 3
            one[axis], other[axis] = slice(shift, None), slice(None, -shift)
            grown[tuple(one)] |= around[tuple(other)]
            grown[tuple(other)] |= around[tuple(one)]
        around = grown
    return np.argwhere(around)


def _depth(samples: np.ndarray, points: np.ndarray, spacing: float) -> Float[np.ndarray, " M"]:
    """How deep samples lie below the surface [m]; negative outside."""
    reach, count = REACH_SPACINGS * spacing, min(MAX_NEIGHBOURS, len(points))
    distance, index = KDTree(points).query(samples, k=count, distance_upper_bound=reach)
    weight = np.clip(1.0 - (distance / reach) ** 2, 0.0, 1.0) ** 3
    total = weight.sum(axis=1)
    found = total > 0
    place = points[np.minimum(index, len(points) - 1)]
    mean = np.einsum("mk,mkd->md", weight, place) / np.maximum(total, 1e-30)[:, None]
    depth = PARTICLE_RADIUS_SPACINGS * spacing - np.linalg.norm(samples - mean, axis=1)
    return np.where(found, np.maximum(depth, -spacing), -spacing)


def _sign(vertices: np.ndarray, triangles: np.ndarray, normals: np.ndarray) -> float:
    """-1 where normals look as triangles do, else 1."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    facing = np.einsum("td,td->t", np.cross(b - a, c - a), normals[triangles[:, 0]])
    return -1.0 if facing.sum() > 0 else 1.0

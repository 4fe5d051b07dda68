"""Fall heights of objects."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh

MAX_DOWNWARD_POINTS = 400
"""Points of an object that look down."""


FLOOR_NUMBER = -1
"""Stands for the floor among the numbers of objects."""


@dataclass(frozen=True)
class FallHeights:
    """How far each of B objects can fall straight down, and onto what."""

    height: Float[np.ndarray, " B"]
    """Free height below it [m]."""
    onto: Int[np.ndarray, " B"]
    """Number of the object that ends it, or ``FLOOR_NUMBER``."""


def fall_heights(meshes: list[Mesh], rng: np.random.Generator) -> FallHeights:
    """Measure free heights, down to the nearest other object or the floor z = 0."""
    heights, ends = [], []
    for number, mesh in enumerate(meshes):
        used = mesh.vertices[np.unique(mesh.triangles)]
        looking = used[np.argsort(used[:, 2])[:MAX_DOWNWARD_POINTS]]
        spread = used[rng.integers(0, len(used), MAX_DOWNWARD_POINTS)]
        points = np.concatenate([looking, spread])
        free, onto = float(points[:, 2].min()), FLOOR_NUMBER
        for other in (k for k in range(len(meshes)) if k != number):
            down = np.tile([0.0, 0.0, -1.0], (len(points), 1))
            lift = np.array([0.0, 0.0, 1e-6 * mesh.extent])
            reach = float(QueryMesh(meshes[other]).reach(points + lift, down).min())
            free, onto = (reach, other) if reach < free else (free, onto)
        heights.append(max(0.0, free))
        ends.append(onto)
    return FallHeights(np.array(heights), np.array(ends, dtype=np.int64))

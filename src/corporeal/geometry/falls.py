"""How far objects are from what they may hit."""

import numpy as np
from jaxtyping import Float

from corporeal.geometry.mesh import Mesh
from corporeal.geometry.shape import Shape

LOWEST = 400
"""Points of an object that look down."""


def drop_heights(meshes: list[Mesh], rng: np.random.Generator) -> Float[np.ndarray, " B"]:
    """Free height below each object, down to the nearest other object or the floor z = 0 [m]."""
    heights = []
    for number, mesh in enumerate(meshes):
        used = mesh.vertices[np.unique(mesh.triangles)]
        others = [m for k, m in enumerate(meshes) if k != number]
        looking = used[np.argsort(used[:, 2])[:LOWEST]]
        spread = used[rng.integers(0, len(used), LOWEST)]
        points = np.concatenate([looking, spread])
        free = points[:, 2].copy()
        for other in others:
            down = np.tile([0.0, 0.0, -1.0], (len(points), 1))
            lift = np.array([0.0, 0.0, 1e-6 * mesh.extent])
            free = np.minimum(free, Shape(other).reach(points + lift, down))
        heights.append(max(0.0, float(free.min())))
    return np.array(heights)

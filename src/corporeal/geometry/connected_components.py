"""Connected components of graphs and of meshes."""

import numpy as np
from jaxtyping import Int
from scipy.sparse import coo_array, csgraph

from corporeal.geometry.mesh import Mesh


def connected_components(
    first: Int[np.ndarray, " E"], second: Int[np.ndarray, " E"], count: int
) -> Int[np.ndarray, " N"]:
    """Return the component of each of ``count`` nodes with edges from ``first`` to ``second``."""
    edges = coo_array((np.ones(len(first), bool), (first, second)), shape=(count, count))
    return csgraph.connected_components(edges, directed=False)[1]


def connected_pieces(mesh: Mesh) -> Int[np.ndarray, " T"]:
    """Give each triangle the number of its connected piece."""
    f = mesh.triangles
    label = connected_components(f[:, :2].ravel(), f[:, 1:].ravel(), len(mesh.vertices))[f[:, 0]]
    return np.unique(label, return_inverse=True)[1].reshape(-1)

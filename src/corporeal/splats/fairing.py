"""Closed surfaces made fair: noise taken off, and what nobody saw put where it is likely."""

import numpy as np
from jaxtyping import Bool
from scipy.sparse import csr_array, eye_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from corporeal.geometry.mesh import Mesh

PULLS = (0.5, -0.53)
"""How far vertices go to their neighbours' mean, and back."""
ONWARD = 0.7
"""Cosine between a patch and the surface about it from which on it goes on as that does: 45°."""
ON = 1e-9
"""What is no higher lies on the floor [m]."""


def means(mesh: Mesh) -> csr_array:
    """Return the matrix (N, N) that makes of a value per vertex the mean of its neighbours'."""
    count, f = len(mesh.vertices), mesh.triangles
    ends = np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]]).T
    edges = csr_array((np.ones(ends.shape[1]), (ends[0], ends[1])), shape=(count, count))
    return csr_array(edges.multiply(1 / edges.sum(axis=1)[:, None]))


def smoothed(mesh: Mesh, floor: float, passes: int, mean: csr_array) -> Mesh:
    """Take noise off a surface without shrinking it (Taubin 1995).

    What lies on the floor stays on it.

    Args:
        mesh: Closed.
        floor: Nothing is below it [m].
        passes: How often.
        mean: As ``means`` returns it.

    """
    v = mesh.vertices.copy()
    low = v[:, 2] < floor + ON
    for _ in range(passes):
        for step in PULLS:
            v += step * (mean @ v - v)
            v[low, 2] = floor
    v[:, 2] = np.maximum(v[:, 2], floor)
    return Mesh(v, mesh.triangles)


def continued(mesh: Mesh, unknown: Bool[np.ndarray, " N"], floor: float, mean: csr_array) -> Mesh:
    """Round off the patches of a surface that nobody knows, where that is likely.

    Where the surface about a patch nearly faces as the patch does, as about the underside of a
    ball, it goes on with the least bending (Botsch and Kobbelt 2004: Δ²x = 0). Elsewhere, as below
    a table, it stays.

    Args:
        mesh: Closed.
        unknown: Vertices that may be moved.
        floor: Nothing is moved below it [m].
        mean: As ``means`` returns it.

    """
    v, normals = mesh.vertices.copy(), mesh.vertex_normals
    pull = csr_array(eye_array(len(v)) - mean)
    some = np.flatnonzero(unknown)
    count, found = connected_components(csr_array(mean[some][:, some]), directed=False)
    patch = np.full(len(v), -1)
    patch[some] = found
    touched = patch[mesh.triangles].max(axis=1)  # what a triangle connects is one patch
    facing = np.zeros((count, 3))
    np.add.at(facing, touched[touched >= 0], mesh.area_vectors[touched >= 0])
    facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-300)
    order = np.argsort(found, kind="stable")
    for k, own in enumerate(np.split(some[order], np.cumsum(np.bincount(found))[:-1])):
        near = np.setdiff1d(mean[own].indices, own)
        if len(near) and np.mean(normals[near] @ facing[k]) > ONWARD:
            v[own] = _solved(pull[np.concatenate([own, near])], v, own)
    v[:, 2] = np.maximum(v[:, 2], floor)
    return Mesh(v, mesh.triangles)


def _solved(pull: csr_array, v: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Return where own vertices make |pull v|² least, the others given."""
    rest = v.copy()
    rest[own] = 0
    mine = pull[:, own]
    return splu((mine.T @ mine).tocsc()).solve(-mine.T @ (pull @ rest))

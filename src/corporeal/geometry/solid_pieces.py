"""Solids that touch or share vertices, told apart."""

import igl
import numpy as np
from jaxtyping import Int
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from corporeal.geometry.mesh import Mesh, boundary_edges, orient_outward, weld_mesh
from corporeal.geometry.remeshing import unique_edges

SAME_ANGLE_RAD = 1e-5
"""Triangles about an edge whose angles differ by less lie on one another."""


def weld_solids(vertices: np.ndarray, triangles: np.ndarray) -> Mesh:
    """Weld and wind a mesh outward; faces at which two closed solids touch stay double."""
    label = _connected(triangles, len(vertices))
    _, owner = boundary_edges(Mesh(vertices, triangles), label)
    is_open = np.bincount(label[owner], minlength=label.max(initial=-1) + 1) > 0
    mesh, _ = weld_mesh(vertices, triangles, np.where(is_open[label], -1, label))
    return orient_outward(mesh)


def _connected(triangles: Int[np.ndarray, "T 3"], size: int) -> Int[np.ndarray, " T"]:
    links = coo_matrix(
        (np.ones(2 * len(triangles)), (triangles[:, [0, 1]].ravel(), triangles[:, [1, 2]].ravel())), shape=(size, size)
    )
    return connected_components(links, directed=False)[1][triangles[:, 0]].astype(np.int64)


def solid_pieces(mesh: Mesh) -> Int[np.ndarray, " T"]:
    """Return the number of each triangle's piece.

    Where four and more meet at an edge, those that bound one wedge belong together; cavities belong to what is around.

    Args:
        mesh: Normals outward.
    """
    edges, number, count = unique_edges(mesh.triangles)
    order = np.argsort(number.ravel(), kind="stable")
    first = np.concatenate([[0], np.cumsum(count)])
    pairs = np.flatnonzero(count == 2)
    one, other = [order[first[pairs]] // 3], [order[first[pairs] + 1] // 3]
    for edge in np.flatnonzero(count > 2):
        linked = _wedges(mesh, edges[edge], order[first[edge] : first[edge + 1]])
        one.append(linked[:, 0])
        other.append(linked[:, 1])
    a, b = np.concatenate(one), np.concatenate(other)
    links = coo_matrix((np.ones(len(a)), (a, b)), shape=(len(mesh.triangles),) * 2)
    return _with_cavities(mesh, connected_components(links, directed=False)[1].astype(np.int64))


def _with_cavities(mesh: Mesh, piece: Int[np.ndarray, " T"]) -> Int[np.ndarray, " T"]:
    """Give what is inside out the number of the smallest solid around it."""
    a, b, c = np.swapaxes(mesh.corners - mesh.vertices.mean(axis=0), 0, 1)
    volume = np.bincount(piece, np.einsum("ij,ij->i", a, np.cross(b, c)) / 6)
    _, owner = boundary_edges(mesh, piece)
    volume[np.unique(piece[owner])] = 0.0
    solids = np.flatnonzero(volume > 0)
    solids = solids[np.argsort(volume[solids], kind="stable")]
    for cavity in np.flatnonzero(volume < 0):
        start = mesh.vertices[mesh.triangles[np.argmax(piece == cavity), :1]]
        for solid in solids:
            winding = igl.fast_winding_number(mesh.vertices, mesh.only(piece == solid).triangles, start)
            if abs(float(np.asarray(winding).reshape(-1)[0])) > 0.5:
                piece = np.where(piece == cavity, solid, piece)
                break
    return np.unique(piece, return_inverse=True)[1].reshape(-1)


def _wedges(mesh: Mesh, edge: Int[np.ndarray, "two"], corners: Int[np.ndarray, " K"]) -> Int[np.ndarray, "W 2"]:
    """Pair the triangles about an edge that have material between them."""
    owner, k = corners // 3, corners % 3
    start, end = mesh.vertices[edge]
    axis = (end - start) / max(np.linalg.norm(end - start), 1e-300)
    away = mesh.vertices[mesh.triangles[owner, (k + 2) % 3]] - start
    away -= (away @ axis)[:, None] * axis
    first = away[0] / max(np.linalg.norm(away[0]), 1e-300)
    angle = np.arctan2(away @ np.cross(axis, first), away @ first)
    angle = np.round(np.where(angle < -SAME_ANGLE_RAD, angle + 2 * np.pi, angle) / SAME_ANGLE_RAD)
    # Material of a triangle that goes along the edge lies before it, of one that goes against it behind it.
    ends = mesh.triangles[owner, k] == edge[0]
    order = np.lexsort([~ends, angle])
    begun, found = [], []
    for turn in np.concatenate([order, order]):
        if not ends[turn]:
            begun.append(turn)
        elif begun:
            found.append((owner[begun[0]], owner[turn]))
            begun = begun[1:]
    return np.array(found, dtype=np.int64).reshape(-1, 2)

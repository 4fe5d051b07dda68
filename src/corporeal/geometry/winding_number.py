"""Generalised winding number by a vertical ray and boundary edges.

Dropped from a point, a line meets faces: into the shape or out of it. That sum is the winding number where no edge is
open. From there on it counts what a curtain, hung from every open edge down to infinity, would close; seen from the
point that is a triangle of directions to the edge's ends and straight down, whose solid angle is known. Equal to
Jacobson et al. 2013, *Robust inside-outside segmentation using generalized winding numbers*, exactly; and it asks few
faces of many.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from corporeal.geometry import kernels_vertical_lines as kernels
from corporeal.geometry.mesh import Mesh

MAX_TABLE_ENTRIES_PER_FACE = 8
"""Places in the table of faces, per face, at most."""


@dataclass(frozen=True)
class VerticalLineTable:
    """A mesh, ready to be asked; C cells of a table of faces by where they lie across."""

    mesh: Mesh
    low: Float[np.ndarray, " 2"]
    """Of the table [m]."""
    width: float
    """Of a cell [m]."""
    counts: Int[np.ndarray, " 2"]
    first: Int[np.ndarray, " C1"]
    """Of each cell, in ``face``."""
    face: Int[np.ndarray, " F"]
    box: Float[np.ndarray, "F 5"]
    """Of each, as it stands in ``face``: least and greatest x, then y, and least height [m], by which they are in order
    within a cell."""
    rim: Int[np.ndarray, "E 2"]
    """Edges that are walked more often one way than the other."""
    excess: Int[np.ndarray, " E"]
    """How many times more, from the first vertex to the second."""

    def winding(self, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
        """Winding number of the mesh about points."""
        found = np.zeros(len(points))
        points = np.ascontiguousarray(points, dtype=np.float64)
        table = self.low, self.width, self.counts, self.first, self.face, self.box
        kernels.add_windings_below(points, self.mesh.vertices, self.mesh.triangles, table, found)
        if len(self.rim):
            kernels.add_open_edge_angles(points, self.mesh.vertices, self.rim, self.excess, found)
        return found


class OpenEdges(NamedTuple):
    """Edges that are walked more often one way than the other; E of them."""

    rim: Int[np.ndarray, "E 2"]
    excess: Int[np.ndarray, " E"]
    """How many times more, from the first vertex to the second."""


def vertical_line_table(mesh: Mesh, open_edges: OpenEdges | None = None) -> VerticalLineTable:
    """Sort the faces of a mesh by where they lie across.

    Args:
        mesh: The mesh.
        open_edges: Its own, from ``unbalanced_edges``, where they are known already: they depend
            on its triangles alone.
    """
    known = unbalanced_edges(mesh) if open_edges is None else open_edges
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    lowest, highest = (f(f(a, b), c) for f in (np.minimum, np.maximum))
    low, high, lowest = lowest[:, :2], highest[:, :2], lowest[:, 2]
    start, span = low.min(axis=0), np.maximum(high.max(axis=0) - low.min(axis=0), 1e-300)
    # About one face a cell; fewer cells where faces are long, so that the table stays small.
    width = float(max(np.sqrt(np.prod(span) / len(low)), span.max() / len(low)))
    while True:
        from_cell = ((low - start) / width).astype(np.int64)
        to_cell = ((high - start) / width).astype(np.int64)
        if (np.prod(to_cell - from_cell + 1, axis=1)).sum() <= MAX_TABLE_ENTRIES_PER_FACE * len(low):
            break
        width *= 2
    counts = to_cell.max(axis=0) + 1
    first, face = _faces_by_cell(from_cell, to_cell, counts, lowest)
    box = np.stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1], lowest], axis=1)[face]
    return VerticalLineTable(mesh, start, width, counts, first, face, box, *known)


def winding_without_table(
    mesh: Mesh, open_edges: OpenEdges, points: Float[np.ndarray, "N 3"]
) -> Float[np.ndarray, " N"]:
    """Winding number about points, as ``VerticalLineTable`` has it, of so few that no table is made."""
    order = np.argsort(points[:, 0], kind="stable")
    points = np.ascontiguousarray(points[order], dtype=np.float64)
    around, found = np.zeros(len(points)), np.empty(len(points))
    kernels.add_windings_below_sorted(points, mesh.vertices, mesh.triangles, around)
    if len(open_edges.rim):
        kernels.add_open_edge_angles(points, mesh.vertices, *open_edges, around)
    found[order] = around
    return found


def unbalanced_edges(mesh: Mesh) -> OpenEdges:
    """Edges that are walked more often one way than the other, and how many times more."""
    f = mesh.triangles
    ends = np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]])
    lower, upper = ends.min(axis=1), ends.max(axis=1)
    key, edge = np.unique(lower * len(mesh.vertices) + upper, return_inverse=True)
    excess = np.zeros(len(key), np.int64)
    np.add.at(excess, edge.reshape(-1), np.where(ends[:, 0] == lower, 1, -1))
    odd = excess != 0
    pairs = np.column_stack([key // len(mesh.vertices), key % len(mesh.vertices)])
    return OpenEdges(np.ascontiguousarray(pairs[odd]), excess[odd])


def _faces_by_cell(
    from_cell: np.ndarray, to_cell: np.ndarray, counts: np.ndarray, lowest: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """List the faces whose boxes touch each cell, cell by cell, from the lowest up."""
    held = np.zeros(int(np.prod(counts)), np.int64)
    kernels.count_faces_in_cells(from_cell, to_cell, int(counts[1]), held)
    first = np.concatenate([[0], np.cumsum(held)])
    face = np.empty(int(first[-1]), np.int64)
    # Within a cell the order is that in which faces are laid into it: from the lowest up.
    upwards = np.argsort(lowest, kind="stable")
    kernels.write_faces_in_cells(from_cell, to_cell, int(counts[1]), upwards, first[:-1].copy(), face)
    return first, face

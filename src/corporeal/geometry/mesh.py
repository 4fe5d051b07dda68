"""A welded triangle mesh and its measures: areas, volumes, consistent winding."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import igl
import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True)
class Mesh:
    """Triangles that share vertices."""

    vertices: Float[np.ndarray, "V 3"]
    """[m]"""
    triangles: Int[np.ndarray, "T 3"]

    @property
    def corners(self) -> Float[np.ndarray, "T 3 3"]:
        """Position of each triangle's corners [m]."""
        return self.vertices[self.triangles]

    @property
    def area_vectors(self) -> Float[np.ndarray, "T 3"]:
        """Normal times area of each triangle [m²]."""
        a, b, c = np.swapaxes(self.corners, 0, 1)
        return 0.5 * np.cross(b - a, c - a)

    @property
    def areas(self) -> Float[np.ndarray, " T"]:
        """Of each triangle [m²]."""
        return np.linalg.norm(self.area_vectors, axis=1)

    @property
    def normals(self) -> Float[np.ndarray, "T 3"]:
        """Unit normals."""
        vectors = self.area_vectors
        return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)

    @property
    def vertex_normals(self) -> Float[np.ndarray, "V 3"]:
        """Unit normals of vertices: means of the triangles around, by area."""
        total = np.zeros_like(self.vertices)
        for corner in range(3):
            np.add.at(total, self.triangles[:, corner], self.area_vectors)
        return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300)

    @property
    def extent(self) -> float:
        """Diagonal of the axis-aligned box [m]; 0 when there are no triangles."""
        if not len(self.triangles):
            return 0.0
        used = self.vertices[np.unique(self.triangles)]
        return float(np.linalg.norm(np.ptp(used, axis=0)))

    def only(self, chosen: np.ndarray) -> "Mesh":
        """Return the chosen triangles, on the same vertices."""
        return Mesh(self.vertices, np.ascontiguousarray(self.triangles[chosen]))


class TriangleSurface(Protocol):
    """A surface, a mesh, or a piece of one."""

    @property
    def vertices(self) -> Float[np.ndarray, "V 3"]:
        """In metres."""
        ...

    @property
    def triangles(self) -> Int[np.ndarray, "T 3"]:
        """Vertex numbers."""
        ...


def join_meshes(pieces: Sequence[TriangleSurface]) -> Mesh:
    """Return all triangles as one mesh, in their order; nothing is welded."""
    starts = np.cumsum([0, *(len(p.vertices) for p in pieces)])
    triangles = [p.triangles + k for p, k in zip(pieces, starts, strict=False)]
    none = np.zeros((0, 3))
    return Mesh(
        np.concatenate([none, *(p.vertices for p in pieces)]), np.concatenate([none.astype(np.int64), *triangles])
    )


def weld_mesh(
    vertices: Float[np.ndarray, "V 3"],
    triangles: Int[np.ndarray, "T 3"],
    part: Int[np.ndarray, " T"] | None = None,
    tolerance: float = 1e-6,
) -> tuple[Mesh, Int[np.ndarray, " kept"]]:
    """Join vertices that coincide and drop triangles without area and repeated ones.

    Exporters split vertices at texture seams and write two-sided faces twice; both break winding numbers.

    Args:
        vertices: [m]
        triangles: Vertex numbers.
        part: Triangles of different parts are never repeats: where two parts meet, both have a face.
        tolerance: Of the diagonal of the box.

    Returns:
        The mesh, and for each of its triangles the number it had.
    """
    vertices = np.ascontiguousarray(vertices, dtype=np.float64)
    triangles = np.ascontiguousarray(triangles, dtype=np.int64)
    if not len(triangles):
        return Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)), np.zeros(0, dtype=np.int64)
    # Relative to one corner, so that rounding means the same everywhere in the world.
    origin = vertices[triangles.ravel()].min(axis=0)
    size = float(np.linalg.norm(np.ptp(vertices[triangles.ravel()], axis=0)))
    keys = np.round((vertices - origin) / max(tolerance * size, 1e-300)).astype(np.int64)
    _, first, joined = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    welded = joined.reshape(-1)[triangles]
    owner = np.zeros(len(triangles), dtype=np.int64) if part is None else part
    ordered = np.column_stack([owner, np.sort(welded, axis=1)])
    _, kept = np.unique(ordered, axis=0, return_index=True)
    kept = np.sort(kept)
    mesh = Mesh(vertices[first], np.ascontiguousarray(welded[kept]))
    real = mesh.areas > 1e-14 * size**2
    return mesh.only(real), kept[real]


def signed_volume(mesh: Mesh) -> float:
    """Volume [m³] by the divergence theorem; exact when the mesh is closed, negative inside out."""
    return float(signed_triangle_volumes(mesh).sum())


def signed_triangle_volumes(mesh: Mesh) -> Float[np.ndarray, " T"]:
    """Volume [m³] between each triangle and the middle of all; of a closed piece they add up."""
    centre = mesh.vertices[mesh.triangles].mean(axis=(0, 1))
    a, b, c = np.swapaxes(mesh.corners - centre, 0, 1)
    return np.einsum("ij,ij->i", a, np.cross(b, c)) / 6


def inward_area_loss_rate(mesh: Mesh) -> float:
    """Return how fast a surface loses area as it moves inward, halved, at first [m].

    V(t) = A t - C t² + ... is what lies within t of it. For smooth ones C is the integral of the mean curvature
    (Steiner 1840); an edge between faces that turn by θ adds its length times tan(θ/2), as where two boards meet, and
    one that is hollow takes θ/2 away. Sharper than 90° counts as that.
    """
    f = mesh.triangles
    ends = np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]])
    edges = np.sort(ends, axis=1)
    triangle = np.tile(np.arange(len(f)), 3)
    order = np.lexsort(edges.T)
    twice = np.flatnonzero((edges[order][1:] == edges[order][:-1]).all(axis=1))
    one, other = order[twice], order[twice + 1]
    along = mesh.vertices[ends[one, 1]] - mesh.vertices[ends[one, 0]]
    length = np.linalg.norm(along, axis=1)
    a, b = mesh.normals[triangle[one]], mesh.normals[triangle[other]]
    sine = np.einsum("ij,ij->i", np.cross(a, b), along) / length
    half = 0.5 * np.arctan2(sine, np.einsum("ij,ij->i", a, b))
    return float(length @ np.where(half > 0, np.tan(half.clip(0, np.pi / 4)), half))


def boundary_edges(
    mesh: Mesh, patch: Int[np.ndarray, " T"] | None = None
) -> tuple[Int[np.ndarray, "B 2"], Int[np.ndarray, " B"]]:
    """Edges that an odd number of triangles (of one patch) share, and a triangle of each."""
    f = mesh.triangles
    edges = np.concatenate([f[:, [0, 1]], f[:, [1, 2]], f[:, [2, 0]]])
    # One number per edge: rows are sorted twenty times slower.
    key = edges.min(axis=1) * len(mesh.vertices) + edges.max(axis=1)
    if patch is not None:
        key = np.tile(patch, 3) * len(mesh.vertices) ** 2 + key
    _, edge, count = np.unique(key, return_inverse=True, return_counts=True)
    odd = np.flatnonzero(count[edge.reshape(-1)] % 2 == 1)
    return edges[odd], odd % len(f)


def open_edge_ratio(mesh: Mesh) -> float:
    """Length of the boundary edges over the root of the area [-]; 0 when closed."""
    edges, _ = boundary_edges(mesh)
    length = np.linalg.norm(mesh.vertices[edges[:, 0]] - mesh.vertices[edges[:, 1]], axis=1)
    return float(length.sum() / np.sqrt(mesh.areas.sum()))


def orient_outward(mesh: Mesh) -> Mesh:
    """Wind every patch consistently and outward, without filling cavities.

    Within a patch the majority of the file's own winding wins. A closed patch that is inside out
    is turned, unless it lies inside a closed patch that is not: then it is a cavity.
    """
    if not len(mesh.triangles):
        return mesh
    turned, patch = (np.asarray(a) for a in igl.bfs_orient(mesh.triangles))
    agrees = np.zeros(len(turned), dtype=bool)
    for roll in range(3):
        agrees |= np.all(np.roll(turned, roll, axis=1) == mesh.triangles, axis=1)
    vote = np.bincount(patch, mesh.areas * np.where(agrees, 1.0, -1.0))
    turned = _flip_triangles(turned, vote[patch] < 0)
    mesh = Mesh(mesh.vertices, turned)
    volume, closed = _patch_volumes(mesh, patch)
    if volume[closed].sum() < 0:
        mesh, volume = (Mesh(mesh.vertices, _flip_triangles(turned, np.ones(len(turned), bool))), -volume)
    wrong = closed & (volume < 0)
    right = closed & (volume > 0)
    if wrong.any() and right.any():
        asked = np.flatnonzero(wrong[patch])
        around = igl.fast_winding_number(
            mesh.vertices, mesh.only(right[patch]).triangles, mesh.corners[asked].mean(axis=1)
        )
        within = mesh.areas[asked] * (np.abs(np.asarray(around)).reshape(-1) > 0.5)
        share = np.bincount(patch[asked], within, len(wrong)) / np.bincount(patch, mesh.areas)
        wrong &= share < 0.95
    return Mesh(mesh.vertices, _flip_triangles(mesh.triangles, wrong[patch]))


def _flip_triangles(triangles: np.ndarray, which: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(np.where(which[:, None], triangles[:, ::-1], triangles))


def _patch_volumes(mesh: Mesh, patch: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Signed volume of each patch about its own middle [m³], and whether it is nearly closed.

    Where parts were welded together a tube can be a patch of its own: open, whatever its ends.
    """
    corners, areas = mesh.corners, mesh.areas
    total = np.bincount(patch, areas)
    middle = np.stack([np.bincount(patch, areas * corners.mean(axis=1)[:, k]) / total for k in range(3)], axis=1)
    a, b, c = np.swapaxes(corners - middle[patch][:, None], 0, 1)
    volume = np.bincount(patch, np.einsum("ij,ij->i", a, np.cross(b, c)) / 6)
    edges, owner = boundary_edges(mesh, patch)
    length = np.linalg.norm(np.diff(mesh.vertices[edges], axis=1)[:, 0], axis=1)
    rim = np.bincount(patch[owner], length, minlength=len(total))
    closed = (rim < 0.1 * np.sqrt(total)) & (np.bincount(patch) >= 4)
    return volume, closed

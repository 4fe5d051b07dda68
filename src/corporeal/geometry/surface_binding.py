"""Binds points to a triangle mesh, so that they follow it as it deforms."""

from dataclasses import dataclass

import igl
import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import coo_array, csr_array

from corporeal.geometry.mesh import Mesh, TriangleSurface
from corporeal.geometry.remeshing import unit_rows

SMOOTH_NORMAL_ANGLE_DEG = 60.0
"""Triangles at a vertex that turn by more from one another do not share a normal there."""
BINDING_ITERATIONS = 20
"""Of a point's foot and its offset."""
MAX_FOOT_OUTSIDE = 0.5
"""Furthest that a foot lies outside its triangle, in barycentric coordinates."""


@dataclass(frozen=True)
class SurfaceBinding:
    """Where N points are bound: p = Σ w_k x_k + s n + R r.

    n is the unit normal between those of the triangle's three corners, R the frame of the triangle. Corners of one
    vertex have one normal where the mesh is smooth.
    """

    triangles: Int[np.ndarray, "N 3"]
    """Vertices of the triangle that each point follows."""
    weights: Float[np.ndarray, "N 3"]
    """Barycentric coordinates w of its foot."""
    offsets: Float[np.ndarray, " N"]
    """Distance s from the foot along the normal [m], signed."""
    rest: Float[np.ndarray, "N 3"]
    """What is left, r, in the frame of the triangle [m]: 0 but beside rims and creases."""
    mesh_triangles: Int[np.ndarray, "T 3"]
    """All triangles of the mesh."""
    corner_normals: csr_array
    """Sum of area vectors of triangles at each corner of each point's triangle, (3 N, T)."""


def bind_to_surface(points: Float[np.ndarray, "N 3"], surface: TriangleSurface) -> SurfaceBinding:
    """Bind points to the nearest triangle of a surface.

    Args:
        points: [m]
        surface: At rest.
    """
    mesh = Mesh(np.asarray(surface.vertices, dtype=np.float64), np.asarray(surface.triangles, dtype=np.int64))
    points = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 3)
    tree = igl.AABB()
    tree.init(mesh.vertices, mesh.triangles)
    _, nearest, foot = tree.squared_distance(mesh.vertices, mesh.triangles, points)
    nearest, foot = np.asarray(nearest).reshape(-1), np.asarray(foot).reshape(-1, 3)
    sums = _corner_normal_sums(mesh)
    rows = (3 * nearest[:, None] + np.arange(3)).reshape(-1)
    mine, triangles = sums[rows].tocsr(), mesh.triangles[nearest]
    corners = mesh.vertices[triangles]
    normals = unit_rows(mine @ mesh.area_vectors).reshape(-1, 3, 3)
    weights = _barycentric(foot, corners)
    for _ in range(BINDING_ITERATIONS):
        normal = unit_rows(np.einsum("nk,nkd->nd", weights, normals))
        offsets = np.einsum("nd,nd->n", points - np.einsum("nk,nkd->nd", weights, corners), normal)
        inner = _barycentric(points - offsets[:, None] * normal, corners)
        inner = inner.clip(-MAX_FOOT_OUTSIDE, 1 + 2 * MAX_FOOT_OUTSIDE)
        weights = 0.5 * (weights + inner / inner.sum(axis=1, keepdims=True))
    normal = unit_rows(np.einsum("nk,nkd->nd", weights, normals))
    foot = np.einsum("nk,nkd->nd", weights, corners)
    offsets = np.einsum("nd,nd->n", points - foot, normal)
    left = points - foot - offsets[:, None] * normal
    rest = np.einsum("nij,ni->nj", _triangle_frames(corners), left)
    return SurfaceBinding(triangles, weights, offsets, rest, mesh.triangles, mine)


def deform_bound_points(binding: SurfaceBinding, vertices: Float[np.ndarray, "V 3"]) -> Float[np.ndarray, "N 3"]:
    """Return where bound points are when the mesh has other positions [m]."""
    corners = vertices[binding.triangles]
    areas = Mesh(vertices, binding.mesh_triangles).area_vectors
    normals = unit_rows(binding.corner_normals @ areas).reshape(-1, 3, 3)
    normal = unit_rows(np.einsum("nk,nkd->nd", binding.weights, normals))
    foot = np.einsum("nk,nkd->nd", binding.weights, corners)
    left = np.einsum("nij,nj->ni", _triangle_frames(corners), binding.rest)
    return foot + binding.offsets[:, None] * normal + left


def _corner_normal_sums(mesh: Mesh) -> csr_array:
    """Return which triangles' area vectors make the normal of each corner, (3 T, T).

    Those at its vertex that are turned little; of what is wound the other way, as where boards meet, the opposite.
    """
    flat, count = mesh.triangles.reshape(-1), len(mesh.triangles)
    at = coo_array((np.ones(3 * count), (flat, np.arange(3 * count))), shape=(len(mesh.vertices), 3 * count)).tocsr()
    pairs = (at.T @ at).tocoo()
    own, other = pairs.row // 3, pairs.col // 3
    normals = unit_rows(mesh.area_vectors)
    alike = np.einsum("ij,ij->i", normals[own], normals[other])
    near = (np.abs(alike) > np.cos(np.radians(SMOOTH_NORMAL_ANGLE_DEG))) | (own == other)
    data = np.where(alike[near] < 0, -1.0, 1.0)
    return coo_array((data, (pairs.row[near], other[near])), shape=(3 * count, count)).tocsr()


def _barycentric(points: Float[np.ndarray, "N 3"], corners: Float[np.ndarray, "N 3 3"]) -> Float[np.ndarray, "N 3"]:
    """Return the barycentric coordinates of points projected onto the planes of triangles."""
    a, b, c = np.swapaxes(corners, 0, 1)
    normal = np.cross(b - a, c - a)
    squared = np.maximum(np.einsum("ij,ij->i", normal, normal), 1e-300)
    v = np.einsum("ij,ij->i", np.cross(points - a, c - a), normal) / squared
    w = np.einsum("ij,ij->i", np.cross(b - a, points - a), normal) / squared
    return np.column_stack([1 - v - w, v, w])


def _triangle_frames(corners: Float[np.ndarray, "N 3 3"]) -> Float[np.ndarray, "N 3 3"]:
    """Return the frame of each triangle: its axes as columns, the last its normal."""
    a, b, c = np.swapaxes(corners, 0, 1)
    first = unit_rows(b - a)
    normal = unit_rows(np.cross(b - a, c - a))
    return np.stack([first, np.cross(normal, first), normal], axis=-1)

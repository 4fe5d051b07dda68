"""Curvature of surfaces at points where triangles approximate a round shape.

A ball of triangles rolls on corners, and loses speed at each as a wheel without a rim does (McGeer 1990, "Passive
dynamic walking"): a fifth in a second. So every point gets the radii of curvature that the mesh says, and between its
points the body is as round as they.
"""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

from corporeal.core.types import CURVATURE_COLUMNS
from corporeal.geometry.connected_components import connected_components
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh

MAX_SMOOTH_EDGE_ANGLE_DEG = 16.0
"""Edges that turn by more than this are edges of the body [deg]; the others stand for something round. 24 sides or 320
faces are round, 80 faces are a polyhedron."""
MAX_FACE_WIDTH_RATIO = 3.0
"""Faces stand for something round where one is at most so many times as wide as the other, over their edge; a wide face
beside a narrow one is flat, and the narrow one rounds its edge."""
MIN_CURVED_ANGLE_DEG = 0.1
"""Triangles that turn by less than this [deg] are one flat face."""
MIN_CURVED_ANGLE_RAD = 2e-3
"""What turns by less than this from one point to the next is straight [rad]."""
REACH_NEIGHBOUR_NUMBER, REACH_NEIGHBOUR_RATIO = 6, 1.2
"""A point stands for what is nearer than so many times the distance to its sixth neighbour [-]: nearly twice what lies
between it and the next, so that no direction is left out."""
SURROUND_NEIGHBOURS_COUNT, MAX_SURROUND_GAP_RAD = 12, 2.6
"""Something round ends where all of so many neighbours leave a larger angle open [rad]."""
AT_CORNER_DISTANCE_FRACTION = 1e-6
"""Points nearer to a corner than this share of the extent lie on it [-]."""


def curve_points(
    mesh: Mesh, points: Float[np.ndarray, "S 3"]
) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "N 12"]]:
    """Move points of a mesh onto the round surface that it stands for, and say how it curves there.

    A corner of the mesh at which several smooth faces meet is given once for each that curves.

    Args:
        mesh: Triangles, normals outward.
        points: On it [m].

    Returns:
        The points [m], and the curvature at each, see ``types.CURVATURE_COLUMNS``.
    """
    if len(points) <= SURROUND_NEIGHBOURS_COUNT or not len(mesh.triangles):
        return points, np.zeros((len(points), CURVATURE_COLUMNS))
    reach = point_reach(points)
    curved = MeshCurvature(mesh)
    at, vertex = map(np.asarray, KDTree(mesh.vertices).query(points))
    is_corner = at < AT_CORNER_DISTANCE_FRACTION * mesh.extent
    inside = np.flatnonzero(~is_corner)
    corners = _curvature_at_corners(curved, points[is_corner], reach[is_corner], vertex[is_corner])
    faces = _curvature_on_faces(curved, points[inside], reach[inside])
    # Corners first, as they were given: the lowest make the object rest exactly.
    place, curvature = (np.concatenate(both) for both in zip(corners, faces, strict=True))
    curvature[:, 9] = is_surrounded(curvature, place)
    return place, curvature


def point_reach(points: Float[np.ndarray, "S 3"]) -> Float[np.ndarray, " S"]:
    """How far from each point of a surface the surface is as it is there [m]."""
    away = np.asarray(KDTree(points).query(points, REACH_NEIGHBOUR_NUMBER + 1)[0])
    return REACH_NEIGHBOUR_RATIO * away[:, REACH_NEIGHBOUR_NUMBER]


def is_surrounded(curvature: Float[np.ndarray, "S 12"], points: Float[np.ndarray, "S 3"]) -> Bool[np.ndarray, " S"]:
    """Whether what is round around a point goes on on all sides, by where its neighbours look.

    Along an arc they look both ways, on a dome all around.
    """
    other = np.asarray(KDTree(points).query(points, SURROUND_NEIGHBOURS_COUNT + 1)[1])[:, 1:]
    normal, along = curvature[:, :3], curvature[:, 3:6]
    across = _unit_normals(np.cross(normal, along))
    near = is_round(curvature)[other] & (np.einsum("ski,si->sk", normal[other], normal) > 0.5)
    x = np.einsum("ski,si->sk", normal[other], along)
    y = np.einsum("ski,si->sk", normal[other], across)
    both = np.any(near & (x > 0.0), axis=1) & np.any(near & (x < 0.0), axis=1)
    # Angles of those around a dome in order; of the others, that of the first.
    angle = np.where(near, np.arctan2(y, x), np.nan)
    order = np.sort(np.where(near, angle, np.nanmin(angle, axis=1, initial=9.0)[:, None]), axis=1)
    turn = np.diff(order, axis=1, append=order[:, :1] + 2 * np.pi).max(axis=1)
    dome = curvature[:, 6] > 0.0
    return is_round(curvature) & np.where(dome, near.any(axis=1) & (turn < MAX_SURROUND_GAP_RAD), both)


class MeshCurvature:
    """Normals of a mesh's corners, across edges that are not sharp, and how its triangles curve."""

    def __init__(self, mesh: Mesh) -> None:
        _, place = np.unique(mesh.vertices, axis=0, return_inverse=True)
        self.place = place.reshape(-1)
        self.mesh = mesh
        self.area, self.flat = mesh.areas, _unit_normals(mesh.area_vectors)
        corner = self.place[mesh.triangles]
        one, other = _shared_half_edges(corner)
        smooth = self._smooth(one // 3, other // 3)
        self.group = self._groups(one[smooth], other[smooth])
        self.normal = self._normals()
        self.order = np.argsort(corner, axis=None, kind="stable")
        self.sorted = corner.reshape(-1)[self.order]

    def around(self, vertex: Int[np.ndarray, " N"]) -> tuple[Int[np.ndarray, " C"], Int[np.ndarray, " C"]]:
        """Corners of triangles at the places of vertices: which of the N, and three times the triangle plus 0, 1 or 2.

        In order of the N, and of their groups.
        """
        place = self.place[vertex]
        low, high = np.searchsorted(self.sorted, place), np.searchsorted(self.sorted, place + 1)
        count = high - low
        owner = np.repeat(np.arange(len(vertex)), count)
        corner = self.order[np.arange(len(owner)) + np.repeat(low - (np.cumsum(count) - count), count)]
        order = np.lexsort((self.group.reshape(-1)[corner], owner))
        return owner[order], corner[order]

    def _smooth(self, t: np.ndarray, u: np.ndarray) -> Bool[np.ndarray, " E"]:
        """Which edges, each of triangles t and u, stand for something round."""
        turn = np.einsum("ei,ei->e", self.flat[t], self.flat[u])
        coplanar = turn > np.cos(np.radians(MIN_CURVED_ANGLE_DEG))
        face = connected_components(t[coplanar], u[coplanar], len(self.flat))
        area = np.bincount(face, self.area)[face]
        wide = np.maximum(area[t], area[u]) <= MAX_FACE_WIDTH_RATIO * np.minimum(area[t], area[u])
        return coplanar | (wide & (turn > np.cos(np.radians(MAX_SMOOTH_EDGE_ANGLE_DEG))))

    def _groups(self, one: np.ndarray, other: np.ndarray) -> Int[np.ndarray, "T 3"]:
        """Group the corners of triangles around each vertex that no edge of the body parts.

        Half edges, which are smooth, run from a corner to the next of its triangle.
        """
        a, b = np.append(one, _next_corners(one)), np.append(_next_corners(other), other)
        return connected_components(a, b, 3 * len(self.flat)).reshape(-1, 3)

    def _normals(self) -> Float[np.ndarray, "T 3 3"]:
        """Of every corner; exact for balls (Max 1999, "Weights for computing vertex normals")."""
        p = self.mesh.corners
        total = np.zeros((self.group.max() + 1, 3))
        for k in range(3):
            a, b = p[:, (k + 1) % 3] - p[:, k], p[:, (k + 2) % 3] - p[:, k]
            size = np.sum(a * a, axis=1) * np.sum(b * b, axis=1)
            np.add.at(total, self.group[:, k], np.cross(a, b) / np.maximum(size, 1e-300)[:, None])
        return _unit_normals(total)[self.group]

    def principal(self, triangle: Int[np.ndarray, " N"]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Larger and smaller curvature of triangles [1/m], and the direction of the larger.

        S e = ΔN along the edges by least squares (Rusinkiewicz 2004, "Estimating curvatures and their derivatives on
        triangle meshes").
        """
        p, n = self.mesh.vertices[self.mesh.triangles[triangle]], self.normal[triangle]
        u = _unit_normals(p[:, 1] - p[:, 0])
        frame = np.stack([u, np.cross(self.flat[triangle], u)], axis=1)
        edge = np.einsum("tij,tkj->tki", frame, np.roll(p, -1, axis=1) - p)
        turn = np.einsum("tij,tkj->tki", frame, np.roll(n, -1, axis=1) - n)
        x, y = edge[..., 0], edge[..., 1]
        zero = np.zeros_like(x)
        rows = np.concatenate([np.stack([x, y, zero], axis=2), np.stack([zero, x, y], axis=2)], axis=1)
        turns = np.concatenate([turn[..., 0], turn[..., 1]], axis=1)
        a, b, c = np.einsum("tij,tj->ti", np.linalg.pinv(rows), turns).T
        value, vector = np.linalg.eigh(np.stack([np.stack([a, b], 1), np.stack([b, c], 1)], 1))
        return value[:, 1], value[:, 0], np.einsum("ti,tij->tj", vector[:, :, 1], frame)


def _next_corners(corner: Int[np.ndarray, " C"]) -> Int[np.ndarray, " C"]:
    """Return the next corners of the same triangles."""
    return corner - corner % 3 + (corner + 1) % 3


def _shared_half_edges(place: Int[np.ndarray, "T 3"]) -> tuple[np.ndarray, np.ndarray]:
    """Half edges, by the corners that they begin at, of both triangles at each edge of just two."""
    ahead = np.roll(place, -1, axis=1)
    ends = np.stack([np.minimum(place, ahead), np.maximum(place, ahead)], axis=2).reshape(-1, 2)
    key = ends[:, 0] * (place.max() + 1) + ends[:, 1]
    order = np.argsort(key, kind="stable")
    _, first, count = np.unique(key[order], return_index=True, return_counts=True)
    one, other = order[first[count == 2]], order[first[count == 2] + 1]
    turned = place.reshape(-1)[one] != place.reshape(-1)[other]  # wound alike
    return one[turned], other[turned]


def _curvature_on_faces(
    curved: MeshCurvature, points: Float[np.ndarray, "N 3"], reach: Float[np.ndarray, " N"]
) -> tuple[np.ndarray, np.ndarray]:
    """Points inside of triangles: they rise to the arcs above them, and curve as their triangle."""
    if not len(points):
        return points, np.zeros((0, CURVATURE_COLUMNS))
    triangle = QueryMesh(curved.mesh).closest(points)[1]
    p = curved.mesh.vertices[curved.mesh.triangles[triangle]]
    n = curved.normal[triangle]
    share = _barycentric_weights(points, p)
    rise = np.einsum("nkj,nkj->nk", p - points[:, None], n)
    lifted = points + 0.5 * np.einsum("nk,nk,nkj->nj", share, rise, n)
    normal = _unit_normals(np.einsum("nk,nkj->nj", share, n))
    large, small, along = curved.principal(triangle)
    curvature = _curvature_row(normal, along, large, small, reach)
    return np.where(is_curved(curvature)[:, None], lifted, points), curvature


def _curvature_at_corners(
    curved: MeshCurvature,
    points: Float[np.ndarray, "N 3"],
    reach: Float[np.ndarray, " N"],
    vertex: Int[np.ndarray, " N"],
) -> tuple[np.ndarray, np.ndarray]:
    """Give each corner once for each curved face that it belongs to; else as a point alone."""
    owner, corner = curved.around(vertex)
    group, triangle = curved.group.reshape(-1)[corner], corner // 3
    is_first = np.diff(owner, prepend=-1) + np.abs(np.diff(group, prepend=-1)) > 0
    first, face = np.flatnonzero(is_first), np.cumsum(is_first)
    large, small, along = curved.principal(triangle)
    area = curved.area[triangle]
    high, low = (np.add.reduceat(area * k, first) / np.add.reduceat(area, first) for k in (large, small))
    steepest = np.lexsort((-large, face))[first]
    normal = curved.normal.reshape(-1, 3)[corner[first]]
    rows = _curvature_row(normal, along[steepest], high, low, reach[owner[first]])
    found = is_curved(rows)
    of_face = owner[first][found]
    alone = np.setdiff1d(np.arange(len(points)), of_face)
    given = np.concatenate([of_face, alone])
    rows = np.concatenate([rows[found], np.zeros((len(alone), CURVATURE_COLUMNS))])
    order = np.argsort(given, kind="stable")
    return points[given[order]], rows[order]


def is_round(curvature: Float[np.ndarray, "N 12"]) -> Bool[np.ndarray, " N"]:
    """Whether the surface curves at each point."""
    return curvature[:, 6] + curvature[:, 7] > 0.0


def is_curved(curvature: Float[np.ndarray, "N 12"]) -> Bool[np.ndarray, " N"]:
    """Whether the surface curves at each point, outwards or, where it is hollow, inwards."""
    return np.any(curvature[:, 10:] != 0.0, axis=1)


def _curvature_row(
    normal: np.ndarray, along: np.ndarray, large: np.ndarray, small: np.ndarray, reach: np.ndarray
) -> Float[np.ndarray, "N 12"]:
    """Put a point's curvature together from its two curvatures [1/m]; hollows have no radii."""
    bent = large * reach > MIN_CURVED_ANGLE_RAD
    dome = bent & (small * reach > MIN_CURVED_ANGLE_RAD)
    tight = np.where(bent, 1.0 / np.where(bent, large, 1.0), 0.0)
    wide = np.where(dome, 1.0 / np.where(dome, small, 1.0), 0.0)
    ball = np.where(dome, tight, 0.0)
    arc = np.where(dome, wide - tight, tight)
    # A dome is a ball moved along an arc in its flatter direction; what is straight in one, an arc.
    across = _unit_normals(np.cross(normal, along))
    flat = along - np.sum(along * normal, axis=1, keepdims=True) * normal
    direction = np.where(dome[:, None], across, _unit_normals(flat))
    both = np.where(dome, small, large), np.where(dome, large, small)
    curved = [np.where(np.abs(k) * reach > MIN_CURVED_ANGLE_RAD, k, 0.0) for k in both]
    return np.column_stack([normal, direction, ball, arc, reach, np.zeros(len(reach)), *curved])


def _barycentric_weights(points: np.ndarray, corners: np.ndarray) -> Float[np.ndarray, "N 3"]:
    a, b, c = np.swapaxes(corners, 0, 1)
    area = np.cross(b - a, c - a)
    size = np.maximum(np.sum(area * area, axis=1), 1e-300)
    u = np.sum(np.cross(c - b, points - b) * area, axis=1) / size
    v = np.sum(np.cross(a - c, points - c) * area, axis=1) / size
    return np.stack([u, v, 1.0 - u - v], axis=1)


def _unit_normals(rows: np.ndarray) -> np.ndarray:
    size = np.linalg.norm(rows, axis=-1, keepdims=True)
    return rows / np.maximum(size, 1e-300)

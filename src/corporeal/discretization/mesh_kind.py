"""Classification of meshes: bodies, walls with both faces or open sheets; outer faces."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from jaxtyping import Float, Int

from corporeal.geometry.connected_components import connected_components, connected_pieces
from corporeal.geometry.mesh import Mesh, boundary_edges
from corporeal.geometry.mesh_queries import QueryMesh, sphere_directions
from corporeal.geometry.point_sampling import sample_surface

MAX_WALL_THICKNESS_FRACTION = 0.1
"""Walls are thinner than this share of the shortest side."""
OUTER_FACE_OPENNESS_RATIO = 1.5
"""The outside of a wall sees so many times as much of the open as the inside, or more."""


class MeshKind(IntEnum):
    """How a piece of mesh is to be read."""

    BODY = 0
    """It encloses what it is made of."""
    WALL = 1
    """It is a thin wall, modelled with both faces: a vase, a bowl."""
    SHEET = 2
    """It is an open surface: a leaf, a vessel modelled with one face."""


def open_sheets(mesh: Mesh, piece: Int[np.ndarray, " T"]) -> np.ndarray:
    """Which triangles belong to open pieces that enclose next to nothing.

    The rim of a sheet is longer than the root of its area; a shorter one is a flaw of the mesh.
    """
    corners, areas = mesh.corners, mesh.areas
    area = np.bincount(piece, areas)
    middle = np.stack([np.bincount(piece, areas * corners.mean(axis=1)[:, k]) / area for k in range(3)], axis=1)
    a, b, c = np.swapaxes(corners - middle[piece][:, None], 0, 1)
    volume = np.abs(np.bincount(piece, np.einsum("ij,ij->i", a, np.cross(b, c)) / 6))
    edges, owner = boundary_edges(mesh, piece)
    length = np.linalg.norm(np.diff(mesh.vertices[edges], axis=1)[:, 0], axis=1)
    rim = np.bincount(piece[owner], length, minlength=len(area))
    is_sheet = (rim > 0.5 * np.sqrt(area)) & (2 * volume / area < 0.03 * np.sqrt(area))
    return (is_sheet | (np.bincount(piece) < 4))[piece]


def longest_rim_length(mesh: Mesh) -> float:
    """Length of the longest opening [m]."""
    edges, _ = boundary_edges(mesh)
    if not len(edges):
        return 0.0
    loop = connected_components(edges[:, 0], edges[:, 1], len(mesh.vertices))[edges[:, 0]]
    length = np.linalg.norm(np.diff(mesh.vertices[edges], axis=1)[:, 0], axis=1)
    return float(np.bincount(loop, length).max())


def mesh_kind_of(shape: QueryMesh, size: tuple[float, float, float], rng: np.random.Generator) -> MeshKind:
    """Tell a body from a thin wall and an open vessel.

    Two opinions on what is inside: the winding number, and whether at least 24 of 26 directions
    are blocked (what it stands on blocks too). Where they share less than 0.9 of their union, the
    object is a wall if it is thin (2 V / A) and most of its surface has another surface close
    behind it; an open sheet or vessel if they share less than 0.6 and it has an opening as long as
    it is wide; and a body with holes otherwise.
    """
    mesh = shape.mesh
    used = mesh.vertices[np.unique(mesh.triangles)]
    low, high = used.min(axis=0), used.max(axis=0)
    points = low + rng.uniform(0, 1, (6000, 3)) * (high - low)
    inside = shape.inside(points)
    enclosed = _with_support_plane(mesh, low, high).sightings(points) >= 24
    either = (inside | enclosed).sum()
    shared = (inside & enclosed).sum()
    if either < 10 or shared >= 0.9 * either:
        return MeshKind.BODY
    volume = inside.mean() * float(np.prod(high - low))
    thin = 2 * volume / float(mesh.areas.sum()) < MAX_WALL_THICKNESS_FRACTION * size[0]
    if thin and np.mean(wall_thickness_behind(shape, rng) < 2 * MAX_WALL_THICKNESS_FRACTION * size[0]) > 0.6:
        return MeshKind.WALL
    open_vessel = shared < 0.6 * either and longest_rim_length(mesh) > size[1]
    return MeshKind.SHEET if open_vessel else MeshKind.BODY


def _with_support_plane(mesh: Mesh, low: np.ndarray, high: np.ndarray) -> QueryMesh:
    """Add what it stands on, so that a missing underside does not count as an opening."""
    z = low[2] - 1e-4 * (high[2] - low[2])
    floor = np.array([[low[0], low[1], z], [high[0], low[1], z], [high[0], high[1], z], [low[0], high[1], z]])
    n = len(mesh.vertices)
    faces = np.array([[n, n + 1, n + 2], [n, n + 2, n + 3]])
    return QueryMesh(Mesh(np.concatenate([mesh.vertices, floor]), np.concatenate([mesh.triangles, faces])))


def wall_thickness_behind(shape: QueryMesh, rng: np.random.Generator, count: int = 2000) -> Float[np.ndarray, " count"]:
    """Thickness behind random points of the surface [m], straight down; inf: nothing behind."""
    points, triangle = sample_surface(shape.mesh, count, rng)
    inward = -shape.mesh.normals[triangle]
    step = 1e-5 * shape.mesh.extent
    return shape.reach(points + step * inward, inward) + step


def inner_face_fraction(
    shape: QueryMesh, part: Mesh, width: float, rng: np.random.Generator, count: int = 2000
) -> float:
    """Share of a part's surface that is the inner face of a wall whose outer face is there, too.

    What has another face close behind it that sees at least half as much again of the open: the inside of a shade, or
    of a vase as far down as pictures show it.

    Args:
        shape: All that encloses something.
        part: Some of its triangles, all wound with their normals to the outside.
        width: Shortest side of the part [m].
        rng: Source of the points that are asked.
        count: How many are.
    """
    points, triangle = sample_surface(part, count, rng)
    normals, step = part.normals[triangle], 1e-5 * shape.mesh.extent
    behind = shape.hit(points - step * normals, -normals)
    depth = shape.reach(points - step * normals, -normals) + step
    near = (behind >= 0) & (depth < 2 * MAX_WALL_THICKNESS_FRACTION * width)
    points, normals, back = points[near], normals[near], shape.mesh.normals[behind[near]]
    own = openness_of_faces(shape, points + step * normals, normals)
    other = openness_of_faces(shape, points - depth[near, None] * normals + step * back, back)
    return float((OUTER_FACE_OPENNESS_RATIO * own < other).sum() / count)


def openness_of_faces(
    shape: QueryMesh, points: Float[np.ndarray, "N 3"], normals: Float[np.ndarray, "N 3"]
) -> Float[np.ndarray, " N"]:
    """Return how much of the open faces see: the sum of cosines over free directions."""
    seen = np.zeros(len(points))
    for direction in sphere_directions(48):
        facing = normals @ direction
        some = np.flatnonzero(facing > 0.05)
        free = shape.reach(points[some], np.tile(direction, (len(some), 1)))
        seen[some] += facing[some] * ~np.isfinite(free)
    return seen


@dataclass(frozen=True)
class OuterSkin:
    """The triangles between inside and outside, wound so that their normals point outside."""

    shape: QueryMesh
    numbers: Int[np.ndarray, " T"]
    """Their numbers in the mesh they were taken from."""


def outer_skin(shape: QueryMesh, rng: np.random.Generator) -> OuterSkin:
    """Leave out surface that is buried where pieces overlap: nothing can touch it."""
    mesh = shape.mesh
    if shape.closed and connected_pieces(mesh).max() == 0:
        return OuterSkin(shape, np.arange(len(mesh.triangles)))
    step = 1e-5 * mesh.extent
    crossing = np.zeros(len(mesh.triangles))
    for weights in rng.dirichlet((2, 2, 2), 2):
        points = np.einsum("k,tkd->td", weights, mesh.corners)
        # The winding number falls by one across a triangle, from behind to before it.
        behind = shape.winding(points - step * mesh.normals)
        crossing += (np.abs(behind) > 0.5).astype(float) - (np.abs(behind - 1) > 0.5)
    kept = np.flatnonzero(crossing)
    wound = np.where(crossing[kept, None] > 0, mesh.triangles[kept], mesh.triangles[kept][:, ::-1])
    return OuterSkin(QueryMesh(Mesh(mesh.vertices, np.ascontiguousarray(wound))), kept)


def outer_wall_side(skin: QueryMesh) -> np.ndarray:
    """Which triangles of a wall with both faces are its outer face.

    A triangle is on the outer face when it sees at least as much of the open as the triangle
    behind it through the wall.
    """
    mesh = skin.mesh
    centres, normals = mesh.corners.mean(axis=1), mesh.normals
    step = 1e-5 * mesh.extent
    seen = openness_of_faces(skin, centres + step * normals, normals)
    behind = skin.hit(centres - step * normals, -normals)
    other = np.where(behind >= 0, seen[behind], 0.0)
    return seen >= other

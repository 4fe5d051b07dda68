"""Rest geometry of a shell's triangle mesh: frames, hinges, and curvature as a linear function of dihedral angles.

A hinge is an edge between two triangles. The second fundamental form of a triangle follows from the changes of its
three dihedral angles: half of it is that of the quadratic surface through its three vertices and the three opposite
vertices of its neighbours, half that of normals at its sides which are the means of both triangles' (Grinspun, Gingold,
Reisman and Zorin 2006, "Computing discrete shape operators on general meshes"). Both are exact on regular meshes. Where
a side is free and its angle is missing, that of least bending energy is taken: no moment acts there.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.mpm.constants import FIT_RANK_CUTOFF, MIN_FIT_SINGULAR_RATIO, QUADRATIC_FIT_SHARE


@dataclass(frozen=True)
class ShellMesh:
    """Rest geometry; V vertices, T triangles, H hinges."""

    triangle: Int[np.ndarray, "T 3"]
    area: Float[np.ndarray, " T"]
    """[m²]"""
    inverse_rest: Float[np.ndarray, "T 2 2"]
    """B = D_m⁻¹ [1/m], with the edges from the first vertex as columns of D_m, in the triangle's own frame."""
    hinge: Int[np.ndarray, "H 4"]
    """Vertices: the edge from a to b, the opposite vertex of the first triangle, and that of the second."""
    hinge_triangle: Int[np.ndarray, "H 2"]
    rest_angle: Float[np.ndarray, " H"]
    """[rad]"""
    curvature_of_angle: Float[np.ndarray, "H 2 3"]
    """Curvatures κ₁₁, κ₂₂, κ₁₂ of either triangle, in its own frame, for each radian that the angle grows [1/m]."""


def shell_mesh(vertices: Float[np.ndarray, "V 3"], triangle: Int[np.ndarray, "T 3"], poisson: float) -> ShellMesh:
    """Measure a mesh at rest.

    Args:
        vertices: [m]
        triangle: Vertices of each; an edge may have any number of triangles.
        poisson: ν [-], on which the curvature at free edges depends.
    """
    triangle = np.asarray(triangle, np.int64)
    corner = vertices[triangle]
    flat = _flat_corners(corner)
    edge = np.stack([flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]], axis=2)
    hinges = _find_hinges(triangle)
    mesh = ShellMesh(
        triangle=triangle,
        area=0.5 * np.abs(np.linalg.det(edge)),
        inverse_rest=np.linalg.inv(edge),
        hinge=hinges.vertex,
        hinge_triangle=hinges.triangle,
        rest_angle=dihedral_angle(vertices[hinges.vertex]),
        curvature_of_angle=_curvature_of_angle(vertices, triangle, flat, hinges, poisson),
    )
    return mesh


def dihedral_angle(corner: Float[np.ndarray, "H 4 3"]) -> Float[np.ndarray, " H"]:
    """Angle by which the surface turns at each hinge [rad]: 0 where it is flat, positive where both sides rise."""
    a, b, o, q = (corner[:, k] for k in range(4))
    edge = b - a
    first, second = np.cross(edge, o - a), np.cross(q - a, edge)
    sine = np.einsum("hi,hi->h", np.cross(second, first), edge) / np.linalg.norm(edge, axis=1)
    return np.arctan2(sine, np.einsum("hi,hi->h", first, second))


@dataclass(frozen=True)
class _Hinges:
    vertex: Int[np.ndarray, "H 4"]
    triangle: Int[np.ndarray, "H 2"]
    side: Int[np.ndarray, "H 2"]
    """Which edge of either triangle it is, by the number of the opposite vertex in it."""
    sign: Float[np.ndarray, "H 2"]
    """-1 where the triangle winds against the hinge."""


def _find_hinges(triangle: Int[np.ndarray, "T 3"]) -> _Hinges:
    """Pair all triangles that share an edge; where n meet, every pair is a hinge."""
    sides: dict[tuple[int, int], list[tuple[int, int]]] = defaultdict(list)
    for t, corners in enumerate(triangle.tolist()):
        for k in range(3):
            a, b = corners[(k + 1) % 3], corners[(k + 2) % 3]
            sides[min(a, b), max(a, b)].append((t, k))
    rows = [(first, second) for found in sides.values() for i, first in enumerate(found) for second in found[i + 1 :]]
    if not rows:
        return _Hinges(np.zeros((0, 4), np.int64), *(np.zeros((0, 2), kind) for kind in (np.int64, np.int64, float)))
    pair = np.array(rows, np.int64)
    tri, side = pair[:, :, 0], pair[:, :, 1]
    a, b = (triangle[tri[:, 0], (side[:, 0] + n) % 3] for n in (1, 2))
    against = triangle[tri[:, 1], (side[:, 1] + 1) % 3] == a
    vertex = np.stack([a, b, triangle[tri[:, 0], side[:, 0]], triangle[tri[:, 1], side[:, 1]]], axis=1)
    sign = np.stack([np.ones(len(tri)), np.where(against, -1.0, 1.0)], axis=1)
    return _Hinges(vertex, tri, side, sign)


def _flat_corners(corner: Float[np.ndarray, "T 3 3"]) -> Float[np.ndarray, "T 3 2"]:
    """Corners in each triangle's own frame: the first at the origin, the second on the first axis [m]."""
    u, v = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    length = np.linalg.norm(u, axis=1)
    along = np.einsum("ti,ti->t", u, v) / length
    height = np.linalg.norm(np.cross(u, v), axis=1) / length
    zero = np.zeros_like(length)
    flat = [np.stack(row, axis=1) for row in ((zero, zero), (length, zero), (along, height))]
    return np.stack(flat, axis=1)


def _curvature_of_angle(
    vertices: Float[np.ndarray, "V 3"],
    triangle: Int[np.ndarray, "T 3"],
    flat: Float[np.ndarray, "T 3 2"],
    hinges: _Hinges,
    poisson: float,
) -> Float[np.ndarray, "H 2 3"]:
    """Invert, for every triangle, the angle changes of a curved surface; of several at one edge, the mean counts."""
    height = np.zeros((len(triangle), 3))
    foot, count = np.zeros_like(height), np.zeros_like(height)
    for s in (0, 1):
        side = hinges.triangle[:, s], hinges.side[:, s]
        at, up = _unfolded(vertices, hinges.vertex[:, [s, 1 - s, 3 - s]])
        np.add.at(foot, side, np.where(hinges.sign[:, s] > 0.0, at, 1.0 - at))
        np.add.at(height, side, up)
        np.add.at(count, side, 1.0)
    known = count > 0.0
    foot, height = foot / np.maximum(count, 1.0), height / np.maximum(count, 1.0)
    fitted = np.linalg.pinv(_angle_of_curvature(flat, foot, height, known), rcond=MIN_FIT_SINGULAR_RATIO)
    share = QUADRATIC_FIT_SHARE
    operator = share * fitted + (1.0 - share) * _mean_normal_operator(flat)
    operator = _least_bending(operator, known, poisson)
    parts = []
    for s in (0, 1):
        t, k = hinges.triangle[:, s], hinges.side[:, s]
        parts.append(operator[t, :, k] * (hinges.sign[:, s] / count[t, k])[:, None])
    return np.stack(parts, axis=1)


def _unfolded(
    vertices: Float[np.ndarray, "V 3"], corner: Int[np.ndarray, "H 3"]
) -> tuple[Float[np.ndarray, " H"], Float[np.ndarray, " H"]]:
    """Foot of the third corner on the edge between the first two, over its length [-], and its height [m]."""
    a, b, far = (vertices[corner[:, k]] for k in range(3))
    edge, arm = b - a, far - a
    length = np.linalg.norm(edge, axis=1)
    return np.einsum("hi,hi->h", arm, edge) / length**2, np.linalg.norm(np.cross(edge, arm), axis=1) / length


def _sides(flat: Float[np.ndarray, "T 3 2"]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Start, vector and outward unit normal of the sides opposite to each corner, (T, 3, 2)."""
    start = np.roll(flat, -1, axis=1)
    edge = np.roll(flat, -2, axis=1) - start
    outward = np.stack([edge[:, :, 1], -edge[:, :, 0]], axis=2)
    return start, edge, outward / np.linalg.norm(edge, axis=2, keepdims=True)


def _angle_of_curvature(
    flat: Float[np.ndarray, "T 3 2"],
    foot: Float[np.ndarray, "T 3"],
    height: Float[np.ndarray, "T 3"],
    known: Bool[np.ndarray, "T 3"],
) -> Float[np.ndarray, "T 3 3"]:
    """Angles at a triangle's three sides for unit κ₁₁, κ₂₂ and κ₁₂ of a quadratic surface w = ½ xᵀκx [rad m].

    The angle is the jump across the side of the slope of linear interpolations, with the neighbour unfolded into the
    triangle's plane. Beyond a free edge a mirrored triangle is taken.

    Args:
        flat: Corners of triangles in their own frames [m].
        foot: Of the neighbour's opposite vertex on the side, over its length, from its start [-].
        height: Of that vertex over the side [m].
        known: Which sides have a neighbour.
    """
    start, edge, outward = _sides(flat)
    own_foot = np.einsum("tki,tki->tk", flat - start, edge) / np.einsum("tki,tki->tk", edge, edge)
    own_height = -np.einsum("tki,tki->tk", flat - start, outward)
    foot, height = np.where(known, foot, own_foot), np.where(known, height, own_height)
    far = start + foot[..., None] * edge + height[..., None] * outward

    def surface(point: np.ndarray) -> np.ndarray:
        x, y = point[..., 0], point[..., 1]
        return np.stack([0.5 * x**2, 0.5 * y**2, x * y], axis=2)

    first, last = surface(start), surface(start + edge)
    rises = [
        (surface(point) - first * (1.0 - at[..., None]) - last * at[..., None]) / up[..., None]
        for point, at, up in ((flat, own_foot, own_height), (far, foot, height))
    ]
    return rises[0] + rises[1]


def _mean_normal_operator(flat: Float[np.ndarray, "T 3 2"]) -> Float[np.ndarray, "T 3 3"]:
    """Curvature for each angle [1/m] where normals at sides are the means of both triangles': l/(2A) n nᵀ."""
    _, edge, n = _sides(flat)
    double = np.abs(edge[:, 0, 0] * edge[:, 1, 1] - edge[:, 0, 1] * edge[:, 1, 0])
    dyad = np.stack([n[..., 0] ** 2, n[..., 1] ** 2, n[..., 0] * n[..., 1]], axis=1)
    return dyad * (np.linalg.norm(edge, axis=2) / double[:, None])[:, None]


def _least_bending(
    operator: Float[np.ndarray, "T 3 3"], known: Bool[np.ndarray, "T 3"], poisson: float
) -> Float[np.ndarray, "T 3 3"]:
    """Let angles at free edges be those of least bending energy: κᵀDκ is least over them.

    With C the curvatures of all angles, those of a known angle get C_k - C_f (C_fᵀ D C_f)⁻¹ C_fᵀ D C_k.
    """
    stiffness = np.array([[1.0, poisson, 0.0], [poisson, 1.0, 0.0], [0.0, 0.0, 2.0 * (1.0 - poisson)]])
    free = operator * ~known[:, None, :]
    weighted = np.swapaxes(free, 1, 2) @ stiffness
    inverse = np.linalg.pinv(weighted @ free, rcond=FIT_RANK_CUTOFF, hermitian=True)
    return (operator - free @ inverse @ weighted @ operator) * known[:, None, :]


def join_meshes(meshes: Sequence[ShellMesh]) -> ShellMesh:
    """Join meshes over one list of vertices."""
    none = ShellMesh(
        triangle=np.zeros((0, 3), np.int64),
        area=np.zeros(0),
        inverse_rest=np.zeros((0, 2, 2)),
        hinge=np.zeros((0, 4), np.int64),
        hinge_triangle=np.zeros((0, 2), np.int64),
        rest_angle=np.zeros(0),
        curvature_of_angle=np.zeros((0, 2, 3)),
    )
    rows, first = [none], 0
    for mesh in meshes:
        rows.append(replace(mesh, hinge_triangle=mesh.hinge_triangle + first))
        first += len(mesh.triangle)
    return ShellMesh(*(np.concatenate(parts) for parts in zip(*(vars(row).values() for row in rows), strict=True)))

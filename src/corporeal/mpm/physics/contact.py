"""Contact between fields on grid nodes: positions and normals of faces.

A pair of fields (a, c) meets at a node; n points from a to c. Every field shows itself there by
its mean offset X̄ from the node and by its outward volume gradient g. Walls are half spaces. What
is transmitted: ``contact_impulses``.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

from corporeal.mpm.constants import (
    FACE_TABLE_INTERVALS,
    FIRST_BIAS,
    FULL_LAYER_COSINE,
    HALF_SPACE_TOLERANCE_DX,
    LATTICE_GAP_DX,
    LATTICE_ROWS,
    LATTICE_SLOPE,
    LATTICE_START_DX,
    LAYER_DEVIATION_DX,
    LIQUID_WALL_REACH_DX,
    MAX_FACE_DEPTH_DX,
    MAX_WETTED_FACES,
    MIN_FILLED_FRACTION,
    MIN_HALF_SPACE_WEIGHT,
    MIN_LAYER_COSINE,
    NORMAL_CACHE_STEPS,
    NORMAL_CACHE_TRAVEL_DX,
    OTHER_BIAS,
    PARALLEL_EDGE_SINE2,
    PARTICLE_RADIUS_DX,
    SPLINE_DEVIATION_DX,
    TINY,
    WALL_REACH,
    WETTED_NORMAL_COSINE,
    WETTED_PATCH_DX,
    WETTED_REACH_DX,
)
from corporeal.mpm.problem import Body, WettedSurface

Vectors = Float[np.ndarray, "E 3"]
Scalars = Float[np.ndarray, " E"]
Indices = Int[np.ndarray, " E"]


def half_space_weight(face: np.ndarray) -> np.ndarray:
    """∫ N(u) du over u < s: share of the quadratic B-spline at 0 that a half space fills [-]."""
    s = np.clip(face, -1.5, 1.5)
    near = -np.abs(s)
    inner = 0.5 + 0.75 * near - near**3 / 3.0
    weight = np.where(near < -0.5, (near + 1.5) ** 3 / 6.0, inner)
    return np.where(s > 0.0, 1.0 - weight, weight)


def half_space_mean(face: np.ndarray) -> np.ndarray:
    """e(s): mean offset [dx] of the half space u < s weighted by the quadratic B-spline at 0.

    e(s) = ∫ u N(u) du / ∫ N(u) du over u < s; nearly s itself far behind the node, 0 when the
    half space fills the spline's support.
    """
    s = np.clip(face, -1.5, 1.5)
    near = -np.abs(s)
    w = near + 1.5
    inner = -13.0 / 64.0 + 0.375 * near**2 - 0.25 * near**4
    moment = np.where(near < -0.5, w**4 / 8.0 - w**3 / 4.0, inner)
    weight = half_space_weight(s)
    return np.where(weight > MIN_HALF_SPACE_WEIGHT, moment / np.maximum(weight, MIN_HALF_SPACE_WEIGHT), near)


def lattice_mean(face: np.ndarray) -> np.ndarray:
    """Mean offset [dx] of a lattice that fills the half space u < s, two points per cell and axis.

    The first row lies a quarter of a cell behind the face. It is what a field at rest shows of itself, where e(s) is
    what a continuum would: up to .05 dx less from s = -½ on, and nothing for s = ½.
    """
    s = np.minimum(np.asarray(face, dtype=np.float64), 1.5)
    u = s[..., None] - PARTICLE_RADIUS_DX * (1.0 + 2.0 * np.arange(LATTICE_ROWS))
    tail = 0.5 * np.maximum(1.5 - np.abs(u), 0.0) ** 2
    w = np.where(np.abs(u) < 0.5, 0.75 - u**2, tail)
    weight = w.sum(axis=-1)
    found = (w * u).sum(axis=-1) / np.maximum(weight, MIN_HALF_SPACE_WEIGHT)
    return np.where(weight > MIN_HALF_SPACE_WEIGHT, found, s - PARTICLE_RADIUS_DX)


_FACES = np.linspace(-1.5, 1.5, 6001)
_MEANS = np.maximum.accumulate(half_space_mean(_FACES))


def half_space_face(mean: np.ndarray) -> np.ndarray:
    """D = e⁻¹: where the face lies [dx] of a half space whose mean offset is ``mean`` [dx]."""
    return np.interp(mean, _MEANS, _FACES)


def half_space_deviation(face: np.ndarray) -> np.ndarray:
    """Return the standard deviation [dx] of the offsets in the half space u < s, weighted by the B-spline at 0."""
    s = np.clip(face, -1.5, 1.5)
    near = -np.abs(s)
    w = near + 1.5
    inner = 0.125 + 0.25 * near**3 - near**5 / 5.0
    square = np.where(near < -0.5, w**5 / 10.0 - 3.0 * w**4 / 8.0 + 3.0 * w**3 / 8.0, inner)
    square = np.where(s > 0.0, SPLINE_DEVIATION_DX**2 - square, square)
    weight = np.maximum(half_space_weight(s), MIN_HALF_SPACE_WEIGHT)
    return np.sqrt(np.maximum(square / weight - half_space_mean(s) ** 2, 0.0))


def spread_table() -> Float[np.ndarray, " K"]:
    """How far half spaces end beyond their mean offset [dx], at ``FACE_TABLE_INTERVALS`` + 1 standard deviations.

    Deviations go from 0 to ``SPLINE_DEVIATION_DX``, that of all that a node sees.
    """
    deviation = np.linspace(0.0, SPLINE_DEVIATION_DX, FACE_TABLE_INTERVALS + 1)
    known = np.maximum.accumulate(half_space_deviation(_FACES))
    return np.interp(deviation, known, _FACES - half_space_mean(_FACES))


_SPREADS = spread_table()


def face_of_spread(mean: np.ndarray, deviation: np.ndarray) -> np.ndarray:
    """Where material ends [dx] along an axis, from mean and standard deviation of its offsets from a node.

    Of a layer across the axis it is the mean itself, and of a half space ``half_space_face``: what is between ends as
    far beyond its mean as the half space of the same deviation does.

    Args:
        mean: [dx]
        deviation: [dx]
    """
    place = np.minimum(deviation, SPLINE_DEVIATION_DX) * (FACE_TABLE_INTERVALS / SPLINE_DEVIATION_DX)
    return mean + np.interp(place, np.arange(len(_SPREADS)), _SPREADS)


def face_table() -> Float[np.ndarray, " K"]:
    """D at ``FACE_TABLE_INTERVALS`` + 1 mean offsets from -1½ to 0 [dx]: what fast engines interpolate."""
    return half_space_face(np.linspace(-1.5, 0.0, FACE_TABLE_INTERVALS + 1))


def touching_distance(face: np.ndarray) -> np.ndarray:
    """t(s): distance of the mean offsets [dx] of two half spaces that touch s dx from the node.

    t(s) = -e(s) - e(-s) + .05 + .25 max(0, s - .7): .84 with the face on the node, .95 mid-cell, 1.27 one cell off. A
    constant would start contact early or sink heavy bodies.
    """
    s = np.minimum(np.abs(face), MAX_FACE_DEPTH_DX)
    lattice = LATTICE_GAP_DX + LATTICE_SLOPE * np.maximum(0.0, s - LATTICE_START_DX)
    return -half_space_mean(s) - half_space_mean(-s) + lattice


def gap_between(mean_a: Vectors, mean_c: Vectors, normal: Vectors, cell: float) -> Float[np.ndarray, " E"]:
    """Open distance g along n [m] of two fields; negative where they overlap.

    The face lies at s = ½ (D(ξ_a) - D(-ξ_c)), ξ = X̄·n/dx, and g = (X̄_c - X̄_a)·n - t(|s|) dx.
    """
    xi_a = np.sum(mean_a * normal, axis=1) / cell
    xi_c = np.sum(mean_c * normal, axis=1) / cell
    face = 0.5 * (half_space_face(xi_a) - half_space_face(-xi_c))
    return (xi_c - xi_a - touching_distance(face)) * cell


def gap_to_wall(mean: Vectors, height: Scalars, normal: Vectors, cell: float) -> Scalars:
    """Open distance g along n [m] of a field to a wall that lies ``height`` [m] below the node.

    The wall is a half space in the same formula; nodes high above it are never in contact.
    """
    gap = gap_to_plane(mean, height, normal, cell)
    return np.where(height > WALL_REACH * cell, np.inf, gap)


def gap_to_plane(mean: Vectors, height: Scalars, normal: Vectors, cell: float) -> Scalars:
    """Return the same at nodes however high above the wall [m]."""
    h = height / cell
    xi = np.sum(mean * normal, axis=1) / cell
    return (-half_space_mean(-h) - xi - touching_distance(h)) * cell


def surface_begins(points: Vectors, node: Vectors, normal: Vectors, around: float, behind: float) -> Scalars:
    """Where a thin rigid body begins along n, seen from each node [m]: least (p - x)·n.

    Its surface points nearer than ``around`` [m] to the line through the node along n count; where there are none, the
    one nearest to the line does. What is farther than ``behind`` [m] behind a node is another wall, and does not count;
    without any others it is infinite.

    Args:
        points: On its surface [m].
        node: Where it is looked from [m].
        normal: Along which, unit.
        around: [m]
        behind: [m]
    """
    offset = points[None, :] - node[:, None]
    along = np.einsum("enk,ek->en", offset, normal)
    aside = np.sum(offset**2, axis=2) - along**2
    far = along <= -behind
    aside[far], along[far] = np.inf, np.inf
    least = np.where(aside < around**2, along, np.inf).min(axis=1)
    nearest = np.take_along_axis(along, np.argmin(aside, axis=1)[:, None], axis=1)[:, 0]
    return np.where(np.isfinite(least), least, nearest)


def sees_thin_place(places: Vectors, node: Vectors, far: float) -> Bool[np.ndarray, " E"]:
    """Return which nodes see a place where a rigid body is thin.

    Args:
        places: Surface points behind which it is thin [m].
        node: Where it is looked from [m].
        far: How far [m].
    """
    square = np.sum((places[None, :] - node[:, None]) ** 2, axis=2)
    return np.any(square < far**2, axis=1)


def touching_offset(mean_a: Vectors, mean_c: Vectors, normal: Vectors, cell: float) -> Vectors:
    """Return how far from a node two rigid bodies touch that meet there [m].

    A node is felt up to 1½ cells beyond a body's edge, where nothing can be pushed at. So the
    place is the one nearest to the node, along the plane of contact, that lies in both bodies,
    each a half space that ends at D(-|t|) along its mean offset t in that plane.

    Args:
        mean_a: X̄ of one body [m].
        mean_c: Of the other [m].
        normal: n, unit.
        cell: dx [m].
    """
    (far, p), (other, q) = (_edge_distance(mean / cell, normal) for mean in (mean_a, mean_c))
    cosine = np.sum(p * q, axis=1)
    apart = 1.0 - cosine**2
    both = (far * cosine < other) & (other * cosine < far)
    crossing = both & (apart > PARALLEL_EDGE_SINE2)
    share = np.where(crossing, apart, 1.0)
    first = np.where(both, 0.5 * far, np.where(far >= other, far, 0.0))
    second = np.where(both, 0.5 * other, np.where(far >= other, 0.0, other))
    first = np.where(crossing, (far - other * cosine) / share, first)
    second = np.where(crossing, (other - far * cosine) / share, second)
    return (first[:, None] * p + second[:, None] * q) * cell


def _edge_distance(mean: Vectors, normal: Vectors) -> tuple[Scalars, Vectors]:
    """How far the edge of a body is that does not reach a node [cells], else 0; and which way."""
    aside = mean - np.sum(mean * normal, axis=1)[:, None] * normal
    size = np.linalg.norm(aside, axis=1)
    far = np.maximum(-half_space_face(-size), 0.0)
    way = aside / np.maximum(size, TINY)[:, None]
    return far, np.where(far[:, None] > 0.0, way, 0.0)


def gap_to_surface(mean: Vectors, begins: Scalars, normal: Vectors, cell: float) -> Scalars:
    """Open distance along n [m] of a field to a surface that begins there [m] beyond the node."""
    return gap_to_wall(mean, begins, normal, cell)


def gap_to_thin(mean: Vectors, begins: Scalars, normal: Vectors, cell: float) -> Scalars:
    """Open distance along n [m] of a field to a thin rigid body that begins there [m].

    Its surface is exact, and the field that touches it a lattice: g = e_lattice(h) - X̄·n.
    """
    xi = np.sum(mean * normal, axis=1) / cell
    gap = (lattice_mean(begins / cell) - xi) * cell
    return np.where(begins > WALL_REACH * cell, np.inf, gap)


def full_cell_mass(body: Body, cell: float) -> float:
    """Mass of a cell that is full of a body [kg]."""
    return float(body.volume @ body.density / body.volume.sum()) * cell**3


def gap_of_liquid(mean: Vectors, height: Scalars, normal: Vectors, full: Scalars, cell: float) -> Scalars:
    """Open distance [m] along n of a liquid to a surface that lies ``height`` [m] below the node.

    Pressure pushes every node whose spline reaches the surface, and a wall that answers behind its face alone would let
    the first layer of a liquid be squeezed along it. So nodes up to ``LIQUID_WALL_REACH_DX`` above are in contact too,
    where the liquid fills the half space up to the face as far as the node can tell: by its mean place, and by how
    ``full`` the node is, its mass over that of a full cell. A sheet or a drop would hover at such a node otherwise.
    """
    h, xi = height / cell, np.sum(mean * normal, axis=1) / cell
    deep = gap_to_plane(mean, height, normal, cell)
    like = (np.abs(half_space_mean(h) - xi) < HALF_SPACE_TOLERANCE_DX) & (full >= MIN_FILLED_FRACTION)
    held = (h > WALL_REACH) & (h <= LIQUID_WALL_REACH_DX) & like
    return np.where(held, deep, gap_to_wall(mean, height, normal, cell))


class WettedFaces(NamedTuple):
    """Faces of a rigid body that nodes of a liquid see; F rows, at most three for a node."""

    node: Indices
    """Which node."""
    outward: Vectors
    """Unit, out of the body."""
    height: Scalars
    """Of the node over the face [m]."""


def wetted_faces(surface: WettedSurface, node: Vectors, place: Vectors, cell: float) -> WettedFaces:
    """Return where a rigid body's surface lies for the liquid at each node.

    The surface point nearest to the liquid's own place decides which face of a thin wall it is; it
    and its neighbours that look alike are averaged, w = (1 - u)² with u from 0 at the nearest to 1
    at ``WETTED_PATCH_DX`` beyond it in squared distance. What looks another way, and at the
    liquid, is
    one more face: walls of a vessel and its bottom hold a node together.

    Args:
        surface: The body's, now.
        node: Nodes [m].
        place: Mean place of the liquid at each [m].
        cell: dx [m].
    """
    rows: list[tuple[int, np.ndarray, float]] = []
    around = KDTree(surface.point).query_ball_point(place, WETTED_REACH_DX * cell)
    for k, near in enumerate(around):
        point, normal = surface.point[near], surface.normal[near]
        square = np.sum((point - place[k]) ** 2, axis=1)
        left = np.ones(len(near), dtype=bool)
        for _ in range(MAX_WETTED_FACES):
            if not left.any():
                break
            first = np.flatnonzero(left)[np.argmin(square[left])]
            far = (np.sqrt(square[first]) + WETTED_PATCH_DX * cell) ** 2
            mine = left & (square <= far) & (normal @ normal[first] >= WETTED_NORMAL_COSINE)
            weight = (1.0 - (square[mine] - square[first]) / (far - square[first])) ** 2
            above = np.sum((node[k] - point[mine]) * normal[mine], axis=1)
            outward = unit(weight @ normal[mine])
            rows.append((k, outward, weight @ above / weight.sum()))
            looks = np.sum((place[k] - point) * normal, axis=1) > 0.0
            left &= looks & (normal @ outward <= WETTED_NORMAL_COSINE)
    return WettedFaces(
        np.array([k for k, _, _ in rows], dtype=np.int64),
        np.array([n for _, n, _ in rows]).reshape(-1, 3),
        np.array([h for _, _, h in rows], dtype=np.float64),
    )


def unit(v: np.ndarray) -> np.ndarray:
    """v/|v| along the last axis; zero stays zero."""
    size = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.where(size > TINY, v / np.maximum(size, TINY), 0.0)


def candidate_normals(outward_a: Vectors, outward_c: Vectors) -> Float[np.ndarray, "E 3 3"]:
    """n1 = g_a - g_c, n2 = g_a, n3 = -g_c, normalised; a corner has several and one is right."""
    return unit(np.stack([outward_a - outward_c, outward_a, -outward_c], axis=1))


def take_candidate(candidates: Float[np.ndarray, "E 3 3"], which: Indices) -> Vectors:
    """Take one of three candidate normals at every node."""
    return np.take_along_axis(candidates, which[:, None, None], axis=1)[:, 0]


def widest_candidate(
    candidates: np.ndarray, reach_a: Float[np.ndarray, "E 3"], reach_c: Float[np.ndarray, "E 3"], cell: float
) -> Indices:
    """Say along which candidate the two fields are farthest apart.

    Args:
        candidates: Unit normals (E, 3, 3), three per pair; zero: absent.
        reach_a: s_a(n) = max (x·n + R) over a's particles [m], R = r0 ‖Fᵀn‖.
        reach_c: s_c(n) = min (x·n - R) over c's particles [m].
        cell: dx [m].
    """
    bias = np.array([FIRST_BIAS, OTHER_BIAS, OTHER_BIAS]) * cell
    absent = np.all(candidates == 0.0, axis=2)
    width = np.where(absent, -np.inf, reach_c - reach_a + bias)
    return np.argmax(width, axis=1)


def normal_cache_steps(travel: float) -> int:
    """For how many steps what is widest is kept, where something moves so far in a step [cells].

    Candidates themselves follow their fields in every step, and contacts that are new are looked
    at at once: what may be out of date is only which of three is taken (decision contact-normal-cache).
    """
    count = NORMAL_CACHE_STEPS
    while count > 1 and count * travel > NORMAL_CACHE_TRAVEL_DX:
        count //= 2
    return count


def layer_normals(normal: Vectors, *covariance: Float[np.ndarray, "E 3 3"]) -> Vectors:
    """Let the normals of contacts be those of the layers that nodes see across them.

    One step of inverse iteration on the covariance of a layer's offsets turns a normal to that of the layer. Where it
    turns too far, the layer stands on its rim, and the normal stays. Of two layers it is the mean.

    Args:
        normal: Unit, or zero.
        covariance: Of the offsets that each node sees of a layer [dx²]; of one body, or of both.
    """
    share = np.zeros_like(normal)
    for square in covariance:
        across = unit(np.linalg.solve(square + LAYER_DEVIATION_DX**2 * np.eye(3), normal[:, :, None])[:, :, 0])
        cosine = np.sum(across * normal, axis=1)
        turned = np.clip((cosine - MIN_LAYER_COSINE) / (FULL_LAYER_COSINE - MIN_LAYER_COSINE), 0.0, 1.0)
        share += unit(normal + turned[:, None] * (across - normal))
    return unit(share) if covariance else normal


def smooth_normals(normal: Vectors, weight: Scalars, index: Int[np.ndarray, "E 3"]) -> Vectors:
    """Average the normals of one pair of bodies over the 27 nodes around each of its nodes.

    Args:
        normal: Unit normals at the pair's nodes.
        weight: min(m_a, m_c) [kg].
        index: The nodes' grid indices.
    """
    low = index.min(axis=0) - 1
    shape = tuple(index.max(axis=0) - low + 2)
    flat = np.asarray(np.ravel_multi_index(tuple((index - low).T), shape))
    order = np.argsort(flat)
    mean = np.zeros_like(normal)
    for offset in np.ndindex(3, 3, 3):
        around = index - low + np.array(offset) - 1
        there = np.ravel_multi_index(tuple(around.T), shape)
        place = np.minimum(np.searchsorted(flat, there, sorter=order), index.shape[0] - 1)
        other = order[place]
        found = flat[other] == there
        mean += np.where(found, weight[other], 0.0)[:, None] * normal[other]
    return unit(mean)

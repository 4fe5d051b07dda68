"""Queries of points near a mesh: inside, distance, visibility.

Ray casting with Embree; hits are refined in double precision.

What Embree finds is met again in double precision, in the plane of its triangle. The mesh is blown up to a diagonal of
100 first, so that its size in metres does not matter. The rules are those of trimesh (``ray.ray_pyembree``), whose
import alone takes .4 s of processor time.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import igl
import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from jaxtyping import Bool, Float, Int

from corporeal.geometry.kernels_segments import collect_segment_crossings
from corporeal.geometry.mesh import Mesh, boundary_edges
from corporeal.geometry.winding_number import (
    OpenEdges,
    VerticalLineTable,
    unbalanced_edges,
    vertical_line_table,
    winding_without_table,
)

EMBREE_DIAGONAL_UNITS = 100.0
"""Of the mesh as Embree sees it."""
ZERO_LENGTH = 100.0 * np.finfo(np.float64).eps
"""Lengths up to it are none."""
GRAZING_COS = 1e-5
"""Up to this cosine to its normal a ray does not meet a plane."""

RayPoints = Float[np.ndarray, "N 3"]


class RayHits(NamedTuple):
    """H places where rays meet triangles."""

    place: Float[np.ndarray, "H 3"]
    """[m]"""
    ray: Int[np.ndarray, " H"]
    triangle: Int[np.ndarray, " H"]


class RayCaster:
    """A mesh that rays can be cast at."""

    def __init__(self, mesh: Mesh) -> None:
        a, b, c = np.swapaxes(mesh.corners, 0, 1)
        self._corner, self._normal = a, _unit_or_same(np.cross(b - a, c - b))
        self._low = mesh.vertices.min(axis=0, initial=np.inf)
        self._scale = EMBREE_DIAGONAL_UNITS / (mesh.extent or 1.0)
        self._scene = EmbreeScene() if len(mesh.triangles) else None
        if self._scene is not None:
            # Doubles and unsigned integers are what Embree's wrapper reads fastest.
            seen = np.ascontiguousarray(self._seen(mesh.vertices))
            TriangleMesh(self._scene, seen, mesh.triangles.astype(np.uint32))

    def first(self, origins: RayPoints, directions: RayPoints) -> Int[np.ndarray, " N"]:
        """Return the first triangle along each ray; -1: none. Origins are in single precision."""
        begin, way = origins.astype(np.float32), directions.astype(np.float32)
        return self._cast(begin.astype(np.float64), _unit_or_same(way))

    def hits(self, origins: RayPoints, directions: RayPoints) -> RayHits:
        """Return the places where rays meet the mesh first."""
        origin, way = np.array(origins, dtype=np.float64), _unit_or_same(directions)
        triangle = self._cast(origin, way)
        ray = np.flatnonzero(triangle >= 0)
        return self._met(origin, way, ray, triangle[ray])

    def _met(self, origin: RayPoints, way: RayPoints, ray: np.ndarray, triangle: np.ndarray) -> RayHits:
        """Meet the planes of triangles, one a ray; rays that graze their triangle are left out."""
        normal = self._normal[triangle]
        height = _dot_rows(self._corner[triangle] - origin[ray], normal)
        slope = _dot_rows(way[ray], normal)
        steep = np.abs(slope) > GRAZING_COS
        ray = ray[steep]
        place = way[ray] * (height[steep] / slope[steep])[:, None] + origin[ray]
        return RayHits(place, ray, triangle[steep])

    def _seen(self, points: RayPoints) -> RayPoints:
        return (points - self._low) * self._scale

    def _cast(self, origins: RayPoints, ways: RayPoints) -> Int[np.ndarray, " N"]:
        if self._scene is None:
            return np.full(len(origins), -1)
        seen = self._seen(origins).astype(np.float32)
        return np.asarray(self._scene.run(seen, ways.astype(np.float32)), dtype=np.int64)


def _unit_or_same(vectors: np.ndarray) -> np.ndarray:
    """Scale vectors to length 1; what has none stays as it is."""
    length = np.sqrt(np.dot(vectors * vectors, np.ones(3)))
    some = length > ZERO_LENGTH
    length[some] = 1.0 / length[some]
    return vectors * length[:, None]


def _dot_rows(a: RayPoints, b: RayPoints) -> Float[np.ndarray, " N"]:
    return np.dot(a * b, np.ones(3))


MAX_POINTS_PER_TRIANGLE_BRUTE = 0.05
"""Points over triangles up to which faces above and below them are looked for one by one."""
MAX_OPEN_EDGES_BRUTE = 1000
"""Open edges up to which their solid angles are added up one by one: 20 ns each, where a tree of faces takes 2 to 100
µs, the most where faces lie upon each other."""


class SegmentCrossings(NamedTuple):
    """H times that a way goes through a triangle."""

    way: Int[np.ndarray, " H"]
    share: Float[np.ndarray, " H"]
    """Of the way that is gone until there [-]."""
    triangle: Int[np.ndarray, " H"]
    side: Int[np.ndarray, " H"]
    """1 into the shape, -1 out of it."""


@dataclass(frozen=True)
class QueryMesh:
    """A welded, consistently wound mesh, ready to be asked."""

    mesh: Mesh

    @cached_property
    def closed(self) -> bool:
        """Whether no edge is open."""
        return not len(boundary_edges(self.mesh)[0])

    @cached_property
    def open_edges(self) -> OpenEdges:
        """Edges that are walked more often one way than the other."""
        return unbalanced_edges(self.mesh)

    def moved(self, vertices: Float[np.ndarray, "V 3"]) -> "QueryMesh":
        """Return the same triangles with their vertices elsewhere, which have the same open edges."""
        other = QueryMesh(Mesh(vertices, self.mesh.triangles))
        other.__dict__["open_edges"] = self.open_edges
        return other

    @cached_property
    def _plumb_lines(self) -> VerticalLineTable:
        return vertical_line_table(self.mesh, self.open_edges)

    @cached_property
    def _winding(self) -> igl.FastWindingNumberBVH:
        tree = igl.FastWindingNumberBVH()
        tree.init(self.mesh.vertices, self.mesh.triangles)
        return tree

    @cached_property
    def _closest(self) -> igl.AABB:
        tree = igl.AABB()
        tree.init(self.mesh.vertices, self.mesh.triangles)
        return tree

    @cached_property
    def _rays(self) -> RayCaster:
        return RayCaster(self.mesh)

    def winding(self, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
        """Generalised winding number: about ±1 inside, about 0 outside.

        Exact where few edges are open; else after Barill et al. 2018, *Fast winding numbers for soups and clouds*, as
        in libigl.
        """
        if not len(points) or not len(self.mesh.triangles):
            return np.zeros(len(points))
        if len(self.open_edges.rim) <= MAX_OPEN_EDGES_BRUTE:
            if len(points) > MAX_POINTS_PER_TRIANGLE_BRUTE * len(self.mesh.triangles):
                return self._plumb_lines.winding(points)
            return winding_without_table(self.mesh, self.open_edges, points)
        return np.asarray(self._winding.winding_number(np.ascontiguousarray(points))).reshape(-1)

    def inside(self, points: Float[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
        """Whether each point is inside, tolerating holes and flipped surfaces."""
        return np.abs(self.winding(points)) > 0.5

    def closest(
        self, points: Float[np.ndarray, "N 3"]
    ) -> tuple[Float[np.ndarray, " N"], Int[np.ndarray, " N"], Float[np.ndarray, "N 3"]]:
        """Distance to the surface [m], the triangle, and the point on it [m]."""
        if not len(points):
            return np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros((0, 3))
        # Neighbours one after the other find their part of the tree in the cache: a third less.
        order = _morton_order(points)
        asked = np.ascontiguousarray(points[order])
        answers = self._closest.squared_distance(self.mesh.vertices, self.mesh.triangles, asked)
        squared, triangle, point = (np.empty_like(a) for a in map(np.asarray, answers))
        for found, answer in zip((squared, triangle, point), answers, strict=True):
            found[order] = answer
        return np.sqrt(squared), triangle, point

    def may_be_within(self, reach: float, points: Float[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
        """Find the points that could be nearer to the surface than ``reach`` [m].

        Asked once per cube of side ``reach``: much faster than the distance of every point.
        """
        if not len(points):
            return np.zeros(0, dtype=bool)
        cubes = np.floor(points / reach).astype(np.int64)
        unique, cube = np.unique(cubes, axis=0, return_inverse=True)
        distance, _, _ = self.closest((unique + 0.5) * reach)
        return (distance < (1 + np.sqrt(3) / 2) * reach)[cube.reshape(-1)]

    def sightings(self, points: Float[np.ndarray, "N 3"]) -> Int[np.ndarray, " N"]:
        """How many of 26 evenly spread directions hit the surface."""
        hits = np.zeros(len(points), dtype=np.int64)
        for direction in sphere_directions(26):
            hits += self.hit(points, np.tile(direction, (len(points), 1))) >= 0
        return hits

    def reach(self, origins: Float[np.ndarray, "N 3"], directions: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, " N"]:
        """Distance to the first hit along each ray [m]; inf: none."""
        length = np.full(len(origins), np.inf)
        if len(origins):
            place, ray, _ = self._rays.hits(origins, directions)
            length[ray] = np.einsum("ij,ij->i", place - origins[ray], directions[ray])
        return length

    def crossings(self, starts: Float[np.ndarray, "N 3"], ends: Float[np.ndarray, "N 3"]) -> SegmentCrossings:
        """Every triangle that short ways from ``starts`` to ``ends`` [m] go through."""
        first, last = (np.ascontiguousarray(x, dtype=np.float64) for x in (starts, ends))
        vertices, triangles, found = self.mesh.vertices, self.mesh.triangles, np.zeros((0, 4))
        count = collect_segment_crossings(first, last, vertices, triangles, found)
        if count:
            found = np.zeros((count, 4))
            collect_segment_crossings(first, last, vertices, triangles, found)
        whole = found.astype(np.int64)
        return SegmentCrossings(whole[:, 0], found[:, 1], whole[:, 2], whole[:, 3])

    def hit(self, origins: Float[np.ndarray, "N 3"], directions: Float[np.ndarray, "N 3"]) -> Int[np.ndarray, " N"]:
        """First triangle along each ray; -1: none."""
        return self._rays.first(origins, directions)


def _morton_order(points: Float[np.ndarray, "N 3"]) -> Int[np.ndarray, " N"]:
    """Order points along a curve through cubes that split their box 64 times a side (Morton)."""
    low, span = points.min(axis=0), max(float(np.ptp(points, axis=0).max()), 1e-300)
    cube = np.minimum((points - low) / span * 64, 63).astype(np.int64)
    key = np.zeros(len(points), dtype=np.int64)
    for bit in range(6):
        for axis in range(3):
            key |= (cube[:, axis] >> bit & 1) << (3 * bit + axis)
    return np.argsort(key.astype(np.int32), kind="stable")


def sphere_directions(count: int) -> Float[np.ndarray, "count 3"]:
    """Spread unit vectors evenly over the sphere (Fibonacci)."""
    i = np.arange(count) + 0.5
    polar = np.arccos(1 - 2 * i / count)
    turn = np.pi * (1 + 5**0.5) * i
    return np.stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)], axis=1)


def random_rotation(rng: np.random.Generator) -> Float[np.ndarray, "3 3"]:
    """Draw a uniformly random rotation matrix."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))

"""Ray casting with Embree; hits are refined in double precision.

What Embree finds is met again in double precision, in the plane of its triangle. The mesh is blown
up to a diagonal of 100 first, so that its size in metres does not matter. The rules are those of
trimesh (``ray.ray_pyembree``), whose import alone takes .4 s of processor time.
"""

from typing import NamedTuple

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from jaxtyping import Float, Int

from corporeal.geometry.mesh import Mesh

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

    def _met(
        self, origin: RayPoints, way: RayPoints, ray: np.ndarray, triangle: np.ndarray
    ) -> RayHits:
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

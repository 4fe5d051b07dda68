"""Clearances between objects along a direction."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Keyframes, Vector
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.geometry.point_sampling import sample_surface
from corporeal.mpm.physics.prescribed_motion import path_pose, path_rows

CLEARANCE_POINTS_COUNT = 300
"""Corners that lie foremost, and as many points spread over the surface, that are asked."""
RAY_START_DEPTH_FRACTION = 0.02
"""Rays begin so much of an object's extent inside, so that what it overlaps a little is met."""


@dataclass(frozen=True)
class SampledObject:
    """An object in its place at the start, with points on it."""

    shape: QueryMesh
    corners: Float[np.ndarray, "V 3"]
    """Corners of its triangles [m]."""
    looks: Float[np.ndarray, "V 3"]
    """Unit normal at each corner."""
    spread: Float[np.ndarray, "P 3"]
    """Points on its surface [m]."""
    faces: Float[np.ndarray, "P 3"]
    """Unit normal at each of those."""

    @classmethod
    def of(cls, mesh: Mesh, rng: np.random.Generator) -> "SampledObject":
        """Choose points."""
        used = np.unique(mesh.triangles)
        spread, triangle = sample_surface(mesh, CLEARANCE_POINTS_COUNT, rng)
        looks = mesh.vertex_normals[used]
        return cls(QueryMesh(mesh), mesh.vertices[used], looks, spread, mesh.normals[triangle])

    @property
    def middle(self) -> Float[np.ndarray, "3"]:
        """Of its box [m]."""
        return 0.5 * (self.corners.min(axis=0) + self.corners.max(axis=0))

    def points(self, along: Float[np.ndarray, "3"]) -> Float[np.ndarray, "P 3"]:
        """Return points that look along a unit vector, all of an open mesh: corners the foremost."""
        corners, spread = self.corners, self.spread
        if self.shape.closed:
            corners, spread = corners[self.looks @ along > 0.0], spread[self.faces @ along > 0.0]
        foremost = np.argsort(-corners @ along)[:CLEARANCE_POINTS_COUNT]
        return np.concatenate([corners[foremost], spread])

    def inward(self, along: Float[np.ndarray, "3"]) -> float:
        """How far inside a ray along a unit vector begins [m]; an open mesh has no inside."""
        return RAY_START_DEPTH_FRACTION * self.length(along) if self.shape.closed else 0.0

    def length(self, along: Float[np.ndarray, "3"]) -> float:
        """Extent along a unit vector [m]."""
        return float(np.ptp(self.corners @ along))


@dataclass(frozen=True)
class PlacedObject:
    """An object that has moved: a point x of it is at place + rotation (x - origin)."""

    thing: SampledObject
    place: Float[np.ndarray, "3"]
    rotation: Float[np.ndarray, "3 3"]
    origin: Float[np.ndarray, "3"]

    @classmethod
    def at_start(cls, thing: SampledObject) -> "PlacedObject":
        """Where it is at the start."""
        return cls(thing, np.zeros(3), np.eye(3), np.zeros(3))

    def out(self, points: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
        """Take points of the object at the start to where they are."""
        return self.place + (points - self.origin) @ self.rotation.T

    def back(self, points: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
        """Take points of space to where they were on the object at the start."""
        return self.origin + (points - self.place) @ self.rotation

    def reach(
        self, points: Float[np.ndarray, "P 3"], along: Float[np.ndarray, "3"]
    ) -> Float[np.ndarray, " P"]:
        """Distance to the object from points along a unit vector [m]; inf: they miss it."""
        ahead = np.tile(along @ self.rotation, (len(points), 1))
        return self.thing.shape.reach(self.back(points), ahead)

    def points(self, along: Float[np.ndarray, "3"]) -> Float[np.ndarray, "P 3"]:
        """Return points of it where they are, of its corners the foremost along a unit vector."""
        return self.out(self.thing.points(along @ self.rotation))


def place_along_path(
    thing: SampledObject, path: Keyframes, pivot: Vector, times: np.ndarray
) -> list[PlacedObject]:
    """Return where an object with a path is at some times [s].

    Args:
        thing: Which.
        path: Of the point ``pivot`` of it.
        pivot: The middle of the underside of its box at the start [m].
        times: [s]

    """
    rows, origin = path_rows(path, pivot), np.array(pivot)
    poses = [path_pose(rows, float(t)) for t in times]
    return [PlacedObject(thing, p.place, p.rotation, origin) for p in poses]


@dataclass(frozen=True)
class Clearance:
    """How far two things are from each other along a direction."""

    gap: float
    """Least distance [m]; below zero where they overlap a little, inf: they pass each other."""
    contact: Float[np.ndarray, "3"]
    """Where they would touch, on the upper one [m]."""


def measure_clearance(
    lower: PlacedObject, upper: PlacedObject, along: Float[np.ndarray, "3"]
) -> Clearance:
    """Measure how far ``lower`` can go along a unit vector until it touches ``upper``."""
    best = Clearance(np.inf, np.zeros(3))
    for one, other, way in ((lower, upper, along), (upper, lower, -along)):
        points = one.points(way)
        inward = one.thing.inward(way @ one.rotation)
        far = one_way_distances(points, other, way, inward)
        if not len(far):
            continue
        k = int(np.argmin(far))
        if far[k] < best.gap:
            touching = points[k] if one is upper else points[k] + far[k] * along
            best = Clearance(float(far[k]), touching)
    return best


def one_way_distances(
    points: Float[np.ndarray, "P 3"],
    other: PlacedObject,
    way: Float[np.ndarray, "3"],
    inward: float,
) -> Float[np.ndarray, " P"]:
    """Distance from points to another object [m], asked from a little inside."""
    return other.reach(points - inward * way, way) - inward


def overlap_along(upper: PlacedObject, lower: PlacedObject, along: Float[np.ndarray, "3"]) -> bool:
    """Return whether a line along a unit vector goes through both objects."""
    points = lower.points(along)
    apart = np.linalg.norm(upper.out(upper.thing.middle) - lower.out(lower.thing.middle))
    away = float(apart) + lower.thing.shape.mesh.extent + upper.thing.shape.mesh.extent
    return bool(np.isfinite(upper.reach(points - away * along, along)).any())

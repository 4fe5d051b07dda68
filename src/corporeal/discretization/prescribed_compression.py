"""Compression by prescribed motion, estimated before the simulation.

A prescribed path forces a displacement on objects that cannot give way: between a path and the floor, a wall or another
path. Along the direction in which those two come closer to each other, all free objects between them are pushed
together as rigid bodies, one up to the next, as far as they go: the least sum of gaps from one to the other is how far
they may come. What they come farther, s, is taken up by what lies in between as by springs in series: it bears p = s /
Σ (L_k/E_k), and strains by p/E, so that a block of steel under a ball of rubber stays what it is. What can go away (a
block before a pusher) is pressed by nothing.

Objects are pushed together from where they start, and are not turned: what is first brought elsewhere, or tips off its
support, is judged as if it had stayed.
"""

from dataclasses import dataclass
from itertools import combinations
from math import inf

import numpy as np
from jaxtyping import Float

from corporeal.core.types import Keyframes, Scene, Vector
from corporeal.discretization.mesh_measures import MeasuredObject
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.geometry.point_sampling import sample_surface
from corporeal.geometry.scene_transforms import underside_centre
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

    def reach(self, points: Float[np.ndarray, "P 3"], along: Float[np.ndarray, "3"]) -> Float[np.ndarray, " P"]:
        """Distance to the object from points along a unit vector [m]; inf: they miss it."""
        ahead = np.tile(along @ self.rotation, (len(points), 1))
        return self.thing.shape.reach(self.back(points), ahead)

    def points(self, along: Float[np.ndarray, "3"]) -> Float[np.ndarray, "P 3"]:
        """Return points of it where they are, of its corners the foremost along a unit vector."""
        return self.out(self.thing.points(along @ self.rotation))


def place_along_path(thing: SampledObject, path: Keyframes, pivot: Vector, times: np.ndarray) -> list[PlacedObject]:
    """Return where an object with a path is at some times [s].

    Args:
        thing: The object.
        path: Of the point ``pivot`` of it.
        pivot: The middle of the underside of its box at the start [m].
        times: [s]
    """
    rows, origin = path_rows(path, pivot), np.array(pivot)
    poses = [path_pose(rows, float(t)) for t in times]
    return [PlacedObject(thing, p.place, p.rotation, origin) for p in poses]


@dataclass(frozen=True)
class Clearance:
    """Distance of two objects along a direction."""

    gap: float
    """Least distance [m]; below zero where they overlap a little, inf: they pass each other."""
    contact: Float[np.ndarray, "3"]
    """Where they would touch, on the upper one [m]."""


def measure_clearance(lower: PlacedObject, upper: PlacedObject, along: Float[np.ndarray, "3"]) -> Clearance:
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
    points: Float[np.ndarray, "P 3"], other: PlacedObject, way: Float[np.ndarray, "3"], inward: float
) -> Float[np.ndarray, " P"]:
    """Distance from points to another object [m], asked from a little inside."""
    return other.reach(points - inward * way, way) - inward


def overlap_along(upper: PlacedObject, lower: PlacedObject, along: Float[np.ndarray, "3"]) -> bool:
    """Return whether a line along a unit vector goes through both objects."""
    points = lower.points(along)
    apart = np.linalg.norm(upper.out(upper.thing.middle) - lower.out(lower.thing.middle))
    away = float(apart) + lower.thing.shape.mesh.extent + upper.thing.shape.mesh.extent
    return bool(np.isfinite(upper.reach(points - away * along, along)).any())


LOOK_TIMES_COUNT = 25
"""At which a scene is looked at, beside the rows of its paths."""
MAX_CLOSING_DIRECTIONS = 6
"""In which two paths may close, at most."""
SAME_DIRECTION_COS = 0.98
"""Cosine from which two directions are one."""
MIN_MOVING_DISTANCE_M = 1e-6
"""A shorter way is none [m]."""


@dataclass(frozen=True)
class CompressionPlane:
    """A floor or wall: what is on its other side is behind it."""

    normal: Float[np.ndarray, "3"]
    """Into the room."""
    offset: float
    """Of the plane from the origin [m]."""

    def gap(self, thing: PlacedObject) -> Clearance:
        """Measure how far an object can go towards it."""
        heights = thing.out(thing.thing.corners) @ self.normal - self.offset
        return Clearance(float(heights.min()), np.zeros(3))


PresserPath = list[PlacedObject]
"""A body with a path, at all times that are looked at."""


def compression_pressures(
    scene: Scene, anatomies: list[MeasuredObject], compliances: list[float], seed: int
) -> list[float]:
    """Estimate the pressure that paths force on every object [Pa]; 0: on none.

    Args:
        scene: With paths, floor and walls.
        anatomies: One per object.
        compliances: 1/E of every object, as a whole [1/Pa].
        seed: Of the points by which gaps are measured.
    """
    found = [0.0] * len(scene.objects)
    prescribed = [k for k, obj in enumerate(scene.objects) if obj.path is not None]
    free = [k for k in range(len(found)) if k not in prescribed]
    if not prescribed or not free:
        return found
    rng = np.random.default_rng([seed, 11])
    things = [SampledObject.of(a.everything, rng) for a in anatomies]
    times = look_times(scene)
    pressers: list[PresserPath] = []
    for k in prescribed:
        path = scene.objects[k].path
        assert path is not None
        pressers.append(place_along_path(things[k], path, underside_centre(scene, k), times))
    heap = FreeObjects([PlacedObject.at_start(things[k]) for k in free], [compliances[k] for k in free])
    for k, pressure in zip(free, heap.pressed(pressers, compression_planes(scene)), strict=True):
        found[k] = pressure
    return found


def look_times(scene: Scene) -> Float[np.ndarray, " T"]:
    """When to look [s]: evenly as long as anything follows a prescribed path, and at all rows of paths."""
    rows = np.concatenate([obj.path.time for obj in scene.objects if obj.path is not None])
    last = min(scene.duration, float(rows.max()))
    even = np.linspace(0.0, last, LOOK_TIMES_COUNT)
    few = np.unique(rows[rows <= last])
    few = few[:: max(1, len(few) // LOOK_TIMES_COUNT)]
    return np.unique(np.concatenate([even, few]))


def compression_planes(scene: Scene) -> list[CompressionPlane]:
    """Return the floor and all walls."""
    planes = [CompressionPlane(np.array([0.0, 0.0, 1.0]), 0.0)]
    for wall in scene.walls:
        normal = np.array(wall.normal, float)
        planes.append(CompressionPlane(normal, float(normal @ np.array(wall.point))))
    return planes


@dataclass(frozen=True)
class FreeObjects:
    """The objects that are free to move."""

    objects: list[PlacedObject]
    compliances: list[float]
    """1/E [1/Pa]"""

    def pressed(self, pressers: list[PresserPath], planes: list[CompressionPlane]) -> Float[np.ndarray, " F"]:
        """Return the greatest pressure on each [Pa]."""
        greatest = np.zeros(len(self.objects))
        for plane in planes:
            for presser in pressers:
                if comes_closer(presser, plane.normal):
                    found = self._between(plane, presser, plane.normal)
                    greatest = np.maximum(greatest, found)
        for one, other in combinations(pressers, 2):
            for along in self._closing(one, other):
                greatest = np.maximum(greatest, self._between(one, other, along))
        return greatest

    def _closing(self, lower: PresserPath, upper: PresserPath) -> list[Float[np.ndarray, "3"]]:
        """Find unit vectors from one to the other along which they close, where objects are."""
        ways = []
        for thing in self.objects:
            middle = thing.thing.middle
            there = [np.array([p.out(presser[0].back(middle)) for p in presser]) for presser in (lower, upper)]
            ways.extend(np.diff(there[0] - there[1], axis=0))
        ways.sort(key=lambda way: -float(np.linalg.norm(way)))
        chosen: list[np.ndarray] = []
        for way in ways:
            length = float(np.linalg.norm(way))
            if length < MIN_MOVING_DISTANCE_M or len(chosen) == MAX_CLOSING_DIRECTIONS:
                break
            if all(way @ known < SAME_DIRECTION_COS * length for known in chosen):
                chosen.append(way / length)
        return chosen

    def _between(
        self, lower: CompressionPlane | PresserPath, upper: PresserPath, along: Float[np.ndarray, "3"]
    ) -> Float[np.ndarray, " F"]:
        """Return the greatest pressure on each free object between two [Pa].

        From each instant on, as long as both stay over an object, they are followed as if they did not meet anything.
        """
        stacked = self._stacked(along)
        greatest = np.zeros(len(self.objects))
        below = [self._side(lower, t, along, upper=False) for t in range(len(upper))]
        above = [self._side(upper, t, along, upper=True) for t in range(len(upper))]
        for start in range(len(upper) - 1):
            if not (np.isfinite(below[start].gaps).any() and np.isfinite(above[start].gaps).any()):
                continue
            first = stacked.room(below[start].gaps, above[start].gaps)
            low, high = below[start].gaps, above[start].gaps
            for end in range(start + 1, len(upper)):
                # What it has once gone past, it does not press when it is back there.
                low = np.where(np.isfinite(low), below[start].followed(below[end], along), inf)
                high = np.where(np.isfinite(high), above[start].followed(above[end], along), inf)
                if not (np.isfinite(low).any() and np.isfinite(high).any()):
                    break
                room = stacked.room(low, high)
                met = np.isfinite(room.left)
                came = first.left[met] - room.left[met]
                squeeze = np.maximum(np.minimum(-room.left[met], came) - MIN_MOVING_DISTANCE_M, 0.0)
                greatest[met] = np.maximum(greatest[met], squeeze / room.compliance[met])
        return greatest

    def _side(
        self, side: CompressionPlane | PresserPath, t: int, along: Float[np.ndarray, "3"], upper: bool
    ) -> "CompressionSide":
        """Measure how far one of the two is from every free object."""
        if isinstance(side, CompressionPlane):
            gaps = [side.gap(thing) for thing in self.objects]
            return CompressionSide(None, gaps, [True] * len(gaps), 1.0)
        there = side[t]
        gaps = [
            measure_clearance(thing, there, along) if upper else measure_clearance(there, thing, along)
            for thing in self.objects
        ]
        shadows = [overlap_along(there, thing, along) for thing in self.objects]
        return CompressionSide(there, gaps, shadows, 1.0 if upper else -1.0)

    def _stacked(self, along: Float[np.ndarray, "3"]) -> "StackedGaps":
        """Push all free objects together along a direction: shortest ways of all pairs."""
        count = len(self.objects)
        gaps = np.full((count, count), inf)
        soft = np.array(
            [
                max(thing.thing.length(along), MIN_MOVING_DISTANCE_M) * compliance
                for thing, compliance in zip(self.objects, self.compliances, strict=True)
            ]
        )
        for i in range(count):
            for j in range(count):
                if i != j:
                    gaps[i, j] = measure_clearance(self.objects[i], self.objects[j], along).gap
        # Above oneself there is nothing to go; its own compliance is counted once, at the end.
        np.fill_diagonal(gaps, 0.0)
        beyond = np.tile(soft, (count, 1))
        np.fill_diagonal(beyond, 0.0)
        for k in range(count):  # Floyd and Warshall
            by = gaps[:, k, None] + gaps[None, k]
            shorter = by < gaps
            gaps = np.where(shorter, by, gaps)
            beyond = np.where(shorter, beyond[:, k, None] + beyond[None, k], beyond)
        return StackedGaps(gaps, beyond, soft)


@dataclass(frozen=True)
class CompressionSide:
    """Floor, wall or path, and how far every free object is from it."""

    there: PlacedObject | None
    """None: it does not move."""
    clearances: list[Clearance]
    shadows: list[bool]
    """Whether it is before or behind each object at all."""
    sign: float
    """1: it comes against the direction, -1: along it."""

    @property
    def gaps(self) -> Float[np.ndarray, " F"]:
        """Distances [m]; inf: it goes past the object."""
        return np.array([c.gap for c in self.clearances])

    def followed(self, later: "CompressionSide", along: Float[np.ndarray, "3"]) -> Float[np.ndarray, " F"]:
        """Distances later on, below zero where it would be inside of an object [m].

        Args:
            later: Where it is then.
            along: Unit vector from the lower to the upper one.
        """
        if self.there is None or later.there is None:
            return self.gaps
        touching = np.array([c.contact for c in self.clearances])
        came = (touching - later.there.out(self.there.back(touching))) @ along
        return np.where(later.shadows, self.gaps - self.sign * came, inf)


@dataclass(frozen=True)
class CompressionGap:
    """What is left between two that come closer, by the object that is pressed."""

    left: Float[np.ndarray, " F"]
    """[m]; below zero: they have to give way."""
    compliance: Float[np.ndarray, " F"]
    """Σ L/E of all that gives way with it [m/Pa]."""


@dataclass(frozen=True)
class StackedGaps:
    """Objects that are pushed together along a direction."""

    gaps: Float[np.ndarray, "F F"]
    """How far each can go until it presses each other [m], through those between."""
    beyond: Float[np.ndarray, "F F"]
    """Σ L/E of what is pressed after the first, up to the last [m/Pa]."""
    soft: Float[np.ndarray, " F"]
    """L/E of each [m/Pa]."""

    def room(self, low: Float[np.ndarray, " F"], high: Float[np.ndarray, " F"]) -> CompressionGap:
        """Return what is left, for each object, from one side through it to the other.

        Args:
            low: Gaps from the lower side [m].
            high: To the upper one [m].
        """
        number = np.arange(len(self.soft))
        up, down = self.gaps + high[None], low[:, None] + self.gaps
        last, first = np.argmin(up, axis=1), np.argmin(down, axis=0)
        before = self.soft[first] + self.beyond[first, number]  # with its own
        return CompressionGap(down[first, number] + up[number, last], before + self.beyond[number, last])


def comes_closer(presser: PresserPath, normal: Float[np.ndarray, "3"]) -> bool:
    """Return whether any point of a body comes closer to a plane than it was."""
    corners = presser[0].thing.corners
    few = corners[:: max(1, len(corners) // 50)]
    heights = np.array([p.out(few) @ normal for p in presser])
    return bool((np.diff(heights, axis=0) < -MIN_MOVING_DISTANCE_M).any())

"""Expected impact speed and acceleration of every object, before the simulation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.types import Scene, SceneObject
from corporeal.discretization.exposed_surface import cross_section_area
from corporeal.discretization.mesh_measures import MeasuredObject
from corporeal.discretization.part_geometry import ExpectedMotion, ObjectLanding
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.mesh_queries import QueryMesh
from corporeal.mpm.physics.prescribed_motion import fastest_velocity
from corporeal.mpm.physics.wind_pressure import largest_wind_acceleration

MAX_DOWNWARD_POINTS = 400
"""Points of an object that look down."""


FLOOR_NUMBER = -1
"""Stands for the floor among the numbers of objects."""


@dataclass(frozen=True)
class FallHeights:
    """How far each of B objects can fall straight down, and onto what."""

    height: Float[np.ndarray, " B"]
    """Free height below it [m]."""
    onto: Int[np.ndarray, " B"]
    """Number of the object that ends it, or ``FLOOR_NUMBER``."""


def fall_heights(meshes: list[Mesh], rng: np.random.Generator) -> FallHeights:
    """Measure free heights, down to the nearest other object or the floor z = 0."""
    heights, ends = [], []
    for number, mesh in enumerate(meshes):
        used = mesh.vertices[np.unique(mesh.triangles)]
        looking = used[np.argsort(used[:, 2])[:MAX_DOWNWARD_POINTS]]
        spread = used[rng.integers(0, len(used), MAX_DOWNWARD_POINTS)]
        points = np.concatenate([looking, spread])
        free, onto = float(points[:, 2].min()), FLOOR_NUMBER
        for other in (k for k in range(len(meshes)) if k != number):
            down = np.tile([0.0, 0.0, -1.0], (len(points), 1))
            lift = np.array([0.0, 0.0, 1e-6 * mesh.extent])
            reach = float(QueryMesh(meshes[other]).reach(points + lift, down).min())
            free, onto = (reach, other) if reach < free else (free, onto)
        heights.append(max(0.0, free))
        ends.append(onto)
    return FallHeights(np.array(heights), np.array(ends, dtype=np.int64))


@dataclass(frozen=True)
class ExternalDrive:
    """What a push, wind or a prescribed path does to an object."""

    velocity: Float[np.ndarray, " 3"]
    """Gained at most [m/s]."""
    acceleration: float
    """Largest [m/s²]."""


def expected_motions(
    scene: Scene,
    anatomies: list[MeasuredObject],
    masses: list[float],
    seed: int,
    vessels: Mapping[int, int] = MappingProxyType({}),
) -> list[ExpectedMotion]:
    """Estimate every object's speed at impact.

    Falling gives √(v_z² + 2 g h) with the free height h below; pushes, wind and own velocity add horizontally. What may
    be hit by another object is hit at the difference of their horizontal velocities, and at the larger of their speeds
    of fall.

    Args:
        scene: The objects, gravity, and what acts on each object.
        anatomies: One per object.
        masses: Of every object [kg].
        seed: Of the points by which free heights are measured.
        vessels: Of each object that lies loose in another, that other.
    """
    gravity = float(np.linalg.norm(scene.gravity))
    drops = fall_heights([a.everything for a in anatomies], np.random.default_rng([seed, 2]))
    # Each object by itself.
    horizontal, fall, forced = [], [], []
    single = [drive_of_object(obj, anatomies[k], masses[k], scene.duration) for k, obj in enumerate(scene.objects)]
    drives = share_vessel_drives(single, masses, vessels)
    for obj, height, drive in zip(scene.objects, drops.height, drives, strict=True):
        velocity = np.array(obj.velocity) + drive.velocity
        horizontal.append(velocity[:2])
        dropped = 0.0 if obj.path is not None else height
        fall.append(np.sqrt(velocity[2] ** 2 + 2 * gravity * dropped))
        forced.append(drive.acceleration)
    # Each object against every other.
    result = []
    for i in range(len(scene.objects)):
        speeds = [float(np.hypot(fall[i], np.linalg.norm(horizontal[i])))]
        for j in range(len(scene.objects)):
            if j != i:
                closing = np.linalg.norm(horizontal[i] - horizontal[j])
                speeds.append(float(np.hypot(max(fall[i], fall[j]), closing)))
        lands = ObjectLanding(int(drops.onto[i]), float(fall[i]), masses[i])
        result.append(ExpectedMotion(max(speeds), gravity + forced[i], forced[i], lands))
    return result


def share_vessel_drives(
    drives: Sequence[ExternalDrive], masses: Sequence[float], vessels: Mapping[int, int]
) -> list[ExternalDrive]:
    """Share what drives a vessel with what lies loose in it, which it carries along.

    Args:
        drives: Of every object by itself.
        masses: Of every object [kg].
        vessels: Of each object that lies loose in another, that other.
    """
    found = list(drives)
    for vessel in set(vessels.values()):
        load = [k for k, v in vessels.items() if v == vessel]
        share = masses[vessel] / (masses[vessel] + sum(masses[k] for k in load))
        drive = drives[vessel]
        for k in (vessel, *load):
            found[k] = ExternalDrive(share * drive.velocity, share * drive.acceleration)
    return found


def drive_of_object(obj: SceneObject, anatomy: MeasuredObject, mass: float, duration: float) -> ExternalDrive:
    """Estimate what push and wind do to an object: wind makes it no faster than the air.

    Args:
        obj: With its push, wind or path.
        anatomy: Its shape.
        mass: [kg]
        duration: Of the simulation [s].
    """
    gained, strongest = np.zeros(3), 0.0
    if obj.path is not None:
        reach = float(np.ptp(anatomy.everything.vertices, axis=0).max())
        return ExternalDrive(fastest_velocity(obj.path, reach), 0.0)
    if obj.push is not None:
        push = np.array(obj.push.acceleration)
        gained += push * max(0.0, min(obj.push.end, duration) - obj.push.start)
        strongest += float(np.linalg.norm(push))
    if obj.wind is not None:
        air = np.array(obj.wind.velocity) * (1.0 + obj.wind.gust)
        shown = cross_section_area(anatomy, obj.wind.velocity)
        blown = largest_wind_acceleration(obj.wind, shown, mass)
        lasts = max(0.0, min(obj.wind.end, duration) - obj.wind.start)
        gained += air * min(1.0, blown * lasts / max(float(np.linalg.norm(air)), 1e-30))
        strongest += blown
    return ExternalDrive(gained, strongest)

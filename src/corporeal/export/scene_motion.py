"""Motion of a scene, and its pose at the exported instant."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from tempfile import TemporaryFile

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial.transform import Rotation

from corporeal.core.errors import UserError
from corporeal.core.types import Frame, Particles, Scene, Trajectory
from corporeal.discretization.build_model import build_model
from corporeal.export.exported_solids import ExportedSolid
from corporeal.mpm.physics.rigid import mass_and_inertia
from corporeal.render.skin_binding import SkinBinding, bind_vertices
from corporeal.simulation.moving_gaussians import fluid_parts, granular_parts
from corporeal.simulation.simulation_result import PreparedScene, SimulationResult
from corporeal.simulation.trajectory_files import FrameSequence

SAME_INSTANT_S = 1e-9
"""Two instants nearer than this are one [s]."""


@dataclass(frozen=True)
class SolidPoses:
    """Where a solid's frame is at every frame of the video; F frames."""

    position: Float[np.ndarray, "F 3"]
    """[m]"""
    quaternion: Float[np.ndarray, "F 4"]
    """(w, x, y, z), from one frame to the next the shorter way round."""


@dataclass(frozen=True)
class SceneMotion:
    """A scene over time, seen from one instant; F frames, B objects, P particles, V vertices."""

    scene: Scene
    source: Particles
    skin: SkinBinding
    time: Float[np.ndarray, " F"]
    """Of every frame [s]; one instant where nothing was simulated."""
    frames: Sequence[Frame]
    rigid: Bool[np.ndarray, " B"]
    """Which objects are one rigid body."""
    centre: Float[np.ndarray, "F B 3"]
    """Centre of mass of every object's particles [m]."""
    rotation: Float[np.ndarray, "F B 3 3"]
    """Since the start; NaN of what can deform."""
    linear: Float[np.ndarray, "B 3"]
    """Velocity of every object's centre now [m/s]."""
    angular: Float[np.ndarray, "B 3"]
    """ω of every rigid object now [rad/s]; 0 of the others."""
    now: int
    """Frame that is exported."""
    particles: Float[np.ndarray, "P 3"]
    """Now [m]."""
    particle_velocity: Float[np.ndarray, "P 3"]
    """Now [m/s]."""
    vertices: Float[np.ndarray, "V 3"]
    """Of all surfaces now [m]."""
    normals: Float[np.ndarray, "V 3"]

    @property
    def instant(self) -> float:
        """The exported instant [s]."""
        return float(self.time[self.now])

    @property
    def moves(self) -> bool:
        """Whether there is more than one instant."""
        return len(self.time) > 1

    def is_rigid(self, number: int) -> bool:
        """Whether an object is one rigid body."""
        return bool(self.rigid[number])

    def velocity(self, number: int) -> Float[np.ndarray, "3"]:
        """Velocity of an object's centre of mass now [m/s]."""
        return self.linear[number]

    def spin(self, number: int) -> Float[np.ndarray, "3"]:
        """ω of an object now [rad/s]."""
        return self.angular[number]

    def vertices_of(self, number: int) -> slice:
        """Which vertices of all belong to a surface."""
        counts = [len(s.vertices) for s in self.scene.surfaces]
        first = sum(counts[:number])
        return slice(first, first + counts[number])

    def surface_now(self, number: int) -> tuple[np.ndarray, np.ndarray]:
        """Vertices [m] and normals of a surface now, in the world."""
        own = self.vertices_of(number)
        return self.vertices[own], self.normals[own]

    def placed(self, number: int, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """Carry points of a rigid object from the scene as assembled to now [m]."""
        own = np.flatnonzero(self.source.object == number)
        start = self.source.mass[own] @ self.source.position[own] / self.source.mass[own].sum()
        return (points - start) @ self.rotation[self.now, number].T + self.centre[self.now, number]

    def poses(self, solid: ExportedSolid) -> SolidPoses:
        """Where the frame of a rigid solid is at every frame."""
        k = solid.number
        turn = self.rotation[:, k] @ self.rotation[self.now, k].T
        arm = solid.origin - self.centre[self.now, k]
        quaternion = Rotation.from_matrix(turn).as_quat(scalar_first=True)
        for i in range(1, len(quaternion)):
            quaternion[i] *= np.sign(quaternion[i] @ quaternion[i - 1]) or 1.0
        return SolidPoses(self.centre[:, k] + turn @ arm, quaternion)

    def shapes(self, solids: Sequence[ExportedSolid]) -> "PosedSurfaces":
        """Pose all surfaces of some solids at every frame; they stay on the disk."""
        numbers = [n for s in solids for n in s.surface_numbers]
        own = [np.arange(len(self.vertices))[self.vertices_of(n)] for n in numbers]
        chosen = np.concatenate([np.zeros(0, np.int64), *own])
        skin = SkinBinding(
            rest=np.ascontiguousarray(self.skin.rest[chosen]),
            normals=np.ascontiguousarray(self.skin.normals[chosen]),
            near=np.ascontiguousarray(self.skin.near[chosen]),
            weight=np.ascontiguousarray(self.skin.weight[chosen]),
            start=self.skin.start,
            loose=self.skin.loose,
        )
        vertices, normals = (disk_array((len(self.time), len(chosen), 3)) for _ in range(2))
        for i, frame in enumerate(self.frames if len(chosen) else ()):
            vertices[i], normals[i] = skin.pose(frame)
        ends = np.cumsum([0, *map(len, own)])
        slices = {n: slice(a, b) for n, a, b in zip(numbers, ends[:-1], ends[1:], strict=True)}
        return PosedSurfaces(vertices, normals, slices)


@dataclass(frozen=True)
class PosedSurfaces:
    """Posed surfaces over time."""

    vertices: Float[np.ndarray, "F V 3"]
    """Of all chosen surfaces [m]."""
    normals: Float[np.ndarray, "F V 3"]
    slices: dict[int, slice]
    """Number of a surface in the scene → its vertices."""

    def of(self, number: int) -> tuple[Float[np.ndarray, "F N 3"], Float[np.ndarray, "F N 3"]]:
        """Vertices [m] and normals of one surface at every frame, in the world."""
        own = self.slices[number]
        return self.vertices[:, own], self.normals[:, own]


def disk_array(shape: tuple[int, ...]) -> np.ndarray:
    """Return an array that the disk holds and that goes with the process."""
    if not np.prod(shape):
        return np.zeros(shape, np.float32)
    with TemporaryFile() as file:
        # A full disk is an error here; a page that finds no room later would end the process.
        os.posix_fallocate(file.fileno(), 0, int(np.prod(shape)) * np.dtype(np.float32).itemsize)
        return np.memmap(file, np.float32, "w+", shape=shape)


def motion_of_run(played: SimulationResult, at: str) -> SceneMotion:
    """Read a finished simulation.

    Args:
        played: What moved.
        at: "start", "end", or seconds: the instant that is exported is the nearest frame's.

    Raises:
        UserError: There is no such instant.
    """
    prepared, trajectory = played.prepared, played.trajectory
    now = frame_at(at, trajectory.time)
    frame = trajectory.frames[now]
    objects = _bodies_of_objects(prepared, trajectory)
    rigid = np.array([b >= 0 for b in objects])
    centre, rotation = _rigid_tracks(prepared, trajectory, objects)
    linear, angular = _object_velocities(prepared, trajectory, rigid, now)
    skin = _scene_skin(prepared)
    vertices, normals = skin.pose(frame)
    return SceneMotion(
        scene=prepared.scene,
        source=prepared.particles,
        skin=skin,
        time=np.asarray(trajectory.time, dtype=float),
        frames=trajectory.frames,
        rigid=rigid,
        centre=centre,
        rotation=rotation,
        linear=linear,
        angular=angular,
        now=now,
        particles=frame.position.astype(float),
        particle_velocity=_particle_velocity(prepared.particles, trajectory, now),
        vertices=vertices,
        normals=normals,
    )


def frame_at(at: str, time: Float[np.ndarray, " F"]) -> int:
    """Return the number of the frame for --at.

    Raises:
        UserError: There is no such instant.
    """
    named = {"start": 0, "end": len(time) - 1}
    if at in named:
        return named[at]
    try:
        seconds = float(at)
    except ValueError:
        raise UserError(f"--at is {at!r}. Give start, end, or a time in seconds.") from None
    if not time[0] - SAME_INSTANT_S <= seconds <= time[-1] + SAME_INSTANT_S:
        raise UserError(f"--at is {seconds:g} s. The run lasts from {time[0]:g} to {time[-1]:g} s.")
    return int(np.argmin(np.abs(time - seconds)))


def _bodies_of_objects(prepared: PreparedScene, trajectory: Trajectory) -> list[int]:
    """Return the body of the solver that each object is; -1: it can deform, or has several."""
    frames = trajectory.frames
    assert isinstance(frames, FrameSequence), "a finished trajectory has a layout"
    layout, owner = frames.layout, prepared.particles.object
    found = []
    for k in range(len(prepared.scene.objects)):
        bodies = np.unique(layout.object[owner == k])
        alone = len(bodies) == 1 and layout.rigid[bodies[0]]
        found.append(int(bodies[0]) if alone else -1)
    return found


def _rigid_tracks(
    prepared: PreparedScene, trajectory: Trajectory, bodies: list[int]
) -> tuple[Float[np.ndarray, "F B 3"], Float[np.ndarray, "F B 3 3"]]:
    """Centres of mass of all objects and rotations of the rigid ones at every frame."""
    owner, mass = prepared.particles.object, prepared.particles.mass
    count = len(bodies)
    whole = np.bincount(owner, mass, count)
    first = [int(np.argmax(owner == k)) for k in range(count)]
    centre = np.empty((len(trajectory.time), count, 3))
    rotation = np.full((len(trajectory.time), count, 3, 3), np.nan)
    for i, frame in enumerate(trajectory.frames):
        for axis in range(3):
            centre[i, :, axis] = np.bincount(owner, mass * frame.position[:, axis], count) / whole
        for k in (k for k in range(count) if bodies[k] >= 0):
            rotation[i, k] = frame.deformation[first[k]]
    return centre, rotation


def _object_velocities(
    prepared: PreparedScene, trajectory: Trajectory, rigid: np.ndarray, now: int
) -> tuple[Float[np.ndarray, "B 3"], Float[np.ndarray, "B 3"]]:
    """Velocities of all objects, from the momenta in the ledger."""
    particles, ledger = prepared.particles, trajectory.ledger
    momentum, position = ledger.momentum[now], trajectory.frames[now].position.astype(float)
    linear, angular = np.zeros((2, len(rigid), 3))
    for k in range(len(rigid)):
        own = particles.object == k
        mass = mass_and_inertia(position[own], particles.mass[own], particles.volume[own])
        linear[k] = momentum[k] / mass.total
        if rigid[k]:
            about = ledger.angular_momentum[now][k] - np.cross(mass.centre, momentum[k])
            angular[k] = np.linalg.solve(mass.inertia, about)
    return linear, angular


def _particle_velocity(particles: Particles, trajectory: Trajectory, now: int) -> np.ndarray:
    """At the start as filled, later the mean over the last frame [m/s]."""
    if now == 0:
        return particles.velocity
    a, b = trajectory.frames[now - 1], trajectory.frames[now]
    return (b.position.astype(float) - a.position) / (b.time - a.time)


def _scene_skin(prepared: PreparedScene) -> SkinBinding:
    field, parts = prepared.field, prepared.parts
    return bind_vertices(prepared.scene, parts, prepared.particles, granular_parts(field), fluid_parts(field))


def motion_of_scene(prepared: PreparedScene) -> SceneMotion:
    """Return the motion of a scene without simulation: one instant."""
    particles, scene = prepared.particles, prepared.scene
    posed = build_model(scene, particles, prepared.field)
    count = len(scene.objects)
    bodies: list[Int[np.ndarray, " N"]] = [np.flatnonzero(posed.object_of_body == k) for k in range(count)]
    rigid = np.array([len(b) == 1 and bool(posed.rigid[b[0]]) for b in bodies])
    mass = [particles.mass * (particles.object == k) for k in range(count)]
    turn = np.where(rigid[:, None, None], np.eye(3), np.nan)
    identity = np.tile(np.eye(3, dtype=np.float32), (particles.count, 1, 1))
    frame = Frame(0.0, particles.position.astype(np.float32), identity)
    skin = _scene_skin(prepared)
    return SceneMotion(
        scene=scene,
        source=particles,
        skin=skin,
        time=np.zeros(1),
        frames=[frame],
        rigid=rigid,
        centre=np.array([m @ particles.position / m.sum() for m in mass])[None],
        rotation=turn[None],
        linear=np.array([m @ particles.velocity / m.sum() for m in mass]),
        angular=np.zeros((count, 3)),
        now=0,
        particles=particles.position,
        particle_velocity=particles.velocity,
        vertices=skin.rest,
        normals=skin.normals,
    )

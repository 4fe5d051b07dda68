"""Particles, treatments, trajectories and videos."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.types.description import PartDescription
from corporeal.core.types.material_field import Material
from corporeal.core.types.scene import Finish, SceneObject, Surface, Vector


@dataclass(frozen=True)
class Discretization:
    """How one part enters the simulation: real numbers, simulated numbers, and why they differ."""

    kind: Literal["rigid", "deformable", "shell", "foliage"]
    young_pa: float
    """Young's modulus of the material [Pa]."""
    simulated_young_pa: float
    """The same as simulated [Pa]."""
    poisson: float
    density: float
    """Simulated density [kg/m³]."""
    yield_stress: float | None
    """Simulated yield stress [Pa]."""
    thickness: float | None
    """Simulated wall thickness of a shell [m]."""
    strain: float
    """Estimated largest strain that decided it [-]."""
    impact_speed: float
    """Estimated [m/s]."""
    wave_speed: float
    """Simulated longitudinal wave speed [m/s]; 0 when rigid."""
    step: float
    """Largest stable time step of this part [s]; inf when rigid."""
    reason: str
    loss: float = 0.0
    """Simulated loss factor [-]: its material's, less what the grid takes of an impact by
    itself.
    """
    vibration: float = 0.0
    """About which angular frequency it loses so much [rad/s]; 0: its object's slowest vibration."""
    bending_young_pa: float = 0.0
    """Young's modulus that acts in the bending of a triangle shell with its true thickness [Pa], where
    ``simulated_young_pa`` acts in its plane; 0: it is no such shell."""
    is_floor_covering: bool = False
    """Whether it is a rigid sheet that lies on the floor, thinner than half a cell: what strikes it strikes the
    floor."""


@dataclass(frozen=True)
class PlantRoot:
    """How a plant stands in its soil: a sprung joint between its wood and the rest."""

    object: int
    part: int
    """The wood: index into the catalogue of parts."""
    point: Vector
    """About which it rocks [m]."""
    stiffness: float
    """[N m/rad]"""
    damping: float
    """[N m s/rad]"""


@dataclass(frozen=True)
class VesselContents:
    """What lies loose in a vessel that it does not fill: an object of its own, and its one part."""

    vessel: int
    """Which object holds it."""
    wall: int
    """Which part's wall is around it."""
    holder: SceneObject
    """The vessel without it."""
    thing: SceneObject
    surface: Surface
    """Where it meets the wall and the air, at the start; its finish is counted after all others."""
    finish: Finish
    material: Material
    words: PartDescription
    friction: Float[np.ndarray, " K1"]
    """On each part of the vessels' scene, those before it among the contents, and the floor [-]."""


CURVATURE_COLUMNS = 12
"""Numbers that say how a surface curves at a point: its outward unit normal (3); the direction of an arc, tangential
and of unit length (3); the radius of the ball that moves along that arc [m], and the arc's own radius less the ball's
[m], both 0 where it is flat; how far from the point the surface is so [m]; 1 where its neighbours take over there on
all sides, 0 where something round ends; and the curvatures along the arc's direction and across it [1/m], less than 0
where the surface is hollow. A ball has no arc, a cylinder no ball. All zeros: nothing is known."""


@dataclass(frozen=True)
class Particles:
    """Material points ready to simulate."""

    position: Float[np.ndarray, "P 3"]
    """World position [m]."""
    velocity: Float[np.ndarray, "P 3"]
    """World velocity [m/s]."""
    volume: Float[np.ndarray, " P"]
    """Rest volume [m³]."""
    density: Float[np.ndarray, " P"]
    """Simulated density [kg/m³]: a thickened shell's is smaller than its material's."""
    object: Int[np.ndarray, " P"]
    """Which object owns the point; each object has its own velocity field."""
    part: Int[np.ndarray, " P"]
    """Index into the catalogue of parts, and so into materials and treatments."""
    cell: float
    """Grid spacing dx that the particles were spaced for [m]."""
    treatments: tuple[Discretization, ...]
    """One per part."""
    surface: Float[np.ndarray, "S 3"]
    """Points on the surfaces of rigid objects, for their contacts [m]."""
    object_of_surface: Int[np.ndarray, " S"]
    mass_real: tuple[float, ...]
    """Estimated mass of every part [kg]: what the particles' masses must add up to."""
    curvature: Float[np.ndarray, "S2 Columns"] = field(default_factory=lambda: np.zeros((0, CURVATURE_COLUMNS)))
    """How each of those points curves, see ``CURVATURE_COLUMNS``; none: as corners."""
    face: Float[np.ndarray, "A 3"] = field(default_factory=lambda: np.zeros((0, 3)))
    """Outward area vectors of the surface that objects in the wind show to the air [m²]."""
    particle_of_face: Int[np.ndarray, " A"] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """Which particle bears each of those faces."""
    rate: Float[np.ndarray, " R"] = field(default_factory=lambda: np.zeros(0))
    """Natural angular frequency of every particle of foliage on its stalk, 0 for all others [rad/s]; empty where there
    is no foliage."""
    roots: tuple[PlantRoot, ...] = ()
    """Of plants that stand in soil."""
    contents: tuple[VesselContents, ...] = ()
    """What moves in vessels: objects and parts after all that the scene has."""
    shell_triangle: Int[np.ndarray, "T 3"] = field(default_factory=lambda: np.zeros((0, 3), dtype=np.int64))
    """Particles that are the vertices of each triangle of thin shells."""
    shell_thickness: Float[np.ndarray, " T"] = field(default_factory=lambda: np.zeros(0))
    """Of the wall at each of them [m]."""
    wetted_point: Float[np.ndarray, "W 3"] = field(default_factory=lambda: np.zeros((0, 3)))
    """Where liquids touch rigid objects, inside of what is hollow too [m]."""
    wetted_normal: Float[np.ndarray, "W 3"] = field(default_factory=lambda: np.zeros((0, 3)))
    """Unit, out of the material there."""
    object_of_wetted: Int[np.ndarray, " W"] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    fills: tuple[str, ...] = ()
    """How each part was filled, in words, for the report."""
    walls: tuple[tuple[float, float], ...] = ()
    """Thickness of each part's wall and of its open sheets, as weighed [m]; 0: it has none."""
    warnings: tuple[str, ...] = ()
    """What a reader of the report should know about resolution and treatments, in sentences."""

    @property
    def count(self) -> int:
        """Number of particles P."""
        return len(self.position)

    @property
    def mass(self) -> Float[np.ndarray, " P"]:
        """Particle mass [kg]."""
        return self.volume * self.density


@dataclass(frozen=True)
class Frame:
    """The scene at one instant."""

    time: float
    """[s]"""
    position: Float[np.ndarray, "P 3"]
    """[m]"""
    deformation: Float[np.ndarray, "P 3 3"]
    """Deformation gradient F [-]; a rigid object's is its rotation."""
    stress: Float[np.ndarray, " P"] | None = None
    """Von Mises stress [Pa]; None where a run did not keep it."""


@dataclass(frozen=True)
class Ledger:
    """Sums over bodies and pairs, at one instant or over time.

    B objects, W planes. F is absent for one instant, the number of frames for a trajectory. Work and impulses are
    accumulated since time 0.
    """

    time: Float[np.ndarray, "*F"]
    """[s]"""
    mass: Float[np.ndarray, "*F B"]
    """[kg]"""
    centre: Float[np.ndarray, "*F B 3"]
    """Centre of mass [m]."""
    momentum: Float[np.ndarray, "*F B 3"]
    """[kg m/s]"""
    angular_momentum: Float[np.ndarray, "*F B 3"]
    """About the origin, affine part included [kg m²/s]."""
    kinetic: Float[np.ndarray, "*F B"]
    """½ Σ m (|v|² + dx²/4 ‖C‖²) [J]."""
    elastic: Float[np.ndarray, "*F B"]
    """[J]"""
    potential: Float[np.ndarray, "*F B"]
    """-m g · x [J]."""
    speed: Float[np.ndarray, "*F"]
    """Largest particle speed [m/s]."""
    external_impulse: Float[np.ndarray, "*F B 3"]
    """Of gravity, pushes and wind [N s]."""
    plane_impulse: Float[np.ndarray, "*F W B 3"]
    """Of each plane on each object [N s]."""
    pair_impulse: Float[np.ndarray, "*F B B"]
    """Sum of normal impulse magnitudes between two objects [N s]; symmetric."""
    push_work: Float[np.ndarray, "*F"]
    """Of pushes and wind [J]."""
    friction_loss: Float[np.ndarray, "*F"]
    """[J]"""
    impact_loss: Float[np.ndarray, "*F"]
    """Taken by normal contact: by restitution of what is rigid, and of what is soft by the nodes of the grid [J]."""
    impact_of_pair: Float[np.ndarray, "*F B+W B+W"]
    """The same of each pair, symmetric [J]; below 0: contact gave it energy."""
    plastic_loss: Float[np.ndarray, "*F"]
    """[J]"""
    viscous_loss: Float[np.ndarray, "*F"]
    """[J]"""
    first_contact: Float[np.ndarray, "*F B+W B+W"]
    """Time of the first impulse of each pair [s]; nan: none yet."""
    last_contact: Float[np.ndarray, "*F B+W B+W"]
    """Time of the latest impulse of each pair [s]; nan: none yet."""
    contact_point: Float[np.ndarray, "*F B+W B+W 3"]
    """Where each pair first touched [m]; nan: it did not."""
    lost: Int[np.ndarray, "*F"]
    """Number of particles that are not finite or left the domain."""
    flow: Float[np.ndarray, "*F B"]
    """Σ m |v| [kg m/s]."""
    rms_speed: Float[np.ndarray, "*F B"]
    """Root mean square of particle speeds, weighted by mass [m/s]."""
    plane_depth: Float[np.ndarray, "*F W B"]
    """How deep each object reaches into each plane [m]."""
    gap: Float[np.ndarray, "*F B B"]
    """Distance between two objects [m]."""
    overlap: Float[np.ndarray, "*F B B"]
    """How deep two objects reach into each other [m]."""
    steps: Int[np.ndarray, "*F"]
    """Time steps since time 0."""
    dt_min: Float[np.ndarray, "*F"]
    """Smallest of them [s]."""
    dt_max: Float[np.ndarray, "*F"]
    """Largest of them [s]."""
    nan: Int[np.ndarray, "*F"]
    """Number of particles that are not finite."""


@dataclass(frozen=True)
class FractureEvent:
    """A brittle rigid object that broke: N pieces, made as it was struck."""

    object: int
    """Which; its first piece keeps its number, the others come after all objects there are."""
    part: int
    """Its one part; likewise."""
    time: float
    """[s]"""
    energy: float
    """Taken from the motion [J]: what it bears until it breaks."""
    ratio: float
    """Energy of the impact over that [-]."""
    by: str
    """The other body, or the floor."""
    speed: float
    """Along the impact [m/s]."""
    impact_energy: float
    """Energy of the impact [J]."""
    piece: Int[np.ndarray, " P"]
    """Which piece each of its particles belongs to."""
    surfaces: tuple[Surface, ...]
    """One per piece, where it was at the start."""


@dataclass(frozen=True)
class Trajectory:
    """The scene over time. Frames stay on disk and are read one by one."""

    folder: Path
    """Holds ``frames/00000.npz`` … and ``ledger.npz``."""
    time: Float[np.ndarray, " F"]
    """[s]"""
    ledger: Ledger
    """Per frame: energies [J], momentum per object [kg m/s], impulses [N s], penetration [m]."""
    frames: Sequence[Frame]
    """Reads frame i from disk when asked for."""
    breaks: tuple[FractureEvent, ...] = ()
    """What broke, in order; its pieces are objects in every frame."""


@dataclass(frozen=True)
class Video:
    """A finished video."""

    path: Path
    fps: int
    width: int
    height: int
    times: tuple[float, ...] = ()
    """What time every picture shows [s]; empty: picture k shows k / fps."""

"""Format-independent input of writers: solids and their interactions.

The frame of a ``ExportedSolid`` has its origin in the centre of mass at the exported instant and the axes of the world,
so that no writer has an offset or a rotation to get wrong.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.types import Discretization, Finish, Material, Surface, Vector, Wall
from corporeal.geometry.convex_hull import ConvexPiece


@dataclass(frozen=True)
class PartMaterial:
    """What one part is made of, as it was simulated, and why."""

    name: str
    """Of the part."""
    object: int
    """Index into ``PhysicalScene.solids``."""
    material: Material
    """As in reality."""
    treatment: Discretization
    """As simulated."""
    provenance: dict[str, Any]
    """Plain data: range, source, who chose and why, of every value; real and simulated modulus."""


@dataclass(frozen=True)
class MaterialPoints:
    """Material points of a soft solid; N points."""

    position: Float[np.ndarray, "N 3"]
    """In the solid's frame [m]."""
    velocity: Float[np.ndarray, "N 3"]
    """[m/s]"""
    volume: Float[np.ndarray, " N"]
    """At rest [m³]."""
    mass: Float[np.ndarray, " N"]
    """[kg]"""
    part: Int[np.ndarray, " N"]
    """Index into ``PhysicalScene.matter``."""
    number: Int[np.ndarray, " N"]
    """Of each in the whole scene."""


@dataclass(frozen=True)
class TetrahedralMesh:
    """A volume mesh of a soft solid."""

    points: Float[np.ndarray, "V 3"]
    """In the solid's frame [m]."""
    corners: Int[np.ndarray, "T 4"]
    """Numbers of points; (b - a) × (c - a) · (d - a) > 0."""


@dataclass(frozen=True)
class ConvexCollider:
    """One convex shape that a rigid solid collides with."""

    shape: ConvexPiece
    """In the solid's frame [m]."""
    part: int
    """Index into ``PhysicalScene.matter``: whose friction and restitution it has."""


@dataclass(frozen=True)
class ExportedSolid:
    """One object at the exported instant; vectors along the world's axes."""

    name: str
    """Lower and upper case Latin letters, digits and underscores: good in every format."""
    title: str
    """As the scene calls it, in any alphabet."""
    number: int
    """Index into the scene's objects."""
    rigid: bool
    """Whether all of it is one rigid body."""
    origin: Float[np.ndarray, "3"]
    """Centre of mass: where the solid's frame is in the world [m]."""
    mass: float
    """[kg]"""
    inertia: Float[np.ndarray, "3 3"]
    """About the centre of mass [kg m²]."""
    velocity: Float[np.ndarray, "3"]
    """Of the centre of mass [m/s]."""
    spin: Float[np.ndarray, "3"]
    """ω of a rigid body [rad/s]; 0 of a soft one."""
    parts: tuple[int, ...]
    """Of what it consists, the heaviest first: indices into ``PhysicalScene.matter``."""
    surfaces: tuple[Surface, ...]
    """What is seen, in the solid's frame."""
    surface_numbers: tuple[int, ...]
    """Of these surfaces in the scene."""
    pieces: tuple[ConvexCollider, ...] = ()
    """Convex pieces of a rigid solid, which meet other objects."""
    hull: ConvexCollider | None = None
    """Convex hull of a rigid solid, which meets floor and walls."""
    grains: MaterialPoints | None = None
    """Of a soft solid."""
    part_of_surface: tuple[int, ...] = ()
    """Which part most of each surface belongs to: indices into ``PhysicalScene.matter``."""
    provenance: dict[str, Any] = field(default_factory=dict)
    """Plain data: class, sizes, source, velocity, as the scene has them."""

    @property
    def heaviest(self) -> int:
        """The part that most of the mass belongs to."""
        return self.parts[0]


@dataclass(frozen=True)
class PhysicalScene:
    """All that a writer needs of a scene at one instant."""

    name: str
    title: str
    solids: tuple[ExportedSolid, ...]
    matter: tuple[PartMaterial, ...]
    """K parts in the catalogue's order."""
    finishes: tuple[Finish, ...]
    friction: Float[np.ndarray, "K1 K1"]
    """Sliding friction of every two parts [-]; the last row and column are floor and walls."""
    restitution: Float[np.ndarray, "K1 K1"]
    """Of rigid parts [-]; last row and column as above."""
    gravity: Vector
    """[m/s²]"""
    walls: tuple[Wall, ...]
    fps: int
    settled: bool
    """Whether everything lay at rest when it began."""
    cell: float
    """Grid spacing that it was simulated with [m]."""
    time: float
    """The exported instant [s]."""
    duration: float = 0.0
    """How long it is simulated [s]."""
    credits: tuple[str, ...] = ()
    """Licences and attributions of what is in it."""
    unsaid: tuple[str, ...] = field(default=())
    """What no format of today can say of this scene, in sentences."""

"""Bodies for settling, with their convex pieces and poses."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.types import Vector
from corporeal.geometry.convex_hull import ConvexPiece, StandingStance, convex_hull_of, standing_stances
from corporeal.geometry.mesh import orient_outward, weld_mesh
from corporeal.geometry.mesh_queries import QueryMesh


@dataclass(frozen=True)
class MassProperties:
    """Mass, and the first two moments of where it is, in the body's frame."""

    mass: float
    """[kg]"""
    centre: Float[np.ndarray, "3"]
    """[m]"""
    inertia: Float[np.ndarray, "3 3"]
    """About the centre [kg m²]."""
    friction: float | None = None
    """Coulomb μ of its roughest part on the floor [-]; None: unknown."""
    grip: float | None = None
    """Coulomb μ of its smoothest part on the floor: what holds it whichever part it stands on [-];
    None: unknown."""
    materials: tuple[str, ...] = ()
    """Names of the materials of its parts."""

    def scaled(self, factor: float) -> "MassProperties":
        """Return that of a body of the same materials and another size, walls and all."""
        mass, inertia = self.mass * factor**3, self.inertia * factor**5
        return replace(self, mass=mass, centre=self.centre * factor, inertia=inertia)


def cubes_mass_properties(
    points: Float[np.ndarray, "N 3"], mass: Float[np.ndarray, " N"], size: Float[np.ndarray, " N"]
) -> MassProperties:
    """Add up cubes.

    Args:
        points: Their middles [m].
        mass: [kg]
        size: Their sides [m].
    """
    total = float(mass.sum())
    centre = mass @ points / total
    arm = points - centre
    own = float(mass @ size**2) / 6 * np.eye(3)
    square = float(mass @ (arm**2).sum(axis=1)) * np.eye(3)
    return MassProperties(total, centre, own + square - (mass * arm.T) @ arm)


Quaternion = tuple[float, float, float, float]

UNKNOWN_FRICTION = 0.6
"""Coulomb μ of what nothing is known of [-]."""
MIN_HULL_THICKNESS_FRACTION = 1e-4
"""Of the extent: thickness that the hull of a flat body is given."""


@dataclass(frozen=True)
class BodyPose:
    """World from body: x ↦ position + R(quaternion) x."""

    position: Vector
    """[m]"""
    quaternion: Quaternion = (1.0, 0.0, 0.0, 0.0)
    """(w, x, y, z), unit."""

    @cached_property
    def rotation(self) -> Float[np.ndarray, "3 3"]:
        """R."""
        w, x, y, z = self.quaternion
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )

    def world(self, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """Take points of the body into the world [m]."""
        return points @ self.rotation.T + np.array(self.position)

    def body(self, points: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N 3"]:
        """Take points of the world into the body's frame [m]."""
        return (points - np.array(self.position)) @ self.rotation

    def moved(self, shift: Sequence[float] | np.ndarray) -> "BodyPose":
        """Shift [m]."""
        x, y, z = (float(p + s) for p, s in zip(self.position, shift, strict=True))
        return BodyPose((x, y, z), self.quaternion)


@dataclass(frozen=True)
class SettlingBody:
    """A rigid body in a frame of its own with +Z up."""

    name: str
    vertices: Float[np.ndarray, "V 3"]
    """[m]"""
    triangles: Int[np.ndarray, "T 3"]
    pieces: tuple[ConvexPiece, ...]
    """Convex; together about the body."""
    density: float = 500.0
    """Of the pieces, where nothing is known of the material [kg/m³]."""
    inertial: MassProperties | None = None
    """How its mass lies, where that is known."""
    grips: Mapping[str, float] = field(default_factory=dict)
    """Coulomb μ on other bodies, by their names, whichever of their parts touch [-]."""

    @cached_property
    def hull(self) -> ConvexPiece:
        """The convex hull of the mesh."""
        points = self.vertices[np.unique(self.triangles)]
        return convex_hull_of(points, MIN_HULL_THICKNESS_FRACTION * float(np.ptp(points, axis=0).max()))

    @cached_property
    def shape(self) -> QueryMesh:
        """The mesh, ready to be asked what is inside."""
        return QueryMesh(orient_outward(weld_mesh(self.vertices, self.triangles)[0]))

    @cached_property
    def extent(self) -> float:
        """Largest side of the upright box [m]."""
        return float(np.ptp(self.hull.vertices, axis=0).max())

    @cached_property
    def volume(self) -> float:
        """Of the pieces [m³]."""
        return sum(p.volume for p in self.pieces)

    @property
    def mass(self) -> float:
        """In kilograms."""
        return self.inertial.mass if self.inertial else self.volume * self.density

    @property
    def friction(self) -> float:
        """Coulomb μ on the floor of its roughest part [-]: what must be overcome."""
        known = self.inertial.friction if self.inertial else None
        return UNKNOWN_FRICTION if known is None else known

    def grip_on(self, other: "SettlingBody | None") -> float:
        """Coulomb μ that holds it on another body, or on the floor, whichever part touches [-]."""
        if other is not None:
            return self.grips.get(other.name, UNKNOWN_FRICTION)
        known = self.inertial.grip if self.inertial else None
        return UNKNOWN_FRICTION if known is None else known

    @cached_property
    def centre(self) -> Float[np.ndarray, "3"]:
        """Centre of mass [m]."""
        if self.inertial:
            return self.inertial.centre
        return np.array([p.volume * p.centre for p in self.pieces]).sum(axis=0) / self.volume

    @cached_property
    def upright(self) -> StandingStance:
        """How it stands upright."""
        return self._stances[0]

    @cached_property
    def steadiest(self) -> StandingStance:
        """How it stands best."""
        return self._stances[1]

    @cached_property
    def _stances(self) -> tuple[StandingStance, StandingStance]:
        return standing_stances(self.hull, self.centre)

    def scaled(self, factor: float) -> "SettlingBody":
        """Return the same body in another size."""
        pieces = tuple(ConvexPiece(p.vertices * factor, p.triangles) for p in self.pieces)
        inertial = self.inertial.scaled(factor) if self.inertial else None
        return replace(self, vertices=self.vertices * factor, pieces=pieces, inertial=inertial)


def scene_unit_of(bodies: Sequence[SettlingBody]) -> float:
    """Length that the scene is measured in [m]: twice the largest extent."""
    return 2.0 * max(b.extent for b in bodies)

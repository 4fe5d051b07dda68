"""Diagnostics of all engines: current particles, and sums of the ledger.

An engine gives its particles and their sums, as it keeps them. What is the same in all of them is here: rigid bodies,
which are known better than their particles, the energy in springs, and the books.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from corporeal.mpm.ledger import EngineLedger
from corporeal.mpm.physics.rigid import RigidBody
from corporeal.mpm.physics.springs import has_springs, stored_spring_energy
from corporeal.mpm.problem import Diagnostics, Problem, Snapshot
from corporeal.mpm.shells.assemble import Shells
from corporeal.mpm.shells.forces import shell_energy, vertex_deformation
from corporeal.mpm.state import ParticleConstants, State, branch_energy, strain_energy

_AXIAL_COMPONENTS = ((2, 1), (0, 2), (1, 0))


@dataclass(frozen=True)
class ParticleEnergy:
    """What particles hold; P of them."""

    elastic: Float[np.ndarray, " P"]
    """In the laws' own strain [J]."""
    relaxing: Float[np.ndarray, " P"]
    """In Maxwell branches [J]."""


@dataclass(frozen=True)
class BodySums:
    """What the particles of every body add up to; B bodies."""

    mass: Float[np.ndarray, " B"]
    """[kg]"""
    first_moment: Float[np.ndarray, "B 3"]
    """Σ m x [kg m]."""
    momentum: Float[np.ndarray, "B 3"]
    """[kg m/s]"""
    angular_momentum: Float[np.ndarray, "B 3"]
    """About the origin, affine part included [kg m²/s]."""
    kinetic: Float[np.ndarray, " B"]
    """[J]"""
    elastic: Float[np.ndarray, " B"]
    """In the laws' own strain [J]."""
    relaxing: Float[np.ndarray, " B"]
    """In Maxwell branches [J]."""
    fastest: Float[np.ndarray, " B"]
    """Largest |v|² [m²/s²]."""

    @classmethod
    def of(
        cls,
        matter: ParticleConstants,
        now: Snapshot,
        affine: Float[np.ndarray, "P 3 3"],
        energy: ParticleEnergy,
        cell: float,
    ) -> "BodySums":
        """Add up particles.

        L = Σ m (x × v + dx²/4 axial(C)), E = ½ Σ m (|v|² + dx²/4 ‖C‖²): a particle's affine motion is that of its
        quadratic spline (Jiang et al. 2015).

        Args:
            matter: What never changes of them.
            now: Where they are.
            affine: C [1/s].
            energy: What each holds.
            cell: dx [m].
        """
        x, v, mass, spread = now.position, now.velocity, matter.mass, 0.25 * cell**2
        swirl = np.stack([affine[:, i, j] - affine[:, j, i] for i, j in _AXIAL_COMPONENTS], axis=1)
        square = np.sum(v * v, axis=1)
        kinetic = 0.5 * mass * (square + spread * np.sum(affine**2, axis=(1, 2)))
        fastest = np.zeros(len(matter.total))
        np.maximum.at(fastest, matter.body, square)

        def per_body(values: np.ndarray) -> np.ndarray:
            out = np.zeros((len(matter.total), *values.shape[1:]))
            np.add.at(out, matter.body, values)
            return out

        return cls(
            mass=matter.total.copy(),
            first_moment=per_body(mass[:, None] * x),
            momentum=per_body(mass[:, None] * v),
            angular_momentum=per_body(mass[:, None] * (np.cross(x, v) + spread * swirl)),
            kinetic=per_body(kinetic),
            elastic=per_body(energy.elastic),
            relaxing=per_body(energy.relaxing),
            fastest=fastest,
        )

    def enter(self, b: int, body: RigidBody) -> None:
        """Put the sums of a rigid body in place of its particles'."""
        momentum = body.mass * body.velocity
        self.first_moment[b] = body.mass * body.centre
        self.momentum[b] = momentum
        self.angular_momentum[b] = np.cross(body.centre, momentum) + body.angular_momentum
        self.kinetic[b] = body.kinetic
        self.elastic[b] = self.relaxing[b] = 0.0
        self.fastest[b] = np.sum(body.particle_velocity() ** 2, axis=1).max()


class EngineReadout(ABC):
    """Snapshots and measures of an engine, over four accessors that it gives."""

    problem: Problem
    lost: Bool[np.ndarray, " P"]

    @property
    @abstractmethod
    def time(self) -> float:
        """Simulated time so far [s]."""

    def snapshot(self) -> Snapshot:
        """Copy every particle's state."""
        now = self._particles()
        starts = np.cumsum([0, *(len(body.position) for body in self.problem.bodies)])
        for b, body in self._rigid_bodies().items():
            mine = slice(starts[b], starts[b + 1])
            now.position[mine] = body.particle_position()
            now.velocity[mine] = body.particle_velocity()
            now.deformation[mine] = now.motion[mine] = body.rotation
        shells = self._shells()
        if shells:
            rest = np.concatenate([body.position for body in self.problem.bodies])
            bent = vertex_deformation(shells.mesh, rest, now.position)
            now.motion[shells.is_vertex] = now.deformation[shells.is_vertex] = bent[shells.is_vertex]
        return now

    def measure(self) -> Diagnostics:
        """Add up the ledger."""
        problem, sums, rigid = self.problem, self._sums(), self._rigid_bodies()
        for b, body in rigid.items():
            sums.enter(b, body)
        centre = sums.first_moment / sums.mass[:, None]
        elastic, booked = sums.elastic + sums.relaxing, self._booked().as_measured()
        # Booked is the work on branches: what they still hold is not lost.
        booked["viscous_loss"] -= float(sums.relaxing.sum())
        if has_springs(problem):
            elastic = elastic + stored_spring_energy(problem, self.snapshot().position, rigid)
        return Diagnostics(
            time=self.time,
            mass=sums.mass,
            centre=centre,
            momentum=sums.momentum,
            angular_momentum=sums.angular_momentum,
            kinetic=sums.kinetic,
            elastic=elastic,
            potential=-sums.mass * (centre @ np.array(problem.gravity)),
            speed=float(np.sqrt(sums.fastest.max())),
            lost=self.lost.copy(),
            **booked,
        )

    @abstractmethod
    def _particles(self) -> Snapshot:
        """Copy every particle's state; those of rigid bodies are overwritten."""

    @abstractmethod
    def _sums(self) -> BodySums:
        """Add up particles in new arrays; those of rigid bodies are overwritten."""

    @abstractmethod
    def _rigid_bodies(self) -> dict[int, RigidBody]:
        """Every rigid body now, by number."""

    @abstractmethod
    def _shells(self) -> Shells:
        """Return the thin parts of all bodies."""

    @abstractmethod
    def _booked(self) -> EngineLedger:
        """Return the ledger, with everything entered that has happened."""


def particle_energy(matter: ParticleConstants, state: State) -> ParticleEnergy:
    """Return what each particle holds [J]; a third of what a triangle of a shell does is each vertex'."""
    energy = ParticleEnergy(strain_energy(matter, state.F, state.log_volume_ratio), branch_energy(matter, state.memory))
    shells = matter.shells
    if not shells:
        return energy
    held = shell_energy(shells.mesh, shells.material, state.shell, state.position)
    corner, count = shells.mesh.triangle.ravel(), len(matter.mass)
    thirds = (np.bincount(corner, np.repeat(one / 3.0, 3), count) for one in (held.elastic, held.relaxing))
    return ParticleEnergy(*(own + third for own, third in zip(vars(energy).values(), thirds, strict=True)))

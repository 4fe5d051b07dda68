"""Loads on particles in the reference engine.

A load gives impulses to particles; the particles of a body that bends hand them to the grid, a rigid body adds them up.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.mpm.constants import TINY_DOUBLE
from corporeal.mpm.physics import wind_pressure
from corporeal.mpm.physics.grid_spline import Stencil
from corporeal.mpm.problem import Problem
from corporeal.mpm.state import ParticleConstants, State


@dataclass(frozen=True)
class ParticleLoads:
    """What some particles are given in one step; M of them, a particle more than once at times."""

    particle: Int[np.ndarray, " M"]
    impulse: Float[np.ndarray, "M 3"]
    """[N s]"""

    @classmethod
    def none(cls) -> "ParticleLoads":
        """Return no impulses."""
        return cls(np.zeros(0, np.int64), np.zeros((0, 3)))

    def joined(self, other: "ParticleLoads") -> "ParticleLoads":
        """Give both."""
        return ParticleLoads(
            np.concatenate([self.particle, other.particle]), np.concatenate([self.impulse, other.impulse])
        )

    def of(self, chosen: Bool[np.ndarray, " P"]) -> "ParticleLoads":
        """Give to some of the particles only."""
        mine = chosen[self.particle]
        return ParticleLoads(self.particle[mine], self.impulse[mine])


@dataclass(frozen=True)
class LoadedMotion:
    """One step's motion after the loads; A slots, B bodies."""

    velocity: Float[np.ndarray, "A 3"]
    """Of the slots [m/s]."""
    state: State
    """With the loads in the velocities of rigid bodies."""
    impulse: Float[np.ndarray, "B 3"]
    """What each body got [N s]."""
    work: float
    """[J]"""


def apply_loads(
    load: ParticleLoads, matter: ParticleConstants, state: State, grid: Stencil, slots: tuple[np.ndarray, np.ndarray]
) -> LoadedMotion:
    """Hand loads to the grid and to rigid bodies with a field of their own.

    Args:
        load: What the particles are given.
        matter: All particles.
        state: With gravity and pushes in the velocities of rigid bodies.
        grid: Where the particles are.
        slots: Mass [kg] and velocity after all other forces [m/s] of the slots.
    """
    mass, velocity = slots
    bodies = len(state.centre)
    if not len(load.particle):
        return LoadedMotion(velocity, state, np.zeros((bodies, 3)), 0.0)
    single = len(np.unique(grid.field)) < bodies
    free = matter.rigid & (not single)
    impulse = np.zeros((bodies, 3))
    np.add.at(impulse, matter.body[load.particle], load.impulse)
    soft = load.of(~free)
    given = np.zeros((len(matter.mass), 3))
    np.add.at(given, soft.particle, soft.impulse)
    given = grid.scatter(given)
    gained = given / np.maximum(mass, TINY_DOUBLE)[:, None]
    work = float(np.sum(given * (velocity + 0.5 * gained)))
    turned, rigid_work = _load_rigid(load.of(free), matter, state)
    return LoadedMotion(velocity + gained, turned, impulse, work + rigid_work)


def _load_rigid(load: ParticleLoads, matter: ParticleConstants, state: State) -> tuple[State, float]:
    """Add a load up to force and torque; give the state after it and the work [J]."""
    body = matter.body[load.particle]
    force, moment = np.zeros_like(state.speed), np.zeros_like(state.speed)
    arm = state.position[load.particle] - state.centre[body]
    np.add.at(force, body, load.impulse)
    np.add.at(moment, body, np.cross(arm, load.impulse))
    after = replace(
        state, speed=state.speed + force / matter.total[:, None], spin_momentum=state.spin_momentum + moment
    )
    mean = 0.5 * (state.speed + after.speed)
    spin = 0.5 * (state.spin(matter) + after.spin(matter))
    return after, float(np.sum(force * mean) + np.sum(moment * spin))


def wind_loads(problem: Problem, matter: ParticleConstants, state: State, dt: float) -> ParticleLoads:
    """Let the wind press on every body that is in it."""
    load, first = ParticleLoads.none(), 0
    for b, body in enumerate(problem.bodies):
        moving = None if body.wind is None else wind_pressure.air_velocity(body.wind, float(state.time) + 0.5 * dt)
        particle = first + body.faces.particle
        first += len(body.position)
        if moving is None or not len(particle):
            continue
        F = state.rotation[[b]] if body.rigid else state.motion[particle]
        seen = moving - state.velocity[particle]
        area = deformed_area(body.faces.area, F)
        load = load.joined(ParticleLoads(particle, wind_pressure.wind_impulses(area, seen, matter.mass[particle], dt)))
    return load


def deformed_area(area: Float[np.ndarray, "A 3"], F: Float[np.ndarray, "K 3 3"]) -> Float[np.ndarray, "A 3"]:
    """Area vectors after a deformation: n da = cof(F) N dA (Nanson's formula)."""
    a, b, c = F[:, :, 0], F[:, :, 1], F[:, :, 2]
    cofactor = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=2)
    return np.einsum("kij,kj->ki", cofactor, area) if len(F) > 1 else area @ cofactor[0].T

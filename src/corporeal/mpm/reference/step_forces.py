"""Forces of wind, springs and grips on bodies."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from corporeal.mpm.physics.grid_spline import Stencil
from corporeal.mpm.physics.spring_grips import Grip
from corporeal.mpm.problem import Problem
from corporeal.mpm.reference.loads import LoadedMotion, ParticleLoads, apply_loads, wind_loads
from corporeal.mpm.reference.springs import add_impulse, apply_springs
from corporeal.mpm.state import ParticleConstants, State

BodyKicks = tuple[Float[np.ndarray, "B 3"], Float[np.ndarray, "B 3"]]


@dataclass(frozen=True)
class StepForces:
    """Where one step's loads act."""

    problem: Problem
    matter: ParticleConstants
    state: State
    """Before gravity and pushes."""
    grid: Stencil
    grips: Mapping[int, Grip]
    """By body."""

    def act(self, slots: tuple[np.ndarray, np.ndarray], kicks: BodyKicks, dt: float) -> tuple[LoadedMotion, float]:
        """Let everything act: wind, then springs, then grips.

        Args:
            slots: Mass [kg] and velocity after all other forces [m/s] of the slots.
            kicks: Velocity that gravity and pushes give each body, and the pushes' alone [m/s].
            dt: [s]

        Returns:
            The motion after it with what came from outside, and what dampers took [J].
        """
        (mass, velocity), kick, matter = slots, kicks[0], self.matter
        kicked = replace(self.state, speed=self.state.speed + kick)
        load = wind_loads(self.problem, matter, self.state, dt)
        blown = apply_loads(load, matter, kicked, self.grid, (mass, velocity))
        before = replace(blown.state, speed=blown.state.speed - kick)
        pulled = apply_springs(self.problem, matter, before, kicks, dt)
        sprung = apply_loads(pulled.load, matter, pulled.state, self.grid, (mass, blown.velocity))
        held, state, work = self._grasp(sprung.state, kick, dt)
        after = apply_loads(held, matter, state, self.grid, (mass, sprung.velocity))
        given = blown.impulse + after.impulse + (state.speed - sprung.state.speed) * (matter.total[:, None])
        outside = blown.work + after.work + work
        return LoadedMotion(after.velocity, after.state, given, outside), pulled.loss

    def _grasp(self, state: State, kick: Float[np.ndarray, "B 3"], dt: float) -> tuple[ParticleLoads, State, float]:
        """Let grips act: loads on particles, rigid bodies' new velocities, work on these [J]."""
        load, work, body = ParticleLoads.none(), 0.0, self.matter.body
        for b, grip in self.grips.items():
            if self.problem.bodies[b].rigid and self.problem.contact == "multi":
                state, done = self._grasp_rigid(b, grip, state, kick[b], dt)
                work += done
            else:
                own = np.flatnonzero(body == b)[grip.hold.particle]
                place = grip.hold.share @ self.state.position[own]
                impulse = grip.impulse(place, grip.hold.share @ self.state.velocity[own], dt)
                load = load.joined(ParticleLoads(own, grip.hold.share[:, None] * impulse))
        return load, state, work

    def _grasp_rigid(
        self, b: int, grip: Grip, state: State, kick: Float[np.ndarray, "3"], dt: float
    ) -> tuple[State, float]:
        arm = state.rotation[b] @ grip.hold.arm
        before = state.speed[b] - kick + np.cross(state.spin(self.matter)[b], arm)
        impulse = grip.impulse(state.centre[b] + arm, before, dt)
        after = add_impulse(state, self.matter, b, impulse, np.cross(arm, impulse))
        moving = after.speed[b] - kick + np.cross(after.spin(self.matter)[b], arm)
        return after, float(impulse @ (0.5 * (before + moving) + kick))

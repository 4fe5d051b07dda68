"""External interaction with bodies between two advances.

An engine says how it changes velocities, takes grips and places bodies. What is the same in all of them is here: what
an impact does, what takes hold of what, what a start from another engine's state takes over, and what is booked of it.
"""

from abc import abstractmethod
from collections.abc import Collection
from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.errors import UserError
from corporeal.core.types import Vector, Wind
from corporeal.mpm.diagnostics import EngineReadout
from corporeal.mpm.physics.spring_grips import (
    Grip,
    GripHold,
    check_grip,
    require_finite,
    take_hold,
    take_hold_of_rigid,
    updated_grips,
)
from corporeal.mpm.state import Velocities


class EngineInteraction(EngineReadout):
    """Impulses, pulls, stops and warm starts of an engine, over accessors that it gives."""

    grips: dict[int, Grip]
    """What is held from outside, by body."""

    def apply_impulse(self, body: int, point: Vector, impulse: Vector) -> None:
        """Give a body an impulse [N s] at a point [m] at once: see ``problem.InteractiveEngine``."""
        check_grip(self.problem, body, point, impulse)
        before, hold = self.measure().kinetic[body], self._hold(body, point)
        given, struck = np.array(impulse, np.float64), self._rigid_bodies().get(body)
        if struck is not None:
            arm = struck.rotation @ hold.arm
            self._add_momentum(body, given, np.cross(arm, given))
        else:
            mass = self._mass(body)[hold.particle]
            self._add_velocity(body, hold.particle, hold.share[:, None] * given / mass[:, None])
        self._enter(body, given, float(self.measure().kinetic[body] - before))

    def attach_spring(self, body: int, point: Vector | None, target: Vector, stiffness: float) -> None:
        """Pull on a body by a spring until released: see ``problem.InteractiveEngine``."""
        check_grip(self.problem, body, point, target)
        hold = None if point is None else self._hold(body, point)
        total = self._total(body)
        self.grips = updated_grips(self.grips, body, hold, np.array(target), stiffness, total)
        self._take_grips()

    def grip_point(self, body: int, position: Float[np.ndarray, "P 3"]) -> Float[np.ndarray, "3"] | None:
        """Where a body is held now [m], or None: see ``problem.InteractiveEngine``."""
        if body not in self.grips:
            return None
        hold, state = self.grips[body].hold, self._rigid_bodies().get(body)
        if state is not None:  # its particles' mean is off by a share of a cell
            return state.centre + state.rotation @ hold.arm
        return hold.share @ position[self._rows_of(body)][hold.particle]

    def stop(self, bodies: Collection[int]) -> None:
        """Take all motion out of some bodies; nothing of it is booked."""
        self._set_motion(bodies, Velocities.none(self.problem))

    def start_from(self, saved: dict[str, np.ndarray], bodies: Collection[int]) -> None:
        """Put some bodies where they were in another's ``save``: see ``problem.Engine``."""
        self._place_as(saved, bodies)
        self._set_motion(range(len(self.problem.bodies)), Velocities.at_start(self.problem))

    def _hold(self, body: int, point: Vector) -> GripHold:
        """Take hold of a body at a point [m]."""
        held = self._rigid_bodies().get(body)
        if held is not None:
            return take_hold_of_rigid(self._total(body), held.centre, held.rotation, point)
        matter, place = self.problem.bodies[body], self.snapshot().position[self._rows_of(body)]
        return take_hold(matter, place, point, self.problem.cell)

    def _rows_of(self, body: int) -> slice:
        """Where a body's particles stand in the problem's order."""
        first = sum(len(other.position) for other in self.problem.bodies[:body])
        return slice(first, first + len(self.problem.bodies[body].position))

    def _mass(self, body: int) -> Float[np.ndarray, " P"]:
        """Mass of each of a body's particles [kg]."""
        return self.problem.bodies[body].volume * self.problem.bodies[body].density

    def _total(self, body: int) -> float:
        """Mass of a body [kg]."""
        return float(self.problem.bodies[body].volume @ self.problem.bodies[body].density)

    @abstractmethod
    def _add_velocity(self, body: int, particle: Int[np.ndarray, " H"], gained: Float[np.ndarray, "H 3"]) -> None:
        """Add to the velocities [m/s] of some particles of a body that bends."""

    @abstractmethod
    def _add_momentum(self, body: int, momentum: Float[np.ndarray, "3"], angular: Float[np.ndarray, "3"]) -> None:
        """Add to the momentum [N s] of a rigid body, and to that about its centre [N m s]."""

    @abstractmethod
    def _enter(self, body: int, impulse: Float[np.ndarray, "3"], work: float) -> None:
        """Book what a body was given from outside [N s], and the work of it [J]."""

    @abstractmethod
    def _take_grips(self) -> None:
        """Let ``grips`` act from now on, and no earlier ones."""

    @abstractmethod
    def _set_motion(self, bodies: Collection[int], motion: Velocities) -> None:
        """Let some bodies move so, with no velocity gradient in what bends."""

    @abstractmethod
    def _place_as(self, saved: dict[str, np.ndarray], bodies: Collection[int]) -> None:
        """Take place, strain and history of some bodies from another engine's ``save``."""


class EngineLoadChanges(EngineInteraction):
    """Gravity and winds of an engine that change while it runs."""

    def set_gravity(self, gravity: Vector) -> None:
        """Let gravity be another from now on [m/s²]: see ``problem.VariableLoadEngine``."""
        require_finite(gravity)
        before = float(np.sum(self.measure().potential))
        self.problem = replace(self.problem, gravity=gravity, gravity_ramp=0.0)
        self._take_loads()
        self._enter(0, np.zeros(3), float(np.sum(self.measure().potential)) - before)

    def set_wind(self, body: int, wind: Vector) -> None:
        """Let the air about a body move from now on [m/s]: see ``problem.VariableLoadEngine``."""
        check_grip(self.problem, body, wind)
        if self.problem.bodies[body].wind is None or not len(self.problem.bodies[body].faces.area):
            raise UserError(
                f"{self.problem.bodies[body].name!r} was filled without faces for the wind. Give "
                "it a wind in the scene file."
            )
        bodies = list(self.problem.bodies)
        bodies[body] = replace(bodies[body], wind=Wind(wind))
        self.problem = replace(self.problem, bodies=tuple(bodies))
        self._take_loads()

    @abstractmethod
    def _take_loads(self) -> None:
        """Let gravity and winds of ``problem`` act from now on."""

"""An engine that obeys orders, and a record of them from which it does the same again."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from corporeal.errors import UserError
from corporeal.mpm.cpu.engine import CpuEngine
from corporeal.mpm.problem import Problem
from corporeal.treatment.problem_from_scene import Posed
from corporeal.types import Vector
from corporeal.viewer.orders import Order


@dataclass(frozen=True)
class Touch:
    """What was done to an engine: an order, or an advance to a time."""

    order: Order | None = None
    until: float = 0.0
    """[s]"""


@dataclass(frozen=True)
class Held:
    """What hangs on the hand."""

    body: int
    stiffness: float
    """[N/m]"""
    to: Vector
    """[m]"""


class Hands:
    """Acts on one engine; all that is done goes into ``touches``."""

    def __init__(self, posed: Posed, problem: Problem, threads: int) -> None:
        """Begin at time 0.

        Args:
            posed: Which objects the bodies belong to.
            problem: Its own, or the control with one velocity field.
            threads: Of the engine.

        """
        self.posed, self.engine = posed, CpuEngine(problem, threads)
        counts = [len(body.position) for body in problem.bodies]
        self.first = np.cumsum([0, *counts])
        self.held: Held | None = None
        self.touches: list[Touch] = []

    def advance(self, seconds: float) -> None:
        """Simulate so much more [s].

        Raises:
            SimulationError: The state became impossible; the engine is where it was.

        """
        until = self.engine.time + seconds
        self.engine.advance(until)
        self.touches.append(Touch(until=until))

    def obey(self, order: Order) -> None:
        """Do what an order says to bodies; ``Hands`` knows nothing of playing and pausing.

        Raises:
            UserError: It cannot be done.

        """
        acts = {"grab": self._grab, "pull": self._pull, "drop": self._drop}
        acts |= {"gravity": self._gravity, "wind": self._wind}
        if order.do in acts:
            acts[order.do](order)
            self.touches.append(Touch(order))

    def replay(self, touches: Sequence[Touch]) -> None:
        """Do again what was done to another engine of the same problem."""
        for touch in touches:
            if touch.order is not None:
                self.obey(touch.order)
            else:
                self.engine.advance(touch.until)
                self.touches.append(touch)

    # ---------------------------------------------------------------- orders

    def _bodies(self, number: int) -> list[int]:
        found = np.flatnonzero(self.posed.object_of_body == number).tolist()
        if not found:
            raise UserError(f"There is no object {number}.")
        return found

    def _grab(self, order: Order) -> None:
        bodies, place = self._bodies(order.object), self.engine.snapshot().position
        point = np.array(order.point)

        def away(b: int) -> float:
            mine = place[self.first[b] : self.first[b + 1]]
            return float(np.linalg.norm(mine - point, axis=1).min())

        body = min(bodies, key=away)
        self._drop(order)
        mass = float(self.engine.measure().mass[body])
        stiffness = mass * (2 * np.pi * order.firm) ** 2
        self.engine.pull(body, order.point, order.to, stiffness)
        self.held = Held(body, stiffness, order.to)

    def _pull(self, order: Order) -> None:
        if self.held is not None:
            self.engine.pull(self.held.body, None, order.to, self.held.stiffness)
            self.held = Held(self.held.body, self.held.stiffness, order.to)

    def _drop(self, order: Order) -> None:
        if self.held is not None:
            self.engine.pull(self.held.body, None, self.held.to, 0.0)
            self.held = None

    def _gravity(self, order: Order) -> None:
        self.engine.weigh(order.to)

    def _wind(self, order: Order) -> None:
        for body in self._bodies(order.object):
            if len(self.engine.problem.bodies[body].faces.area):
                self.engine.blow(body, order.to)

    # ---------------------------------------------------------------- the hand

    def grip(self, position: np.ndarray) -> np.ndarray | None:
        """Where the hand holds now [m]; None: it holds nothing.

        Args:
            position: Of all particles, in the engine's order [m].

        """
        if self.held is None:
            return None
        hold = self.engine.grips[self.held.body].hold
        state = self.engine._rigid_bodies().get(self.held.body)
        if state is not None:  # its particles' mean is off by a share of a cell
            return state.centre + state.rotation @ hold.arm
        mine = position[self.first[self.held.body] : self.first[self.held.body + 1]]
        return hold.share @ mine[hold.particle]

    def force(self, position: np.ndarray) -> float:
        """How hard the hand pulls now [N]."""
        at = self.grip(position)
        if self.held is None or at is None:
            return 0.0
        return float(self.held.stiffness * np.linalg.norm(np.array(self.held.to) - at))

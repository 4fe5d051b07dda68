"""Applies commands to an engine, and records them for replay."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from corporeal.core.errors import UserError
from corporeal.core.types import Vector
from corporeal.discretization.build_model import ModelMapping
from corporeal.mpm.engines import DEFAULT_ENGINE, build_engine, require
from corporeal.mpm.problem import BodyAddingEngine, InteractiveEngine, Problem, VariableLoadEngine
from corporeal.viewer.commands import Command
from corporeal.viewer.live_edit import MAX_DROP_HEIGHT_M, AddedObject, LiveEditor

RECORDED_GRAB = "hold"
"""What a record has in place of a page's "grab": its point is that of material at the start [m]."""

RECORDED_ADD = "join"
"""What a record has in place of a page's "add": its point is where the object begins."""
MIN_CLEARANCE_DX = 2.0
"""Between what is added and what is under it, at least [cells]: no contact is felt so far away."""


@dataclass(frozen=True, slots=True)
class InteractionEvent:
    """What was done to an engine: an order, or an advance to a time."""

    order: Command | None = None
    until: float = 0.0
    """[s]"""


@dataclass(frozen=True)
class SpringGrip:
    """What hangs on the hand."""

    body: int
    stiffness: float
    """[N/m]"""
    to: Vector
    """[m]"""


@dataclass(frozen=True)
class _GrippedParticle:
    """A particle, and the body that it is of."""

    body: int
    row: int


class InteractionController:
    """Acts on one engine; all that is done goes into ``touches``."""

    def __init__(
        self,
        posed: ModelMapping,
        problem: Problem,
        threads: int,
        growth: LiveEditor | None = None,
        engine: str = DEFAULT_ENGINE,
    ) -> None:
        """Begin at time 0.

        Args:
            posed: Which objects the bodies belong to.
            problem: Its own, or the control with one velocity field.
            threads: Of the engine.
            growth: Gives the scene with objects that are added; None: nothing can be.
            engine: Its name.

        Raises:
            UserError: The engine cannot solve the problem, or does not work on this machine.
        """
        self.engine, self.growth = build_engine(problem, engine, threads), growth
        self.added: tuple[AddedObject, ...] = ()
        self._know(posed)
        self.held: SpringGrip | None = None
        self.touches: list[InteractionEvent] = []

    def _know(self, posed: ModelMapping) -> None:
        self.posed, bodies = posed, posed.problem.bodies
        self.first = np.cumsum([0, *(len(body.position) for body in bodies)])
        self.start = np.concatenate([body.position for body in bodies])

    def advance(self, seconds: float) -> None:
        """Simulate so much more [s].

        Raises:
            SimulationError: The state became impossible; the engine is where it was.
        """
        until = self.engine.time + seconds
        self.engine.advance(until)
        self.touches.append(InteractionEvent(until=until))

    def obey(self, order: Command) -> Command | None:
        """Do what an order says to bodies; ``InteractionController`` knows nothing of playing and pausing.

        Returns:
            Order for another engine to do the same; None: nothing was done.

        Raises:
            UserError: It cannot be done.
        """
        acts = {RECORDED_GRAB: self._hold, "pull": self._pull, "drop": self._drop}
        acts |= {"gravity": self._gravity, "wind": self._wind, RECORDED_ADD: self._join}
        if order.do == "grab":
            order = self._at_rest(order)
        if order.do not in acts:
            return None
        acts[order.do](order)
        # Of several pulls between two advances only the last is felt.
        if self.touches and order.do == "pull" and _is_pull(self.touches[-1]):
            self.touches.pop()
        self.touches.append(InteractionEvent(order))
        return order

    def replay(self, touches: Sequence[InteractionEvent]) -> None:
        """Do again what was done to another engine of the same bodies."""
        for touch in touches:
            self.again(touch)

    def again(self, touch: InteractionEvent) -> None:
        """Repeat one order."""
        if touch.order is not None:
            self.obey(touch.order)
        else:
            self.engine.advance(touch.until)
            self.touches.append(touch)

    def _bodies(self, number: int) -> list[int]:
        found = np.flatnonzero(self.posed.object_of_body == number).tolist()
        if not found:
            raise UserError(f"There is no object {number}.")
        return found

    def _nearest(self, bodies: Sequence[int], places: np.ndarray, point: Vector) -> _GrippedParticle:
        """Find the particle of some bodies that is nearest to a point [m].

        Args:
            bodies: Among which.
            places: Of all particles, now or at the start [m].
            point: In the same.
        """
        rows = np.concatenate([np.arange(self.first[b], self.first[b + 1]) for b in bodies])
        row = int(rows[np.linalg.norm(places[rows] - np.array(point), axis=1).argmin()])
        return _GrippedParticle(int(np.searchsorted(self.first, row, side="right")) - 1, row)

    def _at_rest(self, order: Command) -> Command:
        """Say of what is taken where it was at the start: so another engine finds it as well.

        Of what is rigid the point is exact, of what deforms it is a particle's.
        """
        now = self.engine.snapshot()
        spot = self._nearest(self._bodies(order.object), now.position, order.point)
        rest = self.start[spot.row]
        if self.posed.rigid[spot.body]:
            away = np.array(order.point) - now.position[spot.row]
            rest = rest + now.deformation[spot.row].T @ away
        x, y, z = rest.tolist()
        return replace(order, do=RECORDED_GRAB, point=(x, y, z))

    def _hold(self, order: Command) -> None:
        """Take hold of what was at a point at the start."""
        now = self.engine.snapshot()
        spot = self._nearest(self._bodies(order.object), self.start, order.point)
        point = now.position[spot.row]
        if self.posed.rigid[spot.body]:
            away = np.array(order.point) - self.start[spot.row]
            point = point + now.deformation[spot.row] @ away
        self._drop(order)
        mass = float(self.engine.measure().mass[spot.body])
        stiffness = mass * (2 * np.pi * order.firm) ** 2
        x, y, z = point.tolist()
        require(self.engine, InteractiveEngine).attach_spring(spot.body, (x, y, z), order.to, stiffness)
        self.held = SpringGrip(spot.body, stiffness, order.to)

    def _pull(self, order: Command) -> None:
        if self.held is not None:
            held, engine = self.held, require(self.engine, InteractiveEngine)
            engine.attach_spring(held.body, None, order.to, held.stiffness)
            self.held = SpringGrip(self.held.body, self.held.stiffness, order.to)

    def _drop(self, order: Command) -> None:
        if self.held is not None:
            engine = require(self.engine, InteractiveEngine)
            engine.attach_spring(self.held.body, None, self.held.to, 0.0)
            self.held = None

    def _gravity(self, order: Command) -> None:
        require(self.engine, VariableLoadEngine).set_gravity(order.to)

    def _wind(self, order: Command) -> None:
        engine, known = require(self.engine, VariableLoadEngine), self.engine.problem.bodies
        for body in self._bodies(order.object):
            if len(known[body].faces.area):
                engine.set_wind(body, order.to)

    def top(self, order: Command) -> float:
        """Return how high material reaches under an object that is to be added [m]."""
        low, high = self._growing.reach(order.thing, drop_height(order))
        wide, place = MIN_CLEARANCE_DX * self.engine.problem.cell, self.engine.snapshot().position
        away = place[:, :2] - np.array(order.point[:2])
        under = ((away > low[:2] - wide) & (away < high[:2] + wide)).all(axis=1)
        return max(order.point[2], float(place[under, 2].max(initial=0.0)))

    def above(self, order: Command, top: float) -> Command:
        """Return where an object that is to be added begins, over what reaches up to ``top`` [m]."""
        room = max(drop_height(order), MIN_CLEARANCE_DX * self.engine.problem.cell)
        x, y, _ = order.point
        return replace(order, do=RECORDED_ADD, point=(x, y, top + room), to=(0.0, 0.0, drop_height(order)))

    def _join(self, order: Command) -> None:
        one = AddedObject(order.thing, order.point, drop_height(order))
        low, high = self._growing.reach(one.thing, one.height)
        away = self.engine.snapshot().position - np.array(one.foot)
        near = 0.5 * self.engine.problem.cell
        if ((away > low - near) & (away < high + near)).all(axis=1).any():
            raise UserError(f"There is no space for {one.thing} there: something is in the way.")
        added = (*self.added, one)
        posed = self._growing.at(added).posed
        self.engine = require(self.engine, BodyAddingEngine).with_added_bodies(posed.problem)
        self.added = added
        self._know(posed)

    @property
    def _growing(self) -> LiveEditor:
        if self.growth is None:
            raise UserError("Nothing can be added to this simulation.")
        return self.growth

    def grip(self, position: np.ndarray) -> np.ndarray | None:
        """Where the hand holds now [m]; None: it holds nothing.

        Args:
            position: Of all particles, in the engine's order [m].
        """
        if self.held is None:
            return None
        return require(self.engine, InteractiveEngine).grip_point(self.held.body, position)

    def force(self, position: np.ndarray) -> float:
        """How hard the hand pulls now [N]."""
        at = self.grip(position)
        if self.held is None or at is None:
            return 0.0
        return float(self.held.stiffness * np.linalg.norm(np.array(self.held.to) - at))


def drop_height(order: Command) -> float:
    """Return how high above all that is under it an object begins [m]."""
    return min(max(order.to[2], 0.0), MAX_DROP_HEIGHT_M)


def _is_pull(touch: InteractionEvent) -> bool:
    return touch.order is not None and touch.order.do == "pull"

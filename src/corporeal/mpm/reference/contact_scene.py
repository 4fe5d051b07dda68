"""Input of the reference engine's contact: bodies, nodes and contact parameters."""

from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from typing import Protocol

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.mpm.constants import STICKING_FRICTION, TINY_DOUBLE
from corporeal.mpm.physics import contact, contact_impulses, wall_stress
from corporeal.mpm.physics.curved_surface import support_point_shift
from corporeal.mpm.physics.flat_facets import FacetsAtNodes
from corporeal.mpm.physics.grid_spline import Stencil
from corporeal.mpm.problem import Problem, WettedSurface
from corporeal.mpm.state import ParticleConstants, State


@dataclass(frozen=True)
class NormalCache:
    """Candidates by pair of bodies and node; N of them. One step reads them, the next is new."""

    pair: Int[np.ndarray, "N 2"]
    node: Int[np.ndarray, "N 3"]
    """Grid indices of nodes."""
    candidate: Int[np.ndarray, " N"]
    """0, 1 or 2: see ``physics.contact.candidate_normals``."""

    @classmethod
    def none(cls) -> "NormalCache":
        """Keep nothing: everything is looked at anew."""
        whole = np.int64
        return cls(np.zeros((0, 2), whole), np.zeros((0, 3), whole), np.zeros(0, whole))

    @classmethod
    def of_pair(
        cls, pair: tuple[int, int], node: Int[np.ndarray, "E 3"], candidate: Int[np.ndarray, " E"]
    ) -> "NormalCache":
        """Keep what one pair took at some nodes."""
        return cls(np.tile(np.array(pair, dtype=np.int64), (len(node), 1)), node, candidate)

    @classmethod
    def of_all(cls, parts: Iterable["NormalCache"]) -> "NormalCache":
        """Keep what several say."""
        every = [cls.none(), *parts]
        return cls(*(np.concatenate([getattr(k, f.name) for k in every]) for f in fields(cls)))

    def of(self, pair: tuple[int, int], node: Int[np.ndarray, "E 3"]) -> Int[np.ndarray, " E"]:
        """Candidate that each of some nodes took for a pair of bodies; -1: none is known."""
        mine = np.all(self.pair == pair, axis=1)
        known = dict(zip(map(tuple, self.node[mine].tolist()), self.candidate[mine], strict=True))
        return np.array([known.get(tuple(at), -1) for at in node.tolist()], dtype=np.int64)

    def as_arrays(self) -> dict[str, np.ndarray]:
        """Copy everything into a dict."""
        return {f.name: np.array(getattr(self, f.name)) for f in fields(self)}


class BodyStandIn(Protocol):
    """Something that moves in a rigid body's stead."""

    def act(self, movers: contact_impulses.Movers) -> None:
        """Take the body's place among what contact can move."""
        ...


@dataclass(frozen=True)
class ContactScene:
    """One step's stage."""

    problem: Problem
    matter: ParticleConstants
    state: State
    grid: Stencil
    mass: Float[np.ndarray, " A"]
    """Of every slot [kg]."""
    kick: Float[np.ndarray, "B 3"]
    """Velocity that gravity and push gave each body in this step [m/s]."""
    old: Float[np.ndarray, "A 3"]
    """Velocity of every slot before this step's forces [m/s]."""
    dt: float
    """[s]"""
    kept: NormalCache
    """Candidate normals that were taken in the last step; none: all are looked at anew."""
    composites: tuple["BodyStandIn", ...] = ()
    """Rigid bodies that move as one with what they hold."""

    @property
    def single(self) -> bool:
        """Whether all bodies share one field."""
        return self.problem.contact == "single"

    def is_rigid(self, field: int) -> bool:
        """Whether a field moves with six degrees of freedom."""
        return not self.single and self.problem.bodies[field].rigid

    def is_shell(self, field: int) -> bool:
        """Whether most particles of a field are vertices of shells."""
        return not self.single and bool(self.matter.is_shell_body[field])

    @property
    def feigned(self) -> Float[np.ndarray, " B"]:
        """Spin of each rigid body times the distance of its surface points [m/s]."""
        return np.linalg.norm(self.state.spin(self.matter), axis=1) * self.matter.spacing

    def surface(self, body: int) -> Float[np.ndarray, "S 3"]:
        """Surface points of a rigid body now [m]."""
        turned = self.matter.surface[body] @ self.state.rotation[body].T
        return self.state.centre[body] + turned

    def thin_places(self, body: int) -> Float[np.ndarray, "S 3"]:
        """Surface points of a rigid body behind which it is thin, and not as a whole, now [m]."""
        return self.surface(body)[self.matter.thin_places(self.problem.cell)[body]]

    def touching(
        self, body: int, towards: Float[np.ndarray, "3"]
    ) -> tuple[Float[np.ndarray, "S 3"], Bool[np.ndarray, " S"]]:
        """Where the rounded surface around each surface point ends in a direction, now [m].

        And whether it is that point's at all, and not its neighbours'.
        """
        R = self.state.rotation[body]
        rows = self.matter.curvature[body]
        shift, own = support_point_shift(rows, np.tile(towards @ R, (len(rows), 1)))
        return self.surface(body) + shift @ R.T, own

    def wetted(self, body: int) -> WettedSurface | None:
        """Where liquids touch a rigid body now; None: as everything else does."""
        given = self.problem.bodies[body].wetted_surface
        if given is None or not self.is_rigid(body):
            return None
        R = self.state.rotation[body].T
        point = self.state.centre[body] + (given.point - self.matter.centre[body]) @ R
        return WettedSurface(point, given.normal @ R)

    def pours(self, field: int) -> bool:
        """Whether a field holds a liquid."""
        if self.is_rigid(field):
            return False
        return bool(self.matter.pours.any() if self.single else self.matter.pours[field])

    def full(self, field: int, slot: Int[np.ndarray, " E"]) -> Float[np.ndarray, " E"]:
        """Masses of a field's nodes over that of a cell full of its body [-]."""
        body = self.problem.bodies[field]
        return self.mass[slot] / contact.full_cell_mass(body, self.problem.cell)

    def slides(self, field: int, wall: int) -> bool:
        """Whether a field is a liquid that slides along a plane: all that it presses holds it."""
        return self.pours(field) and not self.sticks(field, len(self.problem.bodies) + wall)

    def sticks(self, field: int, other: int) -> bool:
        """Whether a field is a liquid on which a body, or B + plane, drags by a viscous stress."""
        return self.pours(field) and bool(friction_table(self.problem)[field, other] >= STICKING_FRICTION)

    def layer(
        self, field: int, slot: np.ndarray, mean: np.ndarray, height: np.ndarray, normal: np.ndarray
    ) -> Float[np.ndarray, "E 4"]:
        """How a wall drags on a liquid that sticks to it: span [m² s] and flow curve, per node.

        Args:
            field: The liquid.
            slot: Its nodes.
            mean: Its mean offset from each [m].
            height: Of the nodes over the wall [m].
            normal: Into the wall.
        """
        body, cell = self.problem.bodies[field], self.problem.cell
        full = contact.full_cell_mass(body, cell)
        span = wall_stress.drag_span(self.mass[slot], full, height, cell, self.dt)
        touches = wall_stress.touches_wall(mean, height, normal, cell)
        curve = np.tile(np.array(wall_stress.flow_curve(body, cell)), (len(slot), 1))
        return np.column_stack([np.where(touches, span, 0.0), curve])

    def thinness(self, field: int) -> int:
        """How thin a rigid body is against the cell; 0 for what deforms."""
        if not self.is_rigid(field):
            return 0
        return self.matter.thinness(self.problem.cell)[field]

    def flat(self, field: int) -> bool:
        """Whether a field is rigid and bounded by flat faces for the most part."""
        return self.is_rigid(field) and self.matter.flat[field]

    def seen_faces(self, body: int, node: Float[np.ndarray, "E 3"], mean: Float[np.ndarray, "E 3"]) -> FacetsAtNodes:
        """Flat faces of a rigid body now, from some nodes [m] with its mean offsets there [m]."""
        rows, cell = self.matter.facets[body].row, self.problem.cell
        outward = rows[:, :3] @ self.state.rotation[body].T
        height = ((node - self.state.centre[body]) @ outward.T - rows[:, 3]) / cell
        return FacetsAtNodes(outward, height, mean / cell)

    def speed_at(self, body: int, node: Float[np.ndarray, "E 3"]) -> Float[np.ndarray, "E 3"]:
        """Velocity of a rigid body at some places [m/s]."""
        spin = self.state.spin(self.matter)[body]
        return self.state.speed[body] + np.cross(spin, node - self.state.centre[body])

    @property
    def wall_mover(self) -> int:
        """Movers are the bodies, then the slots, then the planes, of which this is the first."""
        return len(self.problem.bodies) + self.grid.count

    def mover_of_slot(self, slot: Int[np.ndarray, " E"]) -> Int[np.ndarray, " E"]:
        """Return the rigid body that owns the slot, or the slot itself."""
        bodies = len(self.problem.bodies)
        stiff = np.array([self.is_rigid(f) for f in range(bodies)])
        field = self.grid.field[slot]
        return np.where(stiff[field], field, bodies + slot)

    def movers(self, velocity: Float[np.ndarray, "A 3"]) -> contact_impulses.Movers:
        """Everything that an impulse can move, with its velocity after forces."""
        bodies = len(self.problem.bodies)
        still = np.zeros((len(self.problem.planes), 3))
        stiff = np.array([self.is_rigid(b) for b in range(bodies)])
        # A body with prescribed motion is as heavy as a wall.
        free = stiff & [body.path is None for body in self.problem.bodies]
        inertia = np.zeros((self.wall_mover + len(still), 3, 3))
        inertia[:bodies] = np.where(free[:, None, None], self.state.inverse_inertia(self.matter), 0.0)
        spin = np.zeros((self.wall_mover + len(still), 3))
        spin[:bodies] = np.where(stiff[:, None], self.state.spin(self.matter), 0.0)
        light = np.where(self.mass > 0.0, 1.0 / np.maximum(self.mass, TINY_DOUBLE), 0.0)
        movers = contact_impulses.Movers(
            np.concatenate([np.where(free, 1.0 / self.matter.total, 0.0), light, still[:, 0]]),
            inertia,
            np.concatenate([self.state.centre, self.grid.index * self.problem.cell, still]),
            np.concatenate([self.state.speed, velocity, still]),
            spin,
        )
        for composite in self.composites:
            composite.act(movers)
        return movers

    def movers_before_forces(self) -> contact_impulses.Movers:
        """Everything that an impulse can move, with the velocity it had as the step began."""
        movers = self.movers(self.old)
        for b in filter(self.is_rigid, range(len(self.problem.bodies))):
            movers.velocity[b] -= self.kick[b]
        return movers


def friction_table(problem: Problem) -> Float[np.ndarray, "N N"]:
    """μ of every pair; a single field has the mean of its bodies against a plane."""
    friction = np.array(problem.friction, dtype=np.float64)
    if problem.contact == "single":
        bodies = len(problem.bodies)
        friction[:bodies, bodies:] = friction[:bodies, bodies:].mean(axis=0, keepdims=True)
    return friction


@dataclass(frozen=True)
class PossibleContacts:
    """Some possible contacts of one pair; E of them."""

    pair: tuple[int, int]
    """Two bodies, or a body and B + plane."""
    a: Int[np.ndarray, " E"]
    c: Int[np.ndarray, " E"]
    point: Float[np.ndarray, "E 3"]
    normal: Float[np.ndarray, "E 3"]
    gap: Float[np.ndarray, " E"]
    slips: Bool[np.ndarray, " E"] | None = None
    """Which of them transmit no friction; None: all do."""
    layer: Float[np.ndarray, "E 4"] | None = None
    """Where a wall drags on a liquid that sticks: see ``contact_impulses.Contacts``."""
    kept: NormalCache = field(default_factory=NormalCache.none)
    """Candidate normals that were taken, where they are kept."""
    instead: Float[np.ndarray, " E"] | None = None
    """Of what is round on what is curved: nodes nearer than this transmit nothing [m] …"""
    inward: Float[np.ndarray, " E"] | None = None
    """… and the speed at which a way straight ahead leads into a hollow within a step [m/s]."""
    rolls: int = -1
    """The body whose surface points they are; -1: they are on nodes."""
    corner: Bool[np.ndarray, " E"] | None = None
    """Which of these points are not round; None: all are."""
    acts: Float[np.ndarray, "E 3"] | None = None
    """Where each acts [m], which is beyond no edge; None: at its point."""

    @property
    def placed(self) -> "PossibleContacts":
        """The same, each at the place where it acts."""
        return self if self.acts is None else replace(self, point=self.acts, acts=None)

    @property
    def grips(self) -> Float[np.ndarray, " E"]:
        """Share of the pair's friction that each transmits [-]."""
        return np.ones(len(self.gap)) if self.slips is None else 1.0 - self.slips

    @property
    def rounds(self) -> Bool[np.ndarray, " E"]:
        """At which of them something round may roll."""
        on_points = np.full(len(self.gap), self.rolls >= 0)
        return on_points if self.corner is None else on_points & ~self.corner

    @property
    def inwards(self) -> Float[np.ndarray, " E"]:
        """Speed at which each would close within the step by going straight ahead [m/s]."""
        return np.zeros(len(self.gap)) if self.inward is None else self.inward

    @property
    def layers(self) -> Float[np.ndarray, "E 4"]:
        """The layer of each, without a span where none drags."""
        return np.zeros((len(self.gap), 4)) if self.layer is None else self.layer

"""Interface of engines: the problem, and the results."""

from collections.abc import Collection
from dataclasses import dataclass, field
from itertools import combinations
from typing import Literal, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.core.types import CURVATURE_COLUMNS, Keyframes, Push, Vector, Wind
from corporeal.mpm.constants import COURANT, GRAVITY


@dataclass(frozen=True)
class WindFaces:
    """Where a body meets the air; A faces."""

    area: Float[np.ndarray, "A 3"]
    """Outward area vectors at rest [m²]; a sheet has one for each side."""
    particle: Int[np.ndarray, " A"]
    """Which of the body's particles each face moves with."""


@dataclass(frozen=True)
class WettedSurface:
    """Where liquids touch a rigid body, inside of it too where it is hollow; N points."""

    point: Float[np.ndarray, "N 3"]
    """[m]"""
    normal: Float[np.ndarray, "N 3"]
    """Unit, out of the material."""


NO_WIND_FACES = WindFaces(np.zeros((0, 3)), np.zeros(0, np.int64))


@dataclass(frozen=True)
class Tether:
    """Damped springs from a body's particles to where they started on a rigid body.

    At the start they bear their particles' weight, so that nothing sags.
    """

    holder: int
    """Which body, a rigid one."""
    rate: Float[np.ndarray, " P"]
    """Natural angular frequency of each particle on its spring [rad/s]; 0: it is free."""
    damping: float
    """Damping ratio ζ [-]."""


@dataclass(frozen=True)
class Joint:
    """Two rigid bodies that share a point and turn about it against a damped spring."""

    first: int
    second: int
    point: tuple[float, float, float]
    """Where, at the start [m]."""
    stiffness: float
    """[N m/rad]"""
    damping: float
    """[N m s/rad]"""


@dataclass(frozen=True)
class Shell:
    """Thin parts of a body at their true thickness: T triangles of its middle surface, whose vertices are particles.

    Forces are those of the triangles (``mpm.shells``). Particles that are vertices have the shell's mass and no stress
    of their own: their E and ν are not used.
    """

    triangle: Int[np.ndarray, "T 3"]
    """Numbers of the body's particles."""
    thickness: Float[np.ndarray, " T"]
    """[m]"""
    law: Int[np.ndarray, " T"]
    """``types.Law`` values."""
    young_pa: Float[np.ndarray, " T"]
    """E in bending [Pa]."""
    membrane_young_pa: Float[np.ndarray, " T"]
    """E in the plane [Pa]: below the measured one where the step budget does not allow that."""
    poisson: Float[np.ndarray, " T"]
    yield_stress: Float[np.ndarray, " T"]
    """[Pa]; unused by laws without it."""
    hardening: Float[np.ndarray, " T"]
    """H [Pa]"""
    loss: Float[np.ndarray, " T"]
    """tan δ [-] around ``vibration``."""
    vibration: Float[np.ndarray, " T"]
    """Angular frequency of the slowest vibration [rad/s]; unused without loss."""


@dataclass(frozen=True)
class Body:
    """One object: particles that share a velocity field; P particles, S surface points."""

    name: str
    position: Float[np.ndarray, "P 3"]
    """[m]"""
    velocity: Float[np.ndarray, "P 3"]
    """[m/s]"""
    volume: Float[np.ndarray, " P"]
    """Rest volume [m³]."""
    density: Float[np.ndarray, " P"]
    """[kg/m³]"""
    law: Int[np.ndarray, " P"]
    """``types.Law`` values."""
    young_pa: Float[np.ndarray, " P"]
    """Young's modulus E as simulated [Pa]; the solver knows no other."""
    poisson: Float[np.ndarray, " P"]
    yield_stress: Float[np.ndarray, " P"]
    """Von Mises yield stress [Pa]; unused by laws without it."""
    hardening: Float[np.ndarray, " P"]
    """Linear isotropic hardening modulus H [Pa]."""
    friction_angle: Float[np.ndarray, " P"]
    """Drucker–Prager friction angle φ [rad]."""
    cohesion: Float[np.ndarray, " P"]
    """Drucker–Prager cohesion c [Pa]."""
    loss: Float[np.ndarray, " P"]
    """Loss factor tan δ [-] around ``vibration``; E is what is resisted slowly."""
    vibration: Float[np.ndarray, " P"]
    """Angular frequency of the slowest vibration [rad/s]; unused without loss."""
    consistency: Float[np.ndarray, " P"] | None = None
    """K_c of a liquid, its viscosity where n is 1 [Pa sⁿ]; None: it is no liquid."""
    flow_index: Float[np.ndarray, " P"] | None = None
    """n of a liquid [-]; None: 1."""
    rigid: bool = False
    """Six degrees of freedom; the elastic fields are then unused."""
    shell: Shell | None = None
    """Its thin parts."""
    surface: Float[np.ndarray, "S 3"] = field(default_factory=lambda: np.zeros((0, 3)))
    """Points on the surface [m]: a rigid body touches planes through them."""
    curvature: Float[np.ndarray, "S2 Columns"] = field(default_factory=lambda: np.zeros((0, CURVATURE_COLUMNS)))
    """How the surface curves at those points, see ``types.CURVATURE_COLUMNS``; none: they are corners."""
    wetted_surface: WettedSurface | None = None
    """Of a rigid body: liquids touch it here; None: as everything else does."""
    push: Push | None = None
    wind: Wind | None = None
    faces: WindFaces = NO_WIND_FACES
    """Faces that the wind acts on."""
    tether: Tether | None = None
    path: Keyframes | None = None
    """Prescribed motion, of a rigid body: nothing that it meets can move it."""
    pivot: Vector = (0.0, 0.0, 0.0)
    """Where the point that the path tells of, and about which it turns, is at the start [m]."""


@dataclass(frozen=True)
class Plane:
    """The floor or a wall: free space is where normal · x > offset."""

    normal: tuple[float, float, float]
    """Unit, out of the wall into free space."""
    offset: float
    """[m]"""


FLOOR = Plane((0.0, 0.0, 1.0), 0.0)


@dataclass(frozen=True)
class Problem:
    """Bodies, what they may touch, and the forces; nothing in it tunes.

    B bodies, W planes, BW = B + W.
    """

    bodies: tuple[Body, ...]
    cell: float
    """Grid spacing dx [m]."""
    friction: Float[np.ndarray, "BW BW"]
    """Coulomb μ of every pair: bodies first, then planes. Symmetric."""
    restitution: Float[np.ndarray, "BW BW"]
    """Newton's e, used only where rigid meets rigid or a plane. Symmetric."""
    planes: tuple[Plane, ...] = (FLOOR,)
    gravity: tuple[float, float, float] = (0.0, 0.0, -GRAVITY)
    """[m/s²]"""
    gravity_ramp: float = 0.0
    """Gravity grows linearly to its full value over this time [s]."""
    contact: Literal["multi", "single"] = "multi"
    """One velocity field per body, or the control: one for all, which glues what touches."""
    transfer: Literal["apic", "flip"] = "flip"
    """APIC, or affine FLIP that forgets at each body's own wave speed."""
    courant: float = COURANT
    """Largest fraction of a cell that a wave may cross in one step."""
    bonds: tuple[tuple[int, int], ...] = ()
    """Rigid inclusions: (inclusion, soft), a rigid and a deformable body of one object. The first holds what of the
    soft body lies inside it, and the two are never in contact."""
    joints: tuple[Joint, ...] = ()
    """Between rigid bodies."""
    excluded_pairs: tuple[tuple[int, int], ...] = ()
    """Bodies of one object that are never in contact with each other."""
    rolling_resistance: Float[np.ndarray, "BW BW"] | None = None
    """c of every pair [m]: what is round and rigid is met by a moment of up to c N against rolling on planes and rigid
    bodies. Symmetric; None: nothing brakes what rolls."""
    restitution_law: Float[np.ndarray, "BW BW 5"] | None = None
    """How e of every pair changes with the speed of an impact: at which it is ``restitution`` [m/s], slope [s/m],
    exponent [-], least and most: see ``physics.impact_support.restitution_at_speed``. None: it is the same at all
    speeds.
    """

    @property
    def all_excluded_pairs(self) -> tuple[tuple[int, int], ...]:
        """Pairs without contact: what is bonded or apart, and two prescribed motions."""
        prescribed = [b for b, body in enumerate(self.bodies) if body.path is not None]
        return (*self.bonds, *self.excluded_pairs, *combinations(prescribed, 2))

    @property
    def restitution_law_of_pair(self) -> Float[np.ndarray, "BW BW 5"]:
        """``restitution_law``, or that no restitution changes."""
        if self.restitution_law is not None:
            return np.asarray(self.restitution_law, float)
        return np.tile([1.0, 0.0, 0.0, 0.0, 1.0], (*np.shape(self.restitution), 1))

    @property
    def has_rolling_resistance(self) -> bool:
        """Whether anything brakes what rolls."""
        return self.contact == "multi" and self.rolling_resistance is not None and bool(self.rolling_resistance.any())


@dataclass(frozen=True)
class Snapshot:
    """Every particle now; bodies in the problem's order, particles in the body's order."""

    time: float
    """[s]"""
    position: Float[np.ndarray, "P 3"]
    """[m]"""
    velocity: Float[np.ndarray, "P 3"]
    """[m/s]"""
    deformation: Float[np.ndarray, "P 3 3"]
    """Elastic deformation gradient F [-]; the rotation of a rigid body."""
    motion: Float[np.ndarray, "P 3 3"]
    """Total deformation gradient, plastic part included [-]: what a picture of the body follows."""
    plastic_strain: Float[np.ndarray, " P"]
    """Accumulated equivalent plastic strain [-]."""


@dataclass(frozen=True)
class Diagnostics:
    """The ledger now. Work and impulses are accumulated since time 0."""

    time: float
    """[s]"""
    mass: Float[np.ndarray, " B"]
    """[kg]"""
    centre: Float[np.ndarray, "B 3"]
    """Centre of mass [m]."""
    momentum: Float[np.ndarray, "B 3"]
    """[kg m/s]"""
    angular_momentum: Float[np.ndarray, "B 3"]
    """About the origin, affine part included [kg m²/s]."""
    kinetic: Float[np.ndarray, " B"]
    """½ Σ m (|v|² + dx²/4 ‖C‖²) [J]."""
    elastic: Float[np.ndarray, " B"]
    """[J]"""
    potential: Float[np.ndarray, " B"]
    """-m g · x, with the full gravity [J]."""
    speed: float
    """Largest particle speed [m/s]."""
    external_impulse: Float[np.ndarray, "B 3"]
    """Of gravity, pushes, wind and what moves a body along a path [N s]."""
    plane_impulse: Float[np.ndarray, "W B 3"]
    """Of plane w on body b [N s]."""
    pair_impulse: Float[np.ndarray, "B B"]
    """Sum of normal impulse magnitudes between two bodies [N s]. Symmetric."""
    push_work: float
    """Of pushes, wind and what moves a body along a path [J]; gravity's is in ``potential``."""
    friction_loss: float
    """[J]"""
    impact_loss: float
    """Taken by normal contact: by restitution of what is rigid, and of what is soft by the nodes of the grid, whose
    mass stops at once [J]."""
    impact_of_pair: Float[np.ndarray, "B+W B+W"]
    """The same of each pair, symmetric [J]; below 0: contact gave it energy."""
    plastic_loss: float
    """[J]"""
    viscous_loss: float
    """[J]"""
    first_contact: Float[np.ndarray, "B+W B+W"]
    """Time of the first impulse of each pair [s]; nan: none yet."""
    last_contact: Float[np.ndarray, "B+W B+W"]
    """Time of the latest impulse of each pair [s]; nan: none yet."""
    contact_point: Float[np.ndarray, "B+W B+W 3"]
    """Where each pair first touched: impulse-weighted mean of that step's nodes [m]; nan: none."""
    lost: Bool[np.ndarray, " P"]
    """Particles that are not finite or left the domain."""


@dataclass
class StepStatistics:
    """How time was cut."""

    count: int = 0
    smallest: float = float("inf")
    """[s]"""
    largest: float = 0.0
    """[s]"""


@dataclass(frozen=True)
class BodySplit:
    """Which body becomes several, and how."""

    body: int
    """Its first piece keeps its number, the others come after all bodies there are."""
    piece: Int[np.ndarray, " P"]
    """Which piece each of its particles belongs to."""
    position: Float[np.ndarray, "P 3"]
    """Of its particles now [m]."""
    velocity: Float[np.ndarray, "P 3"]
    """[m/s]"""
    surfaces: tuple[Float[np.ndarray, "_ 3"], ...]
    """Points on the surface of each piece, now [m]."""

    @property
    def count(self) -> int:
        """Number of pieces."""
        return len(self.surfaces)


@runtime_checkable
class Engine(Protocol):
    """What every solver of one problem does.

    Its class is called with the problem and with ``threads``, how many threads it may use on the CPU (None: as it
    likes), and is listed in ``ENGINES``. What only some engines can do follows as protocols of methods alone;
    ``engines.require`` asks for them.
    """

    name: str
    """Its key in ``ENGINES``."""
    problem: Problem
    """What it solves now."""
    steps: StepStatistics

    @property
    def time(self) -> float:
        """Simulated time so far [s]."""
        ...

    def advance(self, until: float) -> None:
        """Step until exactly ``until`` [s], choosing steps by stability.

        Raises:
            SimulationError: A particle is not finite or left the domain; the message says which body, when, and what to
                do. The state is that of the last good check.
        """
        ...

    def stable_step(self) -> float:
        """Largest stable step now [s]."""
        ...

    def step(self, dt: float) -> None:
        """Take one step of dt [s]."""
        ...

    def snapshot(self) -> Snapshot:
        """Copy every particle's state."""
        ...

    def measure(self) -> Diagnostics:
        """Add up the ledger."""
        ...

    def save(self) -> dict[str, np.ndarray]:
        """Everything needed to go on later exactly as if nothing had happened."""
        ...

    def restore(self, saved: dict[str, np.ndarray]) -> None:
        """Go on from what ``save`` returned, on an engine built from the same problem."""
        ...

    def stop(self, bodies: Collection[int]) -> None:
        """Take all motion out of some bodies; nothing of it is booked."""
        ...

    def start_from(self, saved: dict[str, np.ndarray], bodies: Collection[int]) -> None:
        """Put some bodies, before the first step, where they were in another engine's ``save``.

        A warm start: place, strain and history are taken over; how they move is what the problem says. Both engines'
        problems have the same bodies but for velocities and forces.
        """
        ...


@runtime_checkable
class InteractiveEngine(Protocol):
    """An engine whose bodies can be touched from outside between two advances.

    A touch reaches the particles within two cells of a point, less with the distance; of a rigid body it is exact. It
    is in the ledger as external impulse and work, but not in what ``save`` keeps.
    """

    def apply_impulse(self, body: int, point: Vector, impulse: Vector) -> None:
        """Give a body an impulse [N s] at a point [m] at once.

        Raises:
            UserError: There is no such body, or something is not finite.
        """
        ...

    def attach_spring(self, body: int, point: Vector | None, target: Vector, stiffness: float) -> None:
        """Pull on a body by a damped spring until released.

        Args:
            body: Which.
            point: Where to take hold of it [m]; None: where it is held already.
            target: Where to [m].
            stiffness: Of the spring [N/m]; 0 lets go.

        Raises:
            UserError: There is no such body, it is not held, or something is not finite.
        """
        ...

    def grip_point(self, body: int, position: Float[np.ndarray, "P 3"]) -> Float[np.ndarray, "3"] | None:
        """Where a body is held now [m]; None: it is not held.

        Args:
            body: Which.
            position: Of all particles, as ``snapshot`` gives it now [m].
        """
        ...


@runtime_checkable
class VariableLoadEngine(Protocol):
    """An engine whose gravity and winds can be changed between two advances."""

    def set_gravity(self, gravity: Vector) -> None:
        """Let gravity be another from now on [m/s²]; what that adds to the potential is work.

        Raises:
            UserError: It is not finite.
        """
        ...

    def set_wind(self, body: int, wind: Vector) -> None:
        """Let the air about a body move with a velocity from now on [m/s].

        Raises:
            UserError: There is no such body, it was given no faces for the wind, or the velocity
                is not finite.
        """
        ...


@runtime_checkable
class BodyAddingEngine(Protocol):
    """An engine whose problem can get more bodies between two advances."""

    def with_added_bodies(self, problem: Problem) -> Engine:
        """Return an engine that goes on from here with more bodies; nothing changes for the others.

        Gravity, winds and what is held stay as they are. The potential energy of the new bodies is booked as work from
        outside.

        Args:
            problem: With the new bodies, as they start, after all others.
        """
        ...


@runtime_checkable
class BodySplittingEngine(Protocol):
    """An engine whose rigid bodies can break into rigid pieces between two advances.

    When and into what is decided outside, from ``snapshot`` and the first contacts of ``measure``.
    """

    def with_split_body(self, split: BodySplit) -> Engine:
        """Return an engine that goes on from here with a body in pieces.

        Mass, momentum and the books are shared out among them (``splitting``). What held the body lets go.
        """
        ...


ENGINES = {
    "cpu": "corporeal.mpm.cpu.engine:CpuEngine",
    "cuda": "corporeal.mpm.cuda.engine:CudaEngine",
    "reference": "corporeal.mpm.reference.engine:ReferenceEngine",
}

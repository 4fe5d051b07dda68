"""Tables of bodies for native code: particles, materials and rigid states."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from corporeal.mpm import laws
from corporeal.mpm.constants import BRANCHES
from corporeal.mpm.cpu import layout
from corporeal.mpm.cpu.contact_memory import write_pointers
from corporeal.mpm.cpu.layout import (
    BOND_RECORD,
    BRANCH_TIME,
    BULK,
    CENTRE,
    CHANNELS,
    CONSISTENCY,
    GRIP_RECORD,
    ID,
    INERTIA,
    INVERSE_MASS,
    JOINT_RECORD,
    MA,
    MATERIAL_COLUMNS,
    MOMENT,
    MT,
    RADIUS,
    REST_INERTIA,
    REST_INVERSE_INERTIA,
    RIGID_STATE_COLUMNS,
    SHEAR,
    SPEED,
    SPIN,
    STIFFENING,
    TETHER_RECORD,
    TURN,
    VE,
    VO,
    WIND_RECORD,
)
from corporeal.mpm.material_table import MaterialTable
from corporeal.mpm.physics import rigid, wind_pressure
from corporeal.mpm.physics.inclusions import inclusion_and_soft_density, inclusion_particles_near
from corporeal.mpm.physics.spring_grips import Grip
from corporeal.mpm.problem import Body, Joint, Problem

GUST_SIGNAL = np.stack([wind_pressure.GUST_SHARE, wind_pressure.GUST_FREQUENCY, wind_pressure.GUST_PHASE])
"""Of the gusts: share, frequency [Hz] and phase [rad] of every part."""


class WindRecords:
    """Records of the bodies in the wind, and the arrays that they point to."""

    def __init__(
        self,
        problem: Problem,
        first: list[int],
        impulse: np.ndarray,
        rigid: dict[int, np.ndarray],
        points: dict[int, np.ndarray],
    ) -> None:
        """Lay out memory.

        Args:
            problem: What to simulate.
            first: Number of each body's first particle.
            impulse: The ledger's external impulses, which the native piece adds to.
            rigid: States of the rigid bodies.
            points: Particles of the rigid bodies in their own frames.
        """
        windy = [b for b, body in enumerate(problem.bodies) if body.wind and len(body.faces.area)]
        self.body = windy
        self.record = np.zeros(len(windy), WIND_RECORD.dtype)
        self.kept: list[np.ndarray] = [np.ascontiguousarray(GUST_SIGNAL)]
        single = problem.contact == "single"
        for row, b in zip(range(len(windy)), windy, strict=True):
            record = self.record[row : row + 1]
            self._face(record, problem.bodies[b])
            write_pointers(record, impulse=impulse[b], signal=self.kept[0])
            record["field"], record["first"] = 0 if single else b, first[b]
            if b in rigid:
                self.kept.append(np.ascontiguousarray(points[b]))
                write_pointers(record, rigid=rigid[b], point=self.kept[-1])
                record["free"] = not single

    def _face(self, record: np.ndarray, body: Body) -> None:
        assert body.wind is not None
        count = len(body.position)
        order = np.argsort(body.faces.particle, kind="stable")
        area = np.ascontiguousarray(body.faces.area[order], np.float64)
        owned = np.bincount(body.faces.particle, minlength=count)
        face = np.concatenate([[0], np.cumsum(owned)]).astype(np.int32)
        self.kept += [area, face]
        write_pointers(record, area=area, face=face)
        record["count"], record["wind"] = count, body.wind.velocity
        record["gust"] = body.wind.gust
        record["start"], record["end"] = body.wind.start, body.wind.end
        record["half_rho_c"] = wind_pressure.HALF_RHO_C

    def set_wind(self, problem: Problem) -> None:
        """Take the winds of a problem that differs in nothing else."""
        for row, b in enumerate(self.body):
            moving = problem.bodies[b].wind
            assert moving is not None
            self.record["wind"][row], self.record["gust"][row] = moving.velocity, moving.gust
            self.record["start"][row], self.record["end"][row] = moving.start, moving.end

    def take_work(self) -> float:
        """Work done since it was last taken [J]."""
        total = float(self.record["work"].sum())
        self.record["work"] = 0.0
        return total


@dataclass(frozen=True)
class FieldMaterials:
    """What the particles of one field are made of; M rows."""

    table: Float[np.ndarray, "M 32"]
    """Columns: see ``layout``."""
    body: Int[np.ndarray, " M"]
    """Whose each row is."""
    uses_mean_dilatation: bool
    """Whether pressure comes from the mean dilatation of clusters."""
    flows: bool
    """Whether any of it has a return map."""
    relaxes: bool
    """Whether any of it has Maxwell branches."""
    pours: bool
    """Whether any of it is a liquid."""

    @classmethod
    def of(cls, substances: MaterialTable) -> "FieldMaterials":
        """Write the rows that native pieces read."""
        s = substances
        table = np.zeros((len(s.body), MATERIAL_COLUMNS), np.float32)
        none = np.zeros(len(s.body))
        numbers = (s.mu, s.lam, s.yield_stress, s.hardening, s.cone, s.apex, none, s.flow_index)
        table[:, :SHEAR] = np.column_stack([s.law, *numbers, s.flip_damping_rate, s.density, s.rigid | s.shell])
        table[:, CONSISTENCY] = s.consistency
        table[:, STIFFENING] = s.stiffening**2
        branches = s.branches
        for first, column in ((SHEAR, branches.shear), (BULK, branches.bulk), (BRANCH_TIME, branches.time)):
            table[:, first : first + BRANCHES] = column
        kinds = (bool(s.uses_mean_dilatation.all()), bool(s.flows.any()), bool(s.relaxes.any()))
        pours = bool(np.isin(s.law, laws.LIQUID_LAWS).any() and not s.rigid.all())
        return cls(table, s.body, *kinds, pours)


def particle_rows(problem: Problem, bodies: list[int], first: list[int], kind: np.ndarray) -> np.ndarray:
    """Channels of some bodies' particles at rest, (P, CHANNELS); places are filled in later."""
    parts = [problem.bodies[b] for b in bodies]
    rows = np.zeros((len(kind), CHANNELS), np.float32)
    volume = np.concatenate([b.volume for b in parts])
    rows[:, VE : VE + 3] = np.concatenate([b.velocity for b in parts])
    rows[:, MA] = volume * np.concatenate([b.density for b in parts])
    rows[:, VO] = volume
    rows[:, MT] = kind.view(np.float32)
    number = np.concatenate([first[b] + np.arange(len(p.position)) for b, p in zip(bodies, parts, strict=True)])
    rows[:, ID] = number.astype(np.int32).view(np.float32)
    return rows


def rigid_state(body: Body) -> np.ndarray:
    """State of a rigid body from its particles."""
    weight = body.volume * body.density
    mass = rigid.mass_and_inertia(body.position, weight, body.volume)
    speed, moment = rigid.fit_motion(mass, body.position, weight, body.velocity)
    state = np.zeros(RIGID_STATE_COLUMNS)
    state[0], state[CENTRE : CENTRE + 3] = mass.total, mass.centre
    state[TURN : TURN + 9] = np.eye(3).ravel()
    state[REST_INVERSE_INERTIA : REST_INVERSE_INERTIA + 9] = np.linalg.inv(mass.inertia).ravel()
    state[SPEED : SPEED + 3], state[MOMENT : MOMENT + 3] = speed, moment
    state[INERTIA : INERTIA + 9] = state[REST_INVERSE_INERTIA : REST_INVERSE_INERTIA + 9]
    state[SPIN : SPIN + 3] = np.linalg.inv(mass.inertia) @ moment
    points = np.concatenate([body.position, body.surface.reshape(-1, 3)])
    state[INVERSE_MASS] = 1.0 / mass.total
    if body.path is not None:
        state[INVERSE_MASS], state[INERTIA : INERTIA + 9] = 0.0, 0.0
        state[REST_INERTIA : REST_INERTIA + 9] = mass.inertia.ravel()
    state[RADIUS] = np.linalg.norm(points - mass.centre, axis=1).max()
    return state


def rigid_body(state: np.ndarray, start: np.ndarray, points: np.ndarray) -> rigid.RigidBody:
    """Read a rigid state."""
    return rigid.RigidBody(
        mass=float(state[0]),
        centre=state[CENTRE : CENTRE + 3],
        rotation=state[TURN : TURN + 9].reshape(3, 3),
        velocity=state[SPEED : SPEED + 3],
        angular_momentum=state[MOMENT : MOMENT + 3],
        spin=state[SPIN : SPIN + 3],
        start=start[CENTRE : CENTRE + 3],
        arm=points[:, :3],
    )


def set_rigid_motion(state: np.ndarray, speed: np.ndarray, moment: np.ndarray) -> None:
    """Write velocity [m/s], angular momentum [kg m²/s] and the spin that follows from it."""
    turn, inverse = (state[k : k + 9].reshape(3, 3) for k in (TURN, REST_INVERSE_INERTIA))
    state[SPEED : SPEED + 3], state[MOMENT : MOMENT + 3] = speed, moment
    state[SPIN : SPIN + 3] = turn @ inverse @ turn.T @ moment


def bond_records(problem: Problem) -> tuple[np.ndarray, list[np.ndarray]]:
    """Native records of the bonds, and each frame's points near what it holds, in its own frame.

    A point is place [m] and volume [m³]. Where held nodes are kept is filled in later.
    """
    pairs = problem.bonds if problem.contact == "multi" else ()
    rows, points = np.zeros(len(pairs), BOND_RECORD.dtype), []
    for row, (f, s) in zip(rows, pairs, strict=True):
        frame, soft = problem.bodies[f], problem.bodies[s]
        stiff, held = inclusion_and_soft_density(frame, soft, problem.cell)
        mass, chosen = (frame.volume * frame.density, inclusion_particles_near(frame, soft, problem.cell))
        place = frame.position - mass @ frame.position / mass.sum()
        points.append(np.column_stack([place, mass / stiff])[chosen])
        row["point"], row["points"] = points[-1].ctypes.data, len(points[-1])
        row["per_soft"], row["frame"], row["soft"] = 1.0 / held, f, s
    return rows, points


def rigid_points(body: Body, state: np.ndarray) -> np.ndarray:
    """Particles in the body's frame: place [m], mass [kg], volume [m³]."""
    place = body.position - state[CENTRE : CENTRE + 3]
    return np.column_stack([place, body.volume * body.density, body.volume])


class SpringRecords:
    """Records of a problem's springs, and the arrays that they point to."""

    def __init__(self, problem: Problem, first: list[int], impulse: np.ndarray, rigid: dict[int, np.ndarray]) -> None:
        """Lay out memory.

        Args:
            problem: What to simulate; in a field that all share no springs act.
            first: Number of each body's first particle.
            impulse: The ledger's external impulses, which grips add to.
            rigid: States of the rigid bodies.
        """
        self.problem, self.first, self.impulse, self.rigid = problem, first, impulse, rigid
        self.start = {b: rigid_state(problem.bodies[b]) for b in rigid}
        self.kept: list[np.ndarray] = []
        apart = problem.contact == "multi"
        tied = [(b, body) for b, body in enumerate(problem.bodies) if body.tether and apart]
        joints = problem.joints if apart else ()
        self.tether, self.joint = (np.zeros(len(tied), TETHER_RECORD.dtype), np.zeros(len(joints), JOINT_RECORD.dtype))
        self.grip = np.zeros(0, GRIP_RECORD.dtype)
        for row, (b, body) in enumerate(tied):
            self._tie(self.tether[row : row + 1], b, body)
        for row, joint in enumerate(joints):
            self._join(self.joint[row], joint)

    def _tie(self, record: np.ndarray, b: int, body: Body) -> None:
        assert body.tether is not None
        holder = body.tether.holder
        centre = self.start[holder][layout.CENTRE : layout.CENTRE + 3]
        anchor = np.ascontiguousarray(body.position - centre, np.float64)
        rate = np.ascontiguousarray(body.tether.rate, np.float64)
        self.kept += [anchor, rate]
        write_pointers(record, anchor=anchor, rate=rate, holder=self.rigid[holder])
        record["damping"], record["field"] = body.tether.damping, b
        record["first"], record["count"] = self.first[b], len(rate)

    def _join(self, record: np.ndarray, joint: Joint) -> None:
        for name, b in (("first", joint.first), ("second", joint.second)):
            record[name] = self.rigid[b].ctypes.data
            centre = self.start[b][layout.CENTRE : layout.CENTRE + 3]
            record[f"arm_{name}"] = np.array(joint.point) - centre
        record["stiffness"], record["damping"] = joint.stiffness, joint.damping

    def grasp(self, grips: dict[int, Grip]) -> None:
        """Take these grips in place of all earlier ones; by body."""
        self.grip = np.zeros(len(grips), GRIP_RECORD.dtype)
        single = self.problem.contact == "single"
        self.held: list[np.ndarray] = []
        for row, (b, grip) in enumerate(grips.items()):
            record = self.grip[row : row + 1]
            share = np.zeros(len(self.problem.bodies[b].position))
            write_pointers(record, impulse=self.impulse[b])
            if b in self.rigid and not single:
                write_pointers(record, rigid=self.rigid[b])
            else:
                share[grip.hold.particle] = grip.hold.share
            self.held.append(share)
            write_pointers(record, share=share)
            record["arm"], record["target"] = grip.hold.arm, grip.target
            record["stiffness"], record["damping"] = grip.stiffness, grip.damping
            record["mass"], record["field"] = grip.hold.mass, 0 if single else b
            record["first"], record["count"] = self.first[b], len(share)

    def connect(self, world: np.ndarray) -> None:
        """Point the world to the records."""
        write_pointers(world, tether=self.tether, joint=self.joint, grip=self.grip)
        counts = len(self.tether), len(self.joint), len(self.grip)
        world["tethers"], world["joints"], world["grips"] = counts
        world["sprung"] = int(any(counts))

    def take_loss(self) -> float:
        """Return what dampers took since last asked [J]."""
        total = float(self.tether["lost"].sum() + self.joint["lost"].sum())
        self.tether["lost"] = self.joint["lost"] = 0.0
        return total

    def take_work(self) -> float:
        """Return the work that grips did since last asked [J]."""
        total = float(self.grip["work"].sum())
        self.grip["work"] = 0.0
        return total

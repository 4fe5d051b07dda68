"""Tables of bodies for native code: particles, materials and rigid states."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from corporeal.mpm import laws
from corporeal.mpm.constants import BRANCHES
from corporeal.mpm.cpu.layout import (
    BOND_RECORD,
    BRANCH_TIME,
    BULK,
    CENTRE,
    CHANNELS,
    CONSISTENCY,
    ID,
    INERTIA,
    INVERSE_MASS,
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
    TURN,
    VE,
    VO,
)
from corporeal.mpm.material_table import MaterialTable
from corporeal.mpm.physics import rigid
from corporeal.mpm.physics.inclusions import inclusion_and_soft_density, inclusion_particles_near
from corporeal.mpm.problem import Body, Problem


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
        table[:, :SHEAR] = np.column_stack(
            [s.law, *numbers, s.flip_damping_rate, s.density, s.rigid]
        )
        table[:, CONSISTENCY] = s.consistency
        table[:, STIFFENING] = s.stiffening**2
        branches = s.branches
        for first, column in (
            (SHEAR, branches.shear),
            (BULK, branches.bulk),
            (BRANCH_TIME, branches.time),
        ):
            table[:, first : first + BRANCHES] = column
        kinds = (bool(s.uses_mean_dilatation.all()), bool(s.flows.any()), bool(s.relaxes.any()))
        pours = bool(np.isin(s.law, laws.LIQUID_LAWS).any() and not s.rigid.all())
        return cls(table, s.body, *kinds, pours)


def particle_rows(
    problem: Problem, bodies: list[int], first: list[int], kind: np.ndarray
) -> np.ndarray:
    """Channels of some bodies' particles at rest, (P, CHANNELS); places are filled in later."""
    parts = [problem.bodies[b] for b in bodies]
    rows = np.zeros((len(kind), CHANNELS), np.float32)
    volume = np.concatenate([b.volume for b in parts])
    rows[:, VE : VE + 3] = np.concatenate([b.velocity for b in parts])
    rows[:, MA] = volume * np.concatenate([b.density for b in parts])
    rows[:, VO] = volume
    rows[:, MT] = kind.view(np.float32)
    number = np.concatenate(
        [first[b] + np.arange(len(p.position)) for b, p in zip(bodies, parts, strict=True)]
    )
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
    """Read a rigid state.

    Args:
        state: Now.
        start: The same body's at the start.
        points: What ``rigid_points`` gave.

    """
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
        mass, chosen = (
            frame.volume * frame.density,
            inclusion_particles_near(frame, soft, problem.cell),
        )
        place = frame.position - mass @ frame.position / mass.sum()
        points.append(np.column_stack([place, mass / stiff])[chosen])
        row["point"], row["points"] = points[-1].ctypes.data, len(points[-1])
        row["per_soft"], row["frame"], row["soft"] = 1.0 / held, f, s
    return rows, points


def rigid_points(body: Body, state: np.ndarray) -> np.ndarray:
    """Particles in the body's frame: place [m], mass [kg], volume [m³]."""
    place = body.position - state[CENTRE : CENTRE + 3]
    return np.column_stack([place, body.volume * body.density, body.volume])

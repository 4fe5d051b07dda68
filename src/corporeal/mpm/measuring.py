"""What the production engine shows of itself: snapshots and measures, in double precision."""

from typing import TYPE_CHECKING

import numpy as np

from corporeal.mpm import tables
from corporeal.mpm.kernels_read import SUMS
from corporeal.mpm.problem import Measure, Snapshot
from corporeal.mpm.springs import stored

if TYPE_CHECKING:
    from corporeal.mpm.warp import WarpEngine


def shown(engine: "WarpEngine") -> Snapshot:
    """Every particle now, in the problem's order."""
    count = engine.first[-1]
    position, velocity = np.zeros((count, 3)), np.zeros((count, 3))
    F, motion = np.zeros((count, 3, 3)), np.zeros((count, 3, 3))
    plastic = np.zeros(count)
    for f, window in engine.window.items():
        engine.reader.spread(
            window,
            engine.material[f],
            position=position,
            velocity=velocity,
            strain=F,
            motion=motion,
            plastic=plastic,
        )
    for b, state in engine.rigid.items():
        mine = slice(engine.first[b], engine.first[b + 1])
        Q = state[tables.TURN : tables.TURN + 9].reshape(3, 3)
        arm = engine.points[b][:, :3] @ Q.T
        position[mine] = state[tables.CENTRE : tables.CENTRE + 3] + arm
        spin = state[tables.SPIN : tables.SPIN + 3]
        velocity[mine] = state[tables.SPEED : tables.SPEED + 3] + np.cross(spin, arm)
        F[mine] = motion[mine] = Q
    return Snapshot(engine.time, position, velocity, F, motion, plastic)


def measured(engine: "WarpEngine") -> Measure:
    """Mass, momentum and energy of every body, and the ledger."""
    problem, book = engine.problem, engine.ledger
    rows = np.zeros((len(problem.bodies), SUMS))
    for f, window in engine.window.items():
        rows[engine.members[f]] = engine.reader.total(
            window, engine.material[f], engine.body_of_material[f] - engine.members[f][0]
        )
    for b, state in engine.rigid.items():
        rows[b] = _rigid_body(state, engine.points[b][:, :3])
    mass = np.array(engine.mass)
    centre = rows[:, :3] / mass[:, None]
    return Measure(
        time=engine.time,
        mass=mass,
        centre=centre,
        momentum=rows[:, 3:6],
        angular_momentum=rows[:, 6:9],
        kinetic=rows[:, 9],
        elastic=rows[:, 10] + _sprung(engine),
        potential=-mass * (centre @ np.array(problem.gravity)),
        speed=float(np.sqrt(rows[:, 11].max())),
        lost=engine.lost.copy(),
        external_impulse=book.external_impulse.copy(),
        plane_impulse=book.plane_impulse.copy(),
        pair_impulse=book.pair_impulse.copy(),
        push_work=float(book.push_work),
        friction_loss=float(book.friction_loss),
        plastic_loss=float(book.plastic_loss),
        viscous_loss=float(book.viscous_loss),
        first_contact=book.first_contact.copy(),
        last_contact=book.last_contact.copy(),
        contact_point=book.contact_point.copy(),
    )


def _sprung(engine: "WarpEngine") -> np.ndarray:
    """Energy in springs, per body [J]."""
    problem = engine.problem
    count = len(problem.bodies)
    if not problem.joints and all(body.tether is None for body in problem.bodies):
        return np.zeros(count)
    now, first = (np.zeros((count, tables.RIGID)) for _ in range(2))
    for b, rigid_state in engine.rigid.items():
        now[b], first[b] = rigid_state, engine.springs.start[b]
    centre = slice(tables.CENTRE, tables.CENTRE + 3)
    turn = now[:, tables.TURN : tables.TURN + 9].reshape(-1, 3, 3)
    return stored(problem, shown(engine).position, now[:, centre], turn, first[:, centre])


def _rigid_body(state: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Add up a rigid body, as ``kernels_read`` has them; its particles in its own frame."""
    mass, centre = state[0], state[tables.CENTRE : tables.CENTRE + 3]
    speed = state[tables.SPEED : tables.SPEED + 3]
    moment = state[tables.MOMENT : tables.MOMENT + 3]
    spin = state[tables.SPIN : tables.SPIN + 3]
    kinetic = 0.5 * mass * speed @ speed + 0.5 * spin @ moment
    about = np.cross(centre, mass * speed) + moment
    arm = points @ state[tables.TURN : tables.TURN + 9].reshape(3, 3).T
    fastest = np.sum((speed + np.cross(spin, arm)) ** 2, axis=1).max()
    return np.concatenate([mass * centre, mass * speed, about, [kinetic, 0.0, fastest]])

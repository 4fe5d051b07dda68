"""What the production engine shows of itself: snapshots and measures, in double precision."""

from typing import TYPE_CHECKING

import numpy as np

from corporeal.mpm import elasticity, tables
from corporeal.mpm.kernels import AF, DE, EP, TM, VE
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
    for window in engine.window.values():
        at = window.number
        position[at] = window.position() * engine.problem.cell
        velocity[at] = window.channel(VE, 3)
        F[at] = window.channel(DE, 9).reshape(-1, 3, 3) + np.eye(3)
        motion[at] = window.past(TM, 9).reshape(-1, 3, 3) + np.eye(3)
        plastic[at] = window.past(EP, 1)[:, 0]
    law = np.concatenate([body.law for body in engine.problem.bodies])
    flows = np.isin(law, tables.PLASTIC_LAWS)
    motion = np.where(flows[:, None, None], motion, F)
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
    state = shown(engine)
    affine = _affine(engine)
    rows = [_body(engine, state, affine, b) for b in range(len(problem.bodies))]
    mass, centre, momentum, angular, kinetic, elastic = (
        np.array(column) for column in zip(*rows, strict=True)
    )
    return Measure(
        time=engine.time,
        mass=mass,
        centre=centre,
        momentum=momentum,
        angular_momentum=angular,
        kinetic=kinetic,
        elastic=elastic + _sprung(engine, state),
        potential=-mass * (centre @ np.array(problem.gravity)),
        speed=float(np.linalg.norm(state.velocity, axis=1).max()),
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


def _sprung(engine: "WarpEngine", state: Snapshot) -> np.ndarray:
    """Energy in springs, per body [J]."""
    count = len(engine.problem.bodies)
    now, first = (np.zeros((count, tables.RIGID)) for _ in range(2))
    for b, rigid_state in engine.rigid.items():
        now[b], first[b] = rigid_state, engine.springs.start[b]
    centre = slice(tables.CENTRE, tables.CENTRE + 3)
    turn = now[:, tables.TURN : tables.TURN + 9].reshape(-1, 3, 3)
    return stored(engine.problem, state.position, now[:, centre], turn, first[:, centre])


def _affine(engine: "WarpEngine") -> np.ndarray:
    """C of every particle [1/s]; 0 where rigid."""
    out = np.zeros((engine.first[-1], 3, 3))
    for window in engine.window.values():
        out[window.number] = window.channel(AF, 9).reshape(-1, 3, 3) / engine.problem.cell
    return out


def _body(engine: "WarpEngine", state: Snapshot, affine: np.ndarray, b: int) -> tuple:
    body, cell = engine.problem.bodies[b], engine.problem.cell
    if b in engine.rigid:
        return _rigid_body(engine.rigid[b])
    mine = slice(engine.first[b], engine.first[b + 1])
    m = body.volume * body.density
    x, v, C = state.position[mine], state.velocity[mine], affine[mine]
    spread = 0.25 * cell**2
    turn = np.stack([C[:, 2, 1] - C[:, 1, 2], C[:, 0, 2] - C[:, 2, 0], C[:, 1, 0] - C[:, 0, 1]], 1)
    mu, lam = elasticity.lame(body.young, body.poisson)
    law = np.asarray(body.law, np.int64)
    stored = elasticity.psi(law, state.deformation[mine], np.asarray(mu), np.asarray(lam))
    return (
        m.sum(),
        m @ x / m.sum(),
        m @ v,
        np.cross(x, m[:, None] * v).sum(axis=0) + spread * (m @ turn),
        0.5 * float(m @ (np.sum(v * v, axis=1) + spread * np.sum(C * C, axis=(1, 2)))),
        float(body.volume @ stored),
    )


def _rigid_body(state: np.ndarray) -> tuple:
    mass, centre = state[0], state[tables.CENTRE : tables.CENTRE + 3].copy()
    speed = state[tables.SPEED : tables.SPEED + 3]
    moment = state[tables.MOMENT : tables.MOMENT + 3]
    spin = state[tables.SPIN : tables.SPIN + 3]
    kinetic = 0.5 * mass * speed @ speed + 0.5 * spin @ moment
    return mass, centre, mass * speed, np.cross(centre, mass * speed) + moment, kinetic, 0.0

"""What the device engine shows of itself: snapshots and measures, in double precision."""

from typing import TYPE_CHECKING

import numpy as np

from corporeal.mpm import elasticity, rigid
from corporeal.mpm.device_layout import PLASTIC, PUSHING, RUBBING, VISCOUS
from corporeal.mpm.matter import PLASTIC_LAWS, strain_energy
from corporeal.mpm.problem import Measure, Snapshot
from corporeal.mpm.springs import stored

if TYPE_CHECKING:
    from corporeal.mpm.device import DeviceEngine


def shown(engine: "DeviceEngine") -> Snapshot:
    """Every particle now, in the problem's order."""
    m, cell = engine.matter, engine.problem.cell
    count, p = len(m.mass), engine.arrays.particles
    at = p.number.numpy()[: p.count]

    def placed(values: np.ndarray) -> np.ndarray:
        out = np.zeros((count, *values.shape[1:]))
        out[at] = values[: p.count]
        return out

    position = placed(p.cell.numpy() + p.place.numpy().astype(np.float64)) * cell
    velocity = placed(p.velocity.numpy())
    F = placed(p.strain.numpy()) + np.eye(3)
    motion = placed(p.motion.numpy()) + np.eye(3)
    motion = np.where(np.isin(m.law, PLASTIC_LAWS)[:, None, None], motion, F)
    r = engine.arrays.rigid
    centre, turn = r.centre.numpy(), r.turn.numpy()
    speed, spin = r.speed.numpy(), r.spin.numpy()
    for b in np.flatnonzero(r.stiff.numpy()):
        mine = m.body == b
        arm = m.arm[mine] @ turn[b].T
        position[mine] = centre[b] + arm
        velocity[mine] = speed[b] + np.cross(spin[b], arm)
        F[mine] = motion[mine] = turn[b]
    return Snapshot(engine.time, position, velocity, F, motion, placed(p.plastic.numpy()))


def measured(engine: "DeviceEngine") -> Measure:
    """Mass, momentum and energy of every body, and the ledger."""
    m, s, state = engine.matter, engine.arrays.sheet, shown(engine)
    gradient = _affine(engine)
    spread = 0.25 * engine.problem.cell**2
    turn = np.stack([gradient[:, i, j] - gradient[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))], 1)
    square = np.sum(state.velocity**2, axis=1)
    F = state.deformation
    strained = strain_energy(m, F, _acting(engine, F, gradient))

    def per_body(values: np.ndarray) -> np.ndarray:
        out = np.zeros((len(engine.problem.bodies), *values.shape[1:]))
        np.add.at(out, m.body, values)
        return out

    p = m.mass[:, None]
    centre = per_body(p * state.position) / m.total[:, None]
    momentum = per_body(p * state.velocity)
    angular = per_body(p * (np.cross(state.position, state.velocity) + spread * turn))
    kinetic = per_body(0.5 * m.mass * (square + spread * np.sum(gradient**2, axis=(1, 2))))
    r = engine.arrays.rigid
    sprung = stored(engine.problem, state.position, r.centre.numpy(), r.turn.numpy(), m.centre)
    _enter_rigid(engine, centre, momentum, angular, kinetic)
    loss = s.loss.numpy().sum(axis=1)
    return Measure(
        time=engine.time,
        mass=m.total.copy(),
        centre=centre,
        momentum=momentum,
        angular_momentum=angular,
        kinetic=kinetic,
        elastic=per_body(strained) + sprung,
        potential=-m.total * (centre @ np.array(engine.problem.gravity)),
        speed=float(np.sqrt(square.max())),
        lost=engine.lost.copy(),
        external_impulse=s.external.numpy(),
        plane_impulse=s.plane_impulse.numpy()[: len(engine.problem.planes)],
        pair_impulse=s.pair_impulse.numpy(),
        push_work=float(loss[PUSHING]),
        friction_loss=float(loss[RUBBING]),
        plastic_loss=float(loss[PLASTIC]),
        viscous_loss=float(loss[VISCOUS]),
        first_contact=s.first_contact.numpy(),
        last_contact=s.last_contact.numpy(),
        contact_point=s.contact_point.numpy(),
    )


def _affine(engine: "DeviceEngine") -> np.ndarray:
    """C of every particle [1/s]; 0 where rigid."""
    p = engine.arrays.particles
    out = np.zeros((len(engine.matter.mass), 3, 3))
    out[p.number.numpy()[: p.count]] = p.affine.numpy()[: p.count] / engine.problem.cell
    return out


def _acting(engine: "DeviceEngine", F: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """Elastic Kirchhoff stress that acts on every particle [Pa]; 0 where rigid."""
    m, p = engine.matter, engine.arrays.particles
    at, rows = p.number.numpy()[: p.count], p.stress.numpy()[: p.count]
    pull = np.zeros((len(m.mass), 3, 3))
    pull[at] = rows[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)
    thick = np.where(m.rigid, 0.0, m.viscosity) * np.maximum(elasticity.determinant(F), 0.0)
    viscous = thick[:, None, None] * (gradient + elasticity.transpose(gradient))
    return -0.25 * engine.problem.cell / m.volume[:, None, None] * pull - viscous


def _enter_rigid(
    engine: "DeviceEngine",
    centre: np.ndarray,
    momentum: np.ndarray,
    angular: np.ndarray,
    kinetic: np.ndarray,
) -> None:
    """Rigid bodies know themselves better than their particles do."""
    r, mass = engine.arrays.rigid, engine.matter.total
    place, speed = r.centre.numpy(), r.speed.numpy()
    moment, turn = r.moment.numpy(), r.turn.numpy()
    for b in np.flatnonzero(r.stiff.numpy()):
        spin = rigid.world_inverse_inertia(turn[b], engine.matter.inertia[b]) @ moment[b]
        centre[b] = place[b]
        momentum[b] = mass[b] * speed[b]
        angular[b] = np.cross(place[b], momentum[b]) + moment[b]
        kinetic[b] = 0.5 * (momentum[b] @ speed[b] + moment[b] @ spin)

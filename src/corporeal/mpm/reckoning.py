"""What the reference engine shows of itself: snapshots, and the sums behind the ledger."""

import numpy as np
from jaxtyping import Bool, Float

from corporeal.mpm.ledger import Ledger
from corporeal.mpm.matter import Matter, State, elastic_stress, strain_energy
from corporeal.mpm.problem import Measure, Problem, Snapshot
from corporeal.mpm.springs import stored

_AXIAL = ((2, 1), (0, 2), (1, 0))


def shown(matter: Matter, state: State) -> Snapshot:
    """Copy every particle's state."""
    turned, stiff = state.rotation[matter.body], matter.rigid[:, None, None]
    return Snapshot(
        time=float(state.time),
        position=state.position.copy(),
        velocity=state.velocity.copy(),
        deformation=np.where(stiff, turned, state.F),
        motion=np.where(stiff, turned, state.motion),
        plastic_strain=state.plastic.copy(),
    )


def measured(
    problem: Problem, matter: Matter, state: State, book: Ledger, lost: Bool[np.ndarray, " P"]
) -> Measure:
    """Add up mass, momentum and energy of every body, and copy the ledger."""
    m, s = matter, state
    apic = 0.25 * problem.cell**2
    energy = 0.5 * m.mass * (_square(s.velocity) + apic * np.sum(s.affine**2, axis=(1, 2)))
    swirl = np.stack([s.affine[:, i, j] - s.affine[:, j, i] for i, j in _AXIAL], axis=1)
    moment = m.mass[:, None] * (np.cross(s.position, s.velocity) + apic * swirl)
    momentum = per_body(m, m.mass[:, None] * s.velocity)
    centre = per_body(m, m.mass[:, None] * s.position) / m.total[:, None]
    angular, kinetic = per_body(m, moment), per_body(m, energy)
    for b in [b for b, body in enumerate(problem.bodies) if body.rigid]:
        momentum[b] = m.total[b] * s.speed[b]
        angular[b] = np.cross(s.centre[b], momentum[b]) + s.spin_momentum[b]
        kinetic[b] = 0.5 * (momentum[b] @ s.speed[b] + s.spin_momentum[b] @ s.spin(m)[b])
    return Measure(
        time=float(s.time),
        mass=m.total.copy(),
        centre=centre,
        momentum=momentum,
        angular_momentum=angular,
        kinetic=kinetic,
        elastic=_strained(problem, m, s),
        potential=-m.total * (centre @ np.array(problem.gravity)),
        speed=float(np.sqrt(_square(s.velocity).max())),
        lost=lost.copy(),
        **book.as_measured(),
    )


def per_body(matter: Matter, values: np.ndarray) -> np.ndarray:
    """Add up what the particles of each body have."""
    out = np.zeros((len(matter.total), *values.shape[1:]))
    np.add.at(out, matter.body, values)
    return out


def _strained(problem: Problem, m: Matter, s: State) -> Float[np.ndarray, " B"]:
    """Energy in strained matter and in springs [J]."""
    sprung = stored(problem, s.position, s.centre, s.rotation, m.centre)
    return per_body(m, strain_energy(m, s.F, elastic_stress(m, s))) + sprung


def _square(v: Float[np.ndarray, "P 3"]) -> Float[np.ndarray, " P"]:
    return np.sum(v * v, axis=1)

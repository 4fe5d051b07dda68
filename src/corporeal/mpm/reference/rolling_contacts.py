"""Rolling friction in the reference engine: after all contacts are solved, one after the other."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.mpm.physics.contact_impulses import ContactList, Movers
from corporeal.mpm.physics.rolling_friction import RollingSide, brake_roll
from corporeal.mpm.problem import Problem


@dataclass(frozen=True)
class RollingOutcome:
    """What rolling friction did in a step."""

    impulse: Float[np.ndarray, "E 3"]
    """Of every contact, as those of ``contact_impulses.solve`` [N s]."""
    moment: Float[np.ndarray, "B 3"]
    """Angular impulse on each body [N m s]."""
    energy: float
    """Taken [J]."""


def brake_rolling(
    problem: Problem,
    movers: Movers,
    contacts: ContactList,
    pair: Int[np.ndarray, "E 2"],
    impulse: Float[np.ndarray, "E 3"],
    rounds: Bool[np.ndarray, " E"],
) -> RollingOutcome:
    """Brake what rolls, and move the movers.

    Args:
        problem: Says by how much: ``rolling``.
        movers: After contact.
        contacts: Where objects touch.
        pair: Two bodies, or a body and B + plane, for each contact.
        impulse: What each transmits [N s].
        rounds: At which of them something round may roll.

    """
    extra, moment, energy = np.zeros_like(impulse), np.zeros((len(problem.bodies), 3)), 0.0
    found = np.flatnonzero(rounds) if problem.has_rolling_resistance else ()
    for e in found:
        a, c, n = contacts.a[e], contacts.c[e], contacts.normal[e]
        push = float(impulse[e] @ n)
        if push <= 0.0 or problem.rolling_resistance is None:
            continue
        one, other = (
            _rolling_side(movers, a, contacts.point[e]),
            _rolling_side(movers, c, contacts.point[e]),
        )
        bounds = (
            float(contacts.friction[e]),
            float(problem.rolling_resistance[tuple(pair[e])]) * push,
        )
        done = brake_roll(one, other, movers.spin[a] - movers.spin[c], n, impulse[e], bounds)
        for m, side, sign in ((a, one, -1.0), (c, other, 1.0)):
            given = done.moment + np.cross(side.arm, done.impulse)
            movers.velocity[m] += sign * side.light * done.impulse
            movers.spin[m] += sign * side.inertia @ given
        extra[e], energy = done.impulse, energy + done.energy
        for body, sign in zip(pair[e], (-1.0, 1.0), strict=True):
            if body < len(moment):
                moment[body] += sign * done.moment
    return RollingOutcome(extra, moment, energy)


def _rolling_side(movers: Movers, mover: int, point: Float[np.ndarray, "3"]) -> RollingSide:
    arm = point - movers.centre[mover]
    return RollingSide(float(movers.inverse_mass[mover]), movers.inverse_inertia[mover], arm)

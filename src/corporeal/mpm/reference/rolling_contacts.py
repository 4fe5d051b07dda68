"""Rolling friction in the reference engine: after all contacts are solved, one after the other."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from corporeal.mpm.constants import MIN_SLIP_SPEED
from corporeal.mpm.physics.contact_impulses import ContactList, Movers
from corporeal.mpm.problem import Problem

Vector = Float[np.ndarray, "3"]


@dataclass(frozen=True)
class RollingSide:
    """One side of a contact of rigid bodies; a plane has neither mass nor inertia to yield with."""

    light: float
    """1/M [1/kg]; 0: immovable."""
    inertia: Float[np.ndarray, "3 3"]
    """I⁻¹ in the world's frame [1/(kg m²)]."""
    arm: Vector
    """Place of contact less the centre [m]."""

    def softness(self, along: Vector) -> float:
        """1/M + (r × d)ᵀ I⁻¹ (r × d) along a unit vector d [1/kg]."""
        lever = np.cross(self.arm, along)
        return self.light + float(lever @ self.inertia @ lever)


@dataclass(frozen=True)
class RollingBrake:
    """What rolling friction does at one contact in one step."""

    moment: Vector
    """M [N m s], -M on the first body and +M on the second."""
    impulse: Vector
    """f [N s], -f on the first body and +f on the second."""
    energy: float
    """Taken [J]."""


NO_BRAKE = RollingBrake(np.zeros(3), np.zeros(3), 0.0)


def brake_roll(
    a: RollingSide, c: RollingSide, spin: Vector, normal: Vector, impulse: Vector, bounds: tuple[float, float]
) -> RollingBrake:
    """Take from two bodies the spin with which one rolls over the other, as far as c J_n reaches.

    The part e of the relative spin ω across the normal is met by M ≤ c J_n. As the bodies turn
    more slowly their places of contact would slip by -B M, B = (I_a⁻¹ e) × r_a + (I_c⁻¹ e) × r_c;
    an impulse f along B hinders it where Coulomb's cone has room, and then A = e·(I_a⁻¹ + I_c⁻¹) e
    becomes A - B²/K with K the softness along B: for a ball on a plane 1/I becomes 1/(I + m r²),
    its inertia about the place of contact.

    Args:
        a: The first body.
        c: The second, or a plane.
        spin: ω_a - ω_c [rad/s].
        normal: Unit, from the first to the second.
        impulse: J that the contact transmits in this step [N s].
        bounds: μ [-], and the greatest M [N m s].
    """
    friction, most = bounds
    across = spin - (spin @ normal) * normal
    speed = float(np.linalg.norm(across))
    if speed <= MIN_SLIP_SPEED or most <= 0.0:
        return NO_BRAKE
    e = across / speed
    turned_a, turned_c = a.inertia @ e, c.inertia @ e
    soft = float(e @ (turned_a + turned_c))
    if soft <= 0.0:
        return NO_BRAKE
    given, held = min(speed / soft, most), np.zeros(3)
    slip = np.cross(turned_a, a.arm) + np.cross(turned_c, c.arm)
    slip = slip - (slip @ normal) * normal
    size = float(np.linalg.norm(slip))
    if size > 0.0:
        along = slip / size
        stiff = a.softness(along) + c.softness(along)
        together = soft - size**2 / stiff
        more = min(speed / together, most) if together > 0.0 else most
        back = -more * size / stiff * along
        push = float(impulse @ normal)
        if np.linalg.norm(impulse - push * normal + back) <= friction * push:
            given, soft, held = more, together, back
    return RollingBrake(given * e, held, given * (speed - 0.5 * soft * given))


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
        one, other = (_rolling_side(movers, a, contacts.point[e]), _rolling_side(movers, c, contacts.point[e]))
        bounds = (float(contacts.friction[e]), float(problem.rolling_resistance[tuple(pair[e])]) * push)
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

"""Rolling friction: a moment of at most c N against rolling. Twin of ``formulas/rolling.h``."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from corporeal.mpm.constants import MIN_SLIP_SPEED

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
    a: RollingSide,
    c: RollingSide,
    spin: Vector,
    normal: Vector,
    impulse: Vector,
    bounds: tuple[float, float],
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

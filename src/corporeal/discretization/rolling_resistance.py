"""Rolling resistance: offset c of the contact force of every pair [m], from their loss factors.

What rolls presses in before it and is pushed back behind it by less, by what its material and the other one lose. The
moment of that is c N, with c = 3/16 α a under a ball and 2/(3π) α a under a cylinder, a the radius or half the width of
the contact and α the share of the energy that a cycle takes (Tabor 1955, "The mechanism of rolling friction", Proc. R.
Soc. A 229; Greenwood, Minshall and Tabor 1961, "Hysteresis losses in rolling and sliding friction"; Johnson, Contact
Mechanics, §9.4). Roughness and dirt, which brake hard balls on hard floors more than that (Cross 2016, "Coulomb's law
for rolling friction", Am. J. Phys. 84), are in no material here, so that c is a lower bound.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi, sqrt

import numpy as np
from jaxtyping import Float

from corporeal.core.types import GRAVITY_M_S2, Material
from corporeal.materials.loss_restitution import restitution_of_loss
from corporeal.materials.restitution_speed import plane_strain_compliance
from corporeal.mpm.problem import Body

BALL_ROLLING_COEFFICIENT, CYLINDER_ROLLING_COEFFICIENT = 3.0 / 16.0, 2.0 / (3.0 * pi)
"""c over α a where contact is a point and where it is a line [-]."""


@dataclass(frozen=True)
class RollingBody:
    """How a rigid body rolls."""

    radius: float
    """[m]; 0: nothing of it is round."""
    weight: float
    """[N]"""
    length: float = 0.0
    """Of a cylinder [m]; 0: a ball."""

    @classmethod
    def of(cls, body: Body) -> "RollingBody":
        """Look at the round points of a body: of most of them one radius is that of a ball or none.

        Weight is that under usual gravity: it is how hard the body lies on what it rolls on.
        """
        mass = float(body.density @ body.volume)
        rows = body.curvature
        curved = rows[rows[:, 6:8].sum(axis=1) > 0.0]
        if not body.rigid or len(curved) == 0:
            return cls(0.0, 0.0)
        radius = float(np.median(curved[:, 6:8].sum(axis=1)))
        long = 0.0
        if np.median(curved[:, 6]) == 0.0:
            long = float(body.volume.sum()) / (pi * radius**2)
        return cls(radius, mass * GRAVITY_M_S2, long)


def rolling_resistance_lengths(
    bodies: Sequence[Body], materials: Sequence[Material], floor: Material | None, planes: int
) -> Float[np.ndarray, "BW BW"]:
    """Give c of every pair of bodies and planes [m]; 0 where nothing rolls or it is not known.

    Args:
        bodies: As simulated.
        materials: What each is made of where it rolls, as in reality.
        floor: Of all planes; None: it is not known.
        planes: How many there are.
    """
    count = len(bodies)
    table = np.zeros((count + planes, count + planes))
    rollers = [RollingBody.of(body) for body in bodies]
    for a, roller in enumerate(rollers):
        if roller.radius == 0.0:
            continue
        for c in range(count):
            if c != a and bodies[c].rigid:
                lighter = rollers[c].radius == 0.0 or roller.weight <= rollers[c].weight
                found = rolling_resistance_length(roller, materials[a], materials[c])
                table[a, c] = table[c, a] = found if lighter else table[a, c]
        if floor is not None:
            table[a, count:] = table[count:, a] = rolling_resistance_length(roller, materials[a], floor)
    return table


def rolling_resistance_length(roller: RollingBody, own: Material, other: Material) -> float:
    """Give c [m] of what rolls under its own weight.

    Each of the two stores energy in proportion to its compliance (1 - ν²)/E, and loses 1 - e² of it with e what a ball
    of it keeps in an impact (``materials.rebound``). Hertz: a³ = 3 N R/(4 E*) of a ball, a² = 4 N R/(π L E*) of a
    cylinder.
    """
    soft = [plane_strain_compliance(m) if m.young_pa > 0 else 0.0 for m in (own, other)]
    taken = [1.0 - restitution_of_loss(min(m.loss, 2.0)) ** 2 for m in (own, other)]
    both = sum(soft)
    if both == 0.0:
        return 0.0
    share = sum(s * t for s, t in zip(soft, taken, strict=True)) / both
    pressed = roller.weight * roller.radius * both
    if roller.length > 0.0:
        return CYLINDER_ROLLING_COEFFICIENT * share * min(sqrt(4.0 * pressed / (pi * roller.length)), roller.radius)
    return BALL_ROLLING_COEFFICIENT * share * min((0.75 * pressed) ** (1.0 / 3.0), roller.radius)

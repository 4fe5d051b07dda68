"""Grips: an impulse at a point of a body, and a spring that pulls it.

Both reach the particles within r = ``GRIP_RADIUS_DX`` cells of the point, weighted by (1 - d²/r²)² and mass; a point
that lies farther out takes hold of the nearest particle's surroundings. A rigid body is taken exactly at the point.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from corporeal.core.errors import UserError
from corporeal.core.types import Vector
from corporeal.mpm.constants import GRIP_DAMPING, GRIP_RADIUS_DX, GRIP_STIFFNESS
from corporeal.mpm.problem import Body, Problem


@dataclass(frozen=True)
class GripHold:
    """Which part of a body is held; H particles, one for a rigid body."""

    particle: Int[np.ndarray, " H"]
    """Of the body's particles; those of a rigid body are not looked at."""
    share: Float[np.ndarray, " H"]
    """Of the impulse, in sum 1 [-]."""
    mass: float
    """What moves at once [kg]; all of a rigid body."""
    arm: Float[np.ndarray, "3"]
    """Rigid: where it is held, from its centre, in its own frame [m]."""


@dataclass(frozen=True)
class Grip:
    """A damped spring between a part of a body and a point in space."""

    hold: GripHold
    target: Float[np.ndarray, "3"]
    """[m]"""
    stiffness: float
    """k [N/m]"""
    damping: float
    """c [N s/m], critical for the whole body."""

    def impulse(
        self, place: Float[np.ndarray, "3"], velocity: Float[np.ndarray, "3"], dt: float
    ) -> Float[np.ndarray, "3"]:
        """Return the spring's impulse in a step [N s]: J = dt (k (x_target - x) - c v).

        k and c are at most what the step can follow with the mass that moves at once.
        """
        stiffness = min(self.stiffness, GRIP_STIFFNESS * self.hold.mass / dt**2)
        damping = min(self.damping, GRIP_DAMPING * self.hold.mass / dt)
        return dt * (stiffness * (self.target - place) - damping * velocity)


def take_hold(body: Body, position: Float[np.ndarray, "P 3"], point: Vector, cell: float) -> GripHold:
    """Hold a body that bends at a point [m] of space; its particles are where they are now."""
    away = np.linalg.norm(position - np.array(point), axis=1)
    if away.min() > GRIP_RADIUS_DX * cell:
        away = np.linalg.norm(position - position[np.argmin(away)], axis=1)
    near = np.flatnonzero(away < GRIP_RADIUS_DX * cell)
    weight = (1.0 - (away[near] / (GRIP_RADIUS_DX * cell)) ** 2) ** 2
    weight = weight * (body.volume * body.density)[near]
    held = float((body.volume * body.density)[near].sum())
    return GripHold(near, weight / weight.sum(), held, np.zeros(3))


def take_hold_of_rigid(
    mass: float, centre: Float[np.ndarray, "3"], turn: Float[np.ndarray, "3 3"], point: Vector
) -> GripHold:
    """Hold a rigid body at a point [m] of space."""
    arm = turn.T @ (np.array(point, np.float64) - centre)
    return GripHold(np.zeros(1, np.int64), np.ones(1), mass, arm)


def updated_grips(
    grips: dict[int, Grip],
    body: int,
    hold: GripHold | None,
    target: Float[np.ndarray, "3"],
    stiffness: float,
    total: float,
) -> dict[int, Grip]:
    """Grip a body anew, or pull what is gripped elsewhere.

    Args:
        grips: The present ones, by body.
        body: Which.
        hold: Where it is held; None: where it is held already.
        target: Where to [m].
        stiffness: Of the spring [N/m]; 0 lets go.
        total: Mass of the whole body [kg].
    """
    if not 0.0 <= stiffness < np.inf:
        raise UserError(f"A pull's stiffness is {stiffness} N/m. Give 0 (let go) or more.")
    kept = {b: grip for b, grip in grips.items() if b != body}
    if stiffness == 0.0:
        return kept
    if hold is None and body not in grips:
        raise UserError(f"Body {body} is not held yet. Give the point to hold it at.")
    hold = hold or grips[body].hold
    damping = 2.0 * float(np.sqrt(stiffness * total))
    return kept | {body: Grip(hold, target, stiffness, damping)}


def check_grip(problem: Problem, body: int, *vectors: Vector | None) -> None:
    """Reject bodies that are not there or follow a path, and what is no number.

    Raises:
        UserError: It says what to give.
    """
    if not 0 <= body < len(problem.bodies):
        raise UserError(f"There is no body {body}. Choose 0 to {len(problem.bodies) - 1}.")
    if problem.bodies[body].path is not None:
        raise UserError(f"{problem.bodies[body].name!r} follows a path: nothing else moves it.")
    require_finite(*vectors)


def require_finite(*vectors: Vector | None) -> None:
    """Refuse what is no number.

    Raises:
        UserError: It says what to give.
    """
    if not all(np.isfinite(v).all() for v in vectors if v is not None):
        raise UserError("A vector is not finite. Give three numbers.")

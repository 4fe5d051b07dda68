"""Prescribed motion of rigid bodies along paths.

In contact it is as heavy as a wall, with the velocity that takes it, in this step, to where its path says. Whatever
that takes is booked: its momentum and energy change by what contacts give it and by what its mover does, J = Δp - Σ
J_contact and W = ΔE - Σ J_contact · v.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from corporeal.core.errors import UserError
from corporeal.core.types import Keyframes, Vector
from corporeal.mpm.constants import KEY_FRAME, KEY_PLACE, KEY_ROW, KEY_SPAN, KEY_START, KEY_TURN, RIGID_COURANT
from corporeal.mpm.physics import rigid
from corporeal.mpm.physics.springs import rotation_vector
from corporeal.mpm.problem import Body, Problem

if TYPE_CHECKING:
    from scipy.interpolate import CubicHermiteSpline

SPEED_SAMPLES_PER_INTERVAL = 9
"""Times in each interval at which speeds are compared: they are quadratic in time there."""


class PathPose(NamedTuple):
    """Where a path is at one instant."""

    place: Float[np.ndarray, "3"]
    """[m]"""
    rotation: Float[np.ndarray, "3 3"]


class PathStep(NamedTuple):
    """What takes a body in one step to where its path says."""

    velocity: Float[np.ndarray, "3"]
    """Of its centre [m/s]."""
    spin: Float[np.ndarray, "3"]
    """[rad/s]"""
    rotation: Float[np.ndarray, "3 3"]
    """At the end of the step."""


def path_rows(path: Keyframes, pivot: Vector) -> Float[np.ndarray, "N K"]:
    """Write a path from a point [m] as engines read it: cubics for each interval, see ``KEY_ROW``.

    Monotone cubics (Fritsch and Carlson 1980): they pass through every row and overshoot nowhere, so that a body
    prescribed to rest rests.
    """
    time = np.array(path.time, float)
    if len(time) == 1:
        time = np.array([time[0], time[0] + 1.0])
    place = np.broadcast_to(np.array(path.shift, float), (len(time), 3)) + np.array(pivot)
    turn = np.zeros((len(time), 3))
    turn[: len(path.turn)] = path.turn
    rows = np.zeros((len(time) - 1, KEY_ROW))
    rows[:, KEY_START], rows[:, KEY_SPAN] = time[:-1], np.diff(time)
    rows[:, KEY_PLACE:KEY_TURN] = _cubics(time, place)
    turned = _cubics(time, np.cumsum(turn, axis=0))
    turned[:, ::4] = 0.0
    rows[:, KEY_TURN:KEY_FRAME] = turned
    frame = np.eye(3)
    for row, by in zip(rows, turn[1:], strict=True):
        row[KEY_FRAME:] = frame.ravel()
        frame = rigid.rotation_matrix(by) @ frame
    return rows


def _cubics(time: Float[np.ndarray, " N"], value: Float[np.ndarray, "N 3"]) -> Float[np.ndarray, "N1 12"]:
    """Coefficients from the constant on of every interval's cubics, component after component."""
    curve = _smooth_curve(time, value)
    return curve.c[::-1].transpose(1, 2, 0).reshape(len(time) - 1, 12)


def _smooth_curve(time: ArrayLike, value: Float[np.ndarray, "N 3"]) -> "CubicHermiteSpline":
    from scipy.interpolate import PchipInterpolator  # few scenes have anything that follows a prescribed path

    return PchipInterpolator(time, value)


def path_pose(rows: Float[np.ndarray, "N K"], time: float) -> PathPose:
    """Place and rotation at a time [s]; at rest before the first row and after the last."""
    row = rows[max(0, int(np.searchsorted(rows[:, KEY_START], time, side="right")) - 1)]
    t = float(np.clip(time - row[KEY_START], 0.0, row[KEY_SPAN]))
    powers = t ** np.arange(4)
    turn = row[KEY_TURN:KEY_FRAME].reshape(3, 4) @ powers
    frame = row[KEY_FRAME:].reshape(3, 3)
    return PathPose(row[KEY_PLACE:KEY_TURN].reshape(3, 4) @ powers, rigid.rotation_matrix(turn) @ frame)


@dataclass(frozen=True)
class PathFollower:
    """The path of one body."""

    rows: Float[np.ndarray, "N K"]
    """See ``KEY_ROW``."""
    arm: Float[np.ndarray, "3"]
    """Of the body's centre at the start from the path's first place [m]."""
    reach: float
    """Of the body's farthest point from its centre [m]."""

    @classmethod
    def of(cls, body: Body) -> "PathFollower":
        """Read the path of a body that has one."""
        assert body.path is not None
        rows = path_rows(body.path, body.pivot)
        weight = body.volume * body.density
        centre = weight @ body.position / weight.sum()
        points = np.concatenate([body.position, body.surface.reshape(-1, 3)])
        reach = float(np.linalg.norm(points - centre, axis=1).max())
        return cls(rows, centre - np.array(body.pivot), reach)

    def follow(
        self, end: float, dt: float, centre: Float[np.ndarray, "3"], rotation: Float[np.ndarray, "3 3"]
    ) -> PathStep:
        """Return how the body moves in a step of dt [s] that ends at ``end`` [s].

        Args:
            end: When the step ends [s].
            dt: [s]
            centre: Where the body's centre of mass is now [m].
            rotation: How it has turned so far.
        """
        there = path_pose(self.rows, end)
        velocity = (there.place + there.rotation @ self.arm - centre) / dt
        return PathStep(velocity, rotation_vector(there.rotation @ rotation.T) / dt, there.rotation)

    @property
    def fastest(self) -> float:
        """Largest speed of any point of the body [m/s], rounded up."""
        share = np.linspace(0.0, 1.0, SPEED_SAMPLES_PER_INTERVAL)
        t = self.rows[:, [KEY_SPAN]] * share
        slopes = np.stack([np.ones_like(t), 2.0 * t, 3.0 * t**2], axis=2)

        def speed(first: int) -> Float[np.ndarray, "N S"]:
            cubic = self.rows[:, first : first + 12].reshape(-1, 3, 4)[:, :, 1:]
            return np.linalg.norm(np.einsum("ntk,ndk->ntd", slopes, cubic), axis=2)

        far = float(np.linalg.norm(self.arm)) + self.reach
        return float((speed(KEY_PLACE) + speed(KEY_TURN) * far).max())


def path_followers(problem: Problem) -> dict[int, PathFollower]:
    """Paths of the bodies that have one, by number.

    Raises:
        UserError: A body with a path is not rigid, or something else moves it too.
    """
    found = {}
    jointed = {b for joint in problem.joints for b in (joint.first, joint.second)}
    jointed |= {b for bond in problem.bonds for b in bond}
    for b, body in enumerate(problem.bodies):
        if body.path is None:
            continue
        _refuse_path(body, b in jointed, problem.contact == "single")
        found[b] = PathFollower.of(body)
    return found


def _refuse_path(body: Body, jointed: bool, single: bool) -> None:
    """Raise where a path cannot be followed."""
    others = {
        "is not rigid": not body.rigid,
        "is pushed too": body.push is not None,
        "is in the wind too": body.wind is not None,
        "is tied to another body": jointed or body.tether is not None,
        "shares one velocity field with all (contact='single')": single,
    }
    for what, so in others.items():
        if so:
            raise UserError(
                f"{body.name!r} follows a path, but {what}. Give a path to rigid bodies alone, "
                "without a push, wind or joints, and with a velocity field of their own."
            )


def longest_step(problem: Problem) -> float:
    """Longest step [s] in which no such body goes farther than a rigid one may."""
    speeds = [guide.fastest for guide in path_followers(problem).values()]
    fastest = max(speeds, default=0.0)
    return RIGID_COURANT * problem.cell / fastest if fastest > 0.0 else float("inf")


def start_velocity(path: Keyframes, pivot: Vector, points: Float[np.ndarray, "P 3"]) -> Float[np.ndarray, "P 3"]:
    """Velocities [m/s] of points of a body [m] as its path begins, if it does at time 0."""
    first = path_rows(path, pivot)[0]
    if first[KEY_START] > 0.0:
        return np.zeros_like(points)
    speed, spin = first[KEY_PLACE + 1 : KEY_TURN : 4], first[KEY_TURN + 1 : KEY_FRAME : 4]
    return speed + np.cross(spin, points - np.array(pivot))


def fastest_velocity(path: Keyframes, reach: float) -> Float[np.ndarray, "3"]:
    """Velocity [m/s] of a body when it is fastest; of its rim, where it only turns.

    Args:
        path: How it moves.
        reach: How far its points are from what it turns about [m].
    """
    t = np.linspace(path.time[0], path.time[-1], SPEED_SAMPLES_PER_INTERVAL * len(path.time))
    if len(path.time) == 1:
        return np.zeros(3)
    moved = _smooth_curve(path.time, np.array(path.shift)).derivative()(t)
    turned = _smooth_curve(path.time, np.cumsum(path.turn, axis=0)).derivative()(t)
    speed, rim = np.linalg.norm(moved, axis=1), reach * np.linalg.norm(turned, axis=1)
    k = int(np.argmax(speed + rim))
    along = moved[k] / speed[k] if speed[k] > 0.0 else np.array([1.0, 0.0, 0.0])
    return along * (speed[k] + rim[k])

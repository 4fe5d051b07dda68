"""Rigid bodies: six degrees of freedom made from particles."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

from corporeal.mpm.constants import (
    FACING_AWAY_COSINE,
    MIN_THIN_WALL_FRACTION,
    RANK_CUTOFF,
    SMALL_ROTATION_RAD,
    THIN_BODY_DX,
    WALL_SAMPLE_POINTS,
)

Vector3 = Float[np.ndarray, "3"]
Matrix3 = Float[np.ndarray, "3 3"]


class BodyInertia(NamedTuple):
    """How a body resists being moved and turned."""

    total: float
    """[kg]"""
    centre: Vector3
    """Centre of mass [m]."""
    inertia: Matrix3
    """Moment of inertia about the centre [kg m²]."""


@dataclass(frozen=True)
class RigidBody:
    """A rigid body at one instant; P particles."""

    mass: float
    """[kg]"""
    centre: Vector3
    """Centre of mass [m]."""
    rotation: Matrix3
    """How far it has turned since the start."""
    velocity: Vector3
    """Of the centre [m/s]."""
    angular_momentum: Vector3
    """About the centre [kg m²/s]."""
    spin: Vector3
    """ω [rad/s]."""
    start: Vector3
    """Where the centre was at the start [m]."""
    arm: Float[np.ndarray, "P 3"]
    """Particles at the start, from the centre [m]."""

    @property
    def kinetic(self) -> float:
        """Kinetic energy ½ M |v|² + ½ ω · L [J]."""
        v, spin = self.velocity, self.spin
        return float(0.5 * self.mass * v @ v + 0.5 * spin @ self.angular_momentum)

    def particle_position(self) -> Float[np.ndarray, "P 3"]:
        """X = X + R r₀ [m]."""
        return self.centre + self.arm @ self.rotation.T

    def particle_velocity(self) -> Float[np.ndarray, "P 3"]:
        """V = V + ω × R r₀ [m/s]."""
        return self.velocity + np.cross(self.spin, self.arm @ self.rotation.T)


def mass_and_inertia(
    position: Float[np.ndarray, "P 3"], mass: Float[np.ndarray, " P"], volume: Float[np.ndarray, " P"]
) -> BodyInertia:
    """Mass, centre and inertia of particles, each a small cube of edge h = V^(1/3).

    I = Σ m (|r|² 1 - r rᵀ) + Σ m h²/6 1; without the cubes' own inertia a coarse body would spin
    up too easily.
    """
    total = float(mass.sum())
    centre = mass @ position / total
    r = position - centre
    own = np.sum(mass * volume ** (2.0 / 3.0)) / 6.0
    spread = (r * mass[:, None]).T @ r
    return BodyInertia(total, centre, (np.trace(spread) + own) * np.eye(3) - spread)


def fit_motion(
    mass: BodyInertia,
    position: Float[np.ndarray, "P 3"],
    particle_mass: Float[np.ndarray, " P"],
    velocity: Float[np.ndarray, "P 3"],
) -> tuple[Vector3, Vector3]:
    """Velocity of the centre [m/s] and angular momentum about it [kg m²/s] of moving particles."""
    r = position - mass.centre
    linear = particle_mass @ velocity / mass.total
    about = np.sum(particle_mass[:, None] * np.cross(r, velocity - linear), axis=0)
    points = mass_and_inertia(position, particle_mass, np.zeros(len(position)))
    spin = np.linalg.lstsq(points.inertia, about, rcond=RANK_CUTOFF)[0]
    return linear, mass.inertia @ spin


def rotation_matrix(turn: Vector3) -> Matrix3:
    """Return the rotation matrix of a rotation vector [rad] (Rodrigues' formula)."""
    angle = float(np.linalg.norm(turn))
    K = cross_matrix(turn)
    if angle < SMALL_ROTATION_RAD:
        return np.eye(3) + (1.0 - angle**2 / 6.0) * K + (0.5 - angle**2 / 24.0) * K @ K
    return np.eye(3) + np.sin(angle) / angle * K + (1.0 - np.cos(angle)) / angle**2 * K @ K


def integrate_rotation(R: Matrix3, inertia: Matrix3, momentum: Vector3, dt: float) -> Matrix3:
    """Give R after a free turn of dt [s] with constant angular momentum L, in the middle's ω.

    R ← exp(ω_½ dt) R with ω_½ = I⁻¹ L half a step ahead: second order, and the energy of a spin about any axis stays;
    with the ω of the step's start it would grow or fade.
    """
    now = world_inverse_inertia(R, inertia) @ momentum
    middle = world_inverse_inertia(rotation_matrix(0.5 * dt * now) @ R, inertia) @ momentum
    U, _, Vt = np.linalg.svd(rotation_matrix(middle * dt) @ R)
    return U @ Vt


def cross_matrix(a: Vector3) -> Matrix3:
    """Give [a]×, the matrix for which [a]× b = a × b."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def world_inverse_inertia(R: Matrix3, inertia: Matrix3) -> Matrix3:
    """I⁻¹ in the world frame of a body turned by R: R I₀⁻¹ Rᵀ."""
    return R @ np.linalg.inv(inertia) @ R.T


def thinness(surface: Float[np.ndarray, "S 3"], normal: Float[np.ndarray, "S 3"], cell: float) -> int:
    """How thin a body is against the cell: 2 in all directions, 1 in some, or in its walls, 0 not.

    Args:
        surface: Points on the body's surface [m]; without any it is 0.
        normal: Which way it looks there; 0 where that is not known.
        cell: dx [m].
    """
    if len(surface) == 0:
        return 0
    arm = surface - surface.mean(axis=0)
    axes = np.linalg.svd(arm, full_matrices=False)[2]
    below = np.ptp(arm @ axes.T, axis=0) < THIN_BODY_DX * cell
    if below.all():
        return 2
    return int(below.any() or thin_walls(surface, normal, THIN_BODY_DX * cell) > MIN_THIN_WALL_FRACTION)


def thin_walls(surface: Float[np.ndarray, "S 3"], normal: Float[np.ndarray, "S 3"], thick: float) -> float:
    """Share of a surface behind which its wall is less than ``thick`` [m] deep.

    A few hundred points speak for all of those whose normals are known.
    """
    known = np.flatnonzero(np.any(normal != 0.0, axis=1))
    if len(known) == 0:
        return 0.0
    asked = known[np.arange(0, len(known), len(known) // WALL_SAMPLE_POINTS + 1)]
    return float(_has_far_side_within(surface, normal, thick, asked).mean())


def thin_places(
    surface: Float[np.ndarray, "S 3"], normal: Float[np.ndarray, "S 3"], cell: float
) -> Bool[np.ndarray, " S"]:
    """Tell behind which surface points a body that is not thin as a whole is thinner than ``THIN_BODY_DX``.

    None of a body that is thin as a whole, see ``thinness``, of which every point counts.
    """
    places = np.zeros(len(surface), dtype=bool)
    if thinness(surface, normal, cell) == 0 and thin_walls(surface, normal, THIN_BODY_DX * cell) > 0.0:
        known = np.flatnonzero(np.any(normal != 0.0, axis=1))
        places[known] = _has_far_side_within(surface, normal, THIN_BODY_DX * cell, known)
    return places


def _has_far_side_within(
    surface: Float[np.ndarray, "S 3"], normal: Float[np.ndarray, "S 3"], thick: float, asked: Int[np.ndarray, " A"]
) -> Bool[np.ndarray, " A"]:
    """Tell behind which of some points, less than ``thick`` [m] deep, another side looks away."""
    known = np.flatnonzero(np.any(normal != 0.0, axis=1))
    points, out, aside = surface[known], normal[known], surface_point_spacing(surface)
    tree = KDTree(points)
    middle = surface[asked] - 0.5 * thick * normal[asked]
    behind = tree.query_ball_point(middle, 0.5 * thick + aside)
    k = np.repeat(np.arange(len(asked)), [len(near) for near in behind])
    near = np.concatenate([np.zeros(0, int), *(np.array(b, int) for b in behind)])
    apart, way = surface[asked][k] - points[near], normal[asked][k]
    depth = np.sum(apart * way, axis=1)
    beside = np.linalg.norm(apart - depth[:, None] * way, axis=1)
    away = np.sum(out[near] * way, axis=1) < -FACING_AWAY_COSINE
    wall = away & (depth > 0.0) & (depth < thick) & (beside <= aside)
    return np.bincount(k[wall], minlength=len(asked)) > 0


def surface_point_spacing(surface: Float[np.ndarray, "S 3"]) -> float:
    """Distance of a surface point from its neighbours [m]: from the sixth nearest, in the mean.

    Without seven points it is 0.
    """
    if len(surface) < 7:
        return 0.0
    return float(KDTree(surface).query(surface, 7)[0][:, 6].mean())

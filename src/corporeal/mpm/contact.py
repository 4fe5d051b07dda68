"""Contact between fields on grid nodes: where a face lies, which way it looks, what it transmits.

A pair of fields (a, c) meets at a node; n points from a to c. Every field shows itself there by
its mean offset X̄ from the node and by its outward volume gradient g. Walls are half spaces.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from numba import njit

DEEPEST = 1.25
"""Faces farther than this from the node [dx] are treated as if they were here."""
WALL_REACH = 0.5
"""Nodes higher than this above a wall [dx] ignore it: its infinite mass would grip the inside."""
LATTICE_GAP = 0.05
"""What two particles per cell and axis add to the continuous touching distance [dx] …"""
LATTICE_SLOPE = 0.25
"""… and what they add per dx once the face is farther than …"""
LATTICE_START = 0.7
"""… this from the node [dx]; all three fitted to flat faces at that density."""
FIRST_BIAS, OTHER_BIAS = 0.10, 0.05
"""Head start of the candidates g_a - g_c, and g_a or -g_c [dx]."""
PATCH = 0.1
"""Contacts of a hit pair nearer than this [dx] rebound with it."""
SLOWEST_BOUNCE = 0.05
"""Slower approaches [m/s] don't rebound, as in other rigid-body engines."""
SWEEPS, SWEEPS_OF_A_HIT = 10, 100

Vectors = Float[np.ndarray, "E 3"]
Scalars = Float[np.ndarray, " E"]
Indices = Int[np.ndarray, " E"]


# ---------------------------------------------------------------- where the face lies


def half_space_mean(face: np.ndarray) -> np.ndarray:
    """e(s): mean offset [dx] of the half space u < s weighted by the quadratic B-spline at 0.

    e(s) = ∫ u N(u) du / ∫ N(u) du over u < s; nearly s itself far behind the node, 0 when the
    half space fills the spline's support.
    """
    s = np.clip(face, -1.5, 1.5)
    near = -np.abs(s)
    tail = near < -0.5
    w = near + 1.5
    weight = np.where(tail, w**3 / 6.0, 0.5 + 0.75 * near - near**3 / 3.0)
    moment = np.where(
        tail, w**4 / 8.0 - w**3 / 4.0, -13.0 / 64.0 + 0.375 * near**2 - 0.25 * near**4
    )
    weight = np.where(s > 0.0, 1.0 - weight, weight)
    return np.where(weight > 1e-12, moment / np.maximum(weight, 1e-12), near)


_FACES = np.linspace(-1.5, 1.5, 6001)
_MEANS = np.maximum.accumulate(half_space_mean(_FACES))


def half_space_face(mean: np.ndarray) -> np.ndarray:
    """D = e⁻¹: where the face lies [dx] of a half space whose mean offset is ``mean`` [dx]."""
    return np.interp(mean, _MEANS, _FACES)


def touching_distance(face: np.ndarray) -> np.ndarray:
    """t(s): distance of the mean offsets [dx] of two half spaces that touch s dx from the node.

    t(s) = -e(s) - e(-s) + .05 + .25 max(0, s - .7): .84 with the face on the node, .95 mid-cell,
    1.27 one cell off. A constant would start contact early or sink heavy bodies.
    """
    s = np.minimum(np.abs(face), DEEPEST)
    lattice = LATTICE_GAP + LATTICE_SLOPE * np.maximum(0.0, s - LATTICE_START)
    return -half_space_mean(s) - half_space_mean(-s) + lattice


def gap_between(
    mean_a: Vectors, mean_c: Vectors, normal: Vectors, cell: float
) -> Float[np.ndarray, " E"]:
    """Open distance g along n [m] of two fields; negative where they overlap.

    The face lies at s = ½ (D(ξ_a) - D(-ξ_c)), ξ = X̄·n/dx, and g = (X̄_c - X̄_a)·n - t(|s|) dx.
    """
    xi_a = np.sum(mean_a * normal, axis=1) / cell
    xi_c = np.sum(mean_c * normal, axis=1) / cell
    face = 0.5 * (half_space_face(xi_a) - half_space_face(-xi_c))
    return (xi_c - xi_a - touching_distance(face)) * cell


def gap_to_wall(mean: Vectors, height: Scalars, normal: Vectors, cell: float) -> Scalars:
    """Open distance g along n [m] of a field to a wall that lies ``height`` [m] below the node.

    The wall is a half space in the same formula; nodes high above it are never in contact.
    """
    h = height / cell
    xi = np.sum(mean * normal, axis=1) / cell
    gap = (-half_space_mean(-h) - xi - touching_distance(h)) * cell
    return np.where(h > WALL_REACH + 0.01, np.inf, gap)


# ---------------------------------------------------------------- which way it looks


def unit(v: np.ndarray) -> np.ndarray:
    """v/|v| along the last axis; zero stays zero."""
    size = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.where(size > 1e-30, v / np.maximum(size, 1e-30), 0.0)


def candidate_normals(outward_a: Vectors, outward_c: Vectors) -> Float[np.ndarray, "E 3 3"]:
    """n1 = g_a - g_c, n2 = g_a, n3 = -g_c, normalised; a corner has several and one is right."""
    return unit(np.stack([outward_a - outward_c, outward_a, -outward_c], axis=1))


def separating_normal(
    candidates: np.ndarray,
    reach_a: Float[np.ndarray, "E 3"],
    reach_c: Float[np.ndarray, "E 3"],
    cell: float,
) -> Vectors:
    """Choose the candidate along which the two fields are farthest apart (separating axis).

    Args:
        candidates: Unit normals (E, 3, 3), three per pair; zero: absent.
        reach_a: s_a(n) = max (x·n + R) over a's particles [m], R = r0 ‖Fᵀn‖.
        reach_c: s_c(n) = min (x·n - R) over c's particles [m].
        cell: dx [m].

    """
    bias = np.array([FIRST_BIAS, OTHER_BIAS, OTHER_BIAS]) * cell
    absent = np.all(candidates == 0.0, axis=2)
    width = np.where(absent, -np.inf, reach_c - reach_a + bias)
    best = np.argmax(width, axis=1)[:, None, None]
    return np.take_along_axis(candidates, best, axis=1)[:, 0]


def smooth_normals(normal: Vectors, weight: Scalars, index: Int[np.ndarray, "E 3"]) -> Vectors:
    """Average the normals of one pair of bodies over the 27 nodes around each of its nodes.

    Args:
        normal: Unit normals at the pair's nodes.
        weight: min(m_a, m_c) [kg].
        index: The nodes' grid indices.

    """
    low = index.min(axis=0) - 1
    shape = tuple(index.max(axis=0) - low + 2)
    flat = np.asarray(np.ravel_multi_index(tuple((index - low).T), shape))
    order = np.argsort(flat)
    mean = np.zeros_like(normal)
    for offset in np.ndindex(3, 3, 3):
        around = index - low + np.array(offset) - 1
        there = np.ravel_multi_index(tuple(around.T), shape)
        place = np.minimum(np.searchsorted(flat, there, sorter=order), index.shape[0] - 1)
        other = order[place]
        found = flat[other] == there
        mean += np.where(found, weight[other], 0.0)[:, None] * normal[other]
    return unit(mean)


# ---------------------------------------------------------------- what it transmits


@dataclass
class Movers:
    """D things that impulses move: grid nodes (no inertia), rigid bodies, one immovable wall."""

    inverse_mass: Float[np.ndarray, " D"]
    """[1/kg]; 0: immovable."""
    inverse_inertia: Float[np.ndarray, "D 3 3"]
    """World frame [1/(kg m²)]; 0 for a node."""
    centre: Float[np.ndarray, "D 3"]
    """[m]"""
    velocity: Float[np.ndarray, "D 3"]
    """Of the centre [m/s]; changed by ``solve``."""
    spin: Float[np.ndarray, "D 3"]
    """[rad/s]; changed by ``solve``."""

    def velocity_at(
        self, mover: Int[np.ndarray, " E"], point: Float[np.ndarray, "E 3"]
    ) -> Float[np.ndarray, "E 3"]:
        """V + ω × r of each mover at a point [m/s]."""
        arm = point - self.centre[mover]
        return self.velocity[mover] + np.cross(self.spin[mover], arm)


class Contacts(NamedTuple):
    """E places where two movers touch or are about to."""

    a: Indices
    """Mover the normal points away from."""
    c: Indices
    """Mover the normal points to."""
    point: Vectors
    """[m]"""
    normal: Vectors
    """Unit, a → c."""
    gap: Scalars
    """Open distance at the start of the step [m]."""
    friction: Scalars
    """Coulomb μ."""

    def approach(self, movers: Movers) -> Vectors:
        """Slip and approach together: u = v_a - v_c [m/s]."""
        return movers.velocity_at(self.a, self.point) - movers.velocity_at(self.c, self.point)

    def repeated(self, times: int) -> "Contacts":
        """Say everything several times, one block after the other."""
        return Contacts(*(np.concatenate([column] * times) for column in self))


class Rebound(NamedTuple):
    """What decides whether rigid contacts bounce in this step."""

    pair: Indices
    """Which pair of bodies the contact belongs to."""
    restitution: Scalars
    """Newton's e; 0 unless both partners are rigid or a wall."""
    kick: Scalars
    """Approach speed that gravity and pushes added in this step [m/s]."""


def target_speeds(
    contacts: Contacts, approach: Scalars, rebound: Rebound, cell: float, dt: float
) -> tuple[Scalars, bool]:
    """Give the normal approach speed each contact may keep [m/s], and whether anything bounces.

    An open gap may close within the step, max(g, 0)/dt. Where one contact of a rigid pair closes
    with v_app > .05 m/s, all its contacts within .1 dx or closing get -e v_app: one impact is one
    event. v_app leaves out this step's gravity, so that nothing rebounds faster than it fell.
    """
    target = np.maximum(contacts.gap, 0.0) / dt
    before = approach - rebound.kick
    closing = approach * dt > contacts.gap
    fast = (before > SLOWEST_BOUNCE) & (rebound.restitution > 0.0)
    hit = np.isin(rebound.pair, rebound.pair[closing & fast])
    bounces = hit & fast & (closing | (contacts.gap < PATCH * cell))
    return np.where(bounces, -rebound.restitution * before, target), bool(bounces.any())


def solve(contacts: Contacts, movers: Movers, target: Scalars, sweeps: int) -> Vectors:
    """Find all impulses J [N s], -J on a and +J on c, and move the movers.

    Projected Gauss–Seidel on accumulated impulses: J_n ≥ 0 removes the approach speed above its
    target, |J_t| ≤ μ J_n opposes the slip. Each impulse moves its two movers at once through
    their true effective mass 1/M + (r × d)ᵀ I⁻¹ (r × d), along the normal and along the slip.
    Conserves momentum to round-off and never adds kinetic energy where targets are ≥ 0.
    """
    impulse = np.zeros((len(contacts.a), 3))
    _sweep(
        (contacts.a, contacts.c, contacts.point, contacts.normal, contacts.friction, target),
        (movers.inverse_mass, movers.inverse_inertia, movers.centre),
        (movers.velocity, movers.spin),
        impulse,
        _orders(contacts, movers, sweeps),
    )
    return impulse


def _orders(contacts: Contacts, movers: Movers, sweeps: int) -> Int[np.ndarray, "S E"]:
    """Give the order of every sweep: forwards, or to and fro where rigid bodies are stacked.

    With one order for all sweeps the first contacts carry more, and stacks creep to one side. To
    and fro, each run of contacts between the same two things is turned about in every second
    sweep; that needs the many sweeps of a stack, and a lone block stands better without.
    """
    forward = np.arange(len(contacts.a))
    changed = (np.diff(contacts.a) != 0) | (np.diff(contacts.c) != 0)
    starts = np.flatnonzero(np.concatenate([[True], changed]))
    block = np.cumsum(np.concatenate([[True], changed])) - 1
    ends = np.append(starts[1:], len(forward))
    turned = (starts + ends - 1)[block] - forward if len(forward) else forward
    rigid = np.any(movers.inverse_inertia != 0.0, axis=(1, 2))
    stacked = bool(np.any(rigid[contacts.a] & rigid[contacts.c]))
    backward = turned if stacked else forward
    return np.stack([forward, backward] * ((sweeps + 1) // 2))[:sweeps]


@njit(cache=True)
def _cross(p, q):
    return np.array(
        [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
    )


@njit(cache=True)
def _softness(inverse_mass, inverse_inertia, arm, direction):
    """1/m_eff of one mover at an arm, along a direction."""
    lever = _cross(arm, direction)
    return inverse_mass + np.dot(lever, np.dot(inverse_inertia, lever))


@njit(cache=True)
def _tangential(impulse, slip, softness, limit):
    """Push against the slip, at most to the Coulomb limit."""
    if softness > 0.0:
        impulse = impulse + slip / softness
    size = np.sqrt(np.dot(impulse, impulse))
    return impulse * (limit / size) if size > limit else impulse


@njit(cache=True)
def _sweep(contacts, masses, motion, impulse, orders):
    """Gauss–Seidel sweeps over all contacts, in given orders; changes motion and impulse."""
    first, second, point, normals, friction, target = contacts
    inverse_mass, inverse_inertia, centre = masses
    velocity, spin = motion
    for order in orders:
        for e in order:
            a, c, n, old = first[e], second[e], normals[e], impulse[e].copy()
            arm_a, arm_c = point[e] - centre[a], point[e] - centre[c]
            slip = velocity[a] + _cross(spin[a], arm_a) - velocity[c] - _cross(spin[c], arm_c)
            along_n = _softness(inverse_mass[a], inverse_inertia[a], arm_a, n)
            along_n += _softness(inverse_mass[c], inverse_inertia[c], arm_c, n)
            speed, old_n = np.dot(slip, n), np.dot(old, n)
            new_n = max(0.0, old_n + (speed - target[e]) / along_n) if along_n > 0.0 else 0.0
            if new_n == 0.0 and old_n == 0.0:
                continue
            slip = slip - speed * n
            size, along_d = np.sqrt(np.dot(slip, slip)), 0.0
            if size > 1e-14:
                along_d = _softness(inverse_mass[a], inverse_inertia[a], arm_a, slip / size)
                along_d += _softness(inverse_mass[c], inverse_inertia[c], arm_c, slip / size)
            push = _tangential(old - old_n * n, slip, along_d, friction[e] * new_n)
            impulse[e] = new_n * n + push
            change = impulse[e] - old
            velocity[a] -= inverse_mass[a] * change
            velocity[c] += inverse_mass[c] * change
            spin[a] -= np.dot(inverse_inertia[a], _cross(arm_a, change))
            spin[c] += np.dot(inverse_inertia[c], _cross(arm_c, change))


def friction_loss(impulse: Vectors, normal: Vectors, before: Vectors, after: Vectors) -> float:
    """Kinetic energy [J] that the tangential impulses took: Σ J_t · ½ (u_before + u_after).

    ``before`` is the relative velocity as the step began, before its forces: then the works of
    stress, gravity and contact, each at the mean velocity of the step, add up to what the kinetic
    energy gained. After the forces, a contact that only holds against them would seem to slip.
    """
    tangential = impulse - np.sum(impulse * normal, axis=1, keepdims=True) * normal
    return float(np.sum(tangential * 0.5 * (before + after)))

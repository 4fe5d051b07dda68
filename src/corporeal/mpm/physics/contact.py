"""Contact between fields on grid nodes: where a face lies, which way it looks, what it transmits.

A pair of fields (a, c) meets at a node; n points from a to c. Every field shows itself there by
its mean offset X̄ from the node and by its outward volume gradient g. Walls are half spaces.
"""

from dataclasses import dataclass
from math import gcd
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from numba import njit
from scipy.spatial import KDTree

from corporeal.mpm.constants import (
    DEEPEST,
    FACE_STEPS,
    FIRST_BIAS,
    HELD_BY_WALL,
    IMPACTS,
    LATTICE_GAP,
    LATTICE_SLOPE,
    LATTICE_START,
    LIKE_HALF_SPACE,
    OTHER_BIAS,
    PATCH,
    SCATTER,
    SLOWEST_BOUNCE,
    SMALLEST_SLIP,
    SMALLEST_WEIGHT,
    SWEEPS_OF_A_HIT,
    TINY,
    WALL_REACH,
    WETTED_FACES,
    WETTED_PATCH,
    WETTED_REACH,
    WETTED_TURN,
)
from corporeal.mpm.problem import WettedSurface

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
    return np.where(weight > SMALLEST_WEIGHT, moment / np.maximum(weight, SMALLEST_WEIGHT), near)


_FACES = np.linspace(-1.5, 1.5, 6001)
_MEANS = np.maximum.accumulate(half_space_mean(_FACES))


def half_space_face(mean: np.ndarray) -> np.ndarray:
    """D = e⁻¹: where the face lies [dx] of a half space whose mean offset is ``mean`` [dx]."""
    return np.interp(mean, _MEANS, _FACES)


def face_table() -> Float[np.ndarray, " K"]:
    """D at ``FACE_STEPS`` + 1 mean offsets from -1½ to 0 [dx]: what fast engines interpolate."""
    return half_space_face(np.linspace(-1.5, 0.0, FACE_STEPS + 1))


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
    return np.where(h > WALL_REACH, np.inf, gap)


def surface_begins(points: Vectors, node: Vectors, normal: Vectors, around: float) -> Scalars:
    """Where a thin rigid body begins along n, seen from each node [m]: least (p - x)·n.

    Its surface points nearer than ``around`` [m] to the line through the node along n count; where
    there are none, the one nearest to the line does.

    Args:
        points: On its surface [m].
        node: Where it is looked from [m].
        normal: Along which, unit.
        around: [m]

    """
    offset = points[None, :] - node[:, None]
    along = np.einsum("enk,ek->en", offset, normal)
    aside = np.sum(offset**2, axis=2) - along**2
    least = np.where(aside < around**2, along, np.inf).min(axis=1)
    nearest = np.take_along_axis(along, np.argmin(aside, axis=1)[:, None], axis=1)[:, 0]
    return np.where(np.isfinite(least), least, nearest)


def gap_to_surface(mean: Vectors, begins: Scalars, normal: Vectors, cell: float) -> Scalars:
    """Open distance along n [m] of a field to a surface that begins there [m] beyond the node."""
    return gap_to_wall(mean, begins, normal, cell)


def gap_of_liquid(mean: Vectors, height: Scalars, outward: Vectors, cell: float) -> Scalars:
    """Open distance [m] of a liquid to a rigid surface that lies ``height`` [m] below the node.

    Pressure pushes every node whose spline reaches the surface, and a wall that answers behind its
    face alone would let the first layer of a liquid be squeezed along it. So nodes up to
    ``HELD_BY_WALL`` above are in contact too, where the liquid fills the half space up to the face
    as far as the node can tell; what is thinner than a cell is not.
    """
    h = height / cell
    gap = gap_to_wall(mean, height, -outward, cell)
    off = half_space_mean(h) + np.sum(mean * outward, axis=1) / cell
    xi = -np.sum(mean * outward, axis=1) / cell
    deep = (-half_space_mean(-h) - xi - touching_distance(h)) * cell
    held = (h > WALL_REACH) & (h <= HELD_BY_WALL) & (np.abs(off) < LIKE_HALF_SPACE)
    return np.where(held, deep, gap)


class WettedFaces(NamedTuple):
    """Faces of a rigid body that nodes of a liquid see; F rows, at most three for a node."""

    node: Indices
    """Which node."""
    outward: Vectors
    """Unit, out of the body."""
    height: Scalars
    """Of the node over the face [m]."""


def wetted_faces(surface: WettedSurface, node: Vectors, place: Vectors, cell: float) -> WettedFaces:
    """Say where a rigid body's surface lies for the liquid at each node.

    The surface point nearest to the liquid's own place decides which face of a thin wall it is; it
    and its neighbours that look alike are averaged, w = (1 - u)² with u from 0 at the nearest to 1
    at ``WETTED_PATCH`` beyond it in squared distance. What looks another way, and at the liquid, is
    one more face: walls of a vessel and its bottom hold a node together.

    Args:
        surface: The body's, now.
        node: Nodes [m].
        place: Mean place of the liquid at each [m].
        cell: dx [m].

    """
    rows: list[tuple[int, np.ndarray, float]] = []
    around = KDTree(surface.point).query_ball_point(place, WETTED_REACH * cell)
    for k, near in enumerate(around):
        point, normal = surface.point[near], surface.normal[near]
        square = np.sum((point - place[k]) ** 2, axis=1)
        left = np.ones(len(near), dtype=bool)
        for _ in range(WETTED_FACES):
            if not left.any():
                break
            first = np.flatnonzero(left)[np.argmin(square[left])]
            far = (np.sqrt(square[first]) + WETTED_PATCH * cell) ** 2
            mine = left & (square <= far) & (normal @ normal[first] >= WETTED_TURN)
            weight = (1.0 - (square[mine] - square[first]) / (far - square[first])) ** 2
            above = np.sum((node[k] - point[mine]) * normal[mine], axis=1)
            outward = unit(weight @ normal[mine])
            rows.append((k, outward, weight @ above / weight.sum()))
            looks = np.sum((place[k] - point) * normal, axis=1) > 0.0
            left &= looks & (normal @ outward <= WETTED_TURN)
    return WettedFaces(
        np.array([k for k, _, _ in rows], dtype=np.int64),
        np.array([n for _, n, _ in rows]).reshape(-1, 3),
        np.array([h for _, _, h in rows], dtype=np.float64),
    )


# ---------------------------------------------------------------- which way it looks


def unit(v: np.ndarray) -> np.ndarray:
    """v/|v| along the last axis; zero stays zero."""
    size = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.where(size > TINY, v / np.maximum(size, TINY), 0.0)


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
    group: Indices | None = None
    """Contacts of one pair of bodies, found in one way, are swept together, groups one after the
    other; None: all are one group."""

    def approach(self, movers: Movers) -> Vectors:
        """Slip and approach together: u = v_a - v_c [m/s]."""
        return movers.velocity_at(self.a, self.point) - movers.velocity_at(self.c, self.point)

    def repeated(self, times: int) -> "Contacts":
        """Say everything several times, one block after the other."""
        columns = {k: column for k, column in self._asdict().items() if column is not None}
        return Contacts(**{k: np.concatenate([column] * times) for k, column in columns.items()})


class Rebound(NamedTuple):
    """What decides whether rigid contacts bounce in this step."""

    pair: Indices
    """Which pair of bodies the contact belongs to."""
    restitution: Scalars
    """Newton's e; 0 unless both partners are rigid or a wall."""
    kick: Scalars
    """Approach speed that gravity and pushes added in this step [m/s]."""
    feigned: Scalars
    """Speed at which a body that rolls on its surface points meets the next one [m/s]: its spin
    times their distance. What closes no faster than that and .05 m/s does not rebound."""


def target_speeds(
    contacts: Contacts, speed: Scalars, rebound: Rebound, cell: float, dt: float
) -> tuple[Scalars, Bool[np.ndarray, " E"]]:
    """Give the normal speed each contact may keep [m/s], and whose pairs are in an impact.

    An open gap may close within the step, max(g, 0)/dt. Where one contact of a rigid pair closes
    with v_app > .05 m/s, all its contacts within .1 dx or closing get -e v_app: one impact is one
    event. v_app leaves out this step's gravity, so that nothing rebounds faster than it fell.

    Args:
        contacts: Where things touch.
        speed: At which they approach along n [m/s].
        rebound: How they rebound.
        cell: dx [m].
        dt: [s]

    """
    approach = speed - np.maximum(rebound.kick, 0.0)
    closing = speed * dt > contacts.gap
    fast = (approach > SLOWEST_BOUNCE + rebound.feigned) & (rebound.restitution > 0.0)
    hit = np.isin(rebound.pair, rebound.pair[closing & fast])
    bounces = hit & fast & (closing | (contacts.gap < PATCH * cell))
    target = np.maximum(contacts.gap, 0.0) / dt
    return np.where(bounces, -rebound.restitution * approach, target), hit


def solve_impacts(
    contacts: Contacts, movers: Movers, rebound: Rebound, cell: float, dt: float
) -> Vectors:
    """Let rigid pairs that are hit rebound, one impact after the other, and move the movers.

    What is hit passes the blow on to what it touches: in every round the pairs that approach now
    rebound together and all others wait (generalized reflections: Smith, Kaufman, Vouga, Tamstorf
    and Grinspun 2012, "Reflections on simultaneous impact"). Solved at once, all pairs of a row of
    touching balls would share the blow; in rounds it runs through to the last.

    Returns:
        Impulses J [N s], as of ``solve``.

    """
    total = np.zeros((len(contacts.a), 3))
    for _ in range(IMPACTS):
        speed = np.sum(contacts.approach(movers) * contacts.normal, axis=1)
        target, hit = target_speeds(contacts, speed, rebound, cell, dt)
        if not hit.any():
            break
        total += solve(contacts, movers, target, SWEEPS_OF_A_HIT, hit)
    return total


def solve(
    contacts: Contacts,
    movers: Movers,
    target: Scalars,
    sweeps: int,
    only: Bool[np.ndarray, " E"] | None = None,
) -> Vectors:
    """Find all impulses J [N s], -J on a and +J on c, and move the movers.

    Projected Gauss–Seidel on accumulated impulses: J_n ≥ 0 removes the approach speed above its
    target, |J_t| ≤ μ J_n opposes the slip. Each impulse moves its two movers at once through
    their true effective mass 1/M + (r × d)ᵀ I⁻¹ (r × d), along the normal and along the slip.
    Conserves momentum to round-off and never adds kinetic energy where targets are ≥ 0. Contacts
    that are not among ``only``, whole groups, wait.
    """
    impulse = np.zeros((len(contacts.a), 3))
    orders = _orders(contacts, movers, sweeps)
    if only is not None:
        orders = np.stack([order[only[order]] for order in orders])
    _sweep(
        (contacts.a, contacts.c, contacts.point, contacts.normal, contacts.friction, target),
        (movers.inverse_mass, movers.inverse_inertia, movers.centre),
        (movers.velocity, movers.spin),
        impulse,
        orders,
    )
    return impulse


def _orders(contacts: Contacts, movers: Movers, sweeps: int) -> Int[np.ndarray, "S E"]:
    """Give the order of every sweep: scattered, and to and fro where rigid bodies are stacked.

    In the order in which the contacts of a rigid body lie next to one another the first would carry
    more, and what rests on many points would tilt and sink; with one order for all sweeps stacks
    creep. Nodes without a rigid body have few contacts each, which stay as they are.
    """
    rigid = np.any(movers.inverse_inertia != 0.0, axis=(1, 2))
    either = np.logical_or(rigid[contacts.a], rigid[contacts.c])
    held = movers.inverse_mass[contacts.c] == 0.0
    stacked = bool(np.any(rigid[contacts.a] & rigid[contacts.c]))
    turns = rigid[contacts.a] & (rigid[contacts.c] | (held & stacked))
    group = np.zeros(len(either), np.int64) if contacts.group is None else contacts.group
    forward = [np.flatnonzero(np.logical_not(either))]
    backward = [*forward]
    for number in np.unique(group[either]):
        own = np.flatnonzero(either & (group == number))
        own = own[scattered(len(own))]
        forward.append(own)
        backward.append(own[::-1] if turns[own].all() else own)
    to, fro = np.concatenate(forward), np.concatenate(backward)
    return np.stack([to, fro] * ((sweeps + 1) // 2))[:sweeps]


def scattered(count: int) -> Int[np.ndarray, " E"]:
    """Give numbers in strides of the golden section of how many they are, modulo that many."""
    stride = max(1, int(SCATTER * count))
    while stride > 1 and gcd(stride, count) > 1:
        stride -= 1
    return np.arange(count) * stride % max(count, 1)


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
            if size > SMALLEST_SLIP:
                along_d = _softness(inverse_mass[a], inverse_inertia[a], arm_a, slip / size)
                along_d += _softness(inverse_mass[c], inverse_inertia[c], arm_c, slip / size)
            push = _tangential(old - old_n * n, slip, along_d, friction[e] * new_n)
            impulse[e] = new_n * n + push
            change = impulse[e] - old
            velocity[a] -= inverse_mass[a] * change
            velocity[c] += inverse_mass[c] * change
            spin[a] -= np.dot(inverse_inertia[a], _cross(arm_a, change))
            spin[c] += np.dot(inverse_inertia[c], _cross(arm_c, change))


def impact_loss(impulse: Vectors, normal: Vectors, before: Vectors, after: Vectors) -> float:
    """Kinetic energy [J] that the normal impulses took: Σ J_n · ½ (u_before + u_after).

    Of a rigid rebound ½ m (1 - e²) v². Matter that is soft stops at a node at once, half a cell of
    it: so much the more, the coarser the grid.
    """
    along = np.sum(impulse * normal, axis=1, keepdims=True) * normal
    return float(np.sum(along * 0.5 * (before + after)))


def friction_loss(impulse: Vectors, normal: Vectors, before: Vectors, after: Vectors) -> float:
    """Kinetic energy [J] that the tangential impulses took: Σ J_t · ½ (u_before + u_after).

    ``before`` is the relative velocity as the step began, before its forces: then the works of
    stress, gravity and contact, each at the mean velocity of the step, add up to what the kinetic
    energy gained. After the forces, a contact that only holds against them would seem to slip.
    """
    tangential = impulse - np.sum(impulse * normal, axis=1, keepdims=True) * normal
    return float(np.sum(tangential * 0.5 * (before + after)))

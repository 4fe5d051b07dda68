"""Contact between fields on grid nodes: impulses and dissipation.

Rigid bodies' impacts come first, in rounds of sweeps; then all contacts, with Coulomb friction.
"""

from dataclasses import dataclass
from math import gcd
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from numba import njit

from corporeal.mpm.constants import (
    IMPACT_PATCH_DX,
    IMPACT_SWEEPS,
    MAX_IMPACTS_PER_STEP,
    MIN_REBOUND_SPEED,
    MIN_SLIP_SPEED,
    SIMULTANEOUS_SWEEPS,
    SUPPORTED_IMPACT_SWEEPS,
    SWEEP_STRIDE_FRACTION,
)
from corporeal.mpm.physics import impact_support
from corporeal.mpm.physics.contact import Indices, Scalars, Vectors
from corporeal.mpm.physics.wall_stress import drag_impulse


@dataclass
class Movers:
    """D objects that impulses move: grid nodes (no inertia), rigid bodies, one immovable wall."""

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

    def velocity_at(self, mover: Int[np.ndarray, " E"], point: Float[np.ndarray, "E 3"]) -> Float[np.ndarray, "E 3"]:
        """V + ω × r of each mover at a point [m/s]."""
        (p, q, r), (x, y, z) = self.spin[mover].T, (point - self.centre[mover]).T
        turning = np.stack([q * z - r * y, r * x - p * z, p * y - q * x], axis=1)
        return self.velocity[mover] + turning


class ContactList(NamedTuple):
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
    """Contacts of one pair of bodies, found in one way, are swept together, groups one after the other; None: all are
    one group."""
    layer: Float[np.ndarray, "E 4"] | None = None
    """Of walls that drag on a liquid (``wall_stress``): span [m² s], yield stress [Pa], drag and index; without a span
    it is Coulomb's friction. None: none does."""
    guided: Bool[np.ndarray, " E"] | None = None
    """Which are of a rigid body with one that follows a prescribed path; None: none is."""

    def approach(self, movers: Movers) -> Vectors:
        """Slip and approach together: u = v_a - v_c [m/s]."""
        return movers.velocity_at(self.a, self.point) - movers.velocity_at(self.c, self.point)

    def repeated(self, times: int) -> "ContactList":
        """Say everything several times, one block after the other."""
        columns = {k: column for k, column in self._asdict().items() if column is not None}
        return ContactList(**{k: np.concatenate([column] * times) for k, column in columns.items()})


class ReboundRules(NamedTuple):
    """What decides whether rigid contacts bounce in this step."""

    pair: Indices
    """Which pair the contact belongs to: number of its first body times how many bodies and planes there are, and the
    second's."""
    restitution: Scalars
    """Newton's e; 0 unless both partners are rigid or a wall."""
    kick: Scalars
    """Approach speed that gravity and pushes added in this step [m/s]."""
    feigned: Scalars
    """Speed at which a body that rolls on its surface points meets the next one [m/s]: its spin times their distance.
    What closes no faster than that and .05 m/s does not rebound."""
    bodies: impact_support.ImpactBodies | None = None
    """What may hold them from behind; None: nothing does."""


def target_speeds(
    contacts: ContactList, speed: Scalars, rebound: ReboundRules, cell: float, dt: float
) -> tuple[Scalars, Bool[np.ndarray, " E"]]:
    """Return the normal speed each contact may keep [m/s], and whose pairs are in an impact.

    An open gap may close within the step, max(g, 0)/dt. Where one contact of a rigid pair closes with v_app > .05 m/s,
    all its contacts within .1 dx or closing get -e v_app: one impact is one event. v_app leaves out this step's
    gravity, so that nothing rebounds faster than it fell.

    Args:
        contacts: Where objects touch.
        speed: At which they approach along n [m/s].
        rebound: How they rebound.
        cell: dx [m].
        dt: [s]
    """
    approach = approach_of(speed, rebound)
    closing = speed * dt > contacts.gap
    fast = (approach > MIN_REBOUND_SPEED + rebound.feigned) & (rebound.restitution > 0.0)
    hit = np.isin(rebound.pair, rebound.pair[closing_fast(contacts, speed, rebound, dt)])
    bounces = hit & fast & (closing | (contacts.gap < IMPACT_PATCH_DX * cell))
    target = np.maximum(contacts.gap, 0.0) / dt
    return np.where(bounces, -rebound.restitution * approach, target), hit


def approach_of(speed: Scalars, rebound: ReboundRules) -> Scalars:
    """Approach speed without this step's forces [m/s], so that nothing gains from them."""
    return speed - np.maximum(rebound.kick, 0.0)


def closing_fast(contacts: ContactList, speed: Scalars, rebound: ReboundRules, dt: float) -> Bool[np.ndarray, " E"]:
    """Which contacts close within the step fast enough to begin an impact."""
    fast = approach_of(speed, rebound) > MIN_REBOUND_SPEED + rebound.feigned
    return (speed * dt > contacts.gap) & fast & (rebound.restitution > 0.0)


def solve_impacts(contacts: ContactList, movers: Movers, rebound: ReboundRules, cell: float, dt: float) -> Vectors:
    """Let rigid pairs that are hit rebound, one impact after the other, and move the movers.

    The struck body passes the impact on to what it touches: in every round the pairs that approach now rebound together
    and all others wait (generalized reflections: Smith, Kaufman, Vouga, Tamstorf and Grinspun 2012, "Reflections on
    simultaneous impact"). Solved at once, all pairs of a row of touching balls would share the impact; in rounds it
    runs through to the last. What is light between what strikes it and what it rests on is held in the same round
    (``impact_support``).

    Returns:
        Impulses J [N s], as of ``solve``.
    """
    total = np.zeros((len(contacts.a), 3))
    for _ in range(MAX_IMPACTS_PER_STEP):
        speed = np.sum(contacts.approach(movers) * contacts.normal, axis=1)
        target, hit = target_speeds(contacts, speed, rebound, cell, dt)
        if not hit.any():
            break
        sweeps = IMPACT_SWEEPS
        if rebound.bodies is not None:
            c = contacts
            approach = np.where(closing_fast(c, speed, rebound, dt), approach_of(speed, rebound), 0.0)
            seen = impact_support.ImpactContacts(rebound.pair, c.point, c.normal, c.gap, speed, hit, approach)
            now = impact_support.ImpactRound.of(rebound.bodies, seen, cell)
            bounces = rebound._replace(restitution=now.bounce(rebound.restitution))
            target, _ = target_speeds(contacts, speed, bounces, cell, dt)
            target = np.where(now.held & (contacts.gap < IMPACT_PATCH_DX * cell), 0.0, target)
            hit, sweeps = hit | now.held, SUPPORTED_IMPACT_SWEEPS if now.held.any() else sweeps
        total += solve(contacts, movers, target, sweeps, hit)
    return total


def solve(
    contacts: ContactList, movers: Movers, target: Scalars, sweeps: int, only: Bool[np.ndarray, " E"] | None = None
) -> Vectors:
    """Find all impulses J [N s], -J on a and +J on c, and move the movers.

    Projected Gauss–Seidel on accumulated impulses: J_n ≥ 0 removes the approach speed above its
    target, |J_t| ≤ μ J_n opposes the slip. Each impulse moves its two movers at once through
    their true effective mass 1/M + (r × d)ᵀ I⁻¹ (r × d), along the normal and along the slip.
    Conserves momentum to round-off and never adds kinetic energy where targets are ≥ 0. Contacts
    that are not among ``only``, whole groups, wait.
    """
    impulse = np.zeros((len(contacts.a), 3))
    orders = _sweep_orders(contacts, movers, sweeps)
    if only is not None:
        orders = np.stack([order[only[order]] for order in orders])
    layer = np.zeros((len(target), 4)) if contacts.layer is None else contacts.layer
    given = (
        (contacts.a, contacts.c, contacts.point, contacts.normal),
        (contacts.friction, target, layer),
        (movers.inverse_mass, movers.inverse_inertia, movers.centre),
        (movers.velocity, movers.spin),
        impulse,
    )
    _sweep(*given, orders)
    # What follows a prescribed path may leave no room between: sweeps then end as the last contacts have it.
    if contacts.guided is not None and contacts.guided[orders[0]].any():
        _solve_simultaneously(*given, orders[0])
    return impulse


def _sweep_orders(contacts: ContactList, movers: Movers, sweeps: int) -> Int[np.ndarray, "S E"]:
    """Return the order of every sweep: scattered, and to and fro where rigid bodies are stacked.

    In the order in which the contacts of a rigid body lie next to one another the first would carry more, and what
    rests on many points would tilt and sink; with one order for all sweeps stacks creep. Nodes without a rigid body
    have few contacts each, which stay as they are.
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
        own = own[golden_section_order(len(own))]
        forward.append(own)
        backward.append(own[::-1] if turns[own].all() else own)
    to, fro = np.concatenate(forward), np.concatenate(backward)
    return np.stack([to, fro] * ((sweeps + 1) // 2))[:sweeps]


def golden_section_order(count: int) -> Int[np.ndarray, " E"]:
    """Give numbers in strides of the golden section of how many they are, modulo that many."""
    stride = max(1, int(SWEEP_STRIDE_FRACTION * count))
    while stride > 1 and gcd(stride, count) > 1:
        stride -= 1
    return np.arange(count) * stride % max(count, 1)


@njit(cache=True)
def _cross(p, q):
    return p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]


@njit(cache=True)
def _dot(p, q):
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


@njit(cache=True)
def _minus(p, q):
    return p[0] - q[0], p[1] - q[1], p[2] - q[2]


@njit(cache=True)
def _plus(p, factor, q):
    """Add a multiple of q to p."""
    return p[0] + factor * q[0], p[1] + factor * q[1], p[2] + factor * q[2]


@njit(cache=True)
def _turned(matrix, p):
    return _dot(matrix[0], p), _dot(matrix[1], p), _dot(matrix[2], p)


@njit(cache=True)
def _softness(inverse_mass, inverse_inertia, arm, direction):
    """1/m_eff of one mover at an arm, along a direction."""
    lever = _cross(arm, direction)
    return inverse_mass + _dot(lever, _turned(inverse_inertia, lever))


@njit(cache=True)
def _speed_at(velocity, spin, arm):
    return _plus(_cross(spin, arm), 1.0, velocity)


@njit(cache=True)
def _tangential(impulse, slip, softness, limit, layer):
    """Push against the slip, at most to the Coulomb limit; or as a viscous layer does."""
    along_n, along_slip = softness
    if along_slip > 0.0:
        impulse = _plus(impulse, 1.0 / along_slip, slip)
    if layer[0] > 0.0:
        stopped = drag_impulse(np.array(impulse), along_slip if along_slip > 0.0 else along_n, layer)
        return stopped[0], stopped[1], stopped[2]
    size = np.sqrt(_dot(impulse, impulse))
    return _plus((0.0, 0.0, 0.0), min(1.0, limit / size) if size > 0.0 else 1.0, impulse)


@njit(cache=True)
def _push(vector, factor, change):
    for k in range(3):
        vector[k] += factor * change[k]


@njit(cache=True)
def _move(mover, sign, arm, impulse, masses, motion):
    """Give a mover an impulse, or take it, at an arm from its centre."""
    inverse_mass, inverse_inertia, _ = masses
    velocity, spin = motion
    _push(velocity[mover], sign * inverse_mass[mover], impulse)
    _push(spin[mover], sign, _turned(inverse_inertia[mover], _cross(arm, impulse)))


# Vectors are tuples: products of small arrays call BLAS and make an array each, which takes
# fifteen times as long.
@njit(cache=True)
def _sweep(contacts, rules, masses, motion, impulse, orders):
    """Gauss–Seidel sweeps over all contacts, in given orders; changes motion and impulse."""
    first, second, point, normals = contacts
    friction, target, layer = rules
    inverse_mass, inverse_inertia, centre = masses
    velocity, spin = motion
    for order in orders:
        for e in order:
            a, c = first[e], second[e]
            n = (normals[e, 0], normals[e, 1], normals[e, 2])
            old = (impulse[e, 0], impulse[e, 1], impulse[e, 2])
            arm_a, arm_c = _minus(point[e], centre[a]), _minus(point[e], centre[c])
            slip = _minus(_speed_at(velocity[a], spin[a], arm_a), _speed_at(velocity[c], spin[c], arm_c))
            along_n = _softness(inverse_mass[a], inverse_inertia[a], arm_a, n)
            along_n += _softness(inverse_mass[c], inverse_inertia[c], arm_c, n)
            speed, old_n = _dot(slip, n), _dot(old, n)
            new_n = max(0.0, old_n + (speed - target[e]) / along_n) if along_n > 0.0 else 0.0
            if new_n == 0.0 and old_n == 0.0 and layer[e, 0] == 0.0:
                continue
            slip = _plus(slip, -speed, n)
            size, along_d = np.sqrt(_dot(slip, slip)), 0.0
            if size > MIN_SLIP_SPEED:
                along = _plus((0.0, 0.0, 0.0), 1.0 / size, slip)
                along_d = _softness(inverse_mass[a], inverse_inertia[a], arm_a, along)
                along_d += _softness(inverse_mass[c], inverse_inertia[c], arm_c, along)
            limit = friction[e] * new_n
            push = _tangential(_plus(old, -old_n, n), slip, (along_n, along_d), limit, layer[e])
            now = _plus(push, new_n, n)
            change = _minus(now, old)
            for k in range(3):
                impulse[e, k] = now[k]
            _move(a, -1.0, arm_a, change, masses, motion)
            _move(c, 1.0, arm_c, change, masses, motion)


@njit(cache=True)
def _solve_simultaneously(contacts, rules, masses, motion, impulse, order):
    """Solve all contacts from the same motion, each with an equal share of what it would change."""
    first, second, point, _ = contacts
    velocity, spin = motion
    one = np.zeros((1, 1), np.int64)
    for _ in range(SIMULTANEOUS_SWEEPS):
        before, many = impulse.copy(), 0
        for e in order:
            a, c, one[0, 0] = first[e], second[e], e
            held = velocity[a].copy(), velocity[c].copy(), spin[a].copy(), spin[c].copy()
            _sweep(contacts, rules, masses, motion, impulse, one)
            velocity[a], velocity[c], spin[a], spin[c] = held
            many += np.any(impulse[e] != before[e])
        if many == 0:
            return
        for e in order:
            change = (impulse[e] - before[e]) / many
            impulse[e] = before[e] + change
            for mover, sign in ((first[e], -1.0), (second[e], 1.0)):
                _move(mover, sign, _minus(point[e], masses[2][mover]), change, masses, motion)


def impact_loss(impulse: Vectors, normal: Vectors, before: Vectors, after: Vectors) -> Scalars:
    """Kinetic energy [J] that each normal impulse took: J_n · ½ (u_before + u_after).

    Of a rigid rebound ½ m (1 - e²) v². Material that is soft stops at a node at once, half a cell of it: so much the
    more, the coarser the grid.
    """
    along = np.sum(impulse * normal, axis=1, keepdims=True) * normal
    return np.sum(along * 0.5 * (before + after), axis=1)


def friction_loss(impulse: Vectors, normal: Vectors, before: Vectors, after: Vectors) -> float:
    """Kinetic energy [J] that the tangential impulses took: Σ J_t · ½ (u_before + u_after).

    ``before`` is the relative velocity as the step began, before its forces: then the works of stress, gravity and
    contact, each at the mean velocity of the step, add up to what the kinetic energy gained. After the forces, a
    contact that only holds against them would seem to slip.
    """
    tangential = impulse - np.sum(impulse * normal, axis=1, keepdims=True) * normal
    return float(np.sum(tangential * 0.5 * (before + after)))

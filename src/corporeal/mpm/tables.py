"""What the native pieces read of bodies: rows of particles, materials and rigid states."""

import numpy as np

from corporeal.mpm import elasticity, rigid
from corporeal.mpm.bond import around, densities
from corporeal.mpm.kernels import BOND, ID, MA, MATERIAL, MT, NC, VE, VO
from corporeal.mpm.plasticity import SMALLEST_ANGLE, cone_slope
from corporeal.mpm.problem import Body, Problem
from corporeal.mpm.stability import forgetting_rate
from corporeal.types import Law

PLASTIC_LAWS = (Law.DRUCKER_PRAGER.value, Law.VON_MISES.value)
STRESSLESS = 5.0
"""Law of a rigid body's particles in a shared field."""
PUSH = 10
RIGID = 64
"""Doubles of a rigid state: mass, centre 3, rotation 9, inverse inertia at rest 9, velocity 3,
angular momentum 3, inverse inertia now 9, spin 3, radius, kick 3, and
while a frame holds soft nodes its own mass and centre 3."""
CENTRE, TURN, REST, SPEED, MOMENT, INERTIA, SPIN, RADIUS, KICK = 1, 4, 13, 22, 25, 28, 37, 40, 41


def materials(problem: Problem, bodies: list[int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Different materials of some bodies: table, each particle's row in it, the row's body.

    Columns: law, μ, λ [Pa], σ_y [Pa], H [Pa], cone slope α, apex strain p₀/K, η [Pa s],
    forgetting rate [1/s], ρ [kg/m³], this step's push [m/s] (3).
    """
    rows = np.concatenate([_rows(problem, problem.bodies[b], b) for b in bodies])
    # Momentum is kept only if all that share a field forget at one rate.
    rows[:, 9] = rows[:, 9].max()
    unique, index = _different(rows)
    table = np.zeros((len(unique), MATERIAL), np.float32)
    table[:, :PUSH] = unique[:, 1:]
    return table, index.astype(np.int32), unique[:, 0].astype(np.int64)


def swells(table: np.ndarray) -> bool:
    """Whether a field's pressure comes from the mean swelling around each particle."""
    return bool(elasticity.is_stiff_in_bulk(table[:, 0], table[:, 1], table[:, 2]).all())


def _different(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Different rows, and which of them each row is; neighbours are mostly equal."""
    new = np.r_[True, (rows[1:] != rows[:-1]).any(axis=1)]
    unique, index = np.unique(rows[new], axis=0, return_inverse=True)
    return unique, index.reshape(-1)[np.cumsum(new) - 1]


def _rows(problem: Problem, body: Body, number: int) -> np.ndarray:
    count = len(body.position)
    rows = np.zeros((count, 11))
    rows[:, 0], rows[:, 10] = number, body.density
    if body.rigid:
        rows[:, 1], rows[:, 9] = STRESSLESS, 1e30
        return rows
    mu, lam = (np.asarray(value) for value in elasticity.lame(body.young, body.poisson))
    wave = np.sqrt((lam + 2.0 * mu) / body.density)
    angle = np.maximum(body.friction_angle, SMALLEST_ANGLE)
    sand = body.law == Law.DRUCKER_PRAGER.value
    rows[:, 1], rows[:, 2], rows[:, 3] = body.law, mu, lam
    rows[:, 4], rows[:, 5] = body.yield_stress, body.hardening
    rows[sand, 6] = np.asarray(cone_slope(angle))[sand]
    rows[sand, 7] = (body.cohesion / np.tan(angle))[sand] / (lam + 2.0 * mu / 3.0)[sand]
    rows[:, 8] = body.viscosity
    affine = (problem.transfer == "apic") | (body.young == 0.0)
    pull = float(np.linalg.norm(problem.gravity))
    rate = forgetting_rate(wave, sand, pull, problem.cell)
    rows[:, 9] = np.where(affine, 1e30, rate)
    return rows


def particle_rows(
    problem: Problem, bodies: list[int], first: list[int], kind: np.ndarray
) -> np.ndarray:
    """Channels of some bodies' particles at rest shape, (P, NC); places are filled in later."""
    parts = [problem.bodies[b] for b in bodies]
    rows = np.zeros((len(kind), NC), np.float32)
    volume = np.concatenate([b.volume for b in parts])
    rows[:, VE : VE + 3] = np.concatenate([b.velocity for b in parts])
    rows[:, MA] = volume * np.concatenate([b.density for b in parts])
    rows[:, VO] = volume
    rows[:, MT] = kind.view(np.float32)
    number = np.concatenate(
        [first[b] + np.arange(len(p.position)) for b, p in zip(bodies, parts, strict=True)]
    )
    rows[:, ID] = number.astype(np.int32).view(np.float32)
    return rows


def rigid_state(body: Body) -> np.ndarray:
    """State of a rigid body from its particles."""
    weight = body.volume * body.density
    mass = rigid.mass_of(body.position, weight, body.volume)
    speed, moment = rigid.fit_motion(mass, body.position, weight, body.velocity)
    state = np.zeros(RIGID)
    state[0], state[CENTRE : CENTRE + 3] = mass.total, mass.centre
    state[TURN : TURN + 9] = np.eye(3).ravel()
    state[REST : REST + 9] = np.linalg.inv(mass.inertia).ravel()
    state[SPEED : SPEED + 3], state[MOMENT : MOMENT + 3] = speed, moment
    state[INERTIA : INERTIA + 9] = state[REST : REST + 9]
    state[SPIN : SPIN + 3] = np.linalg.inv(mass.inertia) @ moment
    points = np.concatenate([body.position, body.surface.reshape(-1, 3)])
    state[RADIUS] = np.linalg.norm(points - mass.centre, axis=1).max()
    return state


def bonds(problem: Problem) -> tuple[np.ndarray, list[np.ndarray]]:
    """Native records of the bonds, and each frame's points near what it holds, in its own frame.

    A point is place [m] and volume [m³]. Where held nodes are kept is filled in later.
    """
    pairs = problem.bonds if problem.contact == "multi" else ()
    rows, points = np.zeros(len(pairs), BOND), []
    for row, (f, s) in zip(rows, pairs, strict=True):
        frame, soft = problem.bodies[f], problem.bodies[s]
        stiff, held = densities(frame, soft, problem.cell)
        mass, chosen = frame.volume * frame.density, around(frame, soft, problem.cell)
        place = frame.position - mass @ frame.position / mass.sum()
        points.append(np.column_stack([place, mass / stiff])[chosen])
        row["point"], row["points"] = points[-1].ctypes.data, len(points[-1])
        row["per_soft"], row["frame"], row["soft"] = 1.0 / held, f, s
    return rows, points


def rigid_points(body: Body, state: np.ndarray) -> np.ndarray:
    """Particles in the body's frame: place [m], mass [kg], volume [m³]."""
    place = body.position - state[CENTRE : CENTRE + 3]
    return np.column_stack([place, body.volume * body.density, body.volume])

"""Springs: tethers of particles, joints of rigid bodies, and grips from outside.

Tethers and grips are explicit, J = -dt (k u + c v): ``longest_step`` keeps them stable. A joint is
implicit in both its point, which is kept together, and its turn, which is sprung at mid-step (soft
constraints: Catto 2011, "Soft Constraints", Game Developers Conference).
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from corporeal.mpm import rigid
from corporeal.mpm.loads import Load
from corporeal.mpm.matter import Matter, State
from corporeal.mpm.problem import Joint, Problem, Tether

CLOSING = 0.2
"""Share of a joint's gap that is closed in a step."""
LONGEST, LONGEST_TURN = 0.05, 0.2
"""Longest step as a fraction of 1/ω of a tether, whose energy swings by ω dt/2, and of a joint."""


@dataclass(frozen=True)
class Pulled:
    """What the springs gave in one step."""

    state: State
    """With the impulses on rigid bodies in their velocities."""
    load: Load
    """What other bodies' particles get."""
    loss: float
    """What dampers took [J]."""


def pull(
    problem: Problem,
    matter: Matter,
    state: State,
    kicks: tuple[Float[np.ndarray, "B 3"], Float[np.ndarray, "B 3"]],
    dt: float,
) -> Pulled:
    """Let tethers and joints act; they do nothing in a field that all share.

    Args:
        problem: Where the springs are.
        matter: All particles.
        state: Before gravity and pushes.
        kicks: What both add to the bodies' velocities in this step, and the pushes alone [m/s]; the
            result has them.
        dt: [s]

    """
    kick, push = kicks
    if problem.contact == "single":
        return Pulled(replace(state, speed=state.speed + kick), Load.none(), 0.0)
    pulled, first = Pulled(state, Load.none(), 0.0), 0
    for body in problem.bodies:
        if body.tether is not None:
            pulled = tethered(pulled, body.tether, first, matter, dt)
            pulled = borne(pulled, body.tether, first, matter, (kick - push)[0])
        first += len(body.position)
    pulled = replace(pulled, state=replace(pulled.state, speed=pulled.state.speed + kick))
    for joint in problem.joints:
        pulled = joined(pulled, joint, matter, dt)
    return pulled


def tethered(pulled: Pulled, tether: Tether, first: int, matter: Matter, dt: float) -> Pulled:
    """Pull every tethered particle back; the holder gets the reaction where the particle is."""
    state, h = pulled.state, tether.holder
    own = first + np.flatnonzero(tether.rate)
    rate = tether.rate[tether.rate > 0]
    start = matter.arm[own] + matter.centre[matter.body[own]] - matter.centre[h]
    arm = start @ state.rotation[h].T
    u = state.position[own] - state.centre[h] - arm
    v = state.velocity[own] - state.speed[h] - np.cross(state.spin(matter)[h], arm)
    brake = 2.0 * tether.damping * rate
    mass = matter.mass[own]
    impulse = -(mass * dt)[:, None] * (rate[:, None] ** 2 * u + brake[:, None] * v)
    middle = v + 0.5 * impulse / mass[:, None]
    loss = float(np.sum(mass * dt * brake * np.sum(v * middle, axis=1)))
    place = state.position[own] - state.centre[h]
    after = struck(state, matter, h, -impulse.sum(axis=0), -np.cross(place, impulse).sum(axis=0))
    return Pulled(after, pulled.load.joined(Load(own, impulse)), pulled.loss + loss)


def borne(
    pulled: Pulled, tether: Tether, first: int, matter: Matter, gained: Float[np.ndarray, "3"]
) -> Pulled:
    """Let the holder bear the weight of what is tethered to it.

    Args:
        pulled: So far.
        tether: Which.
        first: Number of the body's first particle.
        matter: All particles.
        gained: Velocity that gravity gives in this step [m/s].

    """
    state, h = pulled.state, tether.holder
    own = first + np.flatnonzero(tether.rate)
    impulse = -matter.mass[own][:, None] * gained
    place = state.position[own] - state.centre[h]
    after = struck(state, matter, h, -impulse.sum(axis=0), -np.cross(place, impulse).sum(axis=0))
    return replace(pulled, state=after, load=pulled.load.joined(Load(own, impulse)))


def struck(
    state: State,
    matter: Matter,
    body: int,
    impulse: Float[np.ndarray, "3"],
    moment: Float[np.ndarray, "3"],
) -> State:
    """Give a rigid body an impulse [N s] and an angular one about its centre [N m s]."""
    speed, spin = state.speed.copy(), state.spin_momentum.copy()
    speed[body] += impulse / matter.total[body]
    spin[body] += moment
    return replace(state, speed=speed, spin_momentum=spin)


def joined(pulled: Pulled, joint: Joint, matter: Matter, dt: float) -> Pulled:
    """Keep a joint's point together and spring its turn, both at once and implicitly.

    [A  B     ] [J]   [-v - .2 e/dt      ]
    [Bᵀ D + γ1] [T] = [-ω - k θ/s       ],  s = c + k dt/2, γ = 1/(dt s), with v, ω and e the
    relative velocity, spin and gap of the second body from the first at the point, θ its turn.
    """
    state, a, c = pulled.state, joint.first, joint.second
    point = np.array(joint.point)
    arms = [state.rotation[b] @ (point - matter.centre[b]) for b in (a, c)]
    inverse = [state.inverse_inertia(matter)[b] for b in (a, c)]
    spin = state.spin(matter)
    crossed = [rigid.cross_matrix(arm) for arm in arms]
    gap = state.centre[c] + arms[1] - state.centre[a] - arms[0]
    v = state.speed[c] + np.cross(spin[c], arms[1]) - state.speed[a] - np.cross(spin[a], arms[0])
    turn = turn_of(state.rotation[c] @ state.rotation[a].T)
    lever = [R @ W for R, W in zip(crossed, inverse, strict=True)]
    stiff = joint.damping + 0.5 * joint.stiffness * dt
    light = 1 / matter.total[a] + 1 / matter.total[c]
    A = light * np.eye(3) - lever[0] @ crossed[0] - lever[1] @ crossed[1]
    B = -lever[0] - lever[1]
    D = inverse[0] + inverse[1] + np.eye(3) / (dt * stiff)
    wanted = [-v - CLOSING / dt * gap, spin[a] - spin[c] - joint.stiffness / stiff * turn]
    given = np.linalg.solve(np.block([[A, B], [B.T, D]]), np.concatenate(wanted))
    J, T = given[:3], given[3:]
    after = struck(state, matter, a, -J, -np.cross(arms[0], J) - T)
    after = struck(after, matter, c, J, np.cross(arms[1], J) + T)
    relative = after.spin(matter)[c] - after.spin(matter)[a]
    loss = joint.damping * dt * float(relative @ relative)
    return replace(pulled, state=after, loss=pulled.loss + loss)


def turn_of(R: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3"]:
    """Rotation vector of a rotation by less than half a turn [rad]."""
    axis = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine, cosine = float(np.linalg.norm(axis)), 0.5 * (float(np.trace(R)) - 1.0)
    return axis * (np.arctan2(sine, cosine) / sine if sine > 1e-12 else 1.0)


def stored(
    problem: Problem,
    position: Float[np.ndarray, "P 3"],
    centre: Float[np.ndarray, "B 3"],
    rotation: Float[np.ndarray, "B 3 3"],
    start: Float[np.ndarray, "B 3"],
) -> Float[np.ndarray, " B"]:
    """Energy in the springs [J]: of a tether with its body, of a joint with its second one.

    Args:
        problem: Where the springs are.
        position: Of all particles [m].
        centre: Of the rigid bodies [m].
        rotation: Of the rigid bodies.
        start: Where their centres were at first [m].

    """
    energy, first = np.zeros(len(problem.bodies)), 0
    for b, body in enumerate(problem.bodies):
        mine = slice(first, first := first + len(body.position))
        if body.tether is not None and problem.contact == "multi":
            h, mass = body.tether.holder, body.volume * body.density
            anchor = (body.position - start[h]) @ rotation[h].T + centre[h]
            away = np.sum((position[mine] - anchor) ** 2, axis=1)
            energy[b] += 0.5 * float(np.sum(mass * body.tether.rate**2 * away))
            held = mass * (body.tether.rate > 0)
            energy[b] += float(held @ (position[mine] - anchor) @ np.array(problem.gravity))
    for joint in problem.joints if problem.contact == "multi" else ():
        turn = turn_of(rotation[joint.second] @ rotation[joint.first].T)
        energy[joint.second] += 0.5 * joint.stiffness * float(turn @ turn)
    return energy


def longest_step(problem: Problem) -> float:
    """Longest step [s] that follows every spring's oscillation."""
    rates = [float(b.tether.rate.max()) / LONGEST for b in problem.bodies if b.tether is not None]
    for joint in problem.joints:
        pair = [problem.bodies[b] for b in (joint.first, joint.second)]
        inertia = [rigid.mass_of(b.position, b.volume * b.density, b.volume).inertia for b in pair]
        lightest = min(float(np.linalg.eigvalsh(i)[0]) for i in inertia)
        rates.append(float(np.sqrt(joint.stiffness / lightest)) / LONGEST_TURN)
    return 1.0 / max([*rates, 1e-30])

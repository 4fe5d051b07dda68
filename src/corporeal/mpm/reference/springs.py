"""Tethers and joints in the reference engine, acting on its state."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from corporeal.mpm.constants import JOINT_GAP_FRACTION_PER_STEP
from corporeal.mpm.physics import rigid
from corporeal.mpm.physics.springs import rotation_vector
from corporeal.mpm.problem import Joint, Problem, Tether
from corporeal.mpm.reference.loads import ParticleLoads
from corporeal.mpm.state import ParticleConstants, State


@dataclass(frozen=True)
class SpringOutcome:
    """What the springs gave in one step."""

    state: State
    """With the impulses on rigid bodies in their velocities."""
    load: ParticleLoads
    """What other bodies' particles get."""
    loss: float
    """What dampers took [J]."""


def apply_springs(
    problem: Problem,
    matter: ParticleConstants,
    state: State,
    kicks: tuple[Float[np.ndarray, "B 3"], Float[np.ndarray, "B 3"]],
    dt: float,
) -> SpringOutcome:
    """Let tethers and joints act; they do nothing in a field that all share.

    Args:
        problem: Where the springs are.
        matter: All particles.
        state: Before gravity and pushes.
        kicks: What both add to the bodies' velocities in this step, and the pushes alone [m/s]; the result has them.
        dt: [s]
    """
    kick, push = kicks
    if problem.contact == "single":
        return SpringOutcome(replace(state, speed=state.speed + kick), ParticleLoads.none(), 0.0)
    pulled, first = SpringOutcome(state, ParticleLoads.none(), 0.0), 0
    for body in problem.bodies:
        if body.tether is not None:
            pulled = pull_tethered(pulled, body.tether, first, matter, dt)
            pulled = load_holder(pulled, body.tether, first, matter, (kick - push)[0])
        first += len(body.position)
    pulled = replace(pulled, state=replace(pulled.state, speed=pulled.state.speed + kick))
    for joint in problem.joints:
        pulled = hold_joint(pulled, joint, matter, dt)
    return pulled


def pull_tethered(
    pulled: SpringOutcome, tether: Tether, first: int, matter: ParticleConstants, dt: float
) -> SpringOutcome:
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
    after = add_impulse(state, matter, h, -impulse.sum(axis=0), -np.cross(place, impulse).sum(axis=0))
    return SpringOutcome(after, pulled.load.joined(ParticleLoads(own, impulse)), pulled.loss + loss)


def load_holder(
    pulled: SpringOutcome, tether: Tether, first: int, matter: ParticleConstants, gained: Float[np.ndarray, "3"]
) -> SpringOutcome:
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
    after = add_impulse(state, matter, h, -impulse.sum(axis=0), -np.cross(place, impulse).sum(axis=0))
    return replace(pulled, state=after, load=pulled.load.joined(ParticleLoads(own, impulse)))


def add_impulse(
    state: State, matter: ParticleConstants, body: int, impulse: Float[np.ndarray, "3"], moment: Float[np.ndarray, "3"]
) -> State:
    """Give a rigid body an impulse [N s] and an angular one about its centre [N m s]."""
    speed, spin = state.speed.copy(), state.spin_momentum.copy()
    speed[body] += impulse / matter.total[body]
    spin[body] += moment
    return replace(state, speed=speed, spin_momentum=spin)


def hold_joint(pulled: SpringOutcome, joint: Joint, matter: ParticleConstants, dt: float) -> SpringOutcome:
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
    turn = rotation_vector(state.rotation[c] @ state.rotation[a].T)
    lever = [R @ W for R, W in zip(crossed, inverse, strict=True)]
    stiff = joint.damping + 0.5 * joint.stiffness * dt
    light = 1 / matter.total[a] + 1 / matter.total[c]
    A = light * np.eye(3) - lever[0] @ crossed[0] - lever[1] @ crossed[1]
    B = -lever[0] - lever[1]
    D = inverse[0] + inverse[1] + np.eye(3) / (dt * stiff)
    wanted = [-v - JOINT_GAP_FRACTION_PER_STEP / dt * gap, spin[a] - spin[c] - joint.stiffness / stiff * turn]
    given = np.linalg.solve(np.block([[A, B], [B.T, D]]), np.concatenate(wanted))
    J, T = given[:3], given[3:]
    after = add_impulse(state, matter, a, -J, -np.cross(arms[0], J) - T)
    after = add_impulse(after, matter, c, J, np.cross(arms[1], J) + T)
    relative = after.spin(matter)[c] - after.spin(matter)[a]
    loss = joint.damping * dt * float(relative @ relative)
    return replace(pulled, state=after, loss=pulled.loss + loss)

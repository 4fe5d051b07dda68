"""Springs: tethers of particles, joints of rigid bodies, and grips from outside.

Tethers and grips are explicit, J = -dt (k u + c v): ``longest_step`` keeps them stable. A joint is implicit in both its
point, which is kept together, and its turn, which is sprung at mid-step (soft constraints: Catto 2011, "Soft
Constraints", Game Developers Conference).
"""

import numpy as np
from jaxtyping import Float

from corporeal.mpm.constants import JOINT_STEP_FRACTION, MIN_ROTATION_SINE, TETHER_STEP_FRACTION, TINY
from corporeal.mpm.physics import rigid
from corporeal.mpm.problem import Problem


def rotation_vector(R: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3"]:
    """Rotation vector of a rotation by less than half a turn [rad]."""
    axis = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine, cosine = float(np.linalg.norm(axis)), 0.5 * (float(np.trace(R)) - 1.0)
    return axis * (np.arctan2(sine, cosine) / sine if sine > MIN_ROTATION_SINE else 1.0)


def has_springs(problem: Problem) -> bool:
    """Whether there are any tethers or joints."""
    return bool(problem.joints) or any(body.tether is not None for body in problem.bodies)


def stored_spring_energy(
    problem: Problem, position: Float[np.ndarray, "P 3"], bodies: dict[int, rigid.RigidBody]
) -> Float[np.ndarray, " B"]:
    """Energy in the springs [J]: of a tether with its body, of a joint with its second one.

    Args:
        problem: Where the springs are.
        position: Of all particles [m].
        bodies: The rigid ones, by number.
    """
    energy, first = np.zeros(len(problem.bodies)), 0
    for b, body in enumerate(problem.bodies):
        mine = slice(first, first := first + len(body.position))
        if body.tether is not None and problem.contact == "multi":
            holder, mass = bodies[body.tether.holder], body.volume * body.density
            anchor = (body.position - holder.start) @ holder.rotation.T + holder.centre
            away = np.sum((position[mine] - anchor) ** 2, axis=1)
            energy[b] += 0.5 * float(np.sum(mass * body.tether.rate**2 * away))
            held = mass * (body.tether.rate > 0)
            energy[b] += float(held @ (position[mine] - anchor) @ np.array(problem.gravity))
    for joint in problem.joints if problem.contact == "multi" else ():
        turn = rotation_vector(bodies[joint.second].rotation @ bodies[joint.first].rotation.T)
        energy[joint.second] += 0.5 * joint.stiffness * float(turn @ turn)
    return energy


def longest_step(problem: Problem) -> float:
    """Longest step [s] that follows every spring's oscillation."""
    tethers = [body.tether for body in problem.bodies if body.tether is not None]
    rates = [float(tether.rate.max()) / TETHER_STEP_FRACTION for tether in tethers]
    for joint in problem.joints:
        pair = [problem.bodies[b] for b in (joint.first, joint.second)]
        inertia = [rigid.mass_and_inertia(b.position, b.volume * b.density, b.volume).inertia for b in pair]
        lightest = min(float(np.linalg.eigvalsh(i)[0]) for i in inertia)
        rates.append(float(np.sqrt(joint.stiffness / lightest)) / JOINT_STEP_FRACTION)
    return 1.0 / max([*rates, TINY])

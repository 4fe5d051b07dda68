"""Prescribed motion in the reference engine: bodies are steered before a step and booked after."""

from dataclasses import replace

import numpy as np

from corporeal.mpm.ledger import EngineLedger
from corporeal.mpm.physics.prescribed_motion import PathFollower, PathStep, longest_step, path_followers
from corporeal.mpm.problem import Problem
from corporeal.mpm.reference.contact import ContactOutcome
from corporeal.mpm.state import ParticleConstants, State


class PrescribedBodies:
    """The bodies of a problem with prescribed motion."""

    def __init__(self, problem: Problem) -> None:
        self.guide: dict[int, PathFollower] = path_followers(problem)
        self.longest_step = longest_step(problem)
        """[s]"""
        self.gravity = np.array(problem.gravity)

    def steer(self, state: State, matter: ParticleConstants, dt: float) -> tuple[State, dict[int, PathStep]]:
        """Give bodies the velocities that take them where their paths say in a step of dt [s]."""
        end, found = float(state.time) + dt, {}
        speed, momentum = state.speed.copy(), state.spin_momentum.copy()
        for b, guide in self.guide.items():
            R = state.rotation[b]
            found[b] = guide.follow(end, dt, state.centre[b], R)
            speed[b] = found[b].velocity
            momentum[b] = R @ matter.inertia[b] @ R.T @ found[b].spin
        return replace(state, speed=speed, spin_momentum=momentum), found

    def place(self, state: State, matter: ParticleConstants, guided: dict[int, PathStep]) -> State:
        """Turn bodies exactly as prescribed, at the end of a step; they keep their spin."""
        if not guided:
            return state
        rotation, momentum = state.rotation.copy(), state.spin_momentum.copy()
        for b, there in guided.items():
            R = rotation[b] = there.rotation
            momentum[b] = R @ matter.inertia[b] @ R.T @ there.spin
        return replace(state, rotation=rotation, spin_momentum=momentum).follow_rigid(matter)

    def book(
        self, book: EngineLedger, matter: ParticleConstants, before: State, after: State, meeting: ContactOutcome
    ) -> None:
        """Book what moving the bodies took in a step: see ``physics.prescribed``."""
        for b in self.guide:
            sign = 1.0 * (meeting.pair[:, 1] == b) - (meeting.pair[:, 0] == b)
            given = sign[:, None] * meeting.impulse
            arm = meeting.contacts.point - before.centre[b]
            velocity = meeting.speed[b] + np.cross(meeting.spin[b], arm)
            mass, moved = matter.total[b], after.centre[b] - before.centre[b]
            gained = _kinetic(after, matter, b) - _kinetic(before, matter, b)
            gained -= mass * float(self.gravity @ moved)
            thrust = mass * (after.speed[b] - before.speed[b])
            book.external_impulse[b] += thrust - given.sum(axis=0)
            turned = float(meeting.moment[b] @ meeting.spin[b])
            book.push_work += gained - float(np.sum(given * velocity)) - turned


def _kinetic(state: State, matter: ParticleConstants, b: int) -> float:
    """Kinetic energy of a rigid body [J]."""
    v, spin = state.speed[b], state.spin(matter)[b]
    return 0.5 * float(matter.total[b] * v @ v + spin @ state.spin_momentum[b])

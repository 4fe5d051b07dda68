"""A body struck while it rests on a floor: fine springs in one dimension, and rules for impacts.

A striker of mass 1 at speed 1 meets a body of mass m that lies on a floor. Both contacts are
unilateral springs F = k δ^p, of which a part e² comes back while they open (a loss that knows no
frequency). k: stiffness of the contact with the floor over that of the impact, at equal forces.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from corporeal.mpm.physics.impact_support import responds_within_impact

STEPS = 20
"""Steps in one radian of the quickest vibration."""
SLOWEST = 0.01
"""Slower approaches, over the speed of the impact, are none [-]."""
ROUNDS = 50


@dataclass(frozen=True)
class Case:
    """One impact."""

    mass: float
    """Of the body between, over the striker's [-]."""
    stiffness: float
    """k [-]."""
    bounce: float
    """Restitution of striker and body [-] …"""
    floor: float
    """… and of body and floor."""
    power: float = 1.5
    """p: 1 a spring, 1.5 Hertz' contact."""


def in_springs(case: Case) -> tuple[float, float]:
    """Speeds after the impact of striker and body, back from the floor [-], of fine steps."""
    stiffness = case.stiffness**case.power
    return _springs(case.mass, stiffness, case.power, case.bounce**2, case.floor**2)


@njit(cache=True)
def _springs(mass, stiffness, power, kept, kept_below):
    dent = (0.5 * (power + 1.0)) ** (1.0 / (power + 1.0))
    own = power * dent ** (power - 1.0)
    dt = 1.0 / (STEPS * np.sqrt(own * (1.0 + stiffness) / mass + own))
    x, y, v, u, time = 0.0, 0.0, 1.0, 0.0, 0.0
    while time < 120.0 * max(1.0, mass) ** 0.5 * max(1.0, stiffness**-0.5):
        above, below = 0.0, 0.0
        if x > y:
            turns = np.tanh((v - u) / 1e-3)
            above = (x - y) ** power * 0.5 * (1.0 + kept + (1.0 - kept) * turns)
        if y > 0.0:
            turns = np.tanh(u / 1e-3)
            below = stiffness * y**power * 0.5 * (1.0 + kept_below + (1.0 - kept_below) * turns)
        v -= dt * above
        u += dt * (above - below) / mass
        x, y, time = x + dt * v, y + dt * u, time + dt
        if x <= y and v <= u and (abs(u) < 1e-3 if y > 0.0 else u <= 0.0):
            break
    return -v, -u


def in_rounds(case: Case) -> tuple[float, float]:
    """Return the same one impact after the other, as before."""
    v, u, mass = 1.0, 0.0, case.mass
    for _ in range(ROUNDS):
        if v - u > SLOWEST:
            push = (1.0 + case.bounce) * (v - u) * mass / (1.0 + mass)
            v, u = v - push, u + push / mass
        elif u > SLOWEST:
            u = -case.floor * u
        else:
            break
    if v > u:
        v = u = (v + mass * u) / (1.0 + mass)
    u = min(u, 0.0)
    return -min(v, u), -u


def held(case: Case) -> tuple[float, float]:
    """Hold the body: both contacts are springs in series."""
    k = case.stiffness
    return float(np.sqrt((k * case.bounce**2 + case.floor**2) / (k + 1.0))), 0.0


def held_alone(case: Case) -> tuple[float, float]:
    """Hold the body, and say that the floor's contact loses nothing."""
    return case.bounce, 0.0


def by_rule(case: Case) -> tuple[float, float]:
    """Do as the engines do: hold it where it swings quickly, else in rounds."""
    return (held if responds_within_impact(case.stiffness, case.mass, 1.0, 0.0) else in_rounds)(case)


RULES = {
    "in rounds": in_rounds,
    "always held, e of the impact": held_alone,
    "always held, in series": held,
    "held where it swings quickly": by_rule,
}


def cases(least: float = 1.0) -> list[Case]:
    """Masses from 1e-3 to 1e3, stiffness from ``least`` to 1e3, six pairs of restitution."""
    bounces = ((1.0, 1.0), (0.9, 0.9), (0.8, 0.8), (0.8, 0.4), (0.5, 0.5), (0.4, 0.8))
    return [
        Case(float(mass), float(k), e, floor, power)
        for power in (1.0, 1.5)
        for e, floor in bounces
        for mass in np.logspace(-3, 3, 13)
        for k in np.logspace(0, 3, 7)
        if k >= least
    ]


def errors(rule: str, given: list[Case]) -> np.ndarray:
    """How far the striker's speed is from that in springs [-]."""
    found = RULES[rule]
    return np.array([found(case)[0] - in_springs(case)[0] for case in given])

"""Bodies at rest: case 11."""

from dataclasses import dataclass

import numpy as np

from corporeal.mpm.problem import Body
from laws.bodies import DOWN, G, Stuff, box, box_surface, floor, problem
from laws.outcome import Check, Outcome, absolute, relative
from laws.watching import History, started, watch

RUBBER = Stuff(young_pa=1e6, poisson=0.3, density=1000.0)
RAMP = 0.1
"""Time in which gravity grows [s]: a sudden weight would make what is soft bounce."""
SIDE, CELL = 0.1, 0.025


@dataclass(frozen=True)
class Rest:
    """How things stood for one second."""

    lateral: float
    """Largest move sideways of any body [dx]."""
    normal: float
    """Largest move up or down of any body, after the weight has come on [dx]."""
    impulse: float
    """Of the floor, relative to m g T [-]."""


def at_rest(history: History) -> Rest:
    """Judge a history that lasted ten ramps of gravity."""
    moved = history.moved / CELL
    settled = history.time >= 2 * RAMP
    later = moved[settled, :, 2] - moved[settled][0, :, 2]
    last = history.measures[-1]
    weight = last.mass.sum() * G * (last.time - 0.5 * RAMP)
    held = last.plane_impulse[0].sum(axis=0)[2]
    return Rest(float(np.abs(moved[:, :, :2]).max()), float(np.abs(later).max()), float(held / weight))


def cubes(count: int, rigid: bool) -> list[Body]:
    """Stack cubes of .1 m, off the grid's symmetry."""
    found = []
    for k in range(count):
        centre = (0.2 * CELL, 0.4 * CELL, SIDE * (k + 0.5))
        skin = box_surface(centre, (SIDE,) * 3) if rigid else None
        found.append(box(centre, (SIDE,) * 3, CELL / 2, stuff=RUBBER, rigid=rigid, surface=skin))
    return found


def standing(count: int, rigid: bool, time: float = 1.0) -> Rest:
    """Let cubes stand on one another on the floor."""
    run = started(
        problem(*cubes(count, rigid), cell=CELL, friction=0.5, planes=[floor()], gravity=DOWN, gravity_ramp=RAMP)
    )
    return at_rest(watch(run, time, 40))


def braked(rigid: bool) -> float:
    """Throw a block along the floor at 1.5 m/s: its way to rest, relative to v²/(2 μ g) [-]."""
    size, speed, mu = (0.2, 0.1, 0.1), 1.5, 0.3
    centre = (0.1, 0.3 * CELL, 0.05)
    skin = box_surface(centre, size, 17) if rigid else None
    block = box(centre, size, CELL / 2, stuff=RUBBER, rigid=rigid, surface=skin, velocity=(speed, 0.0, 0.0))
    run = started(problem(block, cell=CELL, friction=mu, planes=[floor()], gravity=DOWN))
    history = watch(run, speed / (mu * G) + 0.1, 20)
    return float(history.moved[:, 0, 0].max() / (speed**2 / (2 * mu * G)))


def bodies_at_rest(quick: bool = False) -> Outcome:
    """Case 11: nothing moves, and the floor carries the weight."""
    checks: list[Check] = []
    time = 0.5 if quick else 1.0
    block = standing(1, False, time)
    checks += [
        absolute("block: move up or down [dx]", block.normal, 0.0, 0.006, "dx"),
        absolute("block: move sideways [% dx]", 100 * block.lateral, 0.0, 0.2, "% dx"),
        absolute("block: impulse of the floor / m g T", block.impulse, 1.0, 0.015),
    ]
    soft, stiff = standing(5, False, time), standing(5, True, time)
    checks += [
        absolute("five soft cubes: move sideways [dx]", soft.lateral, 0.0, 0.02, "dx"),
        absolute("five rigid cubes: move sideways [dx]", stiff.lateral, 0.0, 0.1, "dx"),
    ]
    if not quick:
        checks.append(relative("thrown block: way to rest / (v²/2μg)", braked(False), 1.0, 0.2))
    words = f"{time} s, gravity grows in 0.1 s, 4 cells across a cube"
    return Outcome("11", "What lies stays, and the floor carries it", words, tuple(checks))

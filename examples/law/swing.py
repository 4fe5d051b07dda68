"""How a bar of one material swings along itself: ``python swing.py MATERIAL``."""

import json
import sys
from collections.abc import Callable
from functools import partial

import numpy as np

import corporeal as co

CELL, LENGTH, WIDTH = 0.01, 16, 4
"""Cell [m]; length and width of the bar [cells]."""
PUSH = 1e-3
"""Fastest point over the speed of sound [-]: strains are small."""


def bar(law: int, young_pa: float, density: float) -> co.Problem:
    """Pose a free bar that does not bulge (ν = 0), all of whose points move in its slowest mode."""
    axes = [CELL * (np.arange(0.25, n, 0.5) - n / 2) for n in (LENGTH, WIDTH, WIDTH)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    one, none = np.ones(len(points)), np.zeros(len(points))
    mode = np.sin(np.pi * points[:, 0] / (LENGTH * CELL))
    velocity = PUSH * np.sqrt(young_pa / density) * mode[:, None] * [1.0, 0.0, 0.0]
    numbers = dict.fromkeys(("poisson", "yield_stress", "hardening"), none)
    numbers |= dict.fromkeys(("friction_angle", "cohesion", "loss", "vibration"), none)
    numbers |= {"young_pa": young_pa * one, "density": density * one, "volume": CELL**3 / 8 * one}
    laws = np.full(len(points), law)
    body = co.Body(name="bar", position=points, velocity=velocity, law=laws, **numbers)
    alone = np.zeros((1, 1))
    return co.Problem((body,), CELL, alone, alone, planes=(), gravity=(0.0, 0.0, 0.0))


def swing(material: str, build: Callable[[co.Problem], co.Engine]) -> dict[str, float]:
    """Return the quarter period over L/2c, and the energy that is stored then over the motion's."""
    entry = co.material(material)
    young_pa, density = entry.ranges["young_pa"].typical, entry.ranges["density"].typical
    problem = bar(entry.law.value, young_pa, density)
    run, quarter = build(problem), 0.5 * LENGTH * CELL / np.sqrt(young_pa / density)
    mode, start = problem.bodies[0].velocity[:, 0], run.measure().kinetic[0]
    times, speed, stored = quarter * np.linspace(0.8, 1.2, 9), [], []
    for time in times:
        run.advance(float(time))
        speed.append(mode @ run.snapshot().velocity[:, 0])
        stored.append(run.measure().elastic[0])
    still = np.interp(0.0, -np.array(speed), times)
    return {"period": float(still / quarter), "stored": float(max(stored) / start)}


if __name__ == "__main__":
    print(json.dumps(swing(sys.argv[1], partial(co.build_engine, engine="reference"))))

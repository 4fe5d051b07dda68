"""Speed of the production engine: nanoseconds per particle and substep.

    python benchmarks/engine.py [--quick] [--json FILE]

A block falls freely (loops alone), and lies on the floor with a heavy rigid ball on it (with
contact). Each is stepped on one thread and on all; a row is the least of several runs.
"""

import argparse
import json
import os
import time
from pathlib import Path

import numpy as np

from corporeal.mpm.problem import FLOOR, Body, Problem
from corporeal.mpm.warp import WarpEngine
from corporeal.types import Law

SIZE = (0.4, 0.4, 0.1)
"""Of the block [m]."""


def lattice(low: np.ndarray, high: np.ndarray, spacing: float) -> np.ndarray:
    """Points of a cubic lattice within a box, (N, 3)."""
    axes = [np.arange(a + spacing / 2, b, spacing) for a, b in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)


def matter(name: str, points: np.ndarray, spacing: float, law: Law, **given) -> Body:
    """Fill a body with one material."""
    one = np.ones(len(points))
    return Body(
        name=name,
        position=points,
        velocity=np.zeros_like(points),
        volume=one * spacing**3,
        density=one * given.pop("density", 1600.0),
        law=np.full(len(points), law.value),
        young=one * 1e6,
        poisson=one * 0.3,
        yield_stress=one * 2e4,
        hardening=one * 0.0,
        friction_angle=one * np.radians(32.0),
        cohesion=one * 0.0,
        viscosity=one * 0.0,
        **given,
    )


def problem(law: Law, count: int, contact: bool) -> Problem:
    """Build the block, with or without the floor and the ball."""
    spacing = float(np.cbrt(np.prod(SIZE) / count))
    half = np.array([SIZE[0] / 2, SIZE[1] / 2, 0.0])
    block = lattice(-half, half + np.array([0, 0, SIZE[2]]), spacing)
    bodies = [matter("block", block, spacing, law)]
    if contact:
        radius, centre = 0.05, np.array([0.0, 0.0, SIZE[2] + 0.05])
        points = lattice(centre - radius, centre + radius, spacing)
        points = points[np.linalg.norm(points - centre, axis=1) < radius]
        bodies.append(matter("ball", points, spacing, law, density=7800.0, rigid=True))
    planes = (FLOOR,) if contact else ()
    n = len(bodies) + len(planes)
    return Problem(
        tuple(bodies),
        2 * spacing,
        friction=np.full((n, n), 0.5),
        restitution=np.zeros((n, n)),
        planes=planes,
    )


def measure(given: Problem, threads: int, steps: int) -> float:
    """Least time per particle and substep over five runs of ``steps`` [ns]."""
    engine = WarpEngine(given, threads=threads)
    for _ in range(steps):
        engine.step(engine.stable_step())
    least = np.inf
    for _ in range(5):
        start = time.perf_counter()
        for _ in range(steps):
            engine.step(engine.stable_step())
        least = min(least, time.perf_counter() - start)
    return 1e9 * least / steps / len(given.bodies[0].position)


def main() -> None:
    """Print a table, and write the rows where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer particles and steps")
    parser.add_argument("--json", type=Path, help="write the rows to this file")
    chosen = parser.parse_args()
    count, steps = (20_000, 10) if chosen.quick else (100_000, 20)
    rows = []
    for law in (Law.COROTATED, Law.NEO_HOOKEAN, Law.DRUCKER_PRAGER, Law.VON_MISES):
        for contact in (False, True):
            for threads in sorted({1, os.cpu_count() or 1}):
                cost = measure(problem(law, count, contact), threads, steps)
                rows.append(
                    {
                        "law": law.name.lower(),
                        "contact": contact,
                        "threads": threads,
                        "particles": count,
                        "ns_per_particle_step": round(cost, 1),
                    }
                )
                print(
                    f"{law.name.lower():16s} {'with' if contact else 'no':4s} contact "
                    f"{threads:2d} threads {cost:7.1f} ns per particle and substep"
                )
    if chosen.json:
        chosen.json.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()

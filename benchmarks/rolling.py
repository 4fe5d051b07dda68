"""How far what is drawn round rolls, with and without knowing that it is: the table of decision 58.

A ball of 50 mm on the floor, by how finely it is drawn, a marble of 12 mm and a cylinder of 20 mm
on a steel board, at detail draft; 5°, or .3 m/s on the level. About half a minute.
"""

from dataclasses import replace

import numpy as np
import trimesh

import corporeal as co
from corporeal.mpm.problem import Problem
from corporeal.types import ROUNDING

G, SLOPE = 9.81, np.radians(5)
LEVEL = (0.0, 0.0, -G)
DOWN = (G * np.sin(SLOPE), 0.0, -G * np.cos(SLOPE))
BALL, MARBLE, CYLINDER, THICK = 0.05, 0.012, 0.02, 0.02
BOARD = co.box("steel", (0.5, 0.1, THICK))


def drawn(faces: int) -> co.Solid:
    """Return a steel ball of 20, 80, 320, … triangles on the floor."""
    shape = trimesh.creation.icosphere(int(np.log(faces / 20) / np.log(4) + 0.5), BALL)
    low = [0.0, 0.0, shape.vertices[:, 2].min()]
    return co.solid("steel", np.array(shape.vertices) - low, shape.faces)


def lying() -> co.Solid:
    """Return a steel cylinder that lies across a board."""
    shape = trimesh.creation.cylinder(CYLINDER, 0.06, sections=48)
    shape.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    at = np.array([-0.2, 0.0, THICK + CYLINDER])
    return co.solid("steel", np.array(shape.vertices) + at, shape.faces)


def marble(speed: float = 0.0) -> co.Solid:
    """Return a marble at one end of a board."""
    return co.ball("glass", MARBLE, (-0.2, 0.0, THICK + MARBLE), velocity=(speed, 0.0, 0.0))


def posed(*solids: co.Solid, gravity: tuple) -> Problem:
    """Make a scene's problem, with all of gravity from the start."""
    scene = co.build_scene(*solids, gravity=gravity)
    return replace(co.pose_problem(co.prepare(scene)), gravity_ramp=0.0)


def moved(problem: Problem, time: float) -> tuple[float, float, float]:
    """Way [m] and speed [m/s] of the first body, and what normal contact took [J]."""
    engine = co.build_engine(problem)
    start = engine.measure().centre[0, 0]
    engine.advance(time)
    found = engine.measure()
    speed = found.momentum[0, 0] / found.mass[0]
    return found.centre[0, 0] - start, speed, found.impact_loss


def unknown(problem: Problem) -> Problem:
    """Return the same problem, in which nobody knows what is round."""
    bodies = (replace(b, rounding=np.zeros((0, ROUNDING))) for b in problem.bodies)
    return replace(problem, bodies=tuple(bodies))


def main() -> None:
    """Print the table."""
    slope = 0.5 * G * np.sin(SLOPE)
    rows = [
        (
            f"ball of {n:,} triangles, floor, 5°, 1 s",
            posed(drawn(n), gravity=DOWN),
            1.0,
            slope / 1.4,
        )
        for n in (20, 80, 320, 1280, 5120, 20480)
    ]
    rows += [
        ("marble, board, 5°, .8 s", posed(marble(), BOARD, gravity=DOWN), 0.8, slope * 0.64 / 1.4),
        ("cylinder, board, 5°, .6 s", posed(lying(), BOARD, gravity=DOWN), 0.6, slope * 0.36 / 1.5),
        ("marble, board, .3 m/s, 1 s", posed(marble(0.3), BOARD, gravity=LEVEL), 1.0, 0.3 / 1.4),
    ]
    print("| | way over ideal, as points | taken [J] | as round | taken [J] | speed [m/s] |")
    print("|---|---:|---:|---:|---:|---:|")
    for name, problem, time, ideal in rows:
        way, _, lost = moved(unknown(problem), time)
        further, speed, taken = moved(problem, time)
        print(
            f"| {name} | {way / ideal:.3f} | {lost:.2g} | {further / ideal:.3f} | {taken:.2g} "
            f"| {speed:.4f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()

"""How far what is drawn round rolls, and where it stops.

    python benchmarks/rolling.py [--only slopes | bowls | floors]

A ball of 50 mm on the floor, by how finely it is drawn, a marble of 12 mm and a cylinder of 20 mm
on a steel board, at detail draft; 5°, or .3 m/s on the level. Then a marble that swings in bowls,
and the period of a ball that rolls in a hollow ball, ω² = g/((R - r)(1 + I/(m r²))), longer by its
swing. Last, balls that roll over floors until what these lose has stopped them. About a minute.
"""

import argparse
from dataclasses import replace

import numpy as np
import trimesh
from scipy.special import ellipk

import corporeal as co
from corporeal.core.types import CURVATURE_COLUMNS
from corporeal.mpm.problem import Problem
from corporeal.mpm.state import ParticleConstants

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
    return replace(co.pose_problem(co.prepare_scene(scene)), gravity_ramp=0.0)


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
    bodies = (replace(b, curvature=np.zeros((0, CURVATURE_COLUMNS))) for b in problem.bodies)
    return replace(problem, bodies=tuple(bodies))


# ---------------------------------------------------------------- in bowls

BOWL = 0.1
"""Radius of the hollow ball [m]."""
SWINGS = ((BOWL, 0.012, 20.0), (BOWL, 0.012, 5.0), (0.06, 0.02, 20.0), (0.15, 0.02, 20.0))
"""Radii of bowl and marble [m], and how far aside the marble begins [deg]."""
LOOKS = 100
"""How often it is looked at in a period."""


def hollow(radius: float, wall: float) -> co.Solid:
    """Return a round block of steel out of which a part of a ball is taken."""
    angle = np.linspace(np.radians(60), 0, 24)
    inside = np.stack([radius * np.sin(angle), radius + wall - radius * np.cos(angle)], axis=1)
    wide = inside[0, 0] + wall
    line = np.concatenate([[[0, 0], [wide, 0], [wide, inside[0, 1]]], inside])
    shape = trimesh.creation.revolve(line, sections=64)
    return co.solid("steel", np.array(shape.vertices), shape.faces)


def in_bowl(radius: float, marble: float, lean: float) -> tuple[Problem, float]:
    """Pose a marble that begins aside in a bowl, and give its period [s]."""
    wall, theta = 0.008, np.radians(lean)
    way = np.array([np.sin(theta), 0.0, -np.cos(theta)])
    at = np.array([0.0, 0.0, radius + wall]) + (radius - marble) * way
    problem = posed(co.ball("glass", marble, tuple(at)), hollow(radius, wall), gravity=LEVEL)
    matter = ParticleConstants.of(problem)
    share = matter.inertia[0][1, 1] / (matter.total[0] * marble**2)
    swing = 4.0 * float(ellipk(np.sin(theta / 2) ** 2))
    return problem, swing * np.sqrt((radius - marble) * (1.0 + share) / G)


def swung(problem: Problem, period: float) -> tuple[float, float, float]:
    """Period [s] and how far it comes back after two; what normal contact took [J].

    The period is that from one way through the middle to the same again; nan: there is none.
    """
    engine, place, time = co.build_engine(problem), [], []
    found = engine.measure()
    for k in range(1, 2 * LOOKS + 1):
        engine.advance(k * period / LOOKS)
        found = engine.measure()
        place.append(found.centre[0, 0] - found.centre[1, 0])
        time.append(found.time)
    x, t = np.array(place), np.array(time)
    k = np.flatnonzero((x[:-1] > 0.0) & (x[1:] <= 0.0))
    through = t[k] - x[k] * (t[k + 1] - t[k]) / (x[k + 1] - x[k])
    first = float(through[1] - through[0]) if len(through) > 1 else float("nan")
    return first, float(x[-1] / x[0]), found.impact_loss


def swings() -> None:
    """Print the table of bowls."""
    print("\n| bowl, marble, begins at | period over ideal, as points | as round | comes back to |")
    print("|---|---:|---:|---:|")
    for radius, marble, lean in SWINGS:
        problem, period = in_bowl(radius, marble, lean)
        before, _, _ = swung(unknown(problem), period)
        now, back, _ = swung(problem, period)
        name = f"{1e3 * radius:.0f} mm, {1e3 * marble:.0f} mm, {lean:.0f}°"
        print(f"| {name} | {before / period:.3f} | {now / period:.4f} | {back:.3f} |", flush=True)


# ---------------------------------------------------------------- on floors

FLOORS = ("hardened_steel", "concrete", "wood", "rubber", "felt", "carpet")
ROLLERS = (("glass", 0.008), ("hardened_steel", 0.01), ("phenolic", 0.0286))
"""What rolls, and its radius [m]."""


def stopped(material: str, radius: float, floor: str) -> tuple[float, float, float]:
    """c/r [-], and where a ball stops [m]: as simulated, and by the energy that it has.

    It starts at .3 m/s without spin, and rolls with what friction leaves it. nan: not after 4 s.
    """
    ball = co.ball(material, radius, (0.0, 0.0, radius), velocity=(0.3, 0.0, 0.0))
    settings = co.Settings()
    settings = replace(settings, ground=replace(settings.ground, floor=floor))
    prepared = co.prepare_scene(co.build_scene(ball), settings)
    problem = replace(co.pose_problem(prepared, settings), gravity_ramp=0.0)
    matter, rolling = ParticleConstants.of(problem), problem.rolling_resistance
    if rolling is None or not problem.bodies[0].rigid:
        return float("nan"), float("nan"), float("nan")
    c, share = rolling[0, 1] / radius, matter.inertia[0][1, 1] / (matter.total[0] * radius**2)
    rolls = 0.3 / (1.0 + share)
    ideal = 0.5 * (1.0 + share) * rolls**2 / (c * G)
    if 2.0 * ideal / rolls > 4.0:
        return c, float("nan"), ideal
    engine = co.build_engine(problem)
    engine.advance(0.1)  # it slides first
    start = engine.measure()
    x, v = float(start.centre[0, 0]), float(start.momentum[0, 0] / start.mass[0])
    engine.advance(4.0)
    return c, float(engine.measure().centre[0, 0]) - x, ideal * (v / rolls) ** 2


def floors() -> None:
    """Print the table of floors."""
    print("\n| ball | floor | c/r | stops after [m] | by its energy [m] |")
    print("|---|---|---:|---:|---:|")
    for material, radius in ROLLERS:
        for floor in FLOORS:
            c, way, ideal = stopped(material, radius, floor)
            far = "not in 4 s" if np.isnan(way) else f"{way:.4f}"
            name = f"{material}, {2e3 * radius:.0f} mm"
            print(f"| {name} | {floor} | {c:.1e} | {far} | {ideal:.4g} |", flush=True)


# ---------------------------------------------------------------- on slopes


def slopes() -> None:
    """Print the table of what rolls down a slope or along the level."""
    slope = 0.5 * G * np.sin(SLOPE)
    rows = [
        (f"ball of {n:,} triangles, floor, 5°, 1 s", posed(drawn(n), gravity=DOWN), 1.0, slope / 1.4)
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
            f"| {name} | {way / ideal:.3f} | {lost:.2g} | {further / ideal:.3f} | {taken:.2g} | {speed:.4f} |",
            flush=True,
        )


TABLES = {"slopes": slopes, "bowls": swings, "floors": floors}


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=TABLES, help="one table alone")
    asked = parser.parse_args()
    for name, table in TABLES.items():
        if asked.only in (None, name):
            table()


if __name__ == "__main__":
    main()

"""Rigid bodies that touch, and what is small or thin against the grid: cases 18 to 20."""

import numpy as np

import corporeal as co
from corporeal.core.audit_data import SurfacePairCheck
from corporeal.mpm.problem import Problem
from corporeal.simulation.mesh_gaps import surface_pairs
from laws.bodies import DOWN, Stuff, ball, ball_surface, body, box, box_surface, floor, problem
from laws.outcome import Check, Outcome, absolute
from laws.watching import started

STEEL = Stuff(density=7850.0)
GLASS = Stuff(density=2500.0)
FOAM = Stuff(young_pa=3e4, poisson=0.2, density=50.0)

# ---------------------------------------------------------------- case 18

BALL = 0.05
"""Radius of the cradle's balls [m]."""
GAPS = (0.0, 0.02, 0.1, 0.5, 1.0)
"""Between them [dx]."""


def cradle(gap: float, restitution: float = 1.0, count: int = 5) -> tuple[Problem, float]:
    """Give a ball at 1 m/s before a row of others, and the time in which all have met [s]."""
    cell = BALL / 5
    start, step = np.array([0.13, 0.31, 0.22]) * cell, 2 * BALL + gap * cell
    ahead = [k * step - (1.5 * cell if k == 0 else 0.0) for k in range(count)]
    places = [start + np.array([x, 0.0, 0.0]) for x in ahead]
    balls = [
        ball(tuple(p), BALL, cell / 2, stuff=STEEL, rigid=True, velocity=(float(k == 0), 0, 0))
        for k, p in enumerate(places)
    ]
    return problem(*balls, cell=cell, restitution=restitution), (3.5 + count * gap) * cell


def newtons_cradle(quick: bool = False) -> Outcome:
    """Case 18: the last ball takes all of the speed, at any gap."""
    checks: list[Check] = []
    for gap in GAPS[1:3] if quick else GAPS:
        given, until = cradle(gap)
        run = started(given)
        run.advance(until)
        last = run.measure()
        u = last.momentum[:, 0] / last.mass
        checks += [
            absolute(f"last ball, gaps of {gap:g} dx [v]", float(u[-1]), 1.0, 0.05),
            absolute(f"fastest other, gaps of {gap:g} dx [v]", float(abs(u[:-1]).max()), 0, 0.05),
        ]
    words = "five rigid balls, R/dx 5, e = 1; the first at 1 m/s"
    return Outcome("18", "An impact runs through a row of touching balls", words, tuple(checks))


# ---------------------------------------------------------------- case 19

MARBLE = 0.008
"""Its radius [m]."""
COUCH = (0.4, 0.4, 0.2)
"""What it lies on [m]."""


def marble_on(rigid: bool, cell: float = 1 / 32, drop: float = 0.01) -> Problem:
    """Drop a marble on a slab, rigid or of foam, on cells four times as wide as its radius."""
    x, y = 0.13 * cell, 0.31 * cell
    middle, centre = (x, y, COUCH[2] / 2), np.array([x + 0.2 * cell, y + 0.1 * cell, COUCH[2]])
    centre[2] += MARBLE + drop
    slab = box(
        middle,
        COUCH,
        cell / 2,
        stuff=STEEL if rigid else FOAM,
        rigid=rigid,
        surface=box_surface(middle, COUCH, 33) if rigid else None,
    )
    small = body(
        centre[None], 4 / 3 * np.pi * MARBLE**3, GLASS, rigid=True, surface=ball_surface(tuple(centre), MARBLE, 600)
    )
    return problem(slab, small, cell=cell, friction=0.3, restitution=0.3, planes=[floor()], gravity=DOWN)


def resting_gap(rigid: bool, time: float = 0.6) -> float:
    """How far the marble ends above the slab [m]."""
    run = started(marble_on(rigid))
    run.advance(time)
    return float(run.measure().centre[1, 2] - MARBLE - COUCH[2])


def marble_at_rest(quick: bool = False) -> Outcome:
    """Case 19: what is smaller than a cell lies on what it touches."""
    seat = co.box("seat_foam", size=(0.8, 0.8, 0.4), at=(0, 0, 0.2), name="couch")
    marble = co.ball("glass", MARBLE, at=(0.013, 0.007, 0.4 + MARBLE + 0.02), name="marble")
    pair = _pair(0.5 if quick else 1.0, seat, marble)
    gap = np.inf if pair.gap_end_m is None else pair.gap_end_m
    checks = (
        absolute("on a rigid slab, cells of 4 R [mm]", 1e3 * resting_gap(True), 0.0, 0.1, "mm"),
        absolute("on foam, cells of 4 R [R]", resting_gap(False) / MARBLE, 0.0, 0.3, "R"),
        absolute("on a couch at draft, by meshes [R]", gap / MARBLE, 0.0, 0.3, "R"),
    )
    words = "glass marble of 16 mm, dropped from 10 and 20 mm; gap at the end"
    return Outcome("19", "A marble lies on a couch", words, checks)


# ---------------------------------------------------------------- case 20


def ball_on_plate(speed: float) -> SurfacePairCheck:
    """Shoot a 40 mm steel ball at a free 1 mm steel plate; what their meshes say."""
    plate = co.box("steel", size=(0.3, 0.3, 0.001), at=(0, 0, 0.3), name="plate")
    shot = co.ball("steel", 0.02, at=(0.013, 0.007, 0.35), velocity=(0, 0, -speed), name="ball")
    return _pair(min(0.04, 1.0 / speed), plate, shot)


def _pair(duration: float, *solids: co.Solid) -> SurfacePairCheck:
    played = co.simulate_scene(co.build_scene(*solids, duration=duration))
    ready = played.prepared
    (pair,) = surface_pairs(ready.scene, ready.particles, played.trajectory)
    return pair


def plate_holds(quick: bool = False) -> Outcome:
    """Case 20: nothing passes through what would stop it."""
    found = [(v, ball_on_plate(v)) for v in ((30.0,) if quick else (10.0, 30.0, 100.0))]
    checks = tuple(
        absolute(f"passed through at {v:g} m/s [0 or 1]", float(pair.passed is not None), 0.0, 0.0) for v, pair in found
    )
    words = "40 mm steel ball on a free steel plate of 1 mm, draft: cells of 6 mm; by their meshes"
    return Outcome("20", "A ball does not pass through a plate", words, checks)

"""Bodies that slide, stick and roll: cases 7 to 10."""

from dataclasses import dataclass, replace

import numpy as np

from corporeal.mpm.problem import Body, Plane, Problem
from laws.bodies import G, Stuff, ball, ball_surface, box, disc, floor, problem, turn_about_y, walls
from laws.outcome import Check, Outcome, absolute, relative
from laws.watching import follow, started

RUBBER = Stuff(young_pa=1e6, poisson=0.3, density=1000.0)
SLOPE = np.radians(30.0)
NEAR, LOSS = 0.9, 0.3
"""Share of the friction that would hold a block, and its loss factor: without loss it shakes, and
parts of it stick at times (decision restitution-pairs)."""
HELD = 10.0
"""Friction that holds a slab to the floor."""
SIZE = (0.2, 0.1, 0.1)
"""Of the sliding block [m]."""


def down_slope(turn: np.ndarray | None = None) -> tuple[float, float, float]:
    """Gravity in the frame of a slope that falls towards its +x, as the grid sees it [m/s²]."""
    g = G * np.array([np.sin(SLOPE), 0.0, -np.cos(SLOPE)])
    return tuple(g if turn is None else turn @ g)


def slide(friction: float, time: float, ramp: float = 0.0) -> float:
    """Way down the slope [m]: a t²/2 with a = g (sin θ - μ cos θ).

    Where gravity grows in a time τ: a (t²/2 - τ t/2 + τ²/6).
    """
    pull = G * (np.sin(SLOPE) - friction * np.cos(SLOPE))
    return float(pull * (time**2 / 2 - ramp * time / 2 + ramp**2 / 6))


@dataclass(frozen=True)
class Slide:
    """A block on a slope."""

    distance: float
    """Down the slope [m]."""
    drift: float
    """Largest distance sideways [dx]."""


@dataclass(frozen=True)
class Slope:
    """How a block is put on a slope."""

    friction: float = 0.3
    cells: int = 4
    """Across the block's height."""
    tilt: float = 0.0
    """Of everything on the grid [degrees]."""
    fill: str = "bricks"
    contact: str = "multi"
    rigid: bool = False
    ramp: float = 0.0
    """Time in which gravity grows [s]."""
    loss: float = 0.0
    """Loss factor of block and slab [-]."""


def block_on_slab(given: Slope, time: float) -> Slide:
    """Let a block of .2 × .1 × .1 m slide on a slab that the floor holds; gravity is tilted."""
    cell = 0.1 / given.cells
    turn = turn_about_y(np.radians(given.tilt))
    block, slab, plane = _block_and_slab(given, cell, turn)
    mu = given.friction
    friction = np.array([[0.0, mu, mu], [mu, 0.0, HELD], [mu, HELD, 0.0]])
    run = started(
        problem(
            block,
            slab,
            cell=cell,
            friction=friction,
            planes=[plane],
            gravity=down_slope(turn),
            gravity_ramp=given.ramp,
            contact=given.contact,
        )
    )
    moved = follow(run, time, 1).moved[-1, 0] @ turn
    return Slide(float(moved[0]), float(abs(moved[1]) / cell))


def _block_and_slab(given: Slope, cell: float, turn: np.ndarray) -> tuple[Body, Body, Plane]:
    thick, wide, long = 0.08, SIZE[1] + 3 * cell, 0.62
    origin = turn @ (np.array([0.13, 0.31, 0.22]) * cell)

    stuff = replace(RUBBER, loss=given.loss)

    def at(x: float, z: float) -> tuple:
        return tuple(origin + turn @ np.array([x, 0.0, z]))

    block = box(at(0.13, thick + SIZE[2] / 2), SIZE, cell / 2, given.fill, turn, stuff=stuff, rigid=given.rigid)
    slab = box(at(long / 2, thick / 2), (long, wide, thick), cell / 2, given.fill, turn, stuff=stuff)
    normal = turn[:, 2]
    return block, slab, Plane(tuple(normal), float(origin @ normal))


def sliding_block(quick: bool = False) -> Outcome:
    """Case 7: s = ½ g (sin θ - μ cos θ) t²; in one field the block sticks."""
    time = 0.5
    found = block_on_slab(Slope(), time)
    glued = block_on_slab(Slope(contact="single"), time)
    checks = [relative("slip of a soft block on a slab [m]", found.distance, slide(0.3, time), 2.0, glued.distance)]
    if not quick:
        gentle = block_on_slab(Slope(ramp=0.1), time).distance
        checks.append(relative("the same, gravity grows in 0.1 s [m]", gentle, slide(0.3, time, 0.1), 2.0))
        stiff = block_on_slab(Slope(rigid=True), time).distance
        checks.append(relative("slip of a rigid block on a slab [m]", stiff, slide(0.3, time), 2.0))
        # A tenth of its weight drives it: an error of friction shows ten times as large.
        near = NEAR * float(np.tan(SLOPE))
        lossy = block_on_slab(Slope(friction=near, ramp=0.1, loss=LOSS), time).distance
        checks.append(
            relative(f"slip at {NEAR} of the friction that holds, loss {LOSS} [m]", lossy, slide(near, time, 0.1), 3.0)
        )
    return Outcome(
        "7",
        "A block slides down a slope as Coulomb says",
        f"30°, μ = .3, 4 cells across the block; {time} s",
        tuple(checks),
    )


def sticking_block(quick: bool = False) -> Outcome:
    """Case 8: with μ > tan θ the block stays."""
    time = 0.3 if quick else 0.5
    found = block_on_slab(Slope(friction=0.8, ramp=0.1), time)
    cell = 0.1 / 4
    checks = (
        absolute("drift down the slope [% dx]", 100 * found.distance / cell, 0.0, 2.0, "% dx"),
        absolute("drift sideways [% dx]", 100 * found.drift, 0.0, 2.0, "% dx"),
    )
    return Outcome(
        "8", "A block sticks where friction exceeds the slope", f"30°, μ = .8, gravity grows in 0.1 s; {time} s", checks
    )


def tilted_block(quick: bool = False) -> Outcome:
    """Case 9: nothing depends on how the slope lies on the grid."""
    time = 0.5
    aligned = block_on_slab(Slope(tilt=20.0), time)
    blue = block_on_slab(Slope(tilt=20.0, fill="blue"), time)
    glued = None if quick else block_on_slab(Slope(tilt=20.0, contact="single"), time).distance
    checks = [
        relative("slip, particles aligned with the block [m]", aligned.distance, slide(0.3, time), 2.0, glued),
        relative("slip, blue-noise fill [m]", blue.distance, slide(0.3, time), 2.0),
    ]
    return Outcome(
        "9",
        "A tilted grid does not change friction",
        f"case 7 with everything turned 20° on the grid; {time} s",
        tuple(checks),
    )


# ---------------------------------------------------------------- case 10


RADIUS = 0.1
"""Of what rolls [m]."""
ROLLS, SLIPS = 0.5, 0.1
"""Friction with which a ball or cylinder rolls without slipping at 30°, or slips."""


def rolled(shape: str, friction: float, time: float) -> float:
    """How far a ball or a cylinder comes down the slope [m].

    Without slipping x = ½ g sin θ t² / (1 + k), k = 2/5 and 1/2, where μ ≥ tan θ k/(1 + k); else
    it slips like a block.
    """
    k = {"ball": 0.4, "cylinder": 0.5}[shape]
    if friction < np.tan(SLOPE) * k / (1 + k):
        return slide(friction, time)
    return 0.5 * G * np.sin(SLOPE) * time**2 / (1 + k)


def round_body(shape: str, friction: float, cells: int = 5, rigid: bool = False, time: float = 0.4) -> float:
    """Release a ball or cylinder on a slope; how far it came, relative to the reference [-].

    A cylinder lies between smooth walls. What is soft lies on a soft slab that the floor holds; a
    rigid ball lies on the floor itself.
    """
    cell = RADIUS / cells
    given = _rigid_ball(friction, cell) if rigid else _on_slab(shape, friction, cell)
    moved = follow(started(given), time, 1).moved[-1, 0, 0]
    return float(moved) / rolled(shape, friction, time)


def _on_slab(shape: str, friction: float, cell: float) -> Problem:
    thick, long = np.ceil(0.05 / cell) * cell, 0.53
    start = np.array([0.13, 0.31, 0.27]) * cell
    wide = 2 * cell if shape == "cylinder" else 0.1
    middle = start + np.array([long / 2, wide / 2, thick / 2])
    above = start + np.array([0.09, wide / 2, thick + RADIUS])
    slab = box(tuple(middle), (long, wide, thick), cell / 2, stuff=RUBBER)
    ground, sides = floor(start[2]), []
    if shape == "ball":
        round_one = ball(tuple(above), RADIUS, cell / 2, stuff=RUBBER)
    else:
        round_one = disc(tuple(above), RADIUS, wide, cell / 2, stuff=RUBBER)
        sides = walls(1, start[1], start[1] + wide)
    table = np.zeros((3 + len(sides), 3 + len(sides)))
    table[0, 1] = table[1, 0] = table[0, 2] = table[2, 0] = friction
    table[1, 2] = table[2, 1] = HELD
    return problem(round_one, slab, cell=cell, friction=table, planes=[ground, *sides], gravity=down_slope())


def _rigid_ball(friction: float, cell: float) -> Problem:
    centre = (0.13 * cell, 0.31 * cell, RADIUS)
    steel = ball(centre, RADIUS, cell / 2, stuff=RUBBER, rigid=True, surface=ball_surface(centre, RADIUS, 5000))
    return problem(steel, cell=cell, friction=friction, planes=[floor()], gravity=down_slope())


def rolling_bodies(quick: bool = False) -> Outcome:
    """Case 10: balls and cylinders roll where friction suffices, and slip where it doesn't."""
    time = 0.25 if quick else 0.4
    plans = [
        ("ball rolls", "ball", ROLLS, 5, False, 5.0),
        ("cylinder rolls", "cylinder", ROLLS, 5, False, 10.0),
        ("rigid ball rolls", "ball", ROLLS, 5, True, 5.0),
        ("ball slips", "ball", SLIPS, 5, False, 2.0),
        ("cylinder slips", "cylinder", SLIPS, 5, False, 2.0),
    ]
    if not quick:
        plans.append(("ball rolls, R/dx 10", "ball", ROLLS, 10, False, 5.0))
    checks: list[Check] = []
    for name, shape, friction, cells, rigid, percent in plans:
        share = round_body(shape, friction, cells, rigid, time)
        ideal = rolled(shape, friction, time)
        checks.append(relative(f"{name} [m]", share * ideal, ideal, percent))
    return Outcome(
        "10",
        "Balls and cylinders roll and slip down a slope",
        f"30°, {time} s, R/dx 5; soft on a soft slab, the rigid ball on the floor",
        tuple(checks),
    )

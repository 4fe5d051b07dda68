"""What carries weight: cases 12a, 12b, 13 and 14."""

from dataclasses import dataclass

import numpy as np

from corporeal.core.types import Law
from laws.bodies import DOWN, G, Stuff, box, floor, problem, walls
from laws.outcome import Check, Outcome, relative
from laws.watching import Path, crossing, follow, started

FOAM = Stuff(young_pa=2.5e5, poisson=0.35, density=30.0)
STEEL = Stuff(young_pa=3e7, poisson=0.3, density=7850.0)
"""Stiff enough beside foam where it has to be deformable."""
HELD = 10.0
"""Friction that holds foam to the floor."""


@dataclass(frozen=True)
class Sink:
    """A heavy block that bobs on foam."""

    mean: float
    """How far it sinks, over whole periods [m]."""
    period: float
    """[s]"""


def heavy_on_foam(cells: int, plane_strain: bool, face: float = 0.0, contact: str = "multi", time: float = 0.4) -> Sink:
    """Put a steel block of .2 × .1 m on foam of .2 × .2 m at once.

    Args:
        cells: Across the foam.
        plane_strain: Between smooth walls, two cells apart; else both are .2 m deep.
        face: Where the common face lies within a cell [dx].
        contact: "multi", where the steel is rigid; or "single", where it is glued and stiff.
        time: How long to watch [s]; whole periods count.

    """
    side = 0.2
    cell = side / cells
    deep = 2 * cell if plane_strain else side
    base = face * cell
    x, y = 0.13 * cell, deep / 2 + (0.0 if plane_strain else 0.31 * cell)
    foam = box((x, y, base + side / 2), (side, deep, side), cell / 2, stuff=FOAM)
    steel = box((x, y, base + side + 0.05), (side, deep, 0.1), cell / 2, stuff=STEEL, rigid=contact == "multi")
    planes = [floor(base), *(walls(1, 0.0, deep) if plane_strain else [])]
    table = np.zeros((2 + len(planes), 2 + len(planes)))
    table[0, 1] = table[1, 0] = 0.5
    table[0, 2] = table[2, 0] = HELD
    run = started(problem(foam, steel, cell=cell, friction=table, planes=planes, gravity=DOWN, contact=contact))
    return bobbing(follow(run, time, round(500 * time)))


def bobbing(path: Path) -> Sink:
    """Mean sink and period of the second body, over whole periods."""
    sunk = -path.moved[:, 1, 2]
    middle = 0.5 * sunk.max()
    rises = crossing(path.time, middle - sunk)
    inside = (path.time >= rises[0]) & (path.time <= rises[-1])
    return Sink(float(sunk[inside].mean()), float(np.mean(np.diff(rises))))


def heavy_in_plane_strain(quick: bool = False) -> Outcome:
    """Case 12a: a rigid block on foam sinks as one field with a stiff block says."""
    checks: list[Check] = []
    time = 0.2 if quick else 0.4
    for face in (0.0,) if quick else (0.0, 0.3):
        ours = heavy_on_foam(8, True, face, time=time)
        same = heavy_on_foam(8, True, face, contact="single", time=time)
        checks += [
            relative(f"sink, face at {face} dx [m]", ours.mean, same.mean, 5.0),
            relative(f"period, face at {face} dx [s]", ours.period, same.period, 5.0),
        ]
    words = "plane strain, 8 cells across the foam; the reference is one field on the same grid"
    words += "; face on a grid plane only" if quick else ""
    return Outcome("12a", "A heavy body on a soft one, plane strain", words, tuple(checks))


CUBE = {0.0: (5.25e-3, 0.1447), 0.3: (5.82e-3, 0.1506)}
"""Sink [m] and period [s] on foam of 8 cells by where the common face lies [dx]."""


def heavy_in_space(quick: bool = False) -> Outcome:
    """Case 12b: the same in three dimensions."""
    checks: list[Check] = []
    time = 0.2 if quick else 0.4
    for face, (sink, period) in CUBE.items():
        if quick and face:
            continue
        ours = heavy_on_foam(8, False, face, time=time)
        checks += [
            relative(f"sink, face at {face} dx [m]", ours.mean, sink, 5.0),
            relative(f"period, face at {face} dx [s]", ours.period, period, 5.0),
        ]
    words = "8 cells across the foam; the reference is one field on the same grid"
    words += "; face on a grid plane only" if quick else ""
    return Outcome("12b", "A heavy body on a soft one, in space", words, tuple(checks))


# ---------------------------------------------------------------- case 13


COLUMN = Stuff(law=Law.COROTATED, young_pa=1e5, poisson=0.3, loss=0.2)
"""Confined, this law is linear at any strain: P = (λ + 2μ) (F - 1)."""


def confined_column(cells: int) -> float:
    """Let a column of .2 m settle between smooth walls; its shortening over Hooke's [-].

    u(z) = ρ g (L z - z²/2) / (λ + 2μ), taken between the lowest and the highest particles,
    on average over three of its periods, after it has crept for six: what loses energy in branches
    gives way slowly, and the more so the more it loses.
    """
    length = 0.2
    cell = length / cells
    width = 2 * cell
    column = box((width / 2, width / 2, length / 2), (width, width, length), cell / 2, stuff=COLUMN)
    planes = [floor(), *walls(0, 0.0, width), *walls(1, 0.0, width)]
    period = 4 * length * np.sqrt(COLUMN.density / COLUMN.p_wave_modulus)
    run = started(problem(column, cell=cell, planes=planes, gravity=DOWN, gravity_ramp=2 * period))
    z = column.position[:, 2]
    ends = [np.flatnonzero(z > z.max() - 0.1 * cell), np.flatnonzero(z < z.min() + 0.1 * cell)]
    before = follow(run, 2 * period, 1, ends).place[0, :, 2]
    follow(run, 8 * period, 1, ends)
    after = follow(run, 11 * period, 60, ends).place[1:, :, 2].mean(axis=0)
    shortened = before[0] - before[1] - (after[0] - after[1])
    high, low = z.max(), z.min()
    between = length * (high - low) - (high**2 - low**2) / 2
    return float(shortened / (COLUMN.density * G / COLUMN.p_wave_modulus * between))


def self_weight(quick: bool = False) -> Outcome:
    """Case 13: u = ρ g L² / 2 (λ + 2μ)."""
    length = 0.2
    share = confined_column(20)
    top = COLUMN.density * G * length**2 / (2 * COLUMN.p_wave_modulus)
    check = relative("sink of the top [m]", share * top, top, 1.0)
    return Outcome("13", "A confined column settles under its weight as Hooke says", "20 cells, smooth walls", (check,))

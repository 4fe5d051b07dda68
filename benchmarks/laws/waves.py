"""Sound in solids: cases 3 and 5."""

from dataclasses import dataclass

import numpy as np

from laws.bodies import Stuff, box, problem
from laws.outcome import Check, Outcome, at_least, relative
from laws.watching import crossing, follow, half_width, started

YOUNG_PA, DENSITY = 1e6, 1000.0
SOUND = float(np.sqrt(YOUNG_PA / DENSITY))
"""[m/s]"""
BAR = Stuff(young_pa=YOUNG_PA, poisson=0.0, density=DENSITY)
RING_TARGETS = {20: (1.2, 0.80), 40: (0.33, 0.963), 80: (0.07, 0.994)}
"""Per cells along the bar: error of the period [%], share of the energy left after 10 periods."""
REBOUND_TARGETS = {20: 0.8, 40: 0.9}


@dataclass(frozen=True)
class Ringing:
    """A free bar in its first mode."""

    period: float
    """[s]"""
    energy: float
    """Share left at the end [-]."""


def ringing_bar(cells: int, periods: int, build=started, transfer: str = "flip") -> Ringing:
    """Let a bar with ν = 0 and free ends ring: v = .01 cos(π x/L), L = 1 m."""
    cell, width = 1.0 / cells, 2.0 / cells
    bar = box((0.5, width / 2, width / 2), (1.0, width, width), cell / 2, stuff=BAR)
    mode = np.cos(np.pi * bar.position[:, 0])
    bar.velocity[:, 0] = 0.01 * mode
    run = build(problem(bar, cell=cell, transfer=transfer))
    first = run.measure()
    times = np.linspace(0, periods * 2 / SOUND, 24 * periods + 1)
    swing = [float(np.mean(run.snapshot().velocity[:, 0] * mode))]
    for time in times[1:]:
        run.advance(float(time))
        swing.append(float(np.mean(run.snapshot().velocity[:, 0] * mode)))
    down = crossing(times, np.array(swing))
    last = run.measure()
    left = (last.kinetic + last.elastic).sum() / (first.kinetic + first.elastic).sum()
    return Ringing(float(down[-1] - down[0]) / (len(down) - 1), float(left))


def free_bar(quick: bool = False) -> Outcome:
    """Case 3: T = 2 L √(ρ/E)."""
    checks: list[Check] = []
    sizes = (20,) if quick else (20, 40, 80)
    for cells in sizes:
        found = ringing_bar(cells, 10)
        percent, least = RING_TARGETS[cells]
        checks += [
            relative(f"period at {cells} cells [s]", found.period, 2 / SOUND, percent),
            at_least(f"energy left after 10 periods at {cells} cells", found.energy, 1.0, least),
        ]
    words = "bar of 1 m, " + ", ".join(map(str, sizes)) + " cells; FLIP"
    return Outcome("3", "A free bar rings with the period of its sound", words, tuple(checks))


def lost(quantity: str, share: float, least: float) -> Check:
    """Hold a share that should be 1 to a least value."""
    return Check(quantity, 1.0, share, abs(1 - share), round(1 - least, 6), "")


@dataclass(frozen=True)
class Rebound:
    """Two equal bars that met head on."""

    restitution: float
    """Of the centres of mass [-]."""
    contact_time: float
    """Width of the force at half its peak [s]."""


def meeting_bars(cells: int, shift: float, contact: str = "multi") -> Rebound:
    """Let two bars of .5 m start one cell apart and meet at ±.1 m/s, with ν = 0 and smooth ends.

    Args:
        cells: Along each bar.
        shift: Of everything on the grid [cells].
        contact: "single" glues.

    """
    cell, length = 0.5 / cells, 0.5
    width = 4 * cell
    bars = [
        box(
            (shift * cell + x, width / 2, width / 2),
            (length, width, width),
            cell / 2,
            stuff=BAR,
            velocity=(v, 0.0, 0.0),
        )
        for x, v in ((length / 2, 0.1), (1.5 * length + cell, -0.1))
    ]
    run = started(problem(*bars, cell=cell, contact=contact))
    path = follow(run, cell / 0.2 + 2.0 * 2 * length / SOUND, 100)
    v = path.velocity[:, 1, 0] - path.velocity[:, 0, 0]
    return Rebound(float(v[-1] / 0.2), half_width(path.time, v))


def equal_bars(quick: bool = False) -> Outcome:
    """Case 5: contact lasts 2 L/c and the bars exchange their velocities; one field glues them."""
    checks: list[Check] = []
    shifts = (0.13, 0.63) if quick else (0.13, 0.38, 0.63, 0.88)
    for cells, least in REBOUND_TARGETS.items():
        found = [meeting_bars(cells, shift) for shift in shifts]
        glued = meeting_bars(cells, shifts[0], contact="single")
        worst = min(f.restitution for f in found)
        checks.append(at_least(f"restitution at L/dx = {cells}", worst, 1.0, least, glued.restitution))
        mean = float(np.mean([f.contact_time for f in found]))
        checks.append(relative(f"contact time at L/dx = {cells} [s]", mean, 1 / SOUND, 10.0))
    words = (
        f"restitution: the worst of {len(shifts)} places on the grid; "
        "time: width of the force at half its peak, their mean"
    )
    return Outcome("5", "Equal bars exchange their velocities", words, tuple(checks))

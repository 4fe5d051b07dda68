"""Sand: case 16."""

from dataclasses import dataclass

import numpy as np

from corporeal.core.types import Law
from corporeal.mpm.problem import Body, Plane, Problem
from laws.bodies import DOWN, Stuff, body, cylinder_sdf, floor, lattice, problem
from laws.outcome import Outcome, absolute, relative
from laws.watching import started

REPOSE = 30.0
"""Friction angle φ [degrees]."""
SAND = Stuff(
    law=Law.DRUCKER_PRAGER, young_pa=1e6, poisson=0.3, density=1500.0, friction_angle=float(np.radians(REPOSE))
)
ROUGH = 0.6
"""Friction of the floor: tan 31°, as rough as the sand."""
LUBE = 1.24
"""ΔR/R of a column as high as its radius (Lube et al. 2004)."""
RADIUS = 0.1


@dataclass(frozen=True)
class Heap:
    """Sand that came to rest."""

    spread: float
    """ΔR/R of the edge [-]: where the layer is a quarter of a cell thick."""
    farthest: float
    """ΔR/R that 99 % of the sand stays within [-]."""
    height: float
    """Of its middle, relative to the radius at the start [-]."""
    slope: float
    """Mean slope from .2 to .8 of its radius [degrees]."""
    speed: float
    """That 95 % of the sand stays below [m/s]."""
    profile: np.ndarray
    """Thickness of the layer in rings one cell wide [m]."""


def quarter(sdf, reach: float, spacing: float, volume: float) -> Body:
    """Fill the quarter x, y > 0 of a round body about z."""
    points = lattice(sdf, (0.0, 0.0, 0.0), reach, spacing)
    points = points[(points[:, 0] > 0) & (points[:, 1] > 0)]
    return body(points, volume / 4, SAND)


def on_rough_floor(sand: Body, cell: float, ramp: float = 0.0) -> Problem:
    """Put a quarter of sand between two smooth walls on a rough floor."""
    friction = np.zeros((4, 4))
    friction[0, 1] = friction[1, 0] = ROUGH
    corner = [Plane((1.0, 0.0, 0.0), 0.0), Plane((0.0, 1.0, 0.0), 0.0)]
    return problem(sand, cell=cell, friction=friction, planes=[floor(), *corner], gravity=DOWN, gravity_ramp=ramp)


def settled(given: Problem, radius: float, time: float) -> Heap:
    """Let sand flow and measure the heap."""
    run = started(given)
    run.advance(time)
    now = run.snapshot()
    out = np.hypot(now.position[:, 0], now.position[:, 1])
    edges = np.arange(0.0, out.max() + 2 * given.cell, given.cell)
    rings = np.histogram(out, edges, weights=given.bodies[0].volume)[0]
    profile = rings / (0.25 * np.pi * np.diff(edges**2))
    edge = float(edges[1:][profile > 0.25 * given.cell].max())
    middle = 0.5 * (edges[1:] + edges[:-1])
    flank = (middle > 0.2 * edge) & (middle < 0.8 * edge)
    fall = -np.polyfit(middle[flank], profile[flank], 1)[0]
    return Heap(
        spread=edge / radius - 1,
        farthest=float(np.percentile(out, 99)) / radius - 1,
        height=float(profile[:2].mean() / radius),
        slope=float(np.degrees(np.arctan(fall))),
        speed=float(np.percentile(np.linalg.norm(now.velocity, axis=1), 95)),
        profile=profile,
    )


def sand_column(cells: int) -> Heap:
    """Let go a column of sand as high as its radius; ``cells`` is R/dx."""
    cell = RADIUS / cells
    whole = cylinder_sdf((0.0, 0.0, RADIUS / 2), RADIUS, RADIUS)
    sand = quarter(whole, 1.5 * RADIUS, cell / 2, np.pi * RADIUS**3)
    return settled(on_rough_floor(sand, cell), RADIUS, 0.8)


def heap_of(slope: float, cells: int) -> Heap:
    """Build a cone of sand with a slope [degrees] and let its weight come on gently."""
    cell, height = RADIUS / cells, RADIUS * np.tan(np.radians(slope))

    def cone(p: np.ndarray) -> np.ndarray:
        top = height - np.hypot(p[:, 0], p[:, 1]) * height / RADIUS
        return np.maximum(p[:, 2] - top, -p[:, 2])

    sand = quarter(cone, 1.5 * RADIUS, cell / 2, np.pi * RADIUS**2 * height / 3)
    return settled(on_rough_floor(sand, cell, ramp=0.1), RADIUS, 0.5)


def steepest(cells: int, rounds: int = 4) -> float:
    """Find the slope of the steepest cone that loses less than 1.5° [degrees], by halving."""
    low, high = REPOSE - 8.0, REPOSE + 8.0
    for _ in range(rounds):
        slope = 0.5 * (low + high)
        stands = heap_of(slope, cells).slope > slope - 1.5
        low, high = (slope, high) if stands else (low, slope)
    return 0.5 * (low + high)


def sand(quick: bool = False) -> Outcome:
    """Case 16: run-out of a column, and the angle of repose."""
    cells = 6 if quick else 12
    column = sand_column(cells)
    checks = (
        relative("run-out ΔR/R", column.spread, LUBE, 15.0),
        absolute("angle of repose [°]", steepest(cells), REPOSE, 3.0, "°"),
    )
    words = f"R/dx {cells}, a = 1, φ = 30°, rough floor; a quarter between smooth walls"
    return Outcome("16", "A column of sand runs out and heaps up", words, checks)

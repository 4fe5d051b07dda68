"""Metal that flows: case 15."""

from dataclasses import dataclass

import numpy as np

from corporeal.core.types import Law
from laws.bodies import Stuff, cylinder, floor, problem
from laws.outcome import Outcome, absolute, relative
from laws.watching import started

COPPER = Stuff(law=Law.VON_MISES, young_pa=117e9, poisson=0.35, density=8930.0, yield_stress=400e6, hardening=100e6)
LENGTH, RADIUS, SPEED, TIME = 32.4e-3, 3.2e-3, 227.0, 80e-6


@dataclass(frozen=True)
class Mushroom:
    """A bar that hit a wall."""

    length: float
    """[m]"""
    radius: float
    """Of its foot [m]."""
    strain: float
    """Largest equivalent plastic strain [-]."""
    particles: int


def taylor_bar(cells: int, fill: str = "lattice") -> Mushroom:
    """Throw a copper bar of 32.4 mm at a smooth wall at 227 m/s (Taylor 1948).

    Args:
        cells: R/dx.
        fill: "lattice" or "blue".

    """
    cell = RADIUS / cells
    centre = (0.13 * cell, 0.31 * cell, LENGTH / 2)
    bar = cylinder(centre, RADIUS, LENGTH, cell / 2, fill, stuff=COPPER, velocity=(0.0, 0.0, -SPEED))
    run = started(problem(bar, cell=cell, planes=[floor()]))
    run.advance(TIME)
    now = run.snapshot()
    half = 0.5 * np.cbrt(bar.volume)
    out = (now.position - (centre[0], centre[1], 0.0)) * (1, 1, 0)
    distance = np.linalg.norm(out, axis=1)
    outward = out / np.maximum(distance, 1e-12)[:, None]
    across = np.linalg.norm(np.einsum("pji,pj->pi", now.motion, outward), axis=1)
    along = np.linalg.norm(now.motion[:, 2], axis=1)
    z = now.position[:, 2]
    return Mushroom(
        float((z + half * along).max() - (z - half * along).min()),
        float((distance + half * across).max()),
        float(now.plastic_strain.max()),
        len(z),
    )


def copper_bar(quick: bool = False) -> Outcome:
    """Case 15: length, foot and strain that several codes agree on."""
    cells = 5 if quick else 6
    found = taylor_bar(cells)
    checks = (
        relative("final length [m]", found.length, 21.46e-3, 2.0),
        relative("final radius of the foot [m]", found.radius, 7.07e-3, 5.0),
        absolute("largest plastic strain", found.strain, 2.875, 0.375),
    )
    words = f"R/dx {cells}, {found.particles} particles, H = 100 MPa; middles of the published ranges"
    return Outcome("15", "A copper bar mushrooms on a wall as Taylor's", words, checks)

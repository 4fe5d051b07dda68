"""Beams: case 14."""

from dataclasses import dataclass

import numpy as np

from laws.bodies import DOWN, G, Stuff, body, box, bricks, floor, problem
from laws.outcome import Outcome, relative
from laws.watching import crossing, follow, started

BEAM = Stuff(young_pa=2e7, poisson=0.3, density=1000.0)
LENGTH, HEIGHT = 0.48, 0.06


@dataclass(frozen=True)
class Cantilever:
    """A beam that is held at one end."""

    deflection: float
    """Of its tip under its own weight [m]."""
    frequency: float
    """First [Hz]."""

    @classmethod
    def of(cls, stuff: Stuff, length: float, height: float) -> "Cantilever":
        """Bending and shear (Timoshenko), and the first mode (Euler and Bernoulli).

        δ = 3 ρ g L⁴ / 2 E h² + ρ g L² / (2 · 5/6 · G);  f = (1.875²/2π) √(E I / ρ A L⁴)
        """
        shear = stuff.young_pa / (2 * (1 + stuff.poisson))
        weight = stuff.density * G
        bent = 3 * weight * length**4 / (2 * stuff.young_pa * height**2)
        sheared = weight * length**2 / (2 * 5 / 6 * shear)
        speed = np.sqrt(stuff.young_pa / (12 * stuff.density)) * height / length**2
        return cls(bent + sheared, 1.8751**2 / (2 * np.pi) * float(speed))


def two_cantilevers(cells: int, transfer: str = "flip") -> Cantilever:
    """Put a beam of twice the length on a narrow rigid support under its middle.

    By symmetry its middle section neither turns nor shifts: two cantilevers, clamped exactly. The
    weight comes at once; they swing about the deflection with their first mode.

    Args:
        cells: Across the height.
        transfer: "flip" or "apic".

    """
    cell = HEIGHT / cells
    width, low = 2 * cell, 4 * cell
    size = (2 * LENGTH, width, HEIGHT)
    beam = box((0.0, width / 2, low + HEIGHT / 2), size, cell / 2, stuff=BEAM)
    foot = body(
        bricks((0.0, width / 2, low / 2), (width, width, low), cell / 2),
        width * width * low,
        Stuff(density=7850.0),
        rigid=True,
    )
    run = started(problem(beam, foot, cell=cell, friction=0.8, planes=[floor()], gravity=DOWN, transfer=transfer))
    x, z = beam.position[:, 0], beam.position[:, 2] - low - HEIGHT / 2
    middle = np.abs(z) < 0.3 * cell
    groups = [
        np.flatnonzero(middle & (np.abs(x) > np.abs(x).max() - 0.1 * cell)),
        np.flatnonzero(middle & (np.abs(x) < 0.6 * cell)),
    ]
    ideal = Cantilever.of(BEAM, LENGTH, HEIGHT)
    path = follow(run, 1.4 / ideal.frequency, 100, groups)
    sunk = path.moved[:, 1, 2] - path.moved[:, 0, 2]
    falls = crossing(path.time, 0.5 * sunk.max() - sunk)
    inside = (path.time >= falls[0]) & (path.time <= falls[-1])
    return Cantilever(
        float(sunk[inside].mean() / bend_at(np.abs(x).max() / LENGTH)), float((len(falls) - 1) / (falls[-1] - falls[0]))
    )


def bend_at(share: float) -> float:
    """Deflection of a cantilever under its own weight at x = share · L, relative to the tip's."""
    return (6 * share**2 - 4 * share**3 + share**4) / 3


def cantilever(quick: bool = False) -> Outcome:
    """Case 14: deflection and first frequency of a heavy cantilever."""
    ideal = Cantilever.of(BEAM, LENGTH, HEIGHT)
    found = two_cantilevers(4 if quick else 6)
    checks = (
        relative("deflection of the tip [m]", found.deflection, ideal.deflection, 5.0),
        relative("first frequency [Hz]", found.frequency, ideal.frequency, 5.0),
    )
    words = f"{4 if quick else 6} cells across the height, L/h = 8; two, back to back on a support"
    return Outcome("14", "A cantilever bends and swings as beams do", words, checks)

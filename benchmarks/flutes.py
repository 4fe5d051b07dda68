"""How stiff corrugated board is across its flutes, and at which pressure they are crushed.

    python benchmarks/flutes.py

A flute is a sine wave of paper between two faces: a frame of straight beams, clamped at its crests,
which come nearer to each other and do not slide. Paper is the library's; weights, heights and
numbers of flutes are those of the source flat-crush (materials/sources.toml).
"""

from dataclasses import dataclass

import numpy as np

from corporeal import materials

BEAMS = 200
WEIGHTS = (0.112, 0.140, 0.180)
"""Of fluting paper [kg/m²]."""
STRENGTH = 1.8e3
"""Force that crushes ten flutes, over the weight of their paper [N m²/kg]."""
STRIP, TESTED = 0.0127, 10
"""Width of the strip that is tested [m], and the number of its flutes."""


@dataclass(frozen=True)
class Flute:
    """One of the usual waves."""

    name: str
    height: float
    """[m]"""
    per_metre: float


FLUTES = (Flute("A", 4.8e-3, 113), Flute("C", 3.5e-3, 130), Flute("B", 2.5e-3, 152))


def beam(start: np.ndarray, end: np.ndarray, stretch: float, bend: float) -> np.ndarray:
    """Stiffness (6, 6) of a straight beam in the plane: two shifts and a turn at either end.

    Args:
        start: [m]
        end: [m]
        stretch: E A [N]
        bend: E I [N m²]

    """
    (x, y), length = end - start, float(np.linalg.norm(end - start))
    c, s = x / length, y / length
    a, b = stretch / length, bend / length**3
    p, q, r = 12 * b, 6 * b * length, 2 * b * length**2
    local = np.array(
        [
            [a, 0, 0, -a, 0, 0],
            [0, p, q, 0, -p, q],
            [0, q, 2 * r, 0, -q, r],
            [-a, 0, 0, a, 0, 0],
            [0, -p, -q, 0, p, -q],
            [0, q, r, 0, -q, 2 * r],
        ]
    )
    turn = np.kron(np.eye(2), np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]))
    return turn.T @ local @ turn


def young_across(flute: Flute, young_pa: float, thickness: float) -> float:
    """Modulus of a layer of flutes, pressed together [Pa].

    Args:
        flute: Which.
        young_pa: Of the paper [Pa].
        thickness: Of the paper [m].

    """
    half = 0.5 / flute.per_metre
    x = np.linspace(0.0, half, BEAMS + 1)
    points = np.stack([x, -0.5 * flute.height * np.cos(np.pi * x / half)], axis=1)
    whole = np.zeros((3 * len(x), 3 * len(x)))
    for k in range(BEAMS):
        own = slice(3 * k, 3 * k + 6)
        whole[own, own] += beam(points[k], points[k + 1], young_pa * thickness, young_pa * thickness**3 / 12)
    shift = np.zeros(len(whole))
    shift[-2] = -1.0  # the upper crest comes down by one
    free = slice(3, len(whole) - 3)
    shift[free] = np.linalg.solve(whole[free, free], -whole[free, -2] * shift[-2])
    force = -float((whole @ shift)[-2])
    return force / half * flute.height


def crush(weight: float) -> float:
    """Pressure that crushes the A flute that is tested [Pa]; weight: of its paper [kg/m²]."""
    return STRENGTH * weight / (STRIP * TESTED / FLUTES[0].per_metre)


def main() -> None:
    """Print both for the usual weights."""
    paper = materials.find_material("paper").ranges
    young_pa, density = paper["young_pa"].typical, paper["density"].typical
    for weight in WEIGHTS:
        across = [young_across(f, young_pa, weight / density) / 1e6 for f in FLUTES]
        named = ", ".join(f"{f.name} {e:.1f}" for f, e in zip(FLUTES, across, strict=True))
        print(f"{1e3 * weight:.0f} g/m2: crushed at {crush(weight) / 1e3:.0f} kPa, {named} MPa")


if __name__ == "__main__":
    main()

"""Measure what a ball loses beyond its loss factor, over cells and the hardness of the impact.

    python benchmarks/hard_impacts.py [--check]

Weightless balls strike a plane. What they lose, as a loss factor by the inverse of hereditary Hertz
contact, less their own: the constant of ``discretization/impact_vibration.py``. ``--check``
strikes other balls, at other places of the grid, with the loss factor that treatments leave them,
and says how far their rebound is from the theory's, without that constant and with it (decision
103).
"""

import argparse
from dataclasses import dataclass
from itertools import product
from statistics import mean

import numpy as np
from laws.bodies import Stuff, ball, problem
from rich.console import Console
from rich.table import Table

from corporeal.core.registry import load_backend
from corporeal.discretization.hertz_indentation import hertz_dent_of_ball
from corporeal.discretization.impact_vibration import vibration_loss
from corporeal.materials.loss_restitution import loss_of_restitution, restitution_of_loss
from corporeal.mpm.constants import GRID_LOSS_FACTOR
from corporeal.mpm.problem import ENGINES, FLOOR

CELLS = (8, 10, 12, 16, 20)
HARDNESS = (0.003, 0.01, 0.03, 0.06, 0.1)
"""ρ v²/E [-]"""
LIFTED = 0.6
"""How far over the plane a ball begins [cells]."""
TOUCHES = 2.94
"""How long it touches, over its dent by its speed (Hertz) [-]."""


@dataclass(frozen=True)
class Impact:
    """One ball that strikes a plane."""

    cells: int
    """Across the ball."""
    loss: float
    """Its own loss factor [-]."""
    hardness: float
    """ρ v²/E [-]"""
    poisson: float
    radius: float = 0.05
    """[m]"""
    density: float = 1000.0
    """[kg/m³]"""
    speed: float = 3.0
    """[m/s]"""
    seed: int | None = None
    """Of its place in the cell; None: its middle is over a node, its points on a lattice."""

    def strike(self) -> tuple[float, int]:
        """Return the speed after over that before [-], and the steps that it took."""
        cell = 2.0 * self.radius / self.cells
        young_pa = self.density * self.speed**2 / self.hardness
        shift, fill = np.zeros(3), "lattice"
        if self.seed is not None:
            shift, fill = np.random.default_rng(self.seed).uniform(0.0, 1.0, 3), "blue"
        place = shift * cell + (0.0, 0.0, self.radius + LIFTED * cell)
        stuff = Stuff(young_pa=young_pa, poisson=self.poisson, density=self.density, loss=self.loss)
        velocity = (0.0, 0.0, -self.speed)
        given = {"fill": fill, "stuff": stuff, "velocity": velocity}
        thing = ball(tuple(place), self.radius, cell / 2, **given)
        run = load_backend("engine", "cpu", ENGINES)(problem(thing, cell=cell, planes=(FLOOR,)))
        dent = hertz_dent_of_ball(young_pa, self.poisson, self.density, self.speed) * self.radius
        lasts, now = TOUCHES * dent / self.speed, run.measure()
        while run.time < 20.0 * lasts:
            run.advance(run.time + lasts / 20.0)
            now = run.measure()
            touched = now.last_contact[np.isfinite(now.last_contact)]
            left = touched.size > 0 and run.time - touched.max() > 0.15 * lasts
            if left and now.momentum[0, 2] > 0.0:
                break
        return float(now.momentum[0, 2] / now.mass[0] / self.speed), run.steps.count


def beyond(console: Console) -> None:
    """Print what is lost beyond the own loss factor, and the two terms that describe it."""
    rows, found = [], []
    for poisson, loss in product((0.2, 0.41), (0.05, 0.15, 0.4)):
        table = Table("ρ v²/E", *map(str, CELLS), title=f"ν {poisson}, loss factor {loss}")
        for hardness in HARDNESS:
            more = []
            for cells in CELLS:
                e, _ = Impact(cells, loss, hardness, poisson).strike()
                more.append(loss_of_restitution(e) - loss)
                rows.append((cells**-2.0, hardness))
            found += more
            table.add_row(f"{hardness:g}", *(f"{m:.3f}" for m in more))
        console.print(table)
    (grid, rings), *_ = np.linalg.lstsq(np.array(rows), np.array(found), rcond=None)
    console.print(f"{grid:.2f}/n² + {rings:.2f} ρ v²/E", highlight=False)


def check(console: Console) -> None:
    """Print how far other balls are from theory, without the second term and with it."""
    off: dict[bool, list[float]] = {False: [], True: []}
    steps = {False: 0, True: 0}
    for poisson, hardness, loss, cells, rule in product(
        (0.3, 0.49), HARDNESS, (0.1, 0.15, 0.3, 0.6), (8, 12), (False, True)
    ):
        taken = GRID_LOSS_FACTOR / cells**2 + (vibration_loss(1.0, 1.0, 1.0 / hardness) if rule else 0.0)
        other = {"radius": 0.12, "density": 300.0, "speed": 7.0, "seed": cells}
        e, count = Impact(cells, max(0.0, loss - taken), hardness, poisson, **other).strike()
        off[rule].append(abs(e - restitution_of_loss(loss)))
        steps[rule] += count
    table = Table("", "mean error of e", "greatest", "steps")
    for rule, name in ((False, "grid alone"), (True, "grid and vibrations")):
        numbers = f"{mean(off[rule]):.4f}", f"{max(off[rule]):.3f}", f"{steps[rule]:,}"
        table.add_row(name, *numbers)
    console.print(table)


def main() -> None:
    """Run what was asked."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="other balls, against theory")
    (check if parser.parse_args().check else beyond)(Console())


if __name__ == "__main__":
    main()

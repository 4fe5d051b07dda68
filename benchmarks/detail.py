"""What the one knob of quality changes: rebound, squeeze and run-out at draft, normal and fine.

    python benchmarks/detail.py

Two balls of 10 cm fall on the floor at 2 m/s, with the grid and stiffness that the policy gives
them, and a column of dry sand as wide as twice its height collapses on as many cells across.
"""

import numpy as np
from laws.bodies import Stuff, ball, cylinder, floor, problem

from corporeal.mpm.part import Motion, PartGeometry
from corporeal.mpm.treatment import QUALITIES, plan
from corporeal.mpm.warp import WarpEngine
from corporeal.types import Law, Material, Structure

DIAMETER, SPEED = 0.1, 2.0
FOAM = Material("foam", Law.NEO_HOOKEAN, 2.5e5, 0.35, 30.0)
GEL = Material("gel", Law.NEO_HOOKEAN, 1e5, 0.45, 1000.0)


def drop(material: Material, detail: str) -> tuple[float, float]:
    """Rebound height over the fall's [-], and largest flattening [mm], of a ball."""
    volume, area = np.pi / 6 * DIAMETER**3, np.pi * DIAMETER**2
    part = PartGeometry(0, material, Structure("solid"), (DIAMETER,) * 3, volume, area)
    found = plan([part], [Motion(SPEED, 9.81)], detail)  # type: ignore[arg-type]
    t = found.treatments[0]
    stuff = Stuff(young=t.young, poisson=t.poisson, density=t.density)
    place, down = (0.0, 0.0, DIAMETER / 2), (0.0, 0.0, -SPEED)
    body = ball(place, DIAMETER / 2, found.cell / 2, "blue", stuff=stuff, velocity=down)
    run = WarpEngine(problem(body, cell=found.cell, planes=[floor()], friction=0.5))
    lasts = DIAMETER / SPEED * (SPEED / np.sqrt(t.young / t.density)) ** 0.4 + 0.01
    height, least, rebound = np.ptp(run.snapshot().position[:, 2]), np.inf, 0.0
    for k in range(40):
        run.advance(lasts * (k + 1) / 40)
        now = run.measure()
        rebound = max(rebound, now.momentum[0, 2] / now.mass[0] / SPEED)
        least = min(least, np.ptp(run.snapshot().position[:, 2]))
    return rebound**2, 1e3 * float(height - least)


def collapse(cells: int, radius: float = 0.1) -> float:
    """Run-out of 98 % of a sand column over its radius [-]; E = 1 MPa, φ = 30°, base .6."""
    cell = radius / cells
    sand = Stuff(law=Law.DRUCKER_PRAGER, young=1e6, density=1600.0, friction_angle=np.radians(30))
    centre = (0.003, 0.002, radius / 2)
    column = cylinder(centre, radius, radius, cell / 2, "blue", stuff=sand)
    down = (0.0, 0.0, -9.81)
    run = WarpEngine(problem(column, cell=cell, friction=0.6, planes=[floor()], gravity=down))
    run.advance(0.6)
    far = np.linalg.norm(run.snapshot().position[:, :2] - centre[:2], axis=1)
    return float(np.quantile(far, 0.98) / radius - 1.0)


def main() -> None:
    """Print one row per detail."""
    print("detail   foam: rebound, squeeze   gel: rebound, squeeze   sand: run-out")
    for detail, quality in QUALITIES.items():
        (e, s), (f, u) = drop(FOAM, detail), drop(GEL, detail)
        far = collapse(quality.cells_across // 2)
        print(f"{detail:8} {e:10.3f} {s:6.2f} mm {f:15.3f} {u:6.2f} mm {far:15.3f}")


if __name__ == "__main__":
    main()

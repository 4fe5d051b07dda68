"""Look materials up: every number has a measured range and a source; compare the speed of sound."""

from math import sqrt

import corporeal as co


def speed_of_sound(name: str) -> float:
    """Return the speed of a wave along a thin bar, sqrt(E/ρ) [m/s], and print where E is from."""
    entry = co.material(name)
    young_pa, density = entry.ranges["young_pa"], entry.ranges["density"]
    speed = sqrt(young_pa.typical / density.typical)
    print(f"{name}: E from {young_pa.low / 1e9:.3g} to {young_pa.high / 1e9:.3g} GPa, {speed:.0f} m/s")
    print(f"  {co.citation(young_pa.source)}")
    return speed


def main() -> float:
    """Return how many times faster sound runs in steel than in lead."""
    stiffest = max(co.library().values(), key=lambda entry: entry.ranges["young_pa"].typical)
    print(f"{len(co.library())} materials; the stiffest is {stiffest.name}")
    return speed_of_sound("steel") / speed_of_sound("lead")


if __name__ == "__main__":
    main()

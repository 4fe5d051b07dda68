"""Let a column of sand go: how far does it run out? (Lube et al. 2004: ΔR / R = 1.24 h / R)."""

import numpy as np

import corporeal as co

RADIUS = HEIGHT = 0.1
"""Of the column [m]."""


def main() -> float:
    """Return the run-out ΔR of the sand, 99 % of it, over the column's radius R."""
    sand = co.cylinder("sand", RADIUS, HEIGHT, name="sand")
    played = co.simulate_scene(co.build_scene(sand, duration=0.6, fps=10))
    final = played.trajectory.frames[-1].position
    edge = float(np.percentile(np.linalg.norm(final[:, :2], axis=1), 99))
    print(f"{len(final)} material points: R grew from {RADIUS:.2f} m to {edge:.3f} m")
    return edge / RADIUS - 1


if __name__ == "__main__":
    main()

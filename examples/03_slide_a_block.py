"""Slide a steel block over concrete: Coulomb friction stops it after v² / (2 μ g)."""

import corporeal as co

SPEED = 1.5
"""At the start [m/s]."""


def main() -> float:
    """Return the distance that it slid over the one that Coulomb's law says."""
    friction = co.friction_between(co.material("steel"), co.material("concrete")).sliding.typical
    block = co.box("steel", (0.12, 0.12, 0.03), velocity=(SPEED, 0, 0), name="block")
    settings = co.Settings(ground=co.GroundConfig(floor="concrete"))
    played = co.simulate_scene(co.build_scene(block, duration=0.6), settings)
    slid = played.outcome.objects["block"].moved_level_m
    law = SPEED**2 / (2 * friction * 9.81)
    print(f"μ = {friction:.2f}: slid {slid:.4f} m; Coulomb says {law:.4f} m")
    return slid / law


if __name__ == "__main__":
    main()

"""A material of one's own: a law from the menu, measured ranges and their source in a file."""

import tempfile
from pathlib import Path

import corporeal as co

MINE = """
extends = "default"
[sources.bench]
cite = "Our compression tests of a moulded silicone, twenty samples, 2026"
[my_silicone]
law = "neo_hookean"
group = "elastomer"
young_MPa = { low = 0.8, typical = 1.0, high = 1.2, source = "bench" }
poisson = { low = 0.47, typical = 0.48, high = 0.49, source = "bench" }
density_kg_m3 = { low = 1080, typical = 1100, high = 1120, source = "bench" }
friction = { low = 0.7, typical = 0.8, high = 0.9, source = "bench" }
restitution = { low = 0.9, typical = 0.93, high = 0.97, source = "bench" }
loss = { low = 0.02, typical = 0.05, high = 0.08, source = "bench" }
"""


def main() -> float:
    """Return how high a ball of it bounces over how high one of the library's rubber does."""
    with tempfile.TemporaryDirectory() as place:
        file = Path(place) / "mine.toml"
        file.write_text(MINE)
        settings = co.Settings(ground=co.GroundConfig(library=str(file)))
        mine = co.ball(co.material("my_silicone", str(file)), 0.03, (0.1, 0, 0.28), name="mine")
        rubber = co.ball("rubber", 0.03, (-0.1, 0, 0.28), name="rubber")
        played = co.simulate_scene(co.build_scene(mine, rubber, duration=0.5), settings)
    rise = {name: row.rebound_m for name, row in played.outcome.objects.items()}
    print(f"mine rose {rise['mine']:.3f} m, rubber {rise['rubber']:.3f} m")
    return rise["mine"] / rise["rubber"]


if __name__ == "__main__":
    main()

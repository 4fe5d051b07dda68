"""An ensemble: how far a rebound is known, if rubber may be any rubber that was measured."""

import tempfile
from pathlib import Path

import corporeal as co

SAMPLES = 6
"""Sets of values drawn from the measured ranges."""


def main() -> float:
    """Return the width of the rebound ratio's spread over its median."""
    with tempfile.TemporaryDirectory() as place:
        model = Path(place) / "ball.glb"
        ball = co.ball("rubber", radius=0.03, at=(0, 0, 0.28))
        co.write_glb(model, co.build_scene(ball, duration=0.5))
        settings = co.Settings(assemble=co.AssembleConfig(duration=0.5))
        run = co.run([model], Path(place) / "run", settings, until="simulate")
        spread = co.simulate_ensemble(run, SAMPLES).of("ball", "rebound_ratio")
    print(f"rebound {spread.median:.2f} of the fall, from {spread.low:.2f} to {spread.high:.2f}")
    return (spread.high - spread.low) / spread.median


if __name__ == "__main__":
    main()

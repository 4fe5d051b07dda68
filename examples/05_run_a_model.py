"""From a GLB to a report: write a scene as a file, run every verb, read what came out."""

import json
import tempfile
from pathlib import Path

import corporeal as co

SETTINGS = co.Settings(assemble=co.AssembleConfig(duration=0.3, fps=10), video=co.VideoConfig(width=160, height=120))


def main() -> float:
    """Return the error of the momentum balance, relative to the largest momentum."""
    with tempfile.TemporaryDirectory() as place:
        model = Path(place) / "steel-and-rubber.glb"
        co.write_glb(model, co.showcase_scene("steel-and-rubber"))
        run = co.run([model], Path(place) / "run", SETTINGS)
        audit = json.loads((run / "audit.json").read_text())
        size = (run / "report.html").stat().st_size
    print(f"report of {size / 1e6:.1f} MB; momentum astray {audit['momentum_residual']:.1e}")
    return audit["momentum_residual"]


if __name__ == "__main__":
    main()

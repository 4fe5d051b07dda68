"""Drop a rubber ball and see how high it comes back: scene → materials → particles → motion."""

import tempfile
from pathlib import Path

import numpy as np
import trimesh

from corporeal.mpm.outcome import outcome
from corporeal.stages.describe import describe
from corporeal.stages.fill import fill
from corporeal.stages.ground import ground
from corporeal.stages.segment import segment
from corporeal.stages.simulate import SimulateConfig, simulate
from corporeal.types import Finish, Scene, SceneObject, Surface


def a_ball(radius: float = 0.03, height: float = 0.25) -> Scene:
    """Hang a rubber ball in the air, its lowest point ``height`` metres above the floor."""
    mesh = trimesh.creation.icosphere(3, radius)
    mesh.apply_translation((0, 0, height + radius))
    said = {"substance": "rubber"}
    surface = Surface("ball", 0, 0, np.array(mesh.vertices), np.array(mesh.faces), extras=said)
    thing = SceneObject("ball_0", "rubber ball", 2 * radius)
    return Scene("ball", "example", (thing,), (surface,), (Finish("red"),), duration=0.5, fps=60)


def main() -> float:
    """Return the height of the rebound over the height of the fall."""
    scene = a_ball()
    words = describe(scene)
    parts = segment(scene, words)
    field = ground(scene, parts, words)
    particles = fill(scene, parts, field)
    with tempfile.TemporaryDirectory() as folder:
        moved = simulate(scene, particles, field, SimulateConfig(), Path(folder))
        ball = outcome(scene, particles, moved)["objects"]["ball_0"]
    print(f"{field.materials[0].name}, E = {field.materials[0].young / 1e6:.1f} MPa")
    print(f"fell {ball['fall_m']:.3f} m, rose {ball['rebound_m']:.3f} m")
    return ball["rebound_ratio"]


if __name__ == "__main__":
    main()

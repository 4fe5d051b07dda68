"""Photographs to a scene: picture a box from all sides, reconstruct it, weigh what was found."""

import tempfile
from dataclasses import replace
from pathlib import Path

import trimesh

import corporeal as co

SIZE = (0.3, 0.2, 0.15)
"""Of the true box [m]."""


def main() -> float:
    """Return the volume of the reconstructed box over the true one."""
    crate = replace(co.box("wood", SIZE, name="crate"), colour=(0.6, 0.05, 0.04, 1.0))
    scene = co.build_scene(crate, name="crate")
    settings = co.ReconstructConfig(object_names=("crate",), training="preview", metres_per_unit=1.0)
    with tempfile.TemporaryDirectory() as place:
        photographs = Path(place) / "photographs"
        co.write_views(photographs, co.capture(scene, co.CaptureConfig(views=12, size=(96, 96))))
        made = co.reconstruct(photographs, settings)
    surface = made.scene.surfaces[0]
    volume = float(trimesh.Trimesh(surface.vertices, surface.triangles).volume)
    print(f"{made.found.gaussians.count} Gaussians, one closed surface of {volume * 1e3:.1f} litres")
    return volume / (SIZE[0] * SIZE[1] * SIZE[2])


if __name__ == "__main__":
    main()

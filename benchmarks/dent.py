"""How wide a dent is in the close-up of a video.

    python benchmarks/dent.py RUN [RUN ...] [--size 1280 720]

RUN is the folder of a finished run. For every object that keeps a dent deeper than a grid cell, the
rigid motion of the part that kept its shape is taken off its surface; what the last instant's
surface is displaced by at least half of the deepest place, and faces the camera of the close
shot, is the dent that is seen. Given are its width and height in the picture, and the object's.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from corporeal.core.terminal import show_table
from corporeal.pipeline.results import StageResults
from corporeal.pipeline.run_pipeline import read_run
from corporeal.pipeline.stages.video import motion_summary
from corporeal.render.camera_placement import CameraAim, camera_from_aim
from corporeal.render.camera_track import camera_track
from corporeal.render.skin_binding import bind_vertices
from corporeal.simulation.moving_gaussians import fluid_parts, granular_parts
from corporeal.simulation.residual_shape import trusted_fit

SEEN = 0.5
"""Share of the deepest displacement: the full width at half maximum is given."""


@dataclass(frozen=True)
class Seen:
    """A dent in the last picture of the close shot."""

    thing: str
    depth: float
    """[m]"""
    dent: np.ndarray
    """Width and height [px]."""
    whole: np.ndarray
    """Of the object [px]."""


def dents(run: Path, size: tuple[int, int]) -> list[Seen]:
    """Measure every dent of a run in pictures of some size [px]."""
    results: StageResults = read_run(run)
    scene, trajectory, field = results.scene, results.trajectory, results.field
    skin = bind_vertices(scene, results.parts, results.particles, granular_parts(field), fluid_parts(field))
    owner = np.repeat([s.object for s in scene.surfaces], [len(s.vertices) for s in scene.surfaces])
    camera = camera_track("close", motion_summary(skin, scene, results.particles, trajectory), size, None)
    place, normal = skin.pose(trajectory.frames[-1])
    aim = camera.at(float(trajectory.time[-1]))
    facing = np.sum(normal * (np.asarray(aim.eye) - place), axis=1) > 0
    names, found = [o.name for o in scene.objects], []
    for name, body in results.played.outcome.objects.items():
        mine = owner == names.index(name)
        if body.dent_depth_dx <= 1 or not mine.any():
            continue
        shift = trusted_fit(skin.rest[mine], place[mine]).undo(place[mine]) - skin.rest[mine]
        far = np.linalg.norm(shift, axis=1)
        dented = facing[mine] & (far > SEEN * far.max())
        pixels = on_picture(place[mine], aim)
        extent = np.ptp(pixels[dented], axis=0) if dented.any() else np.zeros(2)
        found.append(Seen(name, float(far.max()), extent, np.ptp(pixels, axis=0)))
    return found


def on_picture(points: np.ndarray, aim: CameraAim) -> np.ndarray:
    """Return where points (N, 3) [m] show [px]."""
    camera = camera_from_aim(aim)
    local = np.linalg.inv(camera.world_from_camera) @ np.c_[points, np.ones(len(points))].T
    flat = camera.K @ local[:3]
    return (flat[:2] / flat[2]).T


def main() -> None:
    """Measure runs and print a table."""
    parser = argparse.ArgumentParser(description="How wide a dent is in a video's close-up.")
    parser.add_argument("runs", nargs="+", type=Path)
    parser.add_argument("--size", nargs=2, type=int, default=(1280, 720), help="of pictures [px]")
    asked = parser.parse_args()
    width, height = asked.size
    rows = [
        (run.name, s.thing, f"{1e3 * s.depth:.1f}", *(f"{a:.0f} x {b:.0f}" for a, b in (s.dent, s.whole)))
        for run in asked.runs
        for s in dents(run, (width, height))
    ]
    show_table(("run", "object", "depth [mm]", "dent [px]", "object [px]"), rows)


if __name__ == "__main__":
    main()

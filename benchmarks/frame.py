"""Find up, floor and things in pictures of composed scenes whose frame nobody knows.

    python benchmarks/frame.py SCENE ...

SCENE is a folder that ``corporeal assemble`` wrote: its ``views`` are posed pictures. Their cameras
are turned, scaled and moved at random, masks and meshes are forgotten. Printed are the angle
between up as found and as it was; the same with cameras held as people do; the height of the floor
as found over the diameter of what the cameras look at; and how well masks that were cut out agree
with the true ones (intersection over union).
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from corporeal.formats.transforms import read_views
from corporeal.geometry.region import region
from corporeal.geometry.rotation import matrix
from corporeal.geometry.similarity import moved_cameras, similarity
from corporeal.geometry.upright import Upright, upright
from corporeal.splats.crew import Crew
from corporeal.splats.cutout import cut_out
from corporeal.splats.sweep import swept
from corporeal.types import Camera, Views

POINTS = 20_000
TWO = 2
"""Threads."""
ROLL = 3.0
"""Standard deviation of how people hold cameras [deg]."""


def measured(scene: Path) -> dict:
    """Measure one scene; angle [deg], height [share], agreement [share], time [s]."""
    views = read_views(scene / "views")
    if views.object_of_pixel is None:
        raise SystemExit(f"{scene}: its views do not say where things are.")
    true = views.object_of_pixel >= 0
    rng = np.random.default_rng(0)
    scale = float(np.exp(rng.normal()))
    made = similarity(matrix(rng.normal(size=4)), scale, rng.normal(size=3))
    moved = Views(views.rgb, moved_cameras(views.cameras, made))
    with Crew(TWO) as crew:
        points = swept(moved, POINTS, rng, crew).points.position
    start = time.process_time()
    frame = upright(moved.cameras, points)
    rolled = upright(_rolled(moved.cameras, rng), points)
    masks = cut_out(moved, points, threads=TWO)
    spent = time.process_time() - start
    whole = frame.world_from_file @ made
    around = region(views.cameras)
    foot = whole @ np.array([around.centre[0], around.centre[1], 0.0, 1.0])
    found = np.zeros_like(true) if masks is None else masks
    agreed = (found & true).sum(axis=(1, 2)) / np.maximum((found | true).sum(axis=(1, 2)), 1)
    return {
        "scene": scene.name,
        "up": _off(frame, made, scale),
        "rolled": _off(rolled, made, scale),
        "floor": float(foot[2] / scale / (2 * around.radius)),
        "floor_by": frame.floor_by,
        "masks": float(agreed.mean()),
        "seconds": spent,
    }


def _off(frame: Upright, made: np.ndarray, scale: float) -> float:
    """Return the angle between up as found and as it was [deg]."""
    up = (frame.world_from_file @ made)[2, 2] / scale
    return float(np.degrees(np.arccos(np.clip(up, -1, 1))))


def _rolled(cameras: tuple[Camera, ...], rng: np.random.Generator) -> tuple[Camera, ...]:
    """Hold cameras as people do: not quite level."""
    made = []
    for camera in cameras:
        roll = np.radians(ROLL) * rng.normal()
        turn = similarity(matrix(np.array([np.cos(roll / 2), 0, 0, np.sin(roll / 2)])))
        made.append(replace(camera, world_from_camera=camera.world_from_camera @ turn))
    return tuple(made)


def main() -> None:
    """Measure scenes and print a table."""
    parser = argparse.ArgumentParser(description="Find up, floor and things in composed scenes.")
    parser.add_argument("scenes", nargs="+", type=Path)
    print("scene | up [deg] | rolled | floor [% of scene] | by | IoU | processor [s]")
    for scene in parser.parse_args().scenes:
        m = measured(scene)
        floor = f"{m['floor']:+.2%} | {m['floor_by']}"
        ups = f"{m['up']:.2f} | {m['rolled']:.2f}"
        print(f"{m['scene']} | {ups} | {floor} | {m['masks']:.3f} | {m['seconds']:.0f}", flush=True)


if __name__ == "__main__":
    main()

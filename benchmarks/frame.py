"""Find up, floor and things in pictures of composed scenes whose frame nobody knows.

    python benchmarks/frame.py SCENE ...

SCENE is a folder with ``views``, as ``corporeal assemble`` and ``as_photographed.py`` write them.
Their cameras are turned, scaled and moved at random, masks and meshes are forgotten, and Gaussians
are learned (draft). Printed are the angle between up as found and as it was; the same with cameras
held as people do; the height of the floor as found over the diameter of what the cameras look at;
how well masks that were cut out agree with the true ones (intersection over union); and the floor's
height again where true masks hide it, and things alone are learned.
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from corporeal.core.types import Camera, Views
from corporeal.geometry.rotation import matrix_from_quaternion
from corporeal.io.photos.transforms_json import read_views
from corporeal.multiview.similarity_transform import apply_similarity_to_cameras, similarity_matrix
from corporeal.multiview.viewed_region import find_viewed_region
from corporeal.multiview.world_alignment import align_world
from corporeal.reconstruction.gaussians.gaussian_scene import GaussianScene, turn_upright
from corporeal.reconstruction.gaussians.train_gaussians import train_gaussians
from corporeal.reconstruction.gaussians.training_schedule import TrainConfig

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
    made = similarity_matrix(matrix_from_quaternion(rng.normal(size=4)), scale, rng.normal(size=3))
    moved = Views(views.rgb, apply_similarity_to_cameras(views.cameras, made))
    start = time.process_time()
    whole = turn_upright(_taken(moved, None))
    spent = time.process_time() - start
    alone = turn_upright(_taken(moved, true))
    rolled = apply_similarity_to_cameras(_rolled(moved.cameras, rng), whole.world_from_file)
    way = align_world(rolled, whole.solid).world_from_file @ whole.world_from_file
    assert whole.masks is not None
    both, either = (m.sum(axis=(1, 2)) for m in (whole.masks & true, whole.masks | true))
    return {
        "scene": scene.name,
        "up": _off(whole.world_from_file, made, scale),
        "rolled": _off(way, made, scale),
        "floor": _height(whole, made, scale, views.cameras),
        "floor_found": whole.floor,
        "masks": float((both / np.maximum(either, 1)).mean()),
        "alone": _height(alone, made, scale, views.cameras),
        "seconds": spent,
    }


def _taken(views: Views, masks: np.ndarray | None) -> GaussianScene:
    learned = train_gaussians(views, masks, config=TrainConfig("draft", threads=TWO))
    return GaussianScene(learned.gaussians, views.cameras, views, masks)


def _height(taken: GaussianScene, made: np.ndarray, scale: float, cameras: tuple[Camera, ...]) -> float:
    """Return how high the true floor is in the frame as found, over the scene's diameter."""
    around = find_viewed_region(cameras)
    foot = made @ np.array([around.centre[0], around.centre[1], 0.0, 1.0])
    return float((taken.world_from_file @ foot)[2] / scale / (2 * around.radius))


def _off(world_from_file: np.ndarray, made: np.ndarray, scale: float) -> float:
    """Return the angle between up as found and as it was [deg]."""
    up = (world_from_file @ made)[2, 2] / scale
    return float(np.degrees(np.arccos(np.clip(up, -1, 1))))


def _rolled(cameras: tuple[Camera, ...], rng: np.random.Generator) -> tuple[Camera, ...]:
    """Hold cameras as people do: not quite level."""
    made = []
    for camera in cameras:
        roll = np.radians(ROLL) * rng.normal()
        turn = similarity_matrix(matrix_from_quaternion(np.array([np.cos(roll / 2), 0, 0, np.sin(roll / 2)])))
        made.append(replace(camera, world_from_camera=camera.world_from_camera @ turn))
    return tuple(made)


def main() -> None:
    """Measure scenes and print a table."""
    parser = argparse.ArgumentParser(description="Find up, floor and things in composed scenes.")
    parser.add_argument("scenes", nargs="+", type=Path)
    print("scene | up [deg] | rolled | floor [% of scene] | IoU | floor, masks | processor [s]")
    for scene in parser.parse_args().scenes:
        m = measured(scene)
        floor = f"{m['floor']:+.2%}" + ("" if m["floor_found"] else " (none found)")
        ups = f"{m['up']:.2f} | {m['rolled']:.2f}"
        masks = f"{m['masks']:.3f} | {m['alone']:+.2%}"
        print(f"{m['scene']} | {ups} | {floor} | {masks} | {m['seconds']:.0f}", flush=True)


if __name__ == "__main__":
    main()

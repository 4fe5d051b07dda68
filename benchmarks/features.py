"""How long features take onto points, and how much memory: seconds and peak.

    python benchmarks/features.py [points] [channels] [views]
    python benchmarks/features.py --fields SCENE ... [--preset draft | normal]

Maps are random and points lie on a sphere: what is timed does not depend on what they show.

With ``--fields`` radiance fields are learned from the posed pictures and masks of scenes that
``corporeal assemble`` wrote, every eighth view held out. The pictures' own depth says how far from
the surface the points are, and maps of which object each pixel shows, how many of them have the
right features. Seconds are the processor's, divided by two: what it takes on two cores.
"""

import argparse
import resource
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import KDTree

from corporeal.core.process_resources import usable_cores
from corporeal.core.types import Camera, Views
from corporeal.geometry.mesh_queries import sphere_directions
from corporeal.io.photos.transforms_json import read_views
from corporeal.reconstruction.features.feature_lifting import (
    back_projection,
    fill_unseen_points,
    uplift_features,
    visible_points,
)
from corporeal.reconstruction.features.point_descriptor import mean_view_directions, point_descriptor
from corporeal.reconstruction.gaussians.feature_distillation import distil_features
from corporeal.reconstruction.gaussians.radiance_field import RadianceFieldConfig, field_surface_points, train_field

SIDE, FOCAL, AWAY = 256, 300.0, 3.0
GRID = 37
"""Patches along a picture's side, as DINOv2 has at 518 pixels."""
CORES = 2
PATCH = 8
"""Pixels along a patch of maps of objects."""


def around(count: int) -> list[Camera]:
    """Return cameras that look at the middle of the world from all sides."""
    cameras = []
    for back in sphere_directions(count):
        right = np.cross([0.0, 0.0, 1.0], back)
        right /= np.linalg.norm(right)
        pose = np.eye(4)
        pose[:3] = np.stack([right, np.cross(right, back), -back, AWAY * back], axis=1)
        K = np.array([[FOCAL, 0, SIDE / 2], [0, FOCAL, SIDE / 2], [0, 0, 1]])
        cameras.append(Camera(K, pose, SIDE, SIDE))
    return cameras


def depth_of_ball() -> np.ndarray:
    """Return what a camera sees of the unit ball in the middle of the world [m]."""
    v, u = (np.mgrid[:SIDE, :SIDE] + 0.5 - SIDE / 2) / FOCAL
    a, b, c = u**2 + v**2 + 1, -2 * AWAY, AWAY**2 - 1
    root = b**2 - 4 * a * c
    return np.where(root > 0, (-b - np.sqrt(np.maximum(root, 0))) / (2 * a), np.inf)


def timed(what: str, work: Callable[[], Any]) -> Any:
    """Do it once, and say how long it took and how much memory the process has needed so far."""
    start = time.perf_counter()
    made = work()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(f"{what:34} {time.perf_counter() - start:7.2f} s   {peak:5.2f} GB at most")
    return made


def main() -> None:
    """Time every way that features come onto points, or learn fields."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sizes", nargs="*", type=int, help="points, channels, views")
    parser.add_argument("--fields", nargs="+", type=Path, default=[], metavar="SCENE")
    parser.add_argument("--preset", choices=["draft", "normal"], default="draft")
    asked = parser.parse_args()
    if asked.fields:
        fields(asked.fields, asked.preset)
    else:
        lifted_onto_a_ball(*[*asked.sizes, *(100_000, 768, 48)[len(asked.sizes) :]])


def lifted_onto_a_ball(points: int, channels: int, views: int) -> None:
    """Time uplift and back-projection, and the descriptor."""
    rng = np.random.default_rng(0)
    position = sphere_directions(points)
    cameras = around(views)
    depth = np.broadcast_to(depth_of_ball(), (views, SIDE, SIDE))
    one = rng.normal(size=(GRID, GRID, channels)).astype(np.float16)
    maps = [one] * views
    print(f"{points} points, {channels} channels, {views} views of {GRID} x {GRID} patches")
    lifted = timed("back-projection", lambda: back_projection(position, cameras, depth, maps))
    timed("filling what no view shows", lambda: fill_unseen_points(position, lifted))
    timed("unit vectors in half precision", lifted.unit)
    weights = timed("weights of Gaussians (made up)", lambda: _weights(rng, points, views))
    timed("uplift", lambda: uplift_features(weights.__getitem__, (32, 32), maps, points))
    shown = [visible_points(position, c, d) for c, d in zip(cameras, depth, strict=True)]
    towards = mean_view_directions(position, cameras, shown)
    colour = rng.random((points, 3))
    timed("descriptor", lambda: point_descriptor(position, colour, towards))


def fields(scenes: list[Path], preset: str) -> None:
    """Learn a field of each scene; print one row each."""
    heads = "scene", "nodes", "whole [dB]", "things [dB]", "two cores [s]", "points"
    heads = *heads, "off, median [px]", "off, 90 % [px]", "right", "768 channels [s]", "peak [GB]"
    print(f"| {' | '.join(heads)} |")
    print(f"|---|{'---:|' * (len(heads) - 1)}")
    for scene in scenes:
        print(f"| {' | '.join(_row(scene, preset))} |", flush=True)


def _row(scene: Path, preset: str) -> list[str]:
    seen = read_views(scene / "views")
    which, depth = seen.object_of_pixel, seen.depth
    if which is None or depth is None:
        raise SystemExit(f"{scene}: its views do not say where things are, and how far away.")
    config, start = (RadianceFieldConfig(preset, threads=min(CORES, usable_cores())), time.process_time())
    made = train_field(Views(seen.rgb, seen.cameras), which >= 0, config)
    spent = time.process_time() - start
    found = field_surface_points(made.field, seen.cameras, 100_000)
    both = (which >= 0) & np.isfinite(found.depth)
    pixels = np.abs(found.depth[both] / depth[both] - 1) * seen.cameras[0].K[0, 0]
    truth = _owners(seen, found.position)
    labels = int(which.max()) + 2
    maps = [_shares(picture, labels) for picture in which]
    told = distil_features(made.field, seen.cameras, maps).at(found.position)
    right = np.mean(told[:, 1:].argmax(axis=1) == truth)
    rng, start = np.random.default_rng(0), time.process_time()
    one = rng.normal(size=(GRID, GRID, 768)).astype(np.float16)
    distil_features(made.field, seen.cameras, [one] * len(seen.cameras)).at(found.position)
    wide = time.process_time() - start
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    good = made.quality
    assert good is not None and good.psnr_on_objects is not None
    numbers = f"{good.psnr:.1f} {good.psnr_on_objects:.1f} {spent / CORES:.0f} {len(told)}"
    off = np.quantile(pixels, (0.5, 0.9))
    rest = f"{off[0]:.1f} {off[1]:.1f} {right:.4f} {wide / CORES:.0f} {peak:.1f}"
    return [scene.name, str(len(made.field.values)), *numbers.split(), *rest.split()]


def _owners(seen: Views, position: np.ndarray) -> np.ndarray:
    """Return which object pictures show nearest to each point."""
    assert seen.depth is not None and seen.object_of_pixel is not None
    places, owners = [], []
    for camera, depth, which in zip(seen.cameras, seen.depth, seen.object_of_pixel, strict=True):
        v, u = np.nonzero(which >= 0)
        flat = np.stack([u + 0.5, v + 0.5, np.ones(len(u))]) * depth[v, u]
        pose = camera.world_from_camera
        places.append((pose[:3, :3] @ np.linalg.solve(camera.K, flat)).T + pose[:3, 3])
        owners.append(which[v, u])
    return np.concatenate(owners)[KDTree(np.concatenate(places)).query(position)[1]]


def _shares(which: np.ndarray, labels: int) -> np.ndarray:
    """Return a map of how much of each patch is of nothing, and of each object."""
    high, wide = (n // PATCH for n in which.shape)
    hot = np.eye(labels, dtype=np.float32)[which[: high * PATCH, : wide * PATCH] + 1]
    return hot.reshape(high, PATCH, wide, PATCH, labels).mean(axis=(1, 3)).astype(np.float16)


def _weights(rng: np.random.Generator, points: int, views: int) -> list[Any]:
    from scipy.sparse import csr_array

    entries = 2 * points
    made = []
    for _ in range(views):
        places = rng.integers(0, points, entries), rng.integers(0, 32 * 32, entries)
        made.append(csr_array((rng.random(entries), places), shape=(points, 32 * 32)))
    return made


if __name__ == "__main__":
    main()

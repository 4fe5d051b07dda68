"""How long features take onto points, and how much memory: seconds, share of the time, peak.

    python benchmarks/features.py [points] [channels] [views]

Maps are random and points lie on a sphere: what is timed does not depend on what they show.
"""

import resource
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from corporeal.features.descriptor import descriptor, seen_from
from corporeal.features.lifting import back_projection, fill, uplift, visible
from corporeal.geometry.shape import sphere_directions
from corporeal.types import Camera

SIDE, FOCAL, AWAY = 256, 300.0, 3.0
GRID = 37
"""Patches along a picture's side, as DINOv2 has at 518 pixels."""


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
    """Time every way that features come onto points."""
    words = [int(word) for word in sys.argv[1:]]
    points, channels, views = [*words, *(100_000, 768, 48)[len(words) :]]
    rng = np.random.default_rng(0)
    position = sphere_directions(points)
    cameras = around(views)
    depth = np.broadcast_to(depth_of_ball(), (views, SIDE, SIDE))
    one = rng.normal(size=(GRID, GRID, channels)).astype(np.float16)
    maps = [one] * views
    print(f"{points} points, {channels} channels, {views} views of {GRID} x {GRID} patches")
    lifted = timed("back-projection", lambda: back_projection(position, cameras, depth, maps))
    timed("filling what no view shows", lambda: fill(position, lifted))
    timed("unit vectors in half precision", lifted.unit)
    weights = timed("weights of Gaussians (made up)", lambda: _weights(rng, points, views))
    timed("uplift", lambda: uplift(weights.__getitem__, (32, 32), maps, points))
    shown = [visible(position, c, d) for c, d in zip(cameras, depth, strict=True)]
    towards = seen_from(position, cameras, shown)
    colour = rng.random((points, 3))
    timed("descriptor", lambda: descriptor(position, colour, towards))


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

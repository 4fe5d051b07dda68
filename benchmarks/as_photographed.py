"""Make captured views look as if somebody had photographed them in a room.

    python benchmarks/as_photographed.py SCENE OUT [--seed 0]

SCENE is a folder that ``corporeal assemble`` wrote, with ``views``. In OUT they have a floor of
planks and four papered walls behind the things, the same from all sides, in place of the plain
backdrop; shadows stay. Every picture then has its own exposure and white balance, is a little out
of focus or shaken, noisy, and was a JPEG. Masks stay with the views for comparing; none is learned
from by ``benchmarks/splats.py OUT --sources pictures``.
"""

import argparse
import io
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.ndimage import gaussian_filter, map_coordinates, uniform_filter1d

from corporeal.formats.transforms import read_views, write_views
from corporeal.types import Camera, Views

ROOM = 1.5
"""Half the room's side, in distances of the farthest camera from its middle."""
GRID = 3
"""Looks per pixel along x and y."""
EXPOSURE, BALANCE = 0.12, 0.03
"""Standard deviations of the logarithms of what pictures and their channels are multiplied by."""
BLUR, SHAKEN = (0.4, 0.9), 2
"""Standard deviations of blur [px]; of every fourth picture, length of the smear [px]."""
NOISE = 2.0
"""Standard deviation [of 255]."""
JPEG = (70, 90)
"""Qualities."""
OAK, PAPER, STRIPE = (0.62, 0.46, 0.32), (0.70, 0.72, 0.66), (0.45, 0.52, 0.56)


def noise(points: np.ndarray, wave: float, seed: int) -> np.ndarray:
    """Return smooth noise in [-1, 1] at points (N, 3) with features of such a size [m]."""
    cells = np.random.default_rng(seed).uniform(-1, 1, (48, 48, 48))
    return map_coordinates(cells, (points / wave).T % 48, order=1, mode="grid-wrap")


def paint(points: np.ndarray, floor: np.ndarray, size: float) -> np.ndarray:
    """Return the colours of places on floor or walls (N, 3)."""
    x, y, z = points.T
    plank = np.floor(y / (0.06 * size))
    tone = np.sin(12.9898 * plank + 78.2 * np.floor(x / (0.5 * size) + 0.37 * plank)) * 43758.5
    grain = noise(points * [0.15, 1, 1], 0.008 * size, 1)
    gap = (y / (0.06 * size)) % 1 < 0.06
    wood = 0.12 * (tone % 1 - 0.5) + 0.06 * grain + 0.05 * noise(points, 0.1 * size, 2)
    oak = np.array(OAK) * (1 + wood - 0.4 * gap)[:, None]
    stripe = (np.sin((x + y) * 20 / size) > 0.3)[:, None]
    stain = 0.08 * noise(points, 0.25 * size, 3) + 0.04 * noise(points, 0.04 * size, 4)
    paper = np.where(stripe, STRIPE, PAPER) * (1 + stain)[:, None]
    skirting = (z < 0.12 * size)[:, None]
    return np.where(floor[:, None], oak, np.where(skirting, 0.85, paper))


def backdrop(camera: Camera, half: float, size: float) -> np.ndarray:
    """Return what a camera sees of an empty room (H, W, 3)."""
    h, w = camera.height * GRID, camera.width * GRID
    v, u = (np.indices((h, w)).reshape(2, -1) + 0.5) / GRID
    K, pose = camera.K, camera.world_from_camera
    local = np.stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones(h * w)], axis=1)
    ray, eye = local @ pose[:3, :3].T, pose[:3, 3]
    with np.errstate(divide="ignore"):
        down = np.where(ray[:, 2] < 0, -eye[2] / ray[:, 2], np.inf)
        out = np.min((half * np.sign(ray[:, :2]) - eye[:2]) / ray[:, :2], axis=1)
    there = eye + np.minimum(down, out)[:, None] * ray
    colours = paint(there, down < out, size).reshape(camera.height, GRID, camera.width, GRID, 3)
    return colours.mean(axis=(1, 3))


def photographed(rgb: np.ndarray, k: int, rng: np.random.Generator) -> np.ndarray:
    """Return a picture (H, W, 3) in [0, 1] as a careless photographer gets it, in bytes."""
    gain = np.exp(EXPOSURE * rng.normal() + BALANCE * rng.normal(size=3))
    blurred = gaussian_filter(rgb, (*[rng.uniform(*BLUR)] * 2, 0))
    if k % 4 == 1:
        blurred = uniform_filter1d(blurred, SHAKEN + 1, axis=int(rng.integers(2)))
    noisy = 255 * gain * blurred + NOISE * rng.normal(size=rgb.shape)
    raw = io.BytesIO()
    picture = Image.fromarray(np.clip(np.round(noisy), 0, 255).astype(np.uint8))
    picture.save(raw, "JPEG", quality=int(rng.integers(*JPEG)))
    return np.asarray(Image.open(raw))


def degraded(views: Views, seed: int) -> Views:
    """Return the views with a room behind the things, photographed."""
    if views.object_of_pixel is None:
        raise SystemExit("These views do not say where things are.")
    eyes = np.stack([c.world_from_camera[:3, 3] for c in views.cameras])
    size = float(np.linalg.norm(eyes[:, :2], axis=1).max())
    rng, rgb = np.random.default_rng(seed), views.rgb.copy()
    plain = np.median(views.rgb[views.object_of_pixel < 0].mean(axis=-1))
    for k, camera in enumerate(views.cameras):
        real = views.rgb[k] / 255
        shade = np.minimum(real.mean(axis=-1, keepdims=True) * 255 / plain, 1)
        room = backdrop(camera, ROOM * size, size) * shade
        on = (views.object_of_pixel[k] >= 0)[..., None]
        rgb[k] = photographed(np.where(on, real, room), k, rng)
    return replace(views, rgb=rgb)


def main() -> None:
    """Read, change, write."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scene", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    write_views(asked.out / "views", degraded(read_views(asked.scene / "views"), asked.seed))


if __name__ == "__main__":
    main()

"""Make captured views look as if somebody had photographed them in a room.

    python benchmarks/as_photographed.py SCENE OUT [--seed 0] [--pictures 24] [--wall] [--clutter]
        [--flash] [--rolled] [--stop] [--turned] [--on table|cloth|newspaper|grass]

SCENE is a folder that ``corporeal assemble`` wrote, with ``views``. In OUT they have a floor of
planks and four papered walls behind the things, the same from all sides, in place of the plain
backdrop; shadows stay. Every picture then has its own exposure and white balance, is a little out
of focus or shaken, noisy, and was a JPEG. Masks stay with the views for comparing; none is learned
from by ``benchmarks/splats.py OUT --sources pictures``.

``--wall`` puts a wall close behind the things and keeps the views from before it; ``--clutter``
puts painted balls on the floor around them; ``--flash`` lights everything from the camera, so that
what is near is bright; ``--rolled`` turns every second picture by a quarter, as telephones are
held (all are cropped to squares); ``--stop`` gives them exposures up to a stop apart; with
``--turned`` the things and what they stand on were turned by hand before a room that stands still;
``--on`` says what that is, and where (``grounds.py``); ``--pictures`` keeps so many.
"""

import argparse
import io
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from grounds import FLOOR, GROUNDS, Ground, noise
from PIL import Image
from scipy.ndimage import gaussian_filter, uniform_filter1d

from corporeal.core.types import Camera, Views
from corporeal.io.photos.transforms_json import read_views, write_views

SWITCHES = ("wall", "clutter", "flash", "rolled", "stop", "turned")
"""Of how pictures are taken."""
GRID = 3
"""Looks per pixel along x and y."""
EXPOSURE, BALANCE = 0.12, 0.03
"""Standard deviations of the logarithms of what pictures and their channels are multiplied by."""
STOPS, BESIDE = 1.0, 3.0
"""Exposures between the darkest and the brightest picture [stops]; standard deviation of where
somebody stands who turns things [deg]."""
BLUR, SHAKEN = (0.4, 0.9), 2
"""Standard deviations of blur [px]; of every fourth picture, length of the smear [px]."""
NOISE = 2.0
"""Standard deviation [of 255]."""
JPEG = (70, 90)
"""Qualities."""
CLOSE = 0.35
"""Distance of the near wall from the middle, in distances of the farthest camera."""
BALLS, BALL, AWAY = 7, 0.09, 0.6
"""Number, radius and distance from the middle of balls around the things, in these distances."""
LIT = 0.9
"""Distance, in these distances, at which flash light is as bright as the room's."""
GREY = (0.66, 0.65, 0.63)
OAK, PAPER, STRIPE = (0.62, 0.46, 0.32), (0.70, 0.72, 0.66), (0.45, 0.52, 0.56)


def paint(points: np.ndarray, floor: np.ndarray, size: float, plain: bool = False) -> np.ndarray:
    """Return the colours of places on floor or walls (N, 3); plain: both have one colour each."""
    if plain:
        return np.where(floor[:, None], GREY, PAPER)
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


@dataclass(frozen=True)
class Look:
    """How badly pictures are taken, and where."""

    seed: int = 0
    pictures: int | None = None
    wall: bool = False
    clutter: bool = False
    flash: bool = False
    rolled: bool = False
    plain: bool = False
    """Whether floor and walls have one colour each."""
    grid: int = GRID
    """Looks per pixel along x and y."""
    stop: bool = False
    turned: bool = False
    on: str | None = None
    """One of ``GROUNDS``; None: the floor of the room."""


@dataclass(frozen=True)
class Room:
    """Around the things."""

    size: float
    """Distance of the farthest camera from the middle [m]."""
    wall: bool
    """Whether the wall at +y is near."""
    balls: np.ndarray
    """Middle and radius of each ball (B, 4) [m]."""
    plain: bool = False
    grid: int = GRID
    ground: Ground = FLOOR
    turn: float = 0.0
    """How far things and what they stand on were turned in it, against the sun [rad]."""


def backdrop(camera: Camera, room: Room) -> tuple[np.ndarray, np.ndarray]:
    """Return what a camera sees of a room without the things (H, W, 3), and how far away (H, W)."""
    size, grid = room.size, room.grid
    h, w = camera.height * grid, camera.width * grid
    v, u = (np.indices((h, w)).reshape(2, -1) + 0.5) / grid
    K, pose = camera.K, camera.world_from_camera
    local = np.stack([(u - K[0, 2]) / K[0, 0], (v - K[1, 2]) / K[1, 1], np.ones(h * w)], axis=1)
    ray, eye = local @ pose[:3, :3].T, pose[:3, 3]
    far, colours = _still(eye, ray, room)
    for k, (*middle, radius) in enumerate(room.balls):
        met = _met(eye - middle, ray, radius)
        near = met < far
        far[near] = met[near]
        tone = 0.8 + 0.2 * noise(eye + far[near, None] * ray[near], 0.03 * size, 5 + k)
        colours[near] = np.random.default_rng(k).uniform(0.1, 0.9, 3) * tone[:, None]
    colours = colours.reshape(camera.height, grid, camera.width, grid, 3)
    far = far.reshape(camera.height, grid, camera.width, grid)
    return colours.mean(axis=(1, 3)), far.mean(axis=(1, 3))


def _still(eye: np.ndarray, ray: np.ndarray, room: Room) -> tuple[np.ndarray, np.ndarray]:
    """Return how far along rays (N, 3) ground, floor and walls are (N,), and their colours."""
    size, ground, turn = room.size, room.ground, _turned(room.turn)
    half = np.full((2, 2), ground.room * size)
    half[1, 1] = CLOSE * size if room.wall else half[1, 1]
    low = np.array([0.0, 0.0, ground.drop * size])
    stands, still = turn @ eye, ray @ turn.T
    with np.errstate(divide="ignore"):
        down = np.where(ray[:, 2] < 0, -eye[2] / ray[:, 2], np.inf)
        here = eye + np.where(np.isfinite(down), down, 0.0)[:, None] * ray
        on = np.isfinite(down) & ground.covers(here / size)
        down = np.where(on, down, np.where(ray[:, 2] < 0, -(eye + low)[2] / ray[:, 2], np.inf))
        ahead = np.where(still[:, :2] > 0, half[:, 1] - stands[:2], -half[:, 0] - stands[:2])
        out = np.min(ahead / still[:, :2], axis=1)
    far, floor = np.minimum(down, out), down < out
    there = stands + low + far[:, None] * still
    colours = paint(there, floor, size, room.plain or ground.plain)
    if ground.walls is not None:
        colours[~floor] = ground.walls(there[~floor] / size)
    if ground.paint is not None:
        colours[on & floor] = ground.paint(here[on & floor] / size)
    return far, colours


def _turned(angle: float) -> np.ndarray:
    """Return the rotation about z by an angle [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _met(eye: np.ndarray, ray: np.ndarray, radius: float) -> np.ndarray:
    """Return how far along rays a ball about the origin is, in lengths of the ray; inf: beside."""
    a, b, c = (ray * ray).sum(axis=1), ray @ eye, eye @ eye - radius**2
    inside = b * b - a * c
    with np.errstate(invalid="ignore"):
        far = (-b - np.sqrt(inside)) / a
    return np.where((inside > 0) & (far > 0), far, np.inf)


def photographed(rgb: np.ndarray, k: int, rng: np.random.Generator, stops: float = 0.0) -> np.ndarray:
    """Return a picture (H, W, 3) in [0, 1] as a careless photographer gets it, in bytes.

    Exposures are so many stops apart, beside what they differ by anyway.
    """
    rgb = rgb * 2 ** rng.uniform(-stops / 2, stops / 2) if stops else rgb
    gain = np.exp(EXPOSURE * rng.normal() + BALANCE * rng.normal(size=3))
    blurred = gaussian_filter(rgb, (*[rng.uniform(*BLUR)] * 2, 0))
    if k % 4 == 1:
        blurred = uniform_filter1d(blurred, SHAKEN + 1, axis=int(rng.integers(2)))
    noisy = 255 * gain * blurred + NOISE * rng.normal(size=rgb.shape)
    raw = io.BytesIO()
    picture = Image.fromarray(np.clip(np.round(noisy), 0, 255).astype(np.uint8))
    picture.save(raw, "JPEG", quality=int(rng.integers(*JPEG)))
    return np.asarray(Image.open(raw))


def degraded(views: Views, asked: Look) -> Views:
    """Return the views with a room behind the things, photographed."""
    if views.object_of_pixel is None or views.depth is None:
        raise SystemExit("These views do not say where things are.")
    eyes = np.stack([c.world_from_camera[:3, 3] for c in views.cameras])
    size = float(np.linalg.norm(eyes[:, :2], axis=1).max())
    before = np.flatnonzero(eyes[:, 1] < 0.5 * CLOSE * size if asked.wall else eyes[:, 1] < np.inf)
    count = min(asked.pictures or len(before), len(before))
    views = _some(views, before[np.linspace(0, len(before) - 1, count).round().astype(int)])
    assert views.object_of_pixel is not None and views.depth is not None
    rng, rgb = np.random.default_rng(asked.seed), views.rgb.copy()
    balls = _balls(size, rng) if asked.clutter else np.zeros((0, 4))
    ground = FLOOR if asked.on is None else GROUNDS[asked.on]
    room = Room(size, asked.wall, balls, asked.plain, asked.grid, ground)
    plain = np.median(views.rgb[views.object_of_pixel < 0].mean(axis=-1))
    for k, camera in enumerate(views.cameras):
        real = views.rgb[k] / 255
        shade = np.minimum(real.mean(axis=-1, keepdims=True) * 255 / plain, 1)
        if asked.turned:
            x, y, _ = camera.world_from_camera[:3, 3]
            stands = np.radians(BESIDE) * rng.normal() - np.pi / 2
            room = replace(room, turn=stands - np.arctan2(y, x))
        around, far = backdrop(camera, room)
        on = views.object_of_pixel[k] >= 0
        seen = np.where(on[..., None], real, around if asked.flash else around * shade)
        if asked.flash:
            away = np.where(on, views.depth[k], far) / (LIT * size)
            seen = np.clip(seen / np.maximum(away, 0.3)[..., None] ** 2, 0, 1)
        rgb[k] = photographed(seen, k, rng, STOPS if asked.stop else 0.0)
    made = Views(rgb, views.cameras, object_of_pixel=views.object_of_pixel)
    return rolled(made) if asked.rolled else made


def _some(views: Views, which: np.ndarray) -> Views:
    assert views.depth is not None and views.object_of_pixel is not None
    cameras = tuple(views.cameras[k] for k in which)
    owners = views.object_of_pixel[which]
    return Views(views.rgb[which], cameras, depth=views.depth[which], object_of_pixel=owners)


def _balls(size: float, rng: np.random.Generator) -> np.ndarray:
    """Return balls on the floor, around the things and not before any camera."""
    turn = 2 * np.pi * (np.arange(BALLS) + rng.uniform(-0.3, 0.3, BALLS)) / BALLS
    radius = BALL * size * rng.uniform(0.5, 1.0, BALLS)
    away = AWAY * size
    return np.stack([away * np.cos(turn), away * np.sin(turn), radius, radius], axis=1)


def rolled(views: Views) -> Views:
    """Return the middle square of each picture, every second one turned by a quarter."""
    assert views.object_of_pixel is not None
    height, width = views.rgb.shape[1:3]
    side = min(height, width)
    top, left = (height - side) // 2, (width - side) // 2
    rgb = views.rgb[:, top : top + side, left : left + side].copy()
    owners = views.object_of_pixel[:, top : top + side, left : left + side].copy()
    cameras = []
    for k, camera in enumerate(views.cameras):
        K, pose = camera.K.copy(), camera.world_from_camera.copy()
        K[:2, 2] -= left, top
        if k % 2:
            rgb[k], owners[k] = np.rot90(rgb[k]), np.rot90(owners[k])
            K = np.array([[K[1, 1], 0, K[1, 2]], [0, K[0, 0], side - K[0, 2]], [0, 0, 1]])
            pose[:3, 0], pose[:3, 1] = pose[:3, 1].copy(), -pose[:3, 0]
        cameras.append(Camera(K, pose, side, side))
    return Views(rgb, tuple(cameras), object_of_pixel=owners)


def add_switches(parser: argparse.ArgumentParser) -> None:
    """Let somebody say how pictures are taken, and where."""
    parser.add_argument("--on", choices=GROUNDS)
    for name in SWITCHES:
        parser.add_argument(f"--{name}", action="store_true")


def look_of(asked: argparse.Namespace, **more: Any) -> Look:
    """Return what somebody said."""
    chosen = {name: getattr(asked, name) for name in SWITCHES}
    return Look(seed=asked.seed, on=asked.on, **chosen, **more)


def main() -> None:
    """Read, change, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--pictures", type=int)
    add_switches(parser)
    asked = parser.parse_args()
    look = look_of(asked, pictures=asked.pictures)
    write_views(asked.out / "views", degraded(read_views(asked.scene / "views"), look))


if __name__ == "__main__":
    main()

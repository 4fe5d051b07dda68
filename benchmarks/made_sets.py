"""Sets of photographs of models, as a stranger takes them: walking around, in a furnished room.

    python benchmarks/made_sets.py MODEL OUT [--pictures 30] [--rounds 20 45] [--size 640 480]
        [--seed 0] [--plain] [--wall] [--clutter] [--flash] [--rolled] [--stop] [--turned]
        [--on table|cloth|newspaper|grass] [--video] [--zoomed 1.6]

MODEL is what ``corporeal run`` takes. Somebody walks around it once for each of the rounds, at such
an angle above the floor [deg], with unsteady hands and at no constant pace. The room and how badly
the pictures are taken are those of ``as_photographed.py``; with ``--plain`` floor and walls have
one colour each. With ``--wall`` half of each round is walked, before it.
OUT is a set for ``real_photographs.py``: ``images``, true ``masks``, true poses in ``sparse/0``,
and ``known.toml`` with up, the sides of what is seen, and those of all that is there: nobody sees
the underside of a ball. With ``--video`` the way is walked once, in frames of a video, ``video.mp4``,
whose numbers are those of the images. With ``--zoomed`` every second picture is taken through a
lens so many times as long; pictures state theirs in EXIF.
"""

import argparse
import json
import sys
from pathlib import Path

import imageio_ffmpeg
import numpy as np
from as_photographed import add_switches, degraded, look_of
from colmap_writer import write_colmap
from PIL import Image

from corporeal.core.errors import UserError
from corporeal.core.types import Camera, Views
from corporeal.geometry.scene_transforms import object_boxes
from corporeal.pipeline.stages.assemble import assemble
from corporeal.pipeline.stages.capture import render_views
from corporeal.render.camera_placement import CameraAim

FIELD = 48.0
"""Vertical field of view [deg]: a telephone's, held level."""
FILLED = 0.55
"""Share of the picture's height that the thing takes, about."""
PACE, REACH, HEIGHT, AIM = 0.25, 0.06, 3.0, 0.04
"""Standard deviations: of steps along the way, in steps; of distances, in distances; of angles
above the floor [deg]; of where hands point, in distances."""
RATE = 10
"""Frames of a video a second."""
QUALITY = 92
"""Of the photographs."""
FINE = 2
"""Looks per pixel along x and y at grounds, whose prints and blades are finer than pixels."""


def way_around(
    low: np.ndarray, high: np.ndarray, asked: argparse.Namespace, rng: np.random.Generator
) -> list[CameraAim]:
    """Return where somebody stands and looks who walks around a box (3,), (3,) [m]."""
    middle, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    away = radius / (FILLED * np.tan(np.radians(FIELD / 2)))
    count, rounds = asked.pictures, asked.rounds
    steps = np.arange(count) + (0 if asked.video else PACE) * rng.normal(size=count)
    turn = 2 * np.pi * len(rounds) * steps / count
    if asked.wall:  # it is behind the thing: there and back, before it
        turn = np.pi + np.abs((turn + np.pi) % (2 * np.pi) - np.pi)
    slant = np.array(rounds)[np.minimum(np.arange(count) * len(rounds) // count, len(rounds) - 1)]
    shaken = [_unsteady(count, asked.video, rng) for _ in range(5)]
    slant = np.radians(slant + HEIGHT * shaken[0])
    far = away * (1 + REACH * shaken[1])
    flat = np.cos(slant)
    where = np.stack([flat * np.cos(turn), flat * np.sin(turn), np.sin(slant)], axis=1)
    eyes = middle + far[:, None] * where
    at = middle + AIM * away * np.stack(shaken[2:], axis=1)
    return [
        CameraAim(tuple(eye.tolist()), tuple(target.tolist()), _field(asked, k), *asked.size)
        for k, (eye, target) in enumerate(zip(eyes, at, strict=True))
    ]


def _field(asked: argparse.Namespace, k: int) -> float:
    """Return the vertical field of view of a picture [deg]."""
    half = np.tan(np.radians(FIELD / 2)) / (asked.zoomed if k % 2 else 1)
    return float(2 * np.degrees(np.arctan(half)))


def _unsteady(count: int, smooth: bool, rng: np.random.Generator) -> np.ndarray:
    """Return how far off hands are for each picture: from one frame to the next not by much."""
    if not smooth:
        return rng.normal(size=count)
    knots = rng.normal(size=max(count // 12, 2) + 1)
    return np.interp(np.linspace(0, len(knots) - 1, count), np.arange(len(knots)), knots)


def sides_of(views: Views) -> np.ndarray:
    """Return the extent (3,) of all that is seen of things [m]."""
    assert views.depth is not None and views.object_of_pixel is not None
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for k, camera in enumerate(views.cameras):
        v, u = np.nonzero((views.object_of_pixel[k] >= 0) & np.isfinite(views.depth[k]))
        K, pose = camera.K, camera.world_from_camera
        x, y = (u + 0.5 - K[0, 2]) / K[0, 0], (v + 0.5 - K[1, 2]) / K[1, 1]
        there = views.depth[k][v, u][:, None] * np.stack([x, y, np.ones(len(x))], axis=1)
        there = there @ pose[:3, :3].T + pose[:3, 3]
        low, high = np.minimum(low, there.min(axis=0)), np.maximum(high, there.max(axis=0))
    return high - low


def write_set(out: Path, views: Views, sides: np.ndarray, note: str, video: bool, zoomed: bool) -> None:
    """Write what ``real_photographs.py`` reads.

    Args:
        out: The set.
        views: Photographs.
        sides: Of what is seen, and of all that is there (2, 3) [m].
        note: How it was made.
        video: Whether photographs are frames of a video, which is written, too.
        zoomed: Whether photographs state their lenses.

    """
    assert views.object_of_pixel is not None
    names = tuple(f"{'frame' if video else 'img'}_{k:05d}" for k in range(len(views.cameras)))
    for name in ("images", "masks"):
        (out / name).mkdir(parents=True, exist_ok=True)
    for name, rgb, owner, camera in zip(names, views.rgb, views.object_of_pixel, views.cameras, strict=True):
        exif = _lens(camera) if zoomed else Image.Exif()
        photograph = Image.fromarray(rgb)
        photograph.save(out / "images" / f"{name}.jpg", quality=QUALITY, subsampling=0, exif=exif)
        Image.fromarray(np.uint8(255) * (owner >= 0)).save(out / "masks" / f"{name}.png")
    write_colmap(out / "sparse" / "0", views.cameras, tuple(f"{name}.jpg" for name in names))
    seen, there = (", ".join(f"{side:.4f}" for side in three) for three in sides)
    facts = f"unit = 1.0\nup = [0.0, 0.0, 1.0]\nsides = [{seen}]\nall_sides = [{there}]\n"
    (out / "known.toml").write_text(f"{facts}note = {json.dumps(note)}\n", encoding="utf-8")
    if video:
        _write_video(out / "video.mp4", views.rgb)


def _lens(camera: Camera) -> Image.Exif:
    """Return what a telephone writes of its lens: the focal length over that of 35 mm film."""
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA405] = round(36 * camera.K[0, 0] / max(camera.width, camera.height))
    return exif


def _write_video(path: Path, frames: np.ndarray) -> None:
    size = frames.shape[2], frames.shape[1]
    writer = imageio_ffmpeg.write_frames(str(path), size, fps=RATE, quality=8, macro_block_size=2)
    writer.send(None)
    for frame in frames:
        writer.send(np.ascontiguousarray(frame))
    writer.close()


def main() -> None:
    """Walk around, take pictures, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model", type=Path, nargs="+")
    parser.add_argument("out", type=Path)
    parser.add_argument("--pictures", type=int, default=30)
    parser.add_argument("--rounds", type=float, nargs="+", default=[20.0, 45.0])
    parser.add_argument("--size", type=int, nargs=2, default=[640, 480])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--zoomed", type=float, default=1.0)
    add_switches(parser)
    for name in ("plain", "video"):
        parser.add_argument(f"--{name}", action="store_true")
    asked = parser.parse_args()
    if asked.pictures < 3:
        parser.error("--pictures: 3 are the fewest that anything can be learned from.")
    rng = np.random.default_rng(asked.seed)
    try:
        scene = assemble(asked.model)
    except UserError as problem:
        parser.error(str(problem))
    boxes = object_boxes(scene)
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    aims = way_around(low, high, asked, rng)
    views = render_views(scene, aims)
    look = look_of(asked, plain=asked.plain, grid=FINE if asked.on else 1)
    options = [word for word in sys.argv[1:] if word not in map(str, (*asked.model, asked.out))]
    note = f"{', '.join(p.name for p in asked.model)}, {' '.join(options)}"
    sides, zoomed = np.stack([sides_of(views), high - low]), asked.zoomed != 1
    write_set(asked.out, degraded(views, look), sides, note, asked.video, zoomed)


if __name__ == "__main__":
    main()

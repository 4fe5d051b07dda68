"""Film: the textured scene itself moves, carried by its particles, and a camera watches.

The camera stands where it sees the whole motion; light and camera do not move; the dice of the
ray caster are fixed per pixel, so that nothing flickers.
"""

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from PIL import Image

from corporeal.errors import UserError
from corporeal.render import video
from corporeal.render.camera import Aim, place
from corporeal.render.embree import Stage, render
from corporeal.render.skin import Skin, bind
from corporeal.store import writing
from corporeal.types import (
    Film,
    Law,
    MaterialField,
    Particles,
    Parts,
    Scene,
    Trajectory,
    Vector,
)

FILM = "film.mp4"
THUMBNAIL = "thumbnail.png"
LOOKS = 60
"""Frames that the camera's place is chosen by, at most."""
STRAYS = 0.4
"""Percent of an object's particles, at either end, that need not be in the picture."""
FAR = 2.5
"""Sizes of the scene beyond which the camera lets things go."""

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class FilmConfig:
    """How the film is taken."""

    width: int = 640
    """[px]"""
    height: int = 480
    """[px]"""
    quality: Literal["draft", "normal", "fine"] = "draft"
    """How many rays: about 1, 2 and 6 CPU seconds a picture of 640 × 480."""
    speed: float = 1.0
    """1: as fast as in life; 0.25: four times slower."""
    view: Vector | None = None
    """From where to look, as a direction; None: where things hide each other least."""
    stills: bool = False
    """Keep every picture as PNG too."""


DEFAULT = FilmConfig()


def film(  # noqa: PLR0913
    scene: Scene,
    parts: Parts,
    particles: Particles,
    field: MaterialField,
    trajectory: Trajectory,
    config: FilmConfig,
    folder: Path,
    progress: Progress = lambda fraction, words: None,
) -> Film:
    """Write ``film.mp4`` and ``thumbnail.png``: the scene's own surfaces following the particles.

    Args:
        scene: What is to be seen.
        parts: Which part each triangle belongs to.
        particles: What the surfaces are bound to, at the start.
        field: Says which parts are granular; their surfaces follow positions more than stretch.
        trajectory: Where the particles go.
        config: Size, quality, view.
        folder: Where the film goes.
        progress: Told the fraction done and what is going on.

    Raises:
        UserError: There is nothing to show, the disk is full, or the encoder fails.

    """
    count = len(trajectory.frames)
    if count == 0:
        raise UserError(f"{trajectory.folder} holds no frames. Run corporeal simulate again.")
    progress(0.0, "placing the camera")
    skin = bind(scene, parts, particles, granular(field))
    camera = watch(skin, scene, particles, trajectory, config)
    fps = max(round(scene.fps * config.speed), 1)
    size = config.width, config.height
    credit = "; ".join(dict.fromkeys(o.credit for o in scene.objects if o.credit))
    with video.reel(folder / FILM, fps, size, credit) as reel:
        for number, stage in enumerate(_stages(Stage(scene), skin, trajectory)):
            picture = render(stage, camera, config.quality)
            reel.add(picture)
            _keep(picture, number, count, config, folder)
            progress((number + 1) / count, f"frame {number + 1} of {count}")
    return Film(folder / FILM, fps, *size)


def granular(field: MaterialField) -> np.ndarray:
    """Which parts are made of grains."""
    return np.array([m.law is Law.DRUCKER_PRAGER for m in field.materials], dtype=bool)


def watch(
    skin: Skin, scene: Scene, particles: Particles, trajectory: Trajectory, config: FilmConfig
) -> Aim:
    """Place one camera for the whole motion."""
    count = len(trajectory.frames)
    numbers = np.unique(np.linspace(0, count - 1, min(count, LOOKS)).round().astype(int))
    boxes = [_surface_boxes(skin, scene)]
    boxes += [
        _boxes(trajectory.frames[int(k)].position, particles.object, len(scene.objects))
        for k in numbers
    ]
    return place(_near(np.array(boxes)), (config.width, config.height), config.view)


def _boxes(points: np.ndarray, owner: np.ndarray, objects: int) -> np.ndarray:
    """Corners (B, 2, 3) of all but a few stray points of each object [m]."""
    out = np.full((objects, 2, 3), np.nan)
    for k in range(objects):
        mine = points[owner == k]
        mine = mine[np.isfinite(mine).all(axis=1)]
        if len(mine):
            out[k] = np.percentile(mine, (STRAYS, 100 - STRAYS), axis=0)
    return out


def _surface_boxes(skin: Skin, scene: Scene) -> np.ndarray:
    out = np.full((len(scene.objects), 2, 3), np.nan)
    owner = np.repeat([s.object for s in scene.surfaces], [len(s.vertices) for s in scene.surfaces])
    for k in range(len(scene.objects)):
        mine = skin.rest[owner == k]
        if len(mine):
            out[k] = mine.min(axis=0), mine.max(axis=0)
    return out


def _near(boxes: np.ndarray) -> np.ndarray:
    """Forget boxes that went far away, and what is below the floor."""
    first = boxes[0]
    if not np.isfinite(first).any():
        return np.nan_to_num(boxes)
    low, high = np.nanmin(first[:, 0], axis=0), np.nanmax(first[:, 1], axis=0)
    reach = FAR * max(float(np.linalg.norm(high - low)), 1e-9)
    middle = (boxes[:, :, 0] + boxes[:, :, 1]) / 2
    away = np.linalg.norm(middle - (low + high) / 2, axis=-1) > reach
    boxes = np.where(away[:, :, None, None], np.nan, boxes)
    boxes[..., 2] = np.maximum(boxes[..., 2], 0.0)
    return boxes


def _stages(stage: Stage, skin: Skin, trajectory: Trajectory) -> Iterator[Stage]:
    """Every frame's surfaces in order; the next one is made ready while one is drawn."""

    def ready(number: int) -> Stage:
        return stage.posed(*skin.pose(trajectory.frames[number]))

    count = len(trajectory.frames)
    with ThreadPoolExecutor(1) as ahead:
        coming = ahead.submit(ready, 0)
        for number in range(count):
            current = coming.result()
            if number + 1 < count:
                coming = ahead.submit(ready, number + 1)
            yield current


def _keep(picture: np.ndarray, number: int, count: int, config: FilmConfig, folder: Path) -> None:
    """Save the thumbnail (two thirds through, when things have met) and the stills asked for."""
    names = [f"stills/{number:05d}.png"] if config.stills else []
    names += [THUMBNAIL] if number == (2 * (count - 1)) // 3 else []
    for name in names:
        path = folder / name
        with writing(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            partial = path.with_name(f".{path.stem}.{os.getpid()}.part.png")
            try:
                Image.fromarray(picture).save(partial)
                partial.replace(path)
            finally:
                partial.unlink(missing_ok=True)

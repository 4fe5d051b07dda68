"""Film: the scene itself moves, carried by its particles, and a camera watches.

What is seen are textured surfaces, or the Gaussians that were learned from pictures: those move and
stretch with the matter (F Σ F^T), stand before the usual floor, and the surfaces that were made of
them are only seen by their shadows on it.

The camera stands where it sees the whole motion; light and camera do not move; the dice of the
ray caster are fixed per pixel, so that nothing flickers.
"""

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float, Int
from PIL import Image

from corporeal.errors import UserError, check_range
from corporeal.geometry.harmonics import DC
from corporeal.render import colours, key, video
from corporeal.render.camera import Aim, camera_of, place
from corporeal.render.embree import Stage, render
from corporeal.render.figures import PAPER, Names, Numbers, Quantity, panels, shades, si
from corporeal.render.look import linear
from corporeal.render.skin import Skin, bind, bind_points
from corporeal.splats import raster
from corporeal.splats.deform import deformed
from corporeal.store import writing
from corporeal.types import (
    Film,
    Frame,
    Gaussians,
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
NEAR = 0.1
"""Gaussians nearer than this share of the way to the scene are haze, and not drawn."""
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
    look: Literal["surfaces", "gaussians"] | None = None
    """What is drawn; None: Gaussians where the scene was made of them."""
    colour_by: Literal["itself", "speed"] | Quantity = "itself"
    """What the colours of things tell, with a key in the corner."""


DEFAULT = FilmConfig()
SLOWEST, FASTEST = 0.01, 100.0


def accept(config: FilmConfig) -> None:
    """Raise UserError where a setting cannot be right, whatever the scene."""
    video.check_size(config.width, config.height)
    check_range("--speed", config.speed, SLOWEST, FASTEST)
    if config.view is not None and not 0 < float(np.linalg.norm(config.view)) < np.inf:
        told = " ".join(f"{x:g}" for x in config.view)
        raise UserError(f"--view is {told}, which is no direction. Give one, for example 1 -1 0.5.")


def film(  # noqa: PLR0913
    scene: Scene,
    parts: Parts,
    particles: Particles,
    field: MaterialField,
    trajectory: Trajectory,
    config: FilmConfig,
    folder: Path,
    progress: Progress = lambda fraction, words: None,
    gaussians: Gaussians | None = None,
    object_of_gaussian: Int[np.ndarray, " N"] | None = None,
) -> Film:
    """Write ``film.mp4`` and ``thumbnail.png``: what the scene looks like follows the particles.

    Args:
        scene: What is to be seen.
        parts: Which part each triangle belongs to.
        particles: What the surfaces are bound to, at the start.
        field: Says which parts are granular; their surfaces follow positions more than stretch.
        trajectory: Where the particles go.
        config: Size, quality, view.
        folder: Where the film goes.
        progress: Told the fraction done and what is going on.
        gaussians: What the scene was made of, where it was made of Gaussians.
        object_of_gaussian: Which object each belongs to; -1: floor or background, standing still.

    Raises:
        UserError: There is nothing to show, Gaussians are asked for and there are none, the disk
            is full, or the encoder fails.

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
    puppet = _puppet(config, gaussians, object_of_gaussian, particles, granular(field))
    paint = _paint(config.colour_by, scene, parts, particles, field, trajectory)
    troupe = _Troupe(Stage(scene), skin, puppet, paint)
    with video.reel(folder / FILM, fps, size, credit) as reel:
        for number, scenery in enumerate(_sceneries(troupe, trajectory)):
            picture = scenery.picture(camera, config.quality)
            picture = picture if paint is None else paint.keyed(picture)
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


@dataclass(frozen=True)
class _Scenery:
    """What is to be seen at one instant."""

    stage: Stage
    gaussians: Gaussians | None

    def picture(self, camera: Aim, quality: Literal["draft", "normal", "fine"]) -> np.ndarray:
        behind = render(self.stage, camera, quality)
        if self.gaussians is None:
            return behind
        near = NEAR * float(np.linalg.norm(np.subtract(camera.eye, camera.target)))
        front = raster.render(self.gaussians, camera_of(camera), near=near)
        through = (1 - front.alpha[..., None]) * behind
        return np.clip(255 * front.rgb + through + 0.5, 0, 255).astype(np.uint8)


@dataclass(frozen=True)
class _Puppet:
    """Gaussians that follow particles; those of no object stand still."""

    gaussians: Gaussians
    moving: Int[np.ndarray, " M"]
    skin: Skin
    """Of those that move."""

    def at(self, frame: Frame, colour: np.ndarray | None) -> Gaussians:
        """Return all Gaussians at one instant; colour: of every particle, (P, 3) sRGB."""
        g, names = self.gaussians, ("mean", "rotation", "scale", "opacity", "sh")
        place, F = self.skin.carried(frame)
        moved = deformed(replace(g, **{n: getattr(g, n)[self.moving] for n in names}), F, place)
        if colour is not None:
            moved = replace(moved, sh=_flat(moved.sh, colour[self.skin.near[:, 0]]))
        arrays = {n: getattr(g, n).copy() for n in names}
        for name, values in arrays.items():
            values[self.moving] = getattr(moved, name)
        return replace(g, **arrays)


def _flat(sh: np.ndarray, colour: np.ndarray) -> np.ndarray:
    """Return coefficients of colours that are the same from all sides."""
    out = np.zeros_like(sh)
    out[:, 0] = (colour - 0.5) / DC
    return out


def _puppet(
    config: FilmConfig,
    gaussians: Gaussians | None,
    owner: np.ndarray | None,
    particles: Particles,
    loose: np.ndarray,
) -> _Puppet | None:
    if config.look == "surfaces" or (config.look is None and gaussians is None):
        return None
    if gaussians is None or owner is None:
        raise UserError(
            "This scene was made of surfaces and has no Gaussians to be filmed. "
            "Film it with look 'surfaces', or run it from photographs or a splat."
        )
    moving = np.flatnonzero(owner >= 0)
    skin = bind_points(gaussians.mean[moving], owner[moving], particles, loose)
    return _Puppet(gaussians, moving, skin)


@dataclass(frozen=True)
class _Paint:
    """Colours that tell something of every particle."""

    panel: Names | Numbers
    of_particle: Float[np.ndarray, "P 3"] | None
    """sRGB; None where they change with time."""
    trajectory: Trajectory
    fastest: float = 1.0
    """[m/s]"""

    def at(self, number: int) -> np.ndarray:
        """Colours (P, 3) of all particles in one frame."""
        if self.of_particle is not None:
            return self.of_particle
        share = np.clip(speeds(self.trajectory, number) / self.fastest, 0, 1)
        return colours.ramp(share)

    def keyed(self, picture: np.ndarray) -> np.ndarray:
        """Say in the picture what the colours mean."""
        p = self.panel
        if isinstance(p, Names):
            return key.names(picture, p.title, list(zip(p.label, p.colour, strict=True)))
        return key.scale(picture, p.title, *(si(f(p.value), p.unit) for f in (min, max)))


def _paint(
    colour_by: Literal["itself", "speed"] | Quantity,
    scene: Scene,
    parts: Parts,
    particles: Particles,
    field: MaterialField,
    trajectory: Trajectory,
) -> _Paint | None:
    if colour_by == "itself":
        return None
    if colour_by == "speed":
        count = len(trajectory.frames)
        some = np.unique(np.linspace(0, count - 1, min(count, LOOKS)).round().astype(int))
        top = max(float(np.percentile(speeds(trajectory, int(k)), 99.5)) for k in some)
        return _Paint(Numbers("Speed", "m/s", [0.0, top]), None, trajectory, max(top, 1e-9))
    panel = panels(scene, parts, field)[colour_by]
    return _Paint(panel, shades(panel)[particles.part], trajectory)


def speeds(trajectory: Trajectory, number: int) -> Float[np.ndarray, " P"]:
    """How fast every particle goes on its way to the next frame, or to the last one [m/s]."""
    last = len(trajectory.frames) - 1
    if last == 0:
        return np.zeros(len(trajectory.frames[0].position))
    a = trajectory.frames[min(number, last - 1)]
    b = trajectory.frames[min(number, last - 1) + 1]
    way = np.linalg.norm(b.position.astype(float) - a.position, axis=1)
    return np.nan_to_num(way / (b.time - a.time))


@dataclass(frozen=True)
class _Troupe:
    """All that moves, in the pose it starts from."""

    stage: Stage
    skin: Skin
    puppet: _Puppet | None
    paint: _Paint | None

    def at(self, number: int, frame: Frame) -> _Scenery:
        stage = self.stage.posed(*self.skin.pose(frame))
        colour = None if self.paint is None else self.paint.at(number)
        if self.puppet is not None:
            return _Scenery(stage.shadows(), self.puppet.at(frame, colour))
        if colour is not None:
            nearest = self.skin.near[self.stage.look.triangles[:, 0], 0]
            stage = stage.painted(linear(colour[nearest]), PAPER)
        return _Scenery(stage, None)


def _sceneries(troupe: _Troupe, trajectory: Trajectory) -> Iterator[_Scenery]:
    """Every frame's scenery in order; the next one is made ready while one is drawn."""

    def ready(number: int) -> _Scenery:
        return troupe.at(number, trajectory.frames[number])

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

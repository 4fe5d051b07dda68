"""Reconstruct: from posed photographs, or a trained splat, to objects with closed surfaces.

What comes out is a scene of objects like any other, which ``assemble`` reads as a GLB; and the
Gaussians themselves, for the film and for telling parts apart.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Int
from scipy.spatial import KDTree

from corporeal.errors import UserError, check_range
from corporeal.features import Reader, connect
from corporeal.features.clouds import Placed, looked_at, projected
from corporeal.features.descriptor import LET_THROUGH, seen_from
from corporeal.features.lifting import Lifted, known, uplift
from corporeal.features.vectors import similarity as likeness
from corporeal.features.vectors import unit
from corporeal.formats.sources import called
from corporeal.formats.words import safe
from corporeal.geometry.extent import oriented_size
from corporeal.geometry.gaussians import LARGEST
from corporeal.geometry.harmonics import DC
from corporeal.geometry.local_shape import neighbours, normals
from corporeal.geometry.metric import MetricScale, TwoPoints, measured
from corporeal.geometry.similarity import moved_gaussians, moved_points, similarity
from corporeal.regions.masks import lifted
from corporeal.regions.match import match
from corporeal.regions.telling import Rule, told_apart
from corporeal.render.camera import cameras_around
from corporeal.render.look import linear
from corporeal.render.portrait import COLOURS, colour_of_part
from corporeal.splats import lesson
from corporeal.splats.channel import distilled
from corporeal.splats.closed import Closed, closed
from corporeal.splats.crew import Crew
from corporeal.splats.field_points import field_points
from corporeal.splats.foreground import Shown, foreground, shown
from corporeal.splats.intake import Intake, Up, take_in, turned_upright
from corporeal.splats.lesson import TrainConfig
from corporeal.splats.radiance import FieldConfig
from corporeal.splats.raster import weights
from corporeal.splats.sight import looked
from corporeal.splats.solid import Solid
from corporeal.types import Cloud, Finish, Reconstruction, Scene, SceneObject, Surface
from corporeal.vlm.things import (
    PERSON,
    UNKNOWN,
    Thing,
    Viewer,
    check_extents,
    metres,
    names_of,
    usual,
)

Progress = Callable[[float, str], None]

MOST_POINTS = 100_000
"""Points that are looked at; other Gaussians do as their neighbours."""
CELL = 8
"""Pixels along a cell of blending weights: maps of features are no finer."""
ROUGHNESS = 0.8
"""Of surfaces: pictures do not tell it apart from light."""
OWN_VIEWS, OWN_SIZE = 48, (384, 384)
"""Of a splat that comes without cameras."""
AROUND = 16
"""Points that a normal is found from."""
GREY = (0.2, 0.2, 0.2)
"""Linear RGB of what is nobody's, in painted pictures."""
NOBODY = Viewer("", "metadata")
TRAINED, LOOKED, FOUND = 0.75, 0.85, 0.9
"""Share of the work that is done after each step."""


@dataclass(frozen=True)
class ReconstructConfig:
    """How pictures, or a splat, become objects. Says nothing where the input is a model."""

    things: tuple[str, ...] = ()
    """What the objects are, the largest first, such as "armchair" "soda can"."""
    count: int | None = None
    """How many objects there are; by default as many as --things names, else it is estimated."""
    apart: Rule = "auto"
    """What tells objects apart; auto: instance masks where there are any, else look and folds."""
    up: Up = "auto"
    """Which axis of the file points up; auto: what the file or the cameras say."""
    floor_at: float | None = None
    """Height of the floor along up, in the file's unit; by default a plane is looked for, and where
    there is none things are put onto the floor."""
    metres_per_unit: float | None = None
    """What one unit of the file is [m]; by default sizes of things say it."""
    known_distance: TwoPoints | None = None
    """Two points of the file, x y z x y z, and their true distance [m]."""
    training: Literal["draft", "normal"] = "normal"
    """How long Gaussians are learned from photographs: one minute or four on two cores."""
    rasteriser: Literal["numba", "gsplat"] = "numba"
    """Where pictures are drawn while learning: on the processor, or on a card with CUDA."""
    semantic: str = "descriptor"
    """What tells what a point is: "clip", "clip:FOLDER", or "descriptor", which needs no model."""
    structural: str = "descriptor"
    """What tells which part a point is of: "dinov2", "dinov2:FOLDER", or "descriptor"."""
    lifting: Literal["uplift", "back-projection", "radiance"] = "uplift"
    """How what pictures look like comes onto points: onto Gaussians, by the weights that they are
    drawn with, or by where they fall; or onto points of a radiance field that is learned, too."""
    training_seed: int = 0
    """Of everything that is left to chance."""


DEFAULT = ReconstructConfig()


@dataclass(frozen=True)
class _Found:
    """Objects before anybody knows what they are, in order of size."""

    taken: Intake
    cloud: Cloud
    closed: Closed

    @property
    def solids(self) -> tuple[Solid, ...]:
        return self.closed.solids

    @property
    def count(self) -> int:
        return len(self.solids)

    @cached_property
    def extents(self) -> list[float]:
        """Longest side of each one's box, in the file's unit, whichever way the thing is turned."""
        return [oriented_size(solid.vertices)[2] for solid in self.solids]


def reconstruct(
    source: Path,
    config: ReconstructConfig = DEFAULT,
    extents: Sequence[str] = (),
    viewer: Viewer = NOBODY,
    folder: Path | None = None,
    progress: Progress = lambda fraction, words: None,
) -> tuple[Reconstruction, Scene]:
    """Find the objects of a scene in photographs, or in a splat.

    Args:
        source: A folder of photographs with poses, or a splat.
        config: How.
        extents: Real largest extents, such as "duck=0.1" [m].
        viewer: Who is asked what the pictures show, where ``config.things`` does not say it.
        folder: Where an interrupted training, and maps of learned features, are kept.
        progress: Told the fraction done and what is being done.

    Returns:
        What was found, and the scene: every object with one closed, coloured surface.

    Raises:
        UserError: The input cannot be used, holds nothing that could be an object, or an option
            does not fit it.

    """
    accept(config, extents, asked=viewer.model is not None)
    training = TrainConfig(config.training, seed=config.training_seed, rasteriser=config.rasteriser)
    kept = None if folder is None else folder / "training.npz"
    learning = _within(progress, 0.0, TRAINED)
    taken = take_in(source, training, kept, learning, config.apart == "masks")
    taken = turned_upright(taken, config.up, config.floor_at)
    if not taken.cameras:
        taken = replace(taken, cameras=cameras_around(taken.solid, OWN_VIEWS, OWN_SIZE))
    progress(TRAINED, "telling things from the background")
    seen, of_things = _of_things(source, taken)
    placed = _placed(taken, seen, of_things, config, folder, _within(progress, TRAINED, LOOKED))
    specs, maps = (config.semantic, config.structural), None if folder is None else folder / "maps"
    cloud = looked_at(placed, taken.pictures, specs, maps)
    progress(LOOKED, "finding objects")
    wanted = _wanted(config, viewer, taken)
    normal = normals(cloud.position, neighbours(cloud.position, AROUND), placed.outside)
    count, drawn = config.count or len(wanted) or None, _drawn(taken, cloud, of_things)
    split = told_apart(cloud, config.apart, count, normal, drawn)
    progress(FOUND, "closing surfaces")
    found = _Found(taken, cloud, closed(taken, of_things, cloud.position, split.object_of_point))
    things = _recognised(wanted, found, config, viewer)
    names = names_of(things)
    sizes = dict(zip(names, found.extents, strict=True))
    scale = metres(sizes, things, extents, _measured(config), taken.z_up)
    warnings = [*taken.warnings, *split.warnings, *viewer.asked().warnings, *scale.warnings]
    warnings += [f"{n}: {w}" for n, s in zip(names, found.solids, strict=True) for w in s.warnings]
    said = (*taken.statements, *placed.statements, split.statement, scale.reason)
    result = _in_metres(found, names, scale, said, tuple(dict.fromkeys(warnings)))
    return result, _scene(source, found, names, things, scale)


def _within(progress: Progress, begin: float, end: float) -> Progress:
    """Tell of a part of the work as of the whole."""
    return lambda fraction, words: progress(begin + (end - begin) * fraction, words)


def accept(config: ReconstructConfig, extents: Sequence[str] = (), asked: bool = False) -> None:
    """Raise UserError where a setting cannot be right, whatever the pictures.

    asked: whether somebody will be asked what there is.
    """
    check_range("--count", config.count, 1, 1000)
    check_range("--training-seed", config.training_seed, 0, 2**63)
    check_range("--floor-at", config.floor_at, -LARGEST, LARGEST)
    if config.count and config.things and config.count != len(config.things):
        raise UserError(
            f"--count says {config.count} objects, --things names {len(config.things)}. Leave "
            "--count out, or name all of them."
        )
    if config.things or not asked:
        check_extents(extents, [usual(name) for name in config.things])
    for spec in (config.semantic, config.structural):
        connect(spec)  # who is to look must be there before anything is learned
    lesson.accept(config.rasteriser)
    _measured(config)


def _measured(config: ReconstructConfig) -> MetricScale | None:
    return measured(config.metres_per_unit, config.known_distance, PERSON)


# ---------------------------------------------------------------- what is a thing


def _of_things(source: Path, taken: Intake) -> tuple[Shown, Int[np.ndarray, " M"]]:
    """Return what shows of all Gaussians, and which of them belong to things."""
    seen = shown(taken.gaussians, taken.cameras, taken.masks)
    found = np.flatnonzero(foreground(taken.gaussians, taken.cameras, seen, taken.floor))
    if not len(found):
        what = "shows nothing but floor and background"
        raise UserError(f"{source} {what}. Masks would say what belongs to things.")
    return seen, found


def _placed(
    taken: Intake,
    seen: Shown,
    things: Int[np.ndarray, " M"],
    config: ReconstructConfig,
    folder: Path | None,
    progress: Progress,
) -> Placed:
    """Return points on things, and how what their pictures look like comes onto them."""
    if config.lifting == "radiance":
        return _of_field(taken, things, config, folder, progress)
    gaussians, cameras = taken.gaussians, taken.cameras
    if len(things) > MOST_POINTS:
        random = np.random.default_rng(config.training_seed)
        things = np.sort(random.choice(things, MOST_POINTS, replace=False))
    position = gaussians.mean[things].astype(np.float64)
    colour = np.clip(0.5 + DC * gaussians.sh[things, 0], 0, 1)
    if config.lifting == "back-projection":
        with Crew() as crew:
            depth = looked(gaussians, cameras, crew).depth
        return projected(position, colour, cameras, depth, things)
    outside = seen_from(position, cameras, list(seen.share[:, things]), LET_THROUGH)
    shares = cache(lambda v: weights(gaussians, cameras[v], CELL)[things])
    cells = -(-cameras[0].height // CELL), -(-cameras[0].width // CELL)

    def lift(maps: Sequence[np.ndarray]) -> Lifted:
        return uplift(shares, cells, maps, len(things), seen.least)

    return Placed(position, colour, outside, seen.views[things], lift, things)


def _of_field(
    taken: Intake,
    things: Int[np.ndarray, " M"],
    config: ReconstructConfig,
    folder: Path | None,
    progress: Progress,
) -> Placed:
    """Learn a radiance field of the things, and take points from where it is dense."""
    how = FieldConfig(config.training, seed=config.training_seed)
    kept = None if folder is None else folder / "radiance.npz"
    learned, found = field_points(taken, things, MOST_POINTS, how, kept, progress)
    placed = projected(found.position, found.colour, taken.cameras, found.depth)

    def lift(maps: Sequence[np.ndarray]) -> Lifted:
        return known(distilled(learned.field, taken.cameras, maps).at(found.position))

    return replace(placed, lift=lift, statements=learned.statements)


def _drawn(
    taken: Intake, cloud: Cloud, of_things: Int[np.ndarray, " M"]
) -> Int[np.ndarray, "V N"] | None:
    """Return what instance masks take each point for in each view; None: there are none."""
    if taken.views is None or taken.views.object_of_pixel is None:
        return None
    near = of_things[KDTree(taken.gaussians.mean[of_things]).query(cloud.position)[1]]
    pixels = list(taken.views.object_of_pixel)
    return lifted(lambda v: weights(taken.gaussians, taken.cameras[v])[near], pixels, cloud.count)


# ---------------------------------------------------------------- which thing is it


def _wanted(config: ReconstructConfig, viewer: Viewer, taken: Intake) -> list[Thing]:
    """Return what things there are: as the command line says, else as somebody sees; or nothing."""
    if config.things:
        return [usual(name) for name in config.things]
    return viewer.things([*taken.some().values()])


def _recognised(
    wanted: Sequence[Thing], found: _Found, config: ReconstructConfig, viewer: Viewer
) -> list[Thing]:
    """Return which thing each object is; the objects are in order of size.

    Who named things on the command line named the largest first. Others are told by CLIP where
    there is one, else by whoever sees the objects painted.
    """
    count = found.count
    if config.things or not wanted:
        said: Sequence[int | None] = range(len(wanted))
    elif config.semantic.startswith("clip"):
        said = _by_words(wanted, found, config.semantic)
    else:
        said = viewer.regions(_painted(found), colour_of_part(count), wanted) or []
    known = [None if k is None or k < 0 or k >= len(wanted) else wanted[k] for k in said]
    return [thing or Thing(UNKNOWN) for thing in [*known, *[None] * count][:count]]


def _by_words(wanted: Sequence[Thing], found: _Found, spec: str) -> list[int]:
    """Pair objects and things so that what CLIP sees fits best what they are called."""
    encoder = connect(spec)
    assert isinstance(encoder, Reader)
    of, seen = found.closed.object_of_point, found.cloud.semantic
    looks = np.stack([seen[of == k].mean(axis=0, dtype=np.float64) for k in range(found.count)])
    words = encoder.words([thing.class_name for thing in wanted])
    return match(likeness(unit(looks), words)).tolist()


def _painted(found: _Found) -> list[np.ndarray]:
    """Return pictures, each followed by itself with the objects in colours of their own."""
    paints = np.array([*COLOURS.values()])
    ink = np.concatenate([paints[np.minimum(np.arange(found.count), len(paints) - 1)], [GREY]])
    return found.taken.painted(np.sqrt(ink[found.closed.owner]))


# ---------------------------------------------------------------- what comes out


def _in_metres(
    found: _Found,
    names: Sequence[str],
    scale: MetricScale,
    statements: tuple[str, ...],
    warnings: tuple[str, ...],
) -> Reconstruction:
    made = similarity(scale=scale.metres_per_unit)
    boxes = [[s.vertices.min(axis=0), s.vertices.max(axis=0)] for s in found.solids]
    return Reconstruction(
        gaussians=moved_gaussians(found.taken.gaussians, made),
        object_of_gaussian=found.closed.owner,
        cloud=replace(found.cloud, position=moved_points(found.cloud.position, made)),
        object_of_point=found.closed.object_of_point,
        names=tuple(names),
        boxes=scale.metres_per_unit * np.array(boxes),
        metres_per_unit=scale.metres_per_unit,
        world_from_file=made @ found.taken.world_from_file,
        statements=statements,
        warnings=warnings,
    )


def _scene(
    source: Path,
    found: _Found,
    names: Sequence[str],
    named: Sequence[Thing],
    scale: MetricScale,
) -> Scene:
    """Make one object of each solid, coloured as its Gaussians are."""
    factor = scale.metres_per_unit
    things, surfaces = [], []
    for k, (name, thing, solid) in enumerate(zip(names, named, found.solids, strict=True)):
        extent, by = factor * found.extents[k], scale.reason
        things.append(SceneObject(name, thing.class_name, extent, source=str(source), sized_by=by))
        colours, vertices = linear(solid.colours), factor * solid.vertices
        surfaces.append(Surface(name, k, 0, vertices, solid.triangles, colours=colours))
    return Scene(
        name=safe(called(source)) or "scene",
        source=str(source),
        objects=tuple(things),
        surfaces=tuple(surfaces),
        finishes=(Finish("as seen", roughness=ROUGHNESS),),
    )

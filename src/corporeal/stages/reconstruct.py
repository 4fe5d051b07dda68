"""Reconstruct: from posed photographs, or a trained splat, to objects with closed surfaces.

What comes out is a scene of objects like any other, which ``assemble`` reads as a GLB; and the
Gaussians themselves, for the film and for telling parts apart.
"""

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

from corporeal.errors import BadFileError, UserError, check_range
from corporeal.features import Reader, connect
from corporeal.features.clouds import Placed, projected, with_features
from corporeal.features.descriptor import LET_THROUGH, seen_from
from corporeal.features.learned_masks import learned_masks
from corporeal.features.lifting import Lifted, known, uplift
from corporeal.features.maskers import MENU as MASKERS
from corporeal.features.maskers import connect_masker, split
from corporeal.features.vectors import similarity as likeness
from corporeal.features.vectors import unit
from corporeal.formats.photographs import MASKS, has_masks, listed
from corporeal.formats.sources import called, kind_of, unposed
from corporeal.formats.words import safe
from corporeal.geometry.extent import oriented_size
from corporeal.geometry.gaussians import LARGEST, AskedUp
from corporeal.geometry.harmonics import DC
from corporeal.geometry.local_shape import neighbours, normals
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.metric import MetricScale, TwoPoints, measured
from corporeal.geometry.similarity import moved_gaussians, moved_points, similarity
from corporeal.geometry.srgb import linear
from corporeal.masking.grown_masks import grown_masks
from corporeal.poses.pose import POSES, Posed, moved_within, pose, pose_object
from corporeal.regions.instance_assignment import Rule, assign_instances
from corporeal.regions.masks import lifted
from corporeal.regions.match import match
from corporeal.render.camera import cameras_around
from corporeal.render.portrait import COLOURS, colour_of_part
from corporeal.splats import training_schedule
from corporeal.splats.closed import Closed, closed
from corporeal.splats.depth_rendering import render_depth
from corporeal.splats.feature_distillation import distilled
from corporeal.splats.field_points import field_points
from corporeal.splats.foreground import Shown, foreground, shown
from corporeal.splats.intake import Intake, take_in, turned_upright
from corporeal.splats.radiance import FieldConfig
from corporeal.splats.raster import weights
from corporeal.splats.solid import Solid
from corporeal.splats.thread_pool import ThreadPool
from corporeal.splats.training_schedule import TrainConfig
from corporeal.splats.worth import not_worth, unlike_masks
from corporeal.types import Camera, Cloud, Finish, Reconstruction, Scene, SceneObject, Surface
from corporeal.vlm.seen_objects import (
    PERSON,
    UNKNOWN,
    SeenObject,
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
POSED = 0.5
"""Share of learning from pictures that is done when poses that nobody gave are found."""
MASKED = 0.1
"""The same, of finding masks."""
WHOLE = 0.7
"""Share of finding poses that is done when whole pictures fit together."""
SEEN, OBJECT_POSES = "poses-seen", "poses-object"
"""Folders of masks that found poses are tested by, and of poses that are found from them."""
STAND_STILL = (
    "Photograph it while neither it nor what is around it moves, give masks (a folder 'masks' with "
    "the names of the pictures), or go on all the same with --force."
)
AUTO, NONE = "auto", "none"
CORRECT = (
    "They lie in 0-reconstruct/masks of the run: what is corrected there is taken by the next run."
)
TRAINED, LOOKED, FOUND = 0.75, 0.85, 0.9
"""Share of the work that is done after each step."""


@dataclass(frozen=True)
class ReconstructConfig:
    """Reconstruction from photographs or a splat; of a model only ``up`` is used."""

    things: tuple[str, ...] = ()
    """Names of the objects, the largest first, such as "armchair" "soda can"."""
    count: int | None = None
    """Number of objects; by default as many as --things names, else it is estimated."""
    apart: Rule = "auto"
    """What objects are segmented by; auto: instance masks where there are any, else appearance
    features and concavity (look)."""
    masks: str = "auto"
    """Masks of the objects: a folder of them; "sam3:FOLDER", "sam2:FOLDER" or "birefnet:FOLDER"
    with weights of such a model; auto: those beside the photographs, else grown from what all
    cameras look at; none: objects are what stands on the floor."""
    up: AskedUp = "auto"
    """Axis of the file that points up, also of a mesh; auto: from the file or the cameras."""
    floor_at: float | None = None
    """Height of the floor along the up axis, in the file's unit; by default a plane is fitted, or,
    where there is none, the floor is put below the lowest object."""
    metres_per_unit: float | None = None
    """Length of one unit of the file [m]; by default it follows from the sizes of the objects."""
    known_distance: TwoPoints | None = None
    """Two points of the file, x y z x y z, and their true distance [m]."""
    training: Literal["preview", "draft", "normal"] = "normal"
    """Length of training on photographs: seconds, about one minute, or four, on two cores."""
    rasteriser: Literal["numba", "gsplat"] = "numba"
    """Rasteriser for training: numba on the processor, or gsplat on a CUDA card."""
    semantic: str = "descriptor"
    """Features that classes of points are found by: "clip", "clip:FOLDER", or "descriptor", which
    needs no weights."""
    structural: str = "descriptor"
    """Features that parts are segmented by: "dinov2", "dinov2:FOLDER", or "descriptor"."""
    lifting: Literal["uplift", "back-projection", "radiance"] = "uplift"
    """How image features are lifted to points: to Gaussians by their blending weights (uplift) or
    by back-projection, or to points of a radiance field, which is then trained as well."""
    force: bool = False
    """Continue where objects are as large as the room, or photographs are reproduced badly."""
    training_seed: int = 0
    """Seed of all random numbers."""


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
    def boxes(self) -> Float[np.ndarray, "K 2 3"]:
        """Low and high corner of each one's surface, in the file's unit."""
        corners = [solid.vertices for solid in self.solids]
        return np.array([[v.min(axis=0), v.max(axis=0)] for v in corners])

    @cached_property
    def extents(self) -> list[float]:
        """Longest side of each one's oriented bounding box, in the file's unit."""
        return [oriented_size(solid.vertices)[2] for solid in self.solids]


@dataclass(frozen=True)
class Reconstructed:
    """What was found in pictures or in a splat."""

    found: Reconstruction
    """Gaussians, and points with features."""
    scene: Scene
    """Every object with one closed, coloured surface."""


def reconstruct(
    source: Path,
    config: ReconstructConfig = DEFAULT,
    extents: Sequence[str] = (),
    viewer: Viewer = NOBODY,
    folder: Path | None = None,
    progress: Progress = lambda fraction, words: None,
) -> Reconstructed:
    """Find the objects of a scene in photographs, or in a splat.

    Args:
        source: A folder of photographs, a film, or a splat.
        config: How.
        extents: Real largest extents, such as "duck=0.1" [m].
        viewer: Who is asked what the pictures show, where ``config.things`` does not say it.
        folder: Where an interrupted training, and maps of learned features, are kept.
        progress: Told the fraction done and what is being done.

    Raises:
        UserError: The input cannot be used, holds nothing that could be an object, or an option
            does not fit it.

    """
    validate(config, extents, asked=viewer.model is not None)
    # Gaussians: trained on photographs or read, upright, with cameras to look from.
    taken, masked = _taken(source, config, folder, _within(progress, 0.0, TRAINED))
    taken = turned_upright(taken, config.up, config.floor_at)
    photographers = taken.cameras
    if not taken.cameras:
        taken = replace(taken, cameras=cameras_around(taken.solid, OWN_VIEWS, OWN_SIZE))
    # Points of the foreground, with features of what the pictures show.
    progress(TRAINED, "segmenting foreground from background")
    front = _foreground(source, taken)
    placed = _placed(
        taken, front.shown, front.on_objects, config, folder, _within(progress, TRAINED, LOOKED)
    )
    specs, maps = (config.semantic, config.structural), None if folder is None else folder / "maps"
    cloud = with_features(placed, taken.pictures, specs, maps)
    # Objects among them.
    progress(LOOKED, "finding objects")
    wanted = _wanted(config, viewer, taken)
    normal = normals(cloud.position, neighbours(cloud.position, AROUND), placed.outside)
    count, drawn = config.count or len(wanted) or None, _drawn(taken, cloud, front.on_objects)
    split = assign_instances(cloud, config.apart, count, normal, drawn)
    # One closed surface for each object.
    progress(FOUND, "closing surfaces")
    found = _Found(
        taken, cloud, closed(taken, front.on_objects, cloud.position, split.object_of_point)
    )
    if not config.force and (why := _why_not(found, photographers, masked)):
        raise UserError(f"{source}: {why}")
    # What they are, and so their names and their size in metres.
    objects = _recognised(wanted, found, config, viewer)
    names = names_of(objects)
    sizes = dict(zip(names, found.extents, strict=True))
    scale = metres(sizes, objects, extents, _measured(config), taken.z_up)
    warnings = [*taken.warnings, *split.warnings, *viewer.asked().warnings, *scale.warnings]
    warnings += [f"{n}: {w}" for n, s in zip(names, found.solids, strict=True) for w in s.warnings]
    statements = (*taken.statements, *placed.statements, split.statement, scale.reason)
    result = _in_metres(found, names, scale, statements, tuple(dict.fromkeys(warnings)))
    return Reconstructed(result, _scene(source, found, names, objects, scale))


def _why_not(found: _Found, photographers: Sequence[Camera], masked: bool) -> str | None:
    """Say why what was found is not worth simulating, if it is not."""
    taken = found.taken
    why = not_worth(found.boxes, photographers, masked, taken.quality)
    if why is not None or taken.masks is None or not photographers:
        return why
    meshes = [Mesh(solid.vertices, solid.triangles) for solid in found.solids]
    return unlike_masks(meshes, photographers, taken.masks)


def _taken(
    source: Path, config: ReconstructConfig, folder: Path | None, progress: Progress
) -> tuple[Intake, bool]:
    """Read a splat, or learn Gaussians from pictures, whose poses are found if nobody gave any.

    Returns:
        What there is, and whether somebody said which pixels are objects.

    """
    training = TrainConfig(config.training, seed=config.training_seed, rasteriser=config.rasteriser)
    kept = None if folder is None else folder / "training.npz"
    instances = config.apart == "masks"
    if kind_of([source]) == "splat":
        return take_in(source, training, kept, progress, instances), False
    posed = _posed(source, config, folder, progress)
    begun = 0.0 if posed is None else POSED
    posed = posed or Posed(source, (), ())
    found = _masks(config, posed.folder, folder, _within(progress, begun, begun + MASKED))
    later = _within(progress, begun + MASKED, 1.0)
    taken = take_in(posed.folder, training, kept, later, instances, found.folder)
    made = replace(
        taken,
        statements=(*posed.statements, *found.statements, *taken.statements),
        warnings=(*posed.warnings, *found.warnings, *taken.warnings),
    )
    return made, taken.masks is not None and not found.grown


@dataclass(frozen=True)
class _Masks:
    """Where masks are, if they are not beside the photographs."""

    folder: Path | None = None
    statements: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    grown: bool = False
    """Whether nobody, and no model, said what an object is."""


def _masks(
    config: ReconstructConfig, source: Path, folder: Path | None, progress: Progress
) -> _Masks:
    """Take masks from a folder, find them with a model, or grow them where there are none."""
    if config.masks not in (AUTO, NONE) and split(config.masks) is None:
        return _Masks(Path(config.masks))
    shots = listed(source).shots
    if config.masks == NONE or (config.masks == AUTO and has_masks(shots)):
        return _Masks()
    place = folder or Path(tempfile.mkdtemp(prefix="corporeal-"))
    if config.masks != AUTO:
        masker = connect_masker(config.masks)
        learned = learned_masks(source, place, masker, config.things, progress)
        return _Masks(learned.folder, (*learned.said, CORRECT))
    grown = grown_masks(source, place, progress=progress)
    if grown.folder is None:
        return _Masks(warnings=grown.said)
    return _Masks(
        grown.folder, (), (" ".join(("There were no masks.", *grown.said, CORRECT)),), True
    )


def _posed(
    source: Path, config: ReconstructConfig, folder: Path | None, progress: Progress
) -> Posed | None:
    """Find where pictures were taken from; None: that is known, or there are none.

    Raises:
        BadFileError: It cannot be found, or is right about what is around the object alone.

    """
    if not unposed(source):
        return None
    place = Path(tempfile.mkdtemp(prefix="corporeal-")) if folder is None else folder
    posed = pose(source, place / POSES, _within(progress, 0.0, POSED * WHOLE))
    if config.masks != AUTO or has_masks(listed(posed.folder).shots):
        return posed
    later = _within(progress, POSED * WHOLE, POSED)
    grown = grown_masks(posed.folder, place / SEEN, progress=later)
    if grown.folder is None:
        return posed
    masks = grown.folder / MASKS[0]
    if (why := moved_within(posed, masks)) is None:
        return posed
    again = pose_object(posed, masks, place / OBJECT_POSES, later)
    said = f"{why[0].upper()}{why[1:]}"
    if again is not None:
        how = f"{said}. Where each was taken from was found from points on the object alone."
        return replace(again, warnings=(how, *again.warnings))
    if not config.force:
        raise BadFileError(source, f"{why}, and it has too few points of its own.", STAND_STILL)
    return replace(posed, warnings=(f"{said}.", *posed.warnings))


def _within(progress: Progress, begin: float, end: float) -> Progress:
    """Tell of a part of the work as of the whole."""
    return lambda fraction, words: progress(begin + (end - begin) * fraction, words)


def validate(config: ReconstructConfig, extents: Sequence[str] = (), asked: bool = False) -> None:
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
    training_schedule.validate(config.rasteriser)
    _check_masks(config)
    _measured(config)


def _check_masks(config: ReconstructConfig) -> None:
    if config.masks in (AUTO, NONE):
        return
    if split(config.masks) is None:
        if not Path(config.masks).expanduser().is_dir():
            raise UserError(
                f"There is no folder {config.masks} for --masks. Name a folder of masks, or "
                f"{', '.join(f'{kind}:FOLDER' for kind in MASKERS)}."
            )
    elif connect_masker(config.masks).needs_words and not config.things:
        raise UserError("These masks are found by words: name the objects with --things.")


def _measured(config: ReconstructConfig) -> MetricScale | None:
    return measured(config.metres_per_unit, config.known_distance, PERSON)


# ---------------------------------------------------------------- what is an object


@dataclass(frozen=True)
class _Foreground:
    """What shows of the Gaussians, and which of them are no floor and no background."""

    shown: Shown
    on_objects: Int[np.ndarray, " M"]
    """Numbers of Gaussians."""


def _foreground(source: Path, taken: Intake) -> _Foreground:
    """Tell objects from floor and background.

    Raises:
        UserError: Nothing stands out.

    """
    seen = shown(taken.gaussians, taken.cameras, taken.masks)
    found = np.flatnonzero(foreground(taken.gaussians, taken.cameras, seen, taken.floor))
    if not len(found):
        what = "shows nothing but floor and background"
        raise UserError(f"{source} {what}. Give masks of the objects.")
    return _Foreground(seen, found)


def _placed(
    taken: Intake,
    seen: Shown,
    on_objects: Int[np.ndarray, " M"],
    config: ReconstructConfig,
    folder: Path | None,
    progress: Progress,
) -> Placed:
    """Return points on objects, and how what their pictures look like comes onto them."""
    if config.lifting == "radiance":
        return _of_field(taken, on_objects, config, folder, progress)
    gaussians, cameras = taken.gaussians, taken.cameras
    if len(on_objects) > MOST_POINTS:
        random = np.random.default_rng(config.training_seed)
        on_objects = np.sort(random.choice(on_objects, MOST_POINTS, replace=False))
    position = gaussians.mean[on_objects].astype(np.float64)
    colour = np.clip(0.5 + DC * gaussians.sh[on_objects, 0], 0, 1)
    if config.lifting == "back-projection":
        with ThreadPool() as pool:
            depth = render_depth(gaussians, cameras, pool).depth
        return projected(position, colour, cameras, depth, on_objects)
    outside = seen_from(position, cameras, list(seen.share[:, on_objects]), LET_THROUGH)
    shares = cache(lambda v: weights(gaussians, cameras[v], CELL)[on_objects])
    cells = -(-cameras[0].height // CELL), -(-cameras[0].width // CELL)

    def lift(maps: Sequence[np.ndarray]) -> Lifted:
        return uplift(shares, cells, maps, len(on_objects), seen.least)

    return Placed(position, colour, outside, seen.views[on_objects], lift, on_objects)


def _of_field(
    taken: Intake,
    on_objects: Int[np.ndarray, " M"],
    config: ReconstructConfig,
    folder: Path | None,
    progress: Progress,
) -> Placed:
    """Learn a radiance field of the objects, and take points from where it is dense."""
    how = FieldConfig(config.training, seed=config.training_seed)
    kept = None if folder is None else folder / "radiance.npz"
    learned, found = field_points(taken, on_objects, MOST_POINTS, how, kept, progress)
    placed = projected(found.position, found.colour, taken.cameras, found.depth)

    def lift(maps: Sequence[np.ndarray]) -> Lifted:
        return known(distilled(learned.field, taken.cameras, maps).at(found.position))

    return replace(placed, lift=lift, statements=learned.statements)


def _drawn(
    taken: Intake, cloud: Cloud, on_objects: Int[np.ndarray, " M"]
) -> Int[np.ndarray, "V N"] | None:
    """Return what instance masks take each point for in each view; None: there are none."""
    if taken.views is None or taken.views.object_of_pixel is None:
        return None
    near = on_objects[KDTree(taken.gaussians.mean[on_objects]).query(cloud.position)[1]]
    pixels = list(taken.views.object_of_pixel)
    return lifted(lambda v: weights(taken.gaussians, taken.cameras[v])[near], pixels, cloud.count)


# ---------------------------------------------------------------- which object is it


def _wanted(config: ReconstructConfig, viewer: Viewer, taken: Intake) -> list[SeenObject]:
    """Return what objects there are, from the command line or a model; or nothing."""
    if config.things:
        return [usual(name) for name in config.things]
    return viewer.objects([*taken.some().values()])


def _recognised(
    wanted: Sequence[SeenObject], found: _Found, config: ReconstructConfig, viewer: Viewer
) -> list[SeenObject]:
    """Return what each segmented object is; these are in order of size.

    Who named objects on the command line named the largest first. Others are told by CLIP where
    there is one, else by whoever sees the objects painted.
    """
    count = found.count
    if config.things or not wanted:
        number: Sequence[int | None] = range(len(wanted))
    elif config.semantic.startswith("clip"):
        number = _by_words(wanted, found, config.semantic)
    else:
        number = viewer.regions(_painted(found), colour_of_part(count), wanted) or []
    known = [None if k is None or k < 0 or k >= len(wanted) else wanted[k] for k in number]
    return [obj or SeenObject(UNKNOWN) for obj in [*known, *[None] * count][:count]]


def _by_words(wanted: Sequence[SeenObject], found: _Found, spec: str) -> list[int]:
    """Pair segmented objects with names by CLIP similarity."""
    encoder = connect(spec)
    assert isinstance(encoder, Reader)
    of, seen = found.closed.object_of_point, found.cloud.semantic
    looks = np.stack([seen[of == k].mean(axis=0, dtype=np.float64) for k in range(found.count)])
    words = encoder.words([obj.class_name for obj in wanted])
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
    named: Sequence[SeenObject],
    scale: MetricScale,
) -> Scene:
    """Make one object of each solid, coloured as its Gaussians are."""
    factor = scale.metres_per_unit
    objects, surfaces = [], []
    for k, (name, obj, solid) in enumerate(zip(names, named, found.solids, strict=True)):
        extent, by = factor * found.extents[k], scale.reason
        objects.append(SceneObject(name, obj.class_name, extent, source=str(source), sized_by=by))
        colours, vertices = linear(solid.colours), factor * solid.vertices
        surfaces.append(Surface(name, k, 0, vertices, solid.triangles, colours=colours))
    return Scene(
        name=safe(called(source)) or "scene",
        source=str(source),
        objects=tuple(objects),
        surfaces=tuple(surfaces),
        finishes=(Finish("as seen", roughness=ROUGHNESS),),
    )

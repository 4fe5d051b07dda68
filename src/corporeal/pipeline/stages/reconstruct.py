"""Reconstruct: from posed photographs, or a trained splat, to objects with closed surfaces.

What comes out is a scene of objects like any other, which ``assemble`` reads as a GLB; and the
Gaussians themselves, for the film and for telling parts apart.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Int

from corporeal.core.errors import UserError, with_notes
from corporeal.core.progress import Progress, within
from corporeal.core.types import (
    Camera,
    Finish,
    Gaussians,
    Note,
    NoteKind,
    Reconstruction,
    Scene,
    SceneObject,
    Surface,
    reworded,
)
from corporeal.geometry.gaussians import only
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.srgb import linear
from corporeal.io.sources import called
from corporeal.multiview.local_shape import neighbours, normals
from corporeal.multiview.metric import MetricScale
from corporeal.multiview.similarity import moved_gaussians, moved_points, similarity
from corporeal.recognition.words import everyday, safe
from corporeal.reconstruction.features.clouds import with_features
from corporeal.reconstruction.found_objects import FoundObjects, named_objects, recognised
from corporeal.reconstruction.gaussians.closed import apart, closed
from corporeal.reconstruction.gaussians.depth_rendering import render_depth
from corporeal.reconstruction.gaussians.discs import backed
from corporeal.reconstruction.gaussians.foreground import sunk
from corporeal.reconstruction.gaussians.intake import Intake, turned_upright
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.gaussians.worth import (
    falls_apart,
    goes_beyond,
    not_worth,
    told_otherwise,
    unlike_masks,
)
from corporeal.reconstruction.masks.grown_masks import lying_in
from corporeal.reconstruction.masks_figure import FIGURE, drawn_over
from corporeal.reconstruction.object_points import drawn_masks, foreground_of, points_on_objects
from corporeal.reconstruction.picture_intake import take_pictures
from corporeal.reconstruction.reconstruct_config import (
    DEFAULT,
    ReconstructConfig,
    metric_scale,
    validate,
)
from corporeal.reconstruction.segment.instance_assignment import assign_instances
from corporeal.reconstruction.segment.space import Space
from corporeal.render.camera import cameras_around
from corporeal.vlm.seen_objects import (
    UNKNOWN,
    SeenObject,
    Viewer,
    metres,
    names_of,
    of_name,
    said_by_class,
    said_by_name,
    telling,
)

ROUGHNESS = 0.8
"""Of surfaces: pictures do not tell it apart from light."""
OWN_VIEWS, OWN_SIZE = 48, (384, 384)
"""Of a splat that comes without cameras."""
AROUND = 16
"""Points that a normal is found from."""
BY_PLACE = "What belongs to it was told by where it is alone, without masks."
NOBODY = Viewer("", "metadata")
DISCS = (
    "were laid along the closed surface, below what was learned: they show where that is thin, "
    "and what no photograph shows."
)
"""Said of the film, and of gaussians.ply."""
TRAINED, LOOKED, FOUND = 0.6, 0.66, 0.7
"""Share of the work that is done after each step. Surfaces took 27 to 38 % of it at preset normal
(docs/inputs.md)."""


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
    validate(config, extents, viewer.model is not None, called(source))
    # Gaussians: trained on photographs or read, upright, with cameras to look from.
    taken, masked = take_pictures(source, config, folder, within(progress, 0.0, TRAINED))
    grown = taken.masks is not None and not masked  # of what all cameras look at: one thing
    taken = _upright(source, taken, config, folder)
    photographers = taken.cameras
    if not taken.cameras:
        taken = replace(taken, cameras=cameras_around(taken.solid, OWN_VIEWS, OWN_SIZE))
    # Points of the foreground, with features of what the pictures show.
    progress(TRAINED, "segmenting foreground from background")
    front = foreground_of(source, taken)
    placed = points_on_objects(
        taken, front.shown, front.on_objects, config, folder, within(progress, TRAINED, LOOKED)
    )
    specs, maps = (config.semantic, config.structural), None if folder is None else folder / "maps"
    cloud = with_features(placed, taken.pictures, specs, maps)
    # Objects among them.
    progress(LOOKED, "finding objects")
    wanted = named_objects(config, viewer, taken)
    normal = normals(cloud.position, neighbours(cloud.position, AROUND), placed.outside)
    count, drawn = config.count or len(wanted) or None, drawn_masks(taken, cloud, front.on_objects)
    space = Space(apart(taken, front.on_objects, cloud.position), alone=grown)
    split = assign_instances(cloud, config.apart, count, normal, drawn, space)
    # One closed surface for each object.
    progress(FOUND, "closing surfaces")
    found = FoundObjects(
        taken, cloud, closed(taken, front.on_objects, cloud.position, split.object_of_point)
    )
    if not config.force and (why := _why_not(found, photographers, masked, count)):
        raise _refusal(source, why, lying_in(None if masked else folder), taken)
    # What they are, and so their names and their size in metres.
    known = _known(source, found, recognised(wanted, found, config, viewer), config, extents)
    warnings = [*known.warnings, *viewer.asked().warnings, *taken.warnings, *split.warnings]
    shown = _shown(found, photographers)
    said = (*placed.statements, split.statement, *shown.statements, *known.statements)
    statements = (*taken.statements, *said)
    result = _in_metres(found, shown, known, statements, tuple(dict.fromkeys(warnings)))
    return Reconstructed(result, _scene(source, found, known))


@dataclass(frozen=True)
class _Known:
    """What objects are, and how large."""

    objects: Sequence[SeenObject]
    names: Sequence[str]
    scale: MetricScale
    warnings: Sequence[str]
    """What to read first: what a person can state, then what is wrong with surfaces."""
    doubts: tuple[str, ...]
    """The latter."""

    @property
    def statements(self) -> list[str]:
        """Say how large they are, where no warning does."""
        return [self.scale.reason] * (self.scale.source != "nobody")


def _known(
    source: Path,
    found: FoundObjects,
    objects: Sequence[SeenObject],
    config: ReconstructConfig,
    extents: Sequence[str],
) -> _Known:
    """Name objects, and decide how large they are; a lone one may be called as its folder.

    Args:
        source: The folder of photographs, the film or the splat.
        found: Objects, in order of size.
        objects: What each is, as far as anybody said.
        config: What was asked for.
        extents: Real largest extents, such as "duck=0.1" [m].

    """
    measured, z_up, title = metric_scale(config), found.taken.z_up, called(source)
    unnamed = [obj.class_name for obj in objects] == [UNKNOWN]
    by_name = of_name(title) if unnamed else None
    if by_name is not None:
        if extents or measured is not None or z_up:
            by_name = replace(by_name, extent=None)  # somebody knows better
        objects = [by_name]
    names = names_of(objects)
    sizes = dict(zip(names, found.extents, strict=True))
    scale = metres(sizes, objects, extents, measured, z_up)
    told = [] if by_name is None else [said_by_name(title, by_name, names[0])]
    if scale.source == "extent" and not extents and by_name is None:
        told = [said_by_class(objects, names)]
    pairs = zip(names, found.solids, strict=True)
    unsound = [reworded(w, f"{name}: {w}") for name, solid in pairs for w in solid.warnings]
    doubts = [*found.taken.doubts, *unsound]
    return _Known(objects, names, scale, [*scale.warnings, *told, *doubts], tuple(doubts))


def _upright(source: Path, taken: Intake, config: ReconstructConfig, folder: Path | None) -> Intake:
    """Turn what was learned upright, and tell objects in photographs that have no masks.

    Args:
        source: Named in errors.
        taken: What was learned.
        config: How.
        folder: Where masks lie that are not believed, and a figure of others is drawn.

    Raises:
        UserError: These are the room.

    """
    made = turned_upright(taken, config.up, config.floor_at)
    cut_out = None if taken.masks is not None else made.masks
    if cut_out is not None and not config.force:
        why = goes_beyond(cut_out) or told_otherwise(cut_out, made.coloured)
        if why is not None:
            raise _refusal(source, why, lying_in(folder), taken)
    if cut_out is not None and made.views is not None and folder is not None:
        numbers = [f"photograph {k + 1}" for k in range(len(cut_out))]
        drawn_over(list(made.views.rgb), cut_out, numbers, folder / FIGURE)
    if cut_out is not None and made.coloured is not None:
        told = Note(f"{BY_PLACE} {lying_in(folder)}".rstrip(), NoteKind.GRAVE)
        made = replace(made, doubts=(*made.doubts, told))
    return made


def _refusal(source: Path, why: str, lie: str, taken: Intake) -> UserError:
    """Make an error of why things are not worth simulating, with what was noticed before."""
    noticed = dict.fromkeys((*taken.doubts, *taken.warnings))
    return with_notes(UserError(f"{source}: {why} {lie}".rstrip()), noticed)


def _why_not(
    found: FoundObjects, photographers: Sequence[Camera], masked: bool, count: int | None
) -> str | None:
    """Say why what was found is not worth simulating, if it is not.

    Args:
        found: Objects.
        photographers: Cameras that took the photographs; (): nobody knows.
        masked: Whether somebody said which pixels are objects.
        count: How many objects somebody said there are; None: nobody did.

    """
    taken = found.taken
    why = not_worth(found.boxes, photographers, masked, taken.quality)
    if why is not None or taken.masks is None or not photographers:
        return why
    meshes = [Mesh(solid.vertices, solid.triangles) for solid in found.solids]
    pieces = [solid.pieces for solid in found.solids]
    most = sum(pieces) if count is None else max(pieces)
    apart = None if masked else falls_apart(most, photographers)
    return apart or unlike_masks(meshes, photographers, taken.masks, given=masked)


@dataclass(frozen=True)
class _Shown:
    """What films show of objects and of what is about them."""

    gaussians: Gaussians
    owner: Int[np.ndarray, " N"]
    statements: tuple[str, ...] = ()


def _shown(found: FoundObjects, photographers: tuple[Camera, ...]) -> _Shown:
    """Leave out what is below the floor, and fill what photographs leave thin.

    A splat stays as it came.
    """
    own, owner = found.taken.gaussians, found.closed.owner
    kept = ~sunk(own, owner, float(max(found.extents)))
    if not photographers:
        return _Shown(only(own, kept), owner[kept])
    with ThreadPool() as pool:
        rendering = render_depth(only(own, owner >= 0), photographers, pool)
    gaussians, whose = backed(only(own, kept), owner[kept], found.solids, rendering)
    said = f"{gaussians.count - np.count_nonzero(kept):,} discs {DISCS}"
    return _Shown(gaussians, whose, (said,))


def _in_metres(
    found: FoundObjects,
    shown: _Shown,
    known: _Known,
    statements: tuple[str, ...],
    warnings: tuple[str, ...],
) -> Reconstruction:
    scale = known.scale
    made = similarity(scale=scale.metres_per_unit)
    boxes = [[s.vertices.min(axis=0), s.vertices.max(axis=0)] for s in found.solids]
    return Reconstruction(
        gaussians=moved_gaussians(shown.gaussians, made),
        object_of_gaussian=shown.owner,
        cloud=replace(found.cloud, position=moved_points(found.cloud.position, made)),
        object_of_point=found.closed.object_of_point,
        names=tuple(known.names),
        boxes=scale.metres_per_unit * np.array(boxes),
        metres_per_unit=scale.metres_per_unit,
        world_from_file=made @ found.taken.world_from_file,
        statements=statements,
        warnings=warnings,
        doubts=known.doubts,
    )


def _scene(source: Path, found: FoundObjects, known: _Known) -> Scene:
    """Make one object of each solid, coloured as its Gaussians are."""
    factor, by = known.scale.metres_per_unit, known.scale.reason
    said = telling(called(source))
    # A folder called "photos" makes nothing one of paper.
    own = str(source) if said == everyday(called(source)) else said or UNKNOWN
    objects, surfaces = [], []
    things = zip(known.names, known.objects, found.solids, strict=True)
    for k, (name, obj, solid) in enumerate(things):
        extent = factor * found.extents[k]
        objects.append(SceneObject(name, obj.class_name, extent, source=own, sized_by=by))
        colours, vertices = linear(solid.colours), factor * solid.vertices
        surfaces.append(Surface(name, k, 0, vertices, solid.triangles, colours=colours))
    return Scene(
        name=safe(called(source)) or "scene",
        source=str(source),
        objects=tuple(objects),
        surfaces=tuple(surfaces),
        finishes=(Finish("as seen", roughness=ROUGHNESS),),
    )

"""Reconstruct: from posed photographs, or a trained splat, to objects with closed surfaces.

The result is a GLB, which ``assemble`` reads, and the Gaussians, for the video and for part segmentation.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Int

from corporeal.core.errors import UserError, with_notes
from corporeal.core.progress import Progress, no_progress, subprogress
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
    with_text,
)
from corporeal.geometry.gaussian_transforms import gaussian_subset
from corporeal.geometry.mesh import Mesh
from corporeal.geometry.srgb import srgb_to_linear
from corporeal.io.input_files import scene_name
from corporeal.multiview.metric_scale import MetricScale
from corporeal.multiview.point_cloud_geometry import nearest_neighbours, point_normals
from corporeal.multiview.similarity_transform import (
    apply_similarity_to_gaussians,
    apply_similarity_to_points,
    similarity_matrix,
)
from corporeal.recognition.readable_names import everyday_words, safe_name
from corporeal.reconstruction.features.point_features import add_point_features
from corporeal.reconstruction.found_objects import FoundObjects, named_objects, recognise_objects
from corporeal.reconstruction.gaussian_source import gaussians_from_source
from corporeal.reconstruction.gaussians.depth_rendering import render_depth
from corporeal.reconstruction.gaussians.foreground import gaussians_below_floor
from corporeal.reconstruction.gaussians.gaussian_scene import GaussianScene, turn_upright
from corporeal.reconstruction.gaussians.thread_pool import ThreadPool
from corporeal.reconstruction.masks.grown_masks import describe_masks_in
from corporeal.reconstruction.masks_figure import MASKS_FIGURE_FILE, draw_masks_over
from corporeal.reconstruction.object_points import foreground_of, labels_from_masks, points_on_objects
from corporeal.reconstruction.reconstruct_config import (
    DEFAULT_RECONSTRUCT,
    ReconstructConfig,
    metric_scale,
    validate_reconstruct,
)
from corporeal.reconstruction.segment.instance_assignment import assign_instances
from corporeal.reconstruction.segment.object_segmentation import SpacePieces
from corporeal.reconstruction.surface.backing_surfels import add_backing_surfels
from corporeal.reconstruction.surface.object_surfaces import build_object_surfaces, pieces_of_objects
from corporeal.reconstruction.surface.reconstruction_acceptance import (
    boxes_rejection_reason,
    colour_rejection_reason,
    cropping_rejection_reason,
    overlap_rejection_reason,
    pieces_rejection_reason,
)
from corporeal.render.camera_placement import cameras_around
from corporeal.vlm.photographed_objects import (
    UNKNOWN_CLASS,
    PhotoInterview,
    SeenObject,
    class_extent_note,
    decide_metric_scale,
    named_object_note,
    object_from_name,
    object_names,
    telling_words,
)

SURFACE_ROUGHNESS = 0.8
"""Roughness of surfaces: pictures do not separate it from light."""
NORMAL_NEIGHBOURS = 16
"""Points that a normal is found from."""
SPLIT_BY_PLACE_WARNING = "Without masks, its extent was decided by place alone."
NO_VIEWER = PhotoInterview("", "metadata")
BACKING_SURFELS_STATEMENT = (
    "were laid along the closed surface, below what was learned: they show where that is thin, "
    "and what no photograph shows."
)
"""Said of the video, and of gaussians.ply."""
PROGRESS_AFTER_TRAINING, PROGRESS_AFTER_VIEWS, PROGRESS_AFTER_OBJECTS = 0.6, 0.66, 0.7
"""Share of the work that is done after each step. Surfaces took 27 to 38 % of it at preset normal
(docs/reference/input-files.md)."""


@dataclass(frozen=True)
class ReconstructedScene:
    """A scene reconstructed from pictures or a splat."""

    found: Reconstruction
    """Gaussians, and points with features."""
    scene: Scene
    """Every object with one closed, coloured surface."""


def reconstruct(
    source: Path,
    config: ReconstructConfig = DEFAULT_RECONSTRUCT,
    extents: Sequence[str] = (),
    viewer: PhotoInterview = NO_VIEWER,
    folder: Path | None = None,
    progress: Progress = no_progress,
) -> ReconstructedScene:
    """Reconstruct the objects of a scene from photographs or a splat.

    Args:
        source: A folder of photographs, a video, or a splat.
        config: How.
        extents: Real largest extents, such as "duck=0.1" [m].
        viewer: Model that names the objects if ``config.object_names`` does not.
        folder: Folder of checkpoints and feature maps.
        progress: Called with the fraction done and a description.

    Raises:
        UserError: The input cannot be used, holds nothing that could be an object, or an option does not fit it.
    """
    validate_reconstruct(config, extents, viewer.model is not None, scene_name(source))
    # Gaussians: trained on photographs or read, upright, with cameras to look from.
    taken, masked = gaussians_from_source(source, config, folder, subprogress(progress, 0.0, PROGRESS_AFTER_TRAINING))
    grown = taken.masks is not None and not masked  # the cameras' common focus: one object
    taken = _align_upright(source, taken, config, folder)
    photographers = taken.cameras
    if not taken.cameras:
        taken = replace(
            taken,
            cameras=cameras_around(taken.solid, config.resolution.rendered_views, config.resolution.rendered_size_px),
        )
    # Points of the foreground, with features of what the pictures show.
    progress(PROGRESS_AFTER_TRAINING, "segmenting foreground from background")
    front = foreground_of(source, taken)
    placed = points_on_objects(
        taken,
        front.shown,
        front.on_objects,
        config,
        folder,
        subprogress(progress, PROGRESS_AFTER_TRAINING, PROGRESS_AFTER_VIEWS),
    )
    specs, maps = (config.semantic, config.structural), None if folder is None else folder / "maps"
    cloud = add_point_features(placed, taken.pictures, specs, maps)
    # Objects among them.
    progress(PROGRESS_AFTER_VIEWS, "finding objects")
    wanted = named_objects(config, viewer, taken)
    normal = point_normals(cloud.position, nearest_neighbours(cloud.position, NORMAL_NEIGHBOURS), placed.outside)
    count, drawn = (config.count or len(wanted) or None, labels_from_masks(taken, cloud, front.on_objects))
    space = SpacePieces(pieces_of_objects(taken, front.on_objects, cloud.position), alone=grown)
    split = assign_instances(cloud, config.apart, count, normal, drawn, space)
    # One closed surface for each object.
    progress(PROGRESS_AFTER_OBJECTS, "closing surfaces")
    closed = build_object_surfaces(
        taken, front.on_objects, cloud.position, split.object_of_point, config.resolution.surface
    )
    found = FoundObjects(taken, cloud, closed)
    if not config.force and (why := _reason_not_worth(found, photographers, masked, count)):
        raise _not_worth_error(source, why, describe_masks_in(None if masked else folder), taken)
    # What they are, and so their names and their size in metres.
    known = _name_objects(source, found, recognise_objects(wanted, found, config, viewer), config, extents)
    warnings = [*known.warnings, *viewer.asked().warnings, *taken.warnings, *split.warnings]
    shown = _video_gaussians(found, photographers)
    said = (*placed.statements, split.statement, *shown.statements, *known.statements)
    statements = (*taken.statements, *said)
    result = _metric_reconstruction(found, shown, known, statements, tuple(dict.fromkeys(warnings)))
    return ReconstructedScene(result, _scene(source, found, known))


@dataclass(frozen=True)
class _NamedObjects:
    """Names and sizes of objects."""

    objects: Sequence[SeenObject]
    names: Sequence[str]
    scale: MetricScale
    warnings: Sequence[str]
    """Warnings: what the user can state, then defects of surfaces."""
    doubts: tuple[str, ...]
    """The latter."""

    @property
    def statements(self) -> list[str]:
        """Return how large they are, where no warning does."""
        return [self.scale.reason] * (self.scale.source != "default")


def _name_objects(
    source: Path, found: FoundObjects, objects: Sequence[SeenObject], config: ReconstructConfig, extents: Sequence[str]
) -> _NamedObjects:
    """Name objects, and decide how large they are; a lone one may be called as its folder.

    Args:
        source: The folder of photographs, the video or the splat.
        found: Objects, in order of size.
        objects: What each is, if stated.
        config: What was asked for.
        extents: Real largest extents, such as "duck=0.1" [m].
    """
    measured, z_up, title = metric_scale(config), found.taken.z_up, scene_name(source)
    unnamed = [obj.class_name for obj in objects] == [UNKNOWN_CLASS]
    by_name = object_from_name(title) if unnamed else None
    if by_name is not None:
        if extents or measured is not None or z_up:
            by_name = replace(by_name, extent=None)  # stated by the user
        objects = [by_name]
    names = object_names(objects)
    sizes = dict(zip(names, found.extents, strict=True))
    scale = decide_metric_scale(sizes, objects, extents, measured, z_up)
    notes = [] if by_name is None else [named_object_note(title, by_name, names[0])]
    if scale.source == "extent" and not extents and by_name is None:
        notes = [class_extent_note(objects, names)]
    pairs = zip(names, found.solids, strict=True)
    unsound = [with_text(w, f"{name}: {w}") for name, solid in pairs for w in solid.warnings]
    doubts = [*found.taken.doubts, *unsound]
    return _NamedObjects(objects, names, scale, [*scale.warnings, *notes, *doubts], tuple(doubts))


def _align_upright(source: Path, taken: GaussianScene, config: ReconstructConfig, folder: Path | None) -> GaussianScene:
    """Align the reconstruction with gravity, and find objects in photographs without masks.

    Raises:
        UserError: The objects cannot be separated from the background.
    """
    made = turn_upright(taken, config.up, config.floor_at)
    cut_out = None if taken.masks is not None else made.masks
    if cut_out is not None and not config.force:
        why = cropping_rejection_reason(cut_out) or colour_rejection_reason(cut_out, made.coloured)
        if why is not None:
            raise _not_worth_error(source, why, describe_masks_in(folder), taken)
    if cut_out is not None and made.views is not None and folder is not None:
        numbers = [f"photograph {k + 1}" for k in range(len(cut_out))]
        draw_masks_over(list(made.views.rgb), cut_out, numbers, folder / MASKS_FIGURE_FILE)
    if cut_out is not None and made.coloured is not None:
        note = Note(f"{SPLIT_BY_PLACE_WARNING} {describe_masks_in(folder)}".rstrip(), NoteKind.GRAVE)
        made = replace(made, doubts=(*made.doubts, note))
    return made


def _not_worth_error(source: Path, why: str, lie: str, taken: GaussianScene) -> UserError:
    """Return the error for objects that are not worth simulating, with earlier warnings."""
    noticed = dict.fromkeys((*taken.doubts, *taken.warnings))
    return with_notes(UserError(f"{source}: {why} {lie}".rstrip()), noticed)


def _reason_not_worth(
    found: FoundObjects, photographers: Sequence[Camera], masked: bool, count: int | None
) -> str | None:
    """Return why what was found is not worth simulating, if it is not."""
    taken = found.taken
    why = boxes_rejection_reason(found.boxes, photographers, masked, taken.quality)
    if why is not None or taken.masks is None or not photographers:
        return why
    meshes = [Mesh(solid.vertices, solid.triangles) for solid in found.solids]
    pieces = [solid.pieces for solid in found.solids]
    most = sum(pieces) if count is None else max(pieces)
    apart = None if masked else pieces_rejection_reason(most, photographers)
    return apart or overlap_rejection_reason(meshes, photographers, taken.masks, given=masked)


@dataclass(frozen=True)
class _VideoGaussians:
    """Gaussians of objects and surroundings for the video."""

    gaussians: Gaussians
    owner: Int[np.ndarray, " N"]
    statements: tuple[str, ...] = ()


def _video_gaussians(found: FoundObjects, photographers: tuple[Camera, ...]) -> _VideoGaussians:
    """Remove Gaussians below the floor, and fill thin regions.

    A splat stays as it came.
    """
    own, owner = found.taken.gaussians, found.closed.owner
    kept = ~gaussians_below_floor(own, owner, float(max(found.extents)))
    if not photographers:
        return _VideoGaussians(gaussian_subset(own, kept), owner[kept])
    with ThreadPool() as pool:
        rendering = render_depth(gaussian_subset(own, owner >= 0), photographers, pool)
    gaussians, whose = add_backing_surfels(gaussian_subset(own, kept), owner[kept], found.solids, rendering)
    said = f"{gaussians.count - np.count_nonzero(kept):,} discs {BACKING_SURFELS_STATEMENT}"
    return _VideoGaussians(gaussians, whose, (said,))


def _metric_reconstruction(
    found: FoundObjects,
    shown: _VideoGaussians,
    known: _NamedObjects,
    statements: tuple[str, ...],
    warnings: tuple[str, ...],
) -> Reconstruction:
    scale = known.scale
    made = similarity_matrix(scale=scale.metres_per_unit)
    boxes = [[s.vertices.min(axis=0), s.vertices.max(axis=0)] for s in found.solids]
    return Reconstruction(
        gaussians=apply_similarity_to_gaussians(shown.gaussians, made),
        object_of_gaussian=shown.owner,
        cloud=replace(found.cloud, position=apply_similarity_to_points(found.cloud.position, made)),
        object_of_point=found.closed.object_of_point,
        names=tuple(known.names),
        boxes=scale.metres_per_unit * np.array(boxes),
        metres_per_unit=scale.metres_per_unit,
        world_from_file=made @ found.taken.world_from_file,
        statements=statements,
        warnings=warnings,
        doubts=known.doubts,
    )


def _scene(source: Path, found: FoundObjects, known: _NamedObjects) -> Scene:
    """Make one object of each solid, with the colours of its Gaussians."""
    factor, by = known.scale.metres_per_unit, known.scale.reason
    said = telling_words(scene_name(source))
    # A folder called "photos" must not suggest the material paper.
    own = str(source) if said == everyday_words(scene_name(source)) else said or UNKNOWN_CLASS
    objects, surfaces = [], []
    things = zip(known.names, known.objects, found.solids, strict=True)
    for k, (name, obj, solid) in enumerate(things):
        extent = factor * found.extents[k]
        objects.append(SceneObject(name, obj.class_name, extent, source=own, sized_by=by))
        colours, vertices = srgb_to_linear(solid.colours), factor * solid.vertices
        surfaces.append(Surface(name, k, 0, vertices, solid.triangles, colours=colours))
    return Scene(
        name=safe_name(scene_name(source)) or "scene",
        source=str(source),
        objects=tuple(objects),
        surfaces=tuple(surfaces),
        finishes=(Finish("as seen", roughness=SURFACE_ROUGHNESS),),
    )

"""Instance segmentation of objects that touch, in pictures of settled scenes with ground truth.

Points are either spread over the surface that pictures show, or the means of Gaussians that were learned from the
pictures. Three methods are compared: identity, which is the ground truth; superpoints cut by appearance features and
concavity, with and without the number of objects, and with instance masks; and the connected components of each point's
nearest neighbours, the rule of published pipelines.
"""

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from corporeal.core.errors import UserError
from corporeal.core.progress import Progress, no_progress
from corporeal.core.types import Camera, FeatureCloud, Gaussians, Scene, Views
from corporeal.geometry.gaussian_transforms import gaussian_subset
from corporeal.geometry.mesh import join_meshes
from corporeal.geometry.point_sampling import sample_surface
from corporeal.geometry.scene_transforms import move_scene
from corporeal.geometry.spherical_harmonics import SH_DC_COEFFICIENT
from corporeal.io.splat.load_splat import load_splat
from corporeal.io.splat.splat_ply import write_splat_ply
from corporeal.lab.evaluation.result_table import ResultTable
from corporeal.multiview.point_cloud_geometry import nearest_neighbours, point_normals
from corporeal.pipeline.stages.assemble import assemble
from corporeal.pipeline.stages.capture import CaptureConfig, capture
from corporeal.reconstruction.features.feature_lifting import back_projection, visible_points
from corporeal.reconstruction.features.point_descriptor import (
    MAX_SHOWING_THROUGH_FRACTION,
    mean_view_directions,
    point_descriptor,
)
from corporeal.reconstruction.gaussians.foreground import foreground_gaussians, gaussian_visibility
from corporeal.reconstruction.gaussians.rasteriser_numba import gaussian_weights
from corporeal.reconstruction.gaussians.train_gaussians import train_gaussians
from corporeal.reconstruction.gaussians.training_schedule import TrainConfig
from corporeal.reconstruction.segment.instance_assignment import assign_instances
from corporeal.reconstruction.segment.instance_masks import lift_labels
from corporeal.reconstruction.segment.object_segmentation import (
    ObjectSegmentation,
    SpacePieces,
    nearest_neighbour_components,
    segment_objects,
)
from corporeal.reconstruction.surface.free_space import pieces_by_free_space
from segmentation.segmentation_scores import matched_iou

TOUCHING_EXTENT_RATIO = 0.002
"""Objects touch that are nearer than this, as a share of the scene's extent."""
MAX_SURFACE_POINTS = 60_000
"""Points on the surface by which distances are measured, and Gaussians assigned to objects."""
APPROACH_STEPS = 100
"""Of bringing one object to another."""
NORMAL_NEIGHBOURS = 16
"""Points that a normal is found from."""


@dataclass(frozen=True)
class ObjectsEvaluationConfig:
    """Views of scenes, and where points come from."""

    points_from: Literal["surface", "gaussians"] = "surface"
    """On visible surfaces, or the means of Gaussians trained on the views."""
    surface_points: int = 20_000
    """Number of points on the surface."""
    pictures: int = 24
    """Number of views."""
    picture_size: int = 256
    """Height and width [px]."""
    kept: Path | None = None
    """Folder of Gaussians that were trained before, which are reused."""


DEFAULT_CONFIG = ObjectsEvaluationConfig()


@dataclass(frozen=True)
class ObjectsRow:
    """One scene; mean IoU over its objects, paired by the Hungarian method."""

    scene: str
    objects: tuple[str, ...]
    points: int
    identity: float
    """The ground truth against itself: 1 by construction."""
    ours: float
    """Superpoints, given the number of objects."""
    with_masks: float
    """The same, with instance masks on every view, numbered anew in each."""
    uncounted: float
    """Superpoints, without the number of objects."""
    counted: int
    """Number of objects that they estimated."""
    components: float
    """Connected components, the published rule."""
    seconds: float
    """Of the processor, for ``ours``."""
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class TouchingObjects:
    """One scene's points with the truth."""

    names: tuple[str, ...]
    cloud: FeatureCloud
    normals: Float[np.ndarray, "N 3"]
    object_of_point: Int[np.ndarray, " N"]
    masks: Int[np.ndarray, "V N"]
    space: SpacePieces | None = None
    """Of Gaussians; points on surfaces were brought together, and there is none between them."""


@dataclass(frozen=True)
class ObjectsResult:
    """One scene: how well its objects were segmented, and its points with what was found."""

    row: ObjectsRow
    taken: TouchingObjects
    ours: ObjectSegmentation
    components: Int[np.ndarray, " N"]


def evaluate_objects(
    folder: Path, config: ObjectsEvaluationConfig = DEFAULT_CONFIG, progress: Progress = no_progress
) -> list[ObjectsResult]:
    """Segment every scene of a folder into objects, and compare with the truth.

    Args:
        folder: Of scenes as ``corporeal assemble`` writes them, or one such scene.
        config: How they are pictured.
        progress: Called with the fraction done.

    Raises:
        UserError: There is no scene of several objects.

    """
    inside = sorted(folder.glob("*/scene.toml")) if folder.is_dir() else []
    paths = [folder / "scene.toml"] if (folder / "scene.toml").exists() else inside
    found = []
    for number, path in enumerate(paths):
        progress(number / len(paths), path.parent.name)
        scene = assemble([path])
        if len(scene.objects) > 1:
            found.append(evaluate_scene(path.parent.name, touching_from_photographs(path.parent.name, scene, config)))
    if not found:
        raise UserError(
            f"{folder} holds no scene of several objects. Make some: corporeal assemble --from "
            "models/ --count 2 --out scenes."
        )
    return found


def evaluate_scene(name: str, taken: TouchingObjects) -> ObjectsResult:
    """Segment objects by all methods, and compare."""
    truth, cloud = taken.object_of_point, taken.cloud
    present = np.unique(truth)
    count = len(present)
    start = time.process_time()
    pieces = None if taken.space is None else taken.space.piece_of_point
    ours = segment_objects(cloud, count, taken.normals, piece_of_point=pieces)
    seconds = time.process_time() - start
    masked = assign_instances(cloud, "masks", count, taken.normals, taken.masks, taken.space)
    uncounted = segment_objects(cloud, None, taken.normals, piece_of_point=pieces)
    published = nearest_neighbour_components(cloud.position)
    row = ObjectsRow(
        scene=name,
        objects=taken.names,
        points=cloud.count,
        identity=matched_iou(truth, truth),
        ours=matched_iou(truth, ours.object_of_point),
        with_masks=matched_iou(truth, masked.object_of_point),
        uncounted=matched_iou(truth, uncounted.object_of_point),
        counted=int(uncounted.object_of_point.max()) + 1,
        components=matched_iou(truth, published),
        seconds=seconds,
        warnings=ours.warnings,
    )
    return ObjectsResult(row, taken, ours, published)


# ---------------------------------------------------------------- photographs of a scene


def touching_from_photographs(
    name: str, scene: Scene, config: ObjectsEvaluationConfig = DEFAULT_CONFIG
) -> TouchingObjects:
    """Picture a scene whose objects touch, and take its points from the pictures."""
    scene = bring_together(scene)
    size = (config.picture_size, config.picture_size)
    views = capture(scene, CaptureConfig(config.pictures, size))
    if config.points_from == "surface":
        return _of_surface(scene, views, config)
    return _of_gaussians(scene, views, _learned_gaussians(name, views, config))


def bring_together(scene: Scene) -> Scene:
    """Bring each object that touches none before it to the nearest of them, along the floor.

    What stands side by side still stands so. An object moves by less than its distance, so
    that it stops where it touches.
    """
    for k in range(1, len(scene.objects)):
        before = KDTree(np.concatenate([_on(scene, j) for j in range(k)]))
        own = _on(scene, k)
        extent = float(np.ptp(np.concatenate([before.data, own]), axis=0).max())
        distance, who = before.query(own)
        nearest = int(np.argmin(distance))
        along = before.data[int(np.asarray(who)[nearest])] - own[nearest]
        along[2] = 0
        length = float(np.linalg.norm(along))
        shift, gap = 0.0, float(distance[nearest])
        for _ in range(APPROACH_STEPS if length > 0 else 0):
            if gap < TOUCHING_EXTENT_RATIO * extent:
                break
            shift += 0.9 * gap
            gap = float(before.query(own + shift / length * along)[0].min())
        if shift > 0:
            scene = move_scene(scene, shift / length * along, k)
    return scene


def _on(scene: Scene, obj: int) -> np.ndarray:
    mesh, owner = join_meshes(scene.surfaces), scene.object_of_triangle
    return sample_surface(mesh.only(owner == obj), MAX_SURFACE_POINTS, np.random.default_rng(obj))[0]


def _of_surface(scene: Scene, views: Views, config: ObjectsEvaluationConfig) -> TouchingObjects:
    assert views.depth is not None
    mesh, owner = join_meshes(scene.surfaces), scene.object_of_triangle
    rng = np.random.default_rng(0)
    position, triangle = sample_surface(mesh, 3 * config.surface_points, rng)
    pairs = list(zip(views.cameras, views.depth, strict=True))
    sights = np.stack([visible_points(position, camera, depth) for camera, depth in pairs])
    kept = rng.permutation(np.flatnonzero(sights.any(axis=0)))[: config.surface_points]
    position, sights, truth = position[kept], sights[:, kept], owner[triangle[kept]]
    lift = back_projection(position, views.cameras, views.depth, list(views.rgb / 255))
    towards = mean_view_directions(position, views.cameras, list(sights))
    shares = [_pixel_of_points(position, c, s) for c, s in zip(views.cameras, sights, strict=True)]
    seen = _VisiblePoints(position, np.clip(lift.mean, 0, 1), towards, truth, shares)
    return _touching_objects(scene, views, seen)


def _pixel_of_points(position: np.ndarray, camera: Camera, shown: np.ndarray) -> csr_array:
    """Return which pixel each point falls on where it is seen."""
    pose = camera.world_from_camera
    local = (position[shown] - pose[:3, 3]) @ pose[:3, :3] @ camera.K.T
    column, row = np.floor(local[:, :2] / local[:, 2:]).astype(np.int64).T
    column, row = np.clip(column, 0, camera.width - 1), np.clip(row, 0, camera.height - 1)
    rows = np.flatnonzero(shown)
    shape = (len(position), camera.height * camera.width)
    return csr_array((np.ones(len(rows)), (rows, row * camera.width + column)), shape=shape)


def _learned_gaussians(name: str, views: Views, config: ObjectsEvaluationConfig) -> Gaussians:
    """Return Gaussians that were learned from the pictures and their masks, or that are kept."""
    path = None if config.kept is None else config.kept / f"{name}.ply"
    if path is not None and path.exists():
        return load_splat(path)
    assert views.object_of_pixel is not None
    masks = views.object_of_pixel >= 0
    pictures = Views(views.rgb, views.cameras)
    made = train_gaussians(pictures, masks, config=TrainConfig("draft", held_out=0)).gaussians
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_splat_ply(path, made)
    return made


def _of_gaussians(scene: Scene, views: Views, gaussians: Gaussians) -> TouchingObjects:
    assert views.object_of_pixel is not None
    shows = gaussian_visibility(gaussians, views.cameras, views.object_of_pixel >= 0)
    kept = np.flatnonzero(foreground_gaussians(gaussians, views.cameras, shows))
    position = gaussians.mean[kept].astype(np.float64)
    shares = [csr_array(gaussian_weights(gaussians, camera)[kept]) for camera in views.cameras]
    towards = mean_view_directions(position, views.cameras, list(shows.share[:, kept]), MAX_SHOWING_THROUGH_FRACTION)
    colour = np.clip(0.5 + SH_DC_COEFFICIENT * gaussians.sh[kept, 0], 0, 1)
    surface = [_on(scene, k) for k in range(len(scene.objects))]
    nearest = KDTree(np.concatenate(surface)).query(position)[1]
    truth = np.repeat(np.arange(len(surface)), MAX_SURFACE_POINTS)[nearest]
    taken = _touching_objects(scene, views, _VisiblePoints(position, colour, towards, truth, shares))
    of_object, seen = np.isin(np.arange(gaussians.count), kept), views.object_of_pixel >= 0
    pieces = pieces_by_free_space(position, gaussian_subset(gaussians, of_object), of_object[kept], views.cameras, seen)
    return replace(taken, space=SpacePieces(pieces))


@dataclass(frozen=True)
class _VisiblePoints:
    position: np.ndarray
    colour: np.ndarray
    towards: np.ndarray
    """Where the outside is."""
    truth: np.ndarray
    shares: Sequence[csr_array]
    """Of each view, how much each pixel belongs to each point."""


def _touching_objects(scene: Scene, views: Views, found: _VisiblePoints) -> TouchingObjects:
    look = point_descriptor(found.position, found.colour, found.towards)
    seen = np.sum([np.asarray(s.sum(axis=1)).ravel() > 0 for s in found.shares], axis=0)
    cloud = FeatureCloud(found.position, found.colour, look, look, np.asarray(seen, np.int64))
    near = nearest_neighbours(found.position, NORMAL_NEIGHBOURS)
    assert views.object_of_pixel is not None
    drawn = _renumbered(views.object_of_pixel)
    return TouchingObjects(
        tuple(obj.name for obj in scene.objects),
        cloud,
        point_normals(found.position, near, found.towards),
        found.truth,
        lift_labels(found.shares.__getitem__, drawn, cloud.count),
    )


def _renumbered(objects_of_view: np.ndarray) -> list[np.ndarray]:
    """Return objects numbered anew in every view, as who draws masks does."""
    rng, count = np.random.default_rng(0), int(objects_of_view.max()) + 1
    return [np.append(rng.permutation(count), -1)[view] for view in objects_of_view]


# ---------------------------------------------------------------- how it is shown


OBJECTS_HEADS = ("scene", "points", "identity", "ours", "with masks", "uncounted", "components", "seconds")


def objects_tables(rows: Sequence[ObjectsRow]) -> list[ResultTable]:
    """Return what to print: title, heads, cells."""
    cells = [
        (
            row.scene,
            f"{row.points}",
            f"{row.identity:.2f}",
            f"{row.ours:.2f}{' !' * bool(row.warnings)}",
            f"{row.with_masks:.2f}",
            f"{row.uncounted:.2f} ({row.counted})",
            f"{row.components:.2f}",
            f"{row.seconds:.1f}",
        )
        for row in rows
    ]
    return [ResultTable("Mean IoU of objects; !: warned; (n): how many were counted", OBJECTS_HEADS, cells)]


def objects_record(rows: Sequence[ObjectsRow]) -> dict:
    """Return everything as data."""
    return {"rows": [asdict(row) for row in rows]}

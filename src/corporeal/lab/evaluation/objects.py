"""Instance segmentation of objects that touch, in pictures of settled scenes with ground truth.

Points are either spread over the surface that pictures show, or the means of Gaussians that were
learned from the pictures. Three methods are compared: identity, which is the ground truth;
superpoints cut by appearance features and concavity, with and without the number of objects, and
with instance masks; and the connected components of each point's nearest neighbours, the rule of
published pipelines.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from corporeal.core.errors import UserError
from corporeal.core.types import Camera, Cloud, Gaussians, Scene, Views
from corporeal.geometry.arrangement import moved
from corporeal.geometry.gaussians import only
from corporeal.geometry.harmonics import DC
from corporeal.geometry.mesh import joined
from corporeal.geometry.spread import sample_surface
from corporeal.io.splat_ply import write_splat
from corporeal.io.splats import read_splat
from corporeal.lab.evaluation.overlap import matched_iou
from corporeal.lab.evaluation.result_table import Table
from corporeal.multiview.local_shape import neighbours, normals
from corporeal.pipeline.stages.assemble import assemble
from corporeal.pipeline.stages.capture import CaptureConfig, capture
from corporeal.reconstruction.features.descriptor import LET_THROUGH, descriptor, seen_from
from corporeal.reconstruction.features.lifting import back_projection, visible
from corporeal.reconstruction.gaussians.clear_space import pieces_in_space
from corporeal.reconstruction.gaussians.foreground import foreground, shown
from corporeal.reconstruction.gaussians.raster import weights
from corporeal.reconstruction.gaussians.train import train
from corporeal.reconstruction.gaussians.training_schedule import TrainConfig
from corporeal.reconstruction.segment.instance_assignment import assign_instances
from corporeal.reconstruction.segment.masks import lifted
from corporeal.reconstruction.segment.objects import Split, components, objects
from corporeal.reconstruction.segment.space import Space

Progress = Callable[[float, str], None]
CLOSE = 0.002
"""Things touch that are nearer than this, as a share of the scene's extent."""
DENSE = 60_000
"""Points on the surface by which distances are measured, and Gaussians told whose they are."""
STEPS = 100
"""Of bringing one object to another."""
AROUND = 16
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


DEFAULT = ObjectsEvaluationConfig()


@dataclass(frozen=True)
class ObjectsRow:
    """One scene; mean IoU over its objects, paired by the Hungarian method."""

    scene: str
    things: tuple[str, ...]
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
class Touching:
    """One scene's points with the truth."""

    names: tuple[str, ...]
    cloud: Cloud
    normals: Float[np.ndarray, "N 3"]
    object_of_point: Int[np.ndarray, " N"]
    masks: Int[np.ndarray, "V N"]
    space: Space | None = None
    """Of Gaussians; points on surfaces were brought together, and there is none between them."""


@dataclass(frozen=True)
class Judged:
    """One scene: how well its objects were segmented, and its points with what was found."""

    row: ObjectsRow
    taken: Touching
    ours: Split
    components: Int[np.ndarray, " N"]


def judge(
    folder: Path,
    config: ObjectsEvaluationConfig = DEFAULT,
    progress: Progress = lambda share, words: None,
) -> list[Judged]:
    """Segment every scene of a folder into objects, and compare with the truth.

    Args:
        folder: Of scenes as ``corporeal assemble`` writes them, or one such scene.
        config: How they are pictured.
        progress: Told the share done.

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
            found.append(judged(path.parent.name, photographed(path.parent.name, scene, config)))
    if not found:
        raise UserError(
            f"{folder} holds no scene of several objects. Make some: corporeal assemble --from "
            "models/ --count 2 --out scenes."
        )
    return found


def judged(name: str, taken: Touching) -> Judged:
    """Segment objects by all methods, and compare."""
    truth, cloud = taken.object_of_point, taken.cloud
    present = np.unique(truth)
    count = len(present)
    start = time.process_time()
    pieces = None if taken.space is None else taken.space.piece_of_point
    ours = objects(cloud, count, taken.normals, piece_of_point=pieces)
    seconds = time.process_time() - start
    masked = assign_instances(cloud, "masks", count, taken.normals, taken.masks, taken.space)
    uncounted = objects(cloud, None, taken.normals, piece_of_point=pieces)
    published = components(cloud.position)
    row = ObjectsRow(
        scene=name,
        things=taken.names,
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
    return Judged(row, taken, ours, published)


# ---------------------------------------------------------------- photographs of a scene


def photographed(name: str, scene: Scene, config: ObjectsEvaluationConfig = DEFAULT) -> Touching:
    """Picture a scene whose objects touch, and take its points from the pictures."""
    scene = closed_up(scene)
    size = (config.picture_size, config.picture_size)
    views = capture(scene, CaptureConfig(config.pictures, size))
    if config.points_from == "surface":
        return _of_surface(scene, views, config)
    return _of_gaussians(scene, views, _learned(name, views, config))


def closed_up(scene: Scene) -> Scene:
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
        for _ in range(STEPS if length > 0 else 0):
            if gap < CLOSE * extent:
                break
            shift += 0.9 * gap
            gap = float(before.query(own + shift / length * along)[0].min())
        if shift > 0:
            scene = moved(scene, shift / length * along, k)
    return scene


def _on(scene: Scene, obj: int) -> np.ndarray:
    mesh, owner = joined(scene.surfaces), scene.object_of_triangle
    return sample_surface(mesh.only(owner == obj), DENSE, np.random.default_rng(obj))[0]


def _of_surface(scene: Scene, views: Views, config: ObjectsEvaluationConfig) -> Touching:
    assert views.depth is not None
    mesh, owner = joined(scene.surfaces), scene.object_of_triangle
    rng = np.random.default_rng(0)
    position, triangle = sample_surface(mesh, 3 * config.surface_points, rng)
    pairs = list(zip(views.cameras, views.depth, strict=True))
    sights = np.stack([visible(position, camera, depth) for camera, depth in pairs])
    kept = rng.permutation(np.flatnonzero(sights.any(axis=0)))[: config.surface_points]
    position, sights, truth = position[kept], sights[:, kept], owner[triangle[kept]]
    lift = back_projection(position, views.cameras, views.depth, list(views.rgb / 255))
    towards = seen_from(position, views.cameras, list(sights))
    shares = [_falls(position, c, s) for c, s in zip(views.cameras, sights, strict=True)]
    seen = _Seen(position, np.clip(lift.mean, 0, 1), towards, truth, shares)
    return _taken(scene, views, seen)


def _falls(position: np.ndarray, camera: Camera, shown: np.ndarray) -> csr_array:
    """Return which pixel each point falls on where it is seen."""
    pose = camera.world_from_camera
    local = (position[shown] - pose[:3, 3]) @ pose[:3, :3] @ camera.K.T
    column, row = np.floor(local[:, :2] / local[:, 2:]).astype(np.int64).T
    column, row = np.clip(column, 0, camera.width - 1), np.clip(row, 0, camera.height - 1)
    rows = np.flatnonzero(shown)
    shape = (len(position), camera.height * camera.width)
    return csr_array((np.ones(len(rows)), (rows, row * camera.width + column)), shape=shape)


def _learned(name: str, views: Views, config: ObjectsEvaluationConfig) -> Gaussians:
    """Return Gaussians that were learned from the pictures and their masks, or that are kept."""
    path = None if config.kept is None else config.kept / f"{name}.ply"
    if path is not None and path.exists():
        return read_splat(path)
    assert views.object_of_pixel is not None
    masks = views.object_of_pixel >= 0
    pictures = Views(views.rgb, views.cameras)
    made = train(pictures, masks, config=TrainConfig("draft", held_out=0)).gaussians
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_splat(path, made)
    return made


def _of_gaussians(scene: Scene, views: Views, gaussians: Gaussians) -> Touching:
    assert views.object_of_pixel is not None
    shows = shown(gaussians, views.cameras, views.object_of_pixel >= 0)
    kept = np.flatnonzero(foreground(gaussians, views.cameras, shows))
    position = gaussians.mean[kept].astype(np.float64)
    shares = [csr_array(weights(gaussians, camera)[kept]) for camera in views.cameras]
    towards = seen_from(position, views.cameras, list(shows.share[:, kept]), LET_THROUGH)
    colour = np.clip(0.5 + DC * gaussians.sh[kept, 0], 0, 1)
    surface = [_on(scene, k) for k in range(len(scene.objects))]
    nearest = KDTree(np.concatenate(surface)).query(position)[1]
    truth = np.repeat(np.arange(len(surface)), DENSE)[nearest]
    taken = _taken(scene, views, _Seen(position, colour, towards, truth, shares))
    of_object, seen = np.isin(np.arange(gaussians.count), kept), views.object_of_pixel >= 0
    pieces = pieces_in_space(
        position, only(gaussians, of_object), of_object[kept], views.cameras, seen
    )
    return replace(taken, space=Space(pieces))


@dataclass(frozen=True)
class _Seen:
    position: np.ndarray
    colour: np.ndarray
    towards: np.ndarray
    """Where the outside is."""
    truth: np.ndarray
    shares: Sequence[csr_array]
    """Of each view, how much each pixel belongs to each point."""


def _taken(scene: Scene, views: Views, found: _Seen) -> Touching:
    look = descriptor(found.position, found.colour, found.towards)
    seen = np.sum([np.asarray(s.sum(axis=1)).ravel() > 0 for s in found.shares], axis=0)
    cloud = Cloud(found.position, found.colour, look, look, np.asarray(seen, np.int64))
    near = neighbours(found.position, AROUND)
    assert views.object_of_pixel is not None
    drawn = _renumbered(views.object_of_pixel)
    return Touching(
        tuple(obj.name for obj in scene.objects),
        cloud,
        normals(found.position, near, found.towards),
        found.truth,
        lifted(found.shares.__getitem__, drawn, cloud.count),
    )


def _renumbered(objects_of_view: np.ndarray) -> list[np.ndarray]:
    """Return objects numbered anew in every view, as who draws masks does."""
    rng, count = np.random.default_rng(0), int(objects_of_view.max()) + 1
    return [np.append(rng.permutation(count), -1)[view] for view in objects_of_view]


# ---------------------------------------------------------------- how it is shown


HEADS = ("scene", "points", "identity", "ours", "with masks", "uncounted", "components", "seconds")


def tables(rows: Sequence[ObjectsRow]) -> list[Table]:
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
    return [Table("Mean IoU of objects; !: warned; (n): how many were counted", HEADS, cells)]


def record(rows: Sequence[ObjectsRow]) -> dict:
    """Return everything as data."""
    return {"rows": [asdict(row) for row in rows]}

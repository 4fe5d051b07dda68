"""Evaluation of part segmentation on rendered models with ground truth.

A model is pictured from all sides; points on its surface that a picture shows take their colours, and what models see,
from the pictures, as points of photographs do. Which node or material a point is of stays secret, but for the names.
"""

import time
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int

from corporeal.core.errors import BadFileError, UserError
from corporeal.core.progress import Progress, no_progress
from corporeal.core.types import FeatureCloud, Inventory, PartDescription, Scene, Views
from corporeal.description.describe_config import DescribeConfig
from corporeal.geometry.mesh import join_meshes
from corporeal.geometry.point_sampling import sample_surface
from corporeal.geometry.scene_transforms import move_scene, surfaces_bounding_box
from corporeal.io.input_files import model_files_in
from corporeal.lab.evaluation.material_evaluation import roc_area
from corporeal.lab.evaluation.result_table import ResultTable
from corporeal.pipeline.stages.assemble import assemble
from corporeal.pipeline.stages.capture import CaptureConfig, capture
from corporeal.pipeline.stages.describe import describe
from corporeal.pipeline.stages.segment import segment
from corporeal.reconstruction import features
from corporeal.reconstruction.features.feature_lifting import back_projection, visible_points
from corporeal.reconstruction.features.point_descriptor import mean_view_directions, point_descriptor
from corporeal.reconstruction.segment.part_clusters import PartsConfig, cluster_parts
from corporeal.reconstruction.segment.part_naming import name_clusters, part_phrases
from corporeal.showcase.showcase_scenes import prop_scene
from segmentation.segmentation_scores import majority_names, matched_iou, named_iou

SHOWCASE_MODELS = ("potted_ficus", "armchair", "floor_lamp", "couch")
NAMES_FILE_ADVICE = "Write [file] with part = 'its everyday name', as in pot = 'clay pot'."

PartNames = Mapping[str, Mapping[str, str]]
"""File's stem → part as the file calls it → its everyday name. What is called the same is one part."""


@dataclass(frozen=True)
class PartsEvaluationConfig:
    """Views of models, and features."""

    points: int = 20_000
    """Number of points on the surface; those that are not visible are left out."""
    photographs: int = 24
    """Number of views, from all sides above the floor."""
    photograph_size: int = 256
    """Height and width [px]."""
    point_seed: int = 0
    """Seed of the points."""
    lying: bool = False
    """Lay each model on its side before it is rendered."""
    structural: str = "descriptor"
    """Features that parts are segmented by: "descriptor", which needs no weights, "dinov2", or "dinov2:FOLDER"."""
    semantic: str = ""
    """Features that parts are named by: "clip", "clip:FOLDER"; "": colour, height and shape."""


@dataclass(frozen=True)
class PartsRow:
    """One object."""

    object: str
    parts: tuple[str, ...]
    """As they were called; those that a picture shows."""
    points: int
    clusters: int
    clusters_iou: float
    """Mean IoU of clusters and parts, paired by the Hungarian method: no word was given."""
    best_iou: float
    """Of clusters that are named after what most of their points are: no naming could do better."""
    found_iou: float
    """Of named parts, paired by the Hungarian method: how well they are separated."""
    named_iou: float
    """Of named parts, each with its own name's: whether they are also called what they are."""
    right: float
    """Share of points under the right name."""
    matter_iou: float
    """As ``named_iou``, parts of one material taken together: what mass and motion depend on."""
    chance_iou: float
    """As ``named_iou``, were everything called what most points are."""
    ordering: float | None
    """How often a right point is surer than a wrong one; None: there are not both."""
    seconds: float
    """For clusters and names."""

    @property
    def ratio(self) -> float:
        """Clusters per part."""
        return self.clusters / len(self.parts)


@dataclass(frozen=True)
class PhotographedObject:
    """One object's points with the truth."""

    cloud: FeatureCloud
    part_of_point: Int[np.ndarray, " N"]
    """Index into the parts of the inventory's first object."""
    inventory: Inventory


@dataclass(frozen=True)
class FeatureModels:
    """Who looks at pictures."""

    structural: Any
    """None: the descriptor."""
    semantic: Any
    """None: no model compares points with words."""


@dataclass(frozen=True)
class PartsMethod:
    """How parts are looked for."""

    look: PartsEvaluationConfig = field(default_factory=PartsEvaluationConfig)
    clusters: PartsConfig = field(default_factory=PartsConfig)
    describe: DescribeConfig = field(default_factory=DescribeConfig)
    """Who says what parts are made of."""


@dataclass(frozen=True)
class PartsResult:
    """One object: how well its parts were found, and its points with what they were taken for."""

    row: PartsRow
    taken: PhotographedObject
    truth: Int[np.ndarray, " N"]
    """Index into the parts that a picture shows."""
    cluster_of_point: Int[np.ndarray, " N"]
    part_of_point: Int[np.ndarray, " N"]


def evaluate_parts(
    folder: Path | None, names: PartNames, how: PartsMethod, progress: Progress = no_progress
) -> list[PartsResult]:
    """Find the parts of every model that has several, and compare.

    Args:
        folder: Models, one object each; None: four of the showcase.
        names: What parts are called; those not in it are called as the file does.
        how: How they are pictured and taken apart, and who looks.
        progress: Called with the fraction done.

    Raises:
        UserError: There is no model of several parts, or an encoder cannot be had.

    """
    look = feature_models(how.look)
    chosen = list(SHOWCASE_MODELS) if folder is None else _models(folder)
    found = []
    for number, each in enumerate(chosen):
        scene = prop_scene(each) if isinstance(each, str) else assemble([each])
        stem = each if isinstance(each, str) else each.stem
        progress(number / len(chosen), stem)
        taken = photographed_object(scene, how.look, look, how.describe)
        if len(_named_parts(taken, names.get(stem, {})).parts) > 1:
            found.append(evaluate_object(stem, taken, names.get(stem, {}), look, how.clusters))
    if not found:
        raise UserError(f"No model in {folder} has two parts that a picture shows.")
    return found


def feature_models(how: PartsEvaluationConfig) -> FeatureModels:
    """Connect to those who look.

    Raises:
        UserError: One cannot be had, or does not know words.

    """
    semantic = features.connect_encoder(how.semantic) if how.semantic else None
    if how.semantic and not isinstance(semantic, features.TextPictureEncoder):
        raise UserError(f"{how.semantic!r} does not compare points with words. Say --semantic clip, or leave it out.")
    return FeatureModels(features.connect_encoder(how.structural), semantic)


def _models(folder: Path) -> list[Path]:
    found = model_files_in(folder) if folder.is_dir() else []
    if not found:
        raise UserError(f"There are no models in {folder}. Name a folder of GLB, glTF or mesh files.")
    return found


# ---------------------------------------------------------------- photographs of a model


def photographed_object(
    scene: Scene, how: PartsEvaluationConfig, look: FeatureModels, words: DescribeConfig
) -> PhotographedObject:
    """Picture a scene of one object, and take its points from the pictures."""
    scene = _laid_on_side(scene) if how.lying else scene
    inventory = describe(scene, words)
    truth = segment(scene, inventory)
    size = (how.photograph_size, how.photograph_size)
    views = capture(scene, CaptureConfig(how.photographs, size))
    rng = np.random.default_rng(how.point_seed)
    position, triangle = sample_surface(join_meshes(scene.surfaces), how.points, rng)
    assert views.depth is not None
    colour = back_projection(position, views.cameras, views.depth, list(views.rgb / 255))
    shown = colour.seen > 0
    cloud = _cloud(position[shown], colour.mean[shown], colour.seen[shown], views, look)
    return PhotographedObject(cloud, truth.part_of_point[triangle[shown]], inventory)


def _laid_on_side(scene: Scene) -> Scene:
    """Turn a scene about y by a quarter, and put it on the floor."""
    turned = tuple(replace(s, vertices=s.vertices[:, ::-1] * [1, 1, -1]) for s in scene.surfaces)
    return move_scene(replace(scene, surfaces=turned), (0.0, 0.0, -float(surfaces_bounding_box(turned)[0, 2])))


def _cloud(
    position: np.ndarray, colour: np.ndarray, seen: np.ndarray, views: Views, look: FeatureModels
) -> FeatureCloud:
    assert views.depth is not None
    depth = views.depth

    def lifted(encoder: Any) -> np.ndarray:
        maps = [encoder.map(picture) for picture in views.rgb]
        return back_projection(position, views.cameras, depth, maps).unit()

    if look.structural is None:
        pairs = zip(views.cameras, depth, strict=True)
        shares = [visible_points(position, camera, d) for camera, d in pairs]
        structural = point_descriptor(position, colour, mean_view_directions(position, views.cameras, shares))
    else:
        structural = lifted(look.structural)
    nothing = np.zeros((len(position), 0), np.float16)
    return FeatureCloud(
        position=position,
        colour=colour,
        semantic=nothing if look.semantic is None else lifted(look.semantic),
        structural=structural,
        seen=seen,
    )


# ---------------------------------------------------------------- how good


def evaluate_object(
    name: str, taken: PhotographedObject, names: Mapping[str, str], look: FeatureModels, config: PartsConfig
) -> PartsResult:
    """Find one object's parts, and compare; only what a picture shows is asked for."""
    called = _named_parts(taken, names)
    shown, truth = called.parts, called.part_of_point
    words = replace(taken.inventory.objects[0], parts=tuple(shown))
    vectors = None if look.semantic is None else look.semantic.words(part_phrases(words))
    start = time.process_time()
    clusters = cluster_parts(taken.cloud, config)
    found = name_clusters(clusters, taken.cloud, vectors, shown)
    seconds = time.process_time() - start
    part, cluster = found.part_of_point, clusters.cluster_of_point
    right = part == truth
    material = _materials(shown)
    row = PartsRow(
        object=name,
        parts=tuple(p.name for p in shown),
        points=len(truth),
        clusters=clusters.count,
        clusters_iou=matched_iou(truth, cluster),
        best_iou=named_iou(truth, majority_names(truth, cluster)),
        found_iou=matched_iou(truth, part),
        named_iou=named_iou(truth, part),
        right=float(right.mean()),
        matter_iou=named_iou(material[truth], material[part]),
        chance_iou=named_iou(truth, np.full_like(truth, np.bincount(truth).argmax())),
        ordering=roc_area(found.confidence[right], found.confidence[~right]),
        seconds=seconds,
    )
    return PartsResult(row, taken, truth, cluster, part)


@dataclass(frozen=True)
class _NamedParts:
    """The parts that a picture shows, under the names that are asked for."""

    parts: list[PartDescription]
    part_of_point: Int[np.ndarray, " N"]
    """Index into ``cluster_parts``."""


def _named_parts(taken: PhotographedObject, names: Mapping[str, str]) -> _NamedParts:
    """Return the parts that a picture shows; parts of one name are one part."""
    known = [p for one in taken.inventory.objects for p in one.parts]
    present = np.unique(taken.part_of_point)
    called = {int(k): names.get(known[k].name, known[k].name) for k in present}
    distinct = list(dict.fromkeys(called.values()))
    number = np.full(len(known), -1)
    number[present] = [distinct.index(called[int(k)]) for k in present]
    first = {called[int(k)]: known[k] for k in present[::-1]}
    shown = [replace(first[name], name=name) for name in distinct]
    return _NamedParts(shown, number[taken.part_of_point])


def _materials(shown: Sequence[PartDescription]) -> np.ndarray:
    """Return one number per material; parts of unknown ones are each of their own."""
    keys = [part.material or f"? {k}" for k, part in enumerate(shown)]
    return np.array([keys.index(key) for key in keys])


def read_names(path: Path) -> PartNames:
    """Read what parts are called.

    Raises:
        BadFileError: The file cannot be read, or says something else.

    """
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BadFileError(path, f"cannot be read ({error}).", NAMES_FILE_ADVICE) from error
    for file, table in tables.items():
        if not isinstance(table, dict) or not all(isinstance(v, str) and v for v in table.values()):
            raise BadFileError(path, f"{file}: must map the file's names to names.", NAMES_FILE_ADVICE)
    return tables


# ---------------------------------------------------------------- for people and programs

PARTS_HEADS = ("object", "parts", "clusters", "alone", "best", "segmented", "named", "by material")


def parts_tables(rows: Sequence[PartsRow]) -> list[ResultTable]:
    """Return title, heads and cells of what a person is shown."""
    cells = [(r.object, str(len(r.parts)), f"{r.clusters} ({r.ratio:.1f}×)", *map(_share, _scores(r))) for r in rows]
    mean = np.mean([_scores(r) for r in rows], axis=0)
    ratio = np.mean([r.ratio for r in rows])
    last = ("mean", "", f"({ratio:.1f}×)", *map(_share, mean))
    return [ResultTable("Parts: mean IoU", PARTS_HEADS, [*cells, last])]


def _scores(r: PartsRow) -> tuple[float, ...]:
    return (r.clusters_iou, r.best_iou, r.found_iou, r.named_iou, r.matter_iou)


def _share(x: float) -> str:
    return f"{x:.2f}"


def parts_record(rows: Sequence[PartsRow]) -> dict:
    """Return rows as plain data."""
    return {"rows": [asdict(r) | {"ratio": r.ratio} for r in rows]}

"""Segmentation of touching objects.

Settled objects always touch, so that nearness does not segment them. What does: the surface
folds inwards where they meet, they look unlike, and the place where they meet is narrow. Points
become patches, patches a graph, and the graph is cut in two, again and again, until there are as
many objects as are known to be there.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

from corporeal.core.errors import UserError
from corporeal.core.types import FeatureCloud
from corporeal.geometry.connected_components import connected_components
from corporeal.multiview.point_cloud_geometry import nearest_neighbours
from corporeal.reconstruction.segment.cut_proposals import PatchGraph
from corporeal.reconstruction.segment.graph_cuts import GraphCut, best_graph_cut
from corporeal.reconstruction.segment.instance_masks import label_agreement
from corporeal.reconstruction.segment.part_clusters import reduce_features
from corporeal.reconstruction.segment.patch_graph import (
    PatchBorders,
    SurfacePatches,
    border_concavity,
    border_difference,
    cut_patches,
    join_pieces,
)


@dataclass(frozen=True)
class SpacePieces:
    """Pieces with empty space between them."""

    piece_of_point: Int[np.ndarray, " N"]
    """0 … the number of pieces - 1, what has most points first."""
    alone: bool = False
    """Whether nothing else tells objects apart, so that what touches is one."""


def join_nearest_pieces(
    piece_of_point: Int[np.ndarray, " N"], position: Float[np.ndarray, "N 3"], most: int | None
) -> Int[np.ndarray, " N"]:
    """Join pieces that are nearest to each other until they are few enough.

    Args:
        piece_of_point: 0 … the number of pieces - 1.
        position: Of the points.
        most: How many objects there are at most; None: not given.
    """
    label, count = piece_of_point.copy(), int(piece_of_point.max(initial=-1)) + 1
    if most is None or count <= most:
        return label
    trees = [KDTree(position[piece_of_point == k]) for k in range(count)]
    pairs = combinations(range(count), 2)
    gaps = sorted((float(trees[a].query(trees[b].data)[0].min()), a, b) for a, b in pairs)
    for _, a, b in gaps:
        if len(np.unique(label)) <= most:
            break
        one, other = (label[piece_of_point == k][0] for k in (a, b))
        label[label == other] = one
    return np.unique(label, return_inverse=True)[1]


MAX_THIN_RATIO = 1 / 3
"""Height over the smaller width of what is thin [-]."""
MIN_COVERED_FRACTION = 0.5
"""Share of the smaller outline, seen from above, under or on which something lies."""
MAX_GAP_RATIO = 0.5
"""Distance of one's top and the other's bottom, over the thin one's height [-]."""


def count_stacked_objects(found: SurfacePatches, instance: Int[np.ndarray, " M"]) -> int:
    """Return how many objects are thin and lie on or under another.

    An object's box stands upright, turned about the vertical as its patches lie. It is thin where it is less than a
    third as high as wide; the other lies on it, or under it, where their outlines overlap by half of the smaller and
    one begins where the other ends.
    """
    count = int(instance.max()) + 1
    rows = [found.centre[instance == k] for k in range(count)]
    height = np.array([np.ptp(r[:, 2]) for r in rows])
    width = np.array([_outline_width(r[:, :2]) for r in rows])
    thin = (height < MAX_THIN_RATIO * width) & (width > 0)
    return sum(
        any(_are_touching(rows[a], rows[b], height[a]) for b in range(count) if b != a) for a in np.flatnonzero(thin)
    )


def _outline_width(flat: np.ndarray) -> float:
    """Return the smaller width of an outline."""
    if len(flat) < 3:
        return 0.0
    local = flat - flat.mean(axis=0)
    axes = np.linalg.eigh(local.T @ local)[1]
    return float(np.ptp(local @ axes, axis=0).min())


def _are_touching(a: np.ndarray, b: np.ndarray, height: float) -> bool:
    gap = min(abs(float(low[:, 2].max() - high[:, 2].min())) for low, high in ((a, b), (b, a)))
    corners = [np.array([r[:, :2].min(axis=0), r[:, :2].max(axis=0)]) for r in (a, b)]
    low, high = np.maximum(*(c[0] for c in corners)), np.minimum(*(c[1] for c in corners))
    common = float(np.prod(np.maximum(high - low, 0)))
    smaller = min(float(np.prod(c[1] - c[0])) for c in corners)
    return gap < MAX_GAP_RATIO * height and common > MIN_COVERED_FRACTION * smaller


MIN_APPEARANCE_DIFFERENCE = 0.04
"""Least difference of appearance that counts, however much alike all is."""
MIN_BORDER_FRACTION = 1e-9
"""Of a border's weight: nothing is cut for nothing."""
DOUBTFUL_SCORE_RATIO = 1.3
"""Cuts whose scores differ by less than this factor are equally good."""
MAX_OBJECTS = 200
"""Objects in one scene."""


@dataclass(frozen=True)
class ObjectSegmentationConfig:
    """How objects are segmented."""

    patches: int = 2000
    """Into which the points are cut, about."""
    unlike: float = 1.5
    """Difference of appearance at which two patches hold together by e^-1/2, over the scene's own root mean square
    difference between neighbours."""
    concave: float = 0.2
    """Inward fold at which two patches hold together by e^-1/2: roughly the sine of the angle."""
    disagreement: float = 0.3
    """Share of views that take two patches for two objects at which they hold together by e^-1/2."""
    narrowest: float = 0.003
    """Share of all borders that a cut counts for at least, so that crumbs are not cut off."""
    apart: float = 0.018
    """Score below which a cut is made where their number is unknown."""


DEFAULT_OBJECT_SEGMENTATION = ObjectSegmentationConfig()
TOUCHING_IS_ONE_CONFIG = ObjectSegmentationConfig(apart=0.0)
"""Only space, or a stated number, makes several objects."""


@dataclass(frozen=True)
class ObjectSegmentation:
    """Which point belongs to which object."""

    object_of_point: Int[np.ndarray, " N"]
    """0 … the number of objects - 1, what has most points first."""
    confidence: Float[np.ndarray, " N"]
    """In [0, 1]: how much more a point's patch holds to its own object than to others."""
    warnings: tuple[str, ...]
    """What a reader of the report should know, in sentences."""
    found_by: str
    """How objects were segmented, in a clause."""

    @property
    def statement(self) -> str:
        """What a reader of the report should know, in a sentence."""
        count = int(self.object_of_point.max()) + 1
        return f"{count} object{'s' * (count != 1)}, segmented by {self.found_by}."


def segment_objects(
    cloud: FeatureCloud,
    count: int | None = None,
    normals: Float[np.ndarray, "N 3"] | None = None,
    masks: Int[np.ndarray, "V N"] | None = None,
    config: ObjectSegmentationConfig = DEFAULT_OBJECT_SEGMENTATION,
    piece_of_point: Int[np.ndarray, " N"] | None = None,
) -> ObjectSegmentation:
    """Segment objects that may touch.

    Args:
        cloud: Points with features; ``semantic`` decides, or ``structural`` where that is empty.
        count: How many objects there are, if known.
        normals: Unit, outward; None: found from the points, which is less sure.
        masks: What each view takes each point for, where there are instance masks (see ``masks.lifted``); -1:
            unknown.
        config: How objects are segmented.
        piece_of_point: Which connected piece each is of, from 0, where a view saw empty space between these; None:
            all may be one.

    Raises:
        UserError: There are no points, or more objects than can be.
    """
    _check_cloud(cloud, count)
    # Points become patches, and patches that meet a graph.
    appearance = reduce_features(cloud.semantic if cloud.semantic.shape[1] else cloud.structural)
    found, meeting = cut_patches(cloud.position, appearance, normals, config.patches)
    borders = join_pieces(found, meeting)
    # Patches hold together where they look alike and do not fold inwards, and where masks agree.
    held = _border_strength(found, borders, config)
    if masks is not None:
        agreed = label_agreement(masks, found, borders)
        held = held * np.exp(-(((1 - agreed) / config.disagreement) ** 2) / 2)
    graph = PatchGraph(
        borders.first,
        borders.second,
        borders.length * np.maximum(held, MIN_BORDER_FRACTION),
        borders.length,
        found.size.astype(np.float64),
        found.appearance.astype(np.float64),
    )
    # What has space between is apart already; the rest is cut where that costs least.
    start = np.zeros(len(found.size), np.int64)
    if piece_of_point is not None:
        start = _objects_of_patches(join_nearest_pieces(piece_of_point, cloud.position, count), found)
    instance, cuts = _cut_into_objects(graph, count, config, start)
    spaces = int(start.max()) + 1
    instance = _number_by_size(instance, found.size)
    return ObjectSegmentation(
        instance[found.of_point],
        _object_confidence(graph, instance)[found.of_point],
        (*_count_warnings(count, instance, config), *_doubt_warnings(found, instance, cuts)),
        _found_by_clause(spaces, int(instance.max()) + 1, masks is not None),
    )


def _found_by_clause(spaces: int, count: int, masks: bool) -> str:
    """Say by what objects were segmented, in a clause."""
    by = ["the space between them"] if spaces > 1 else []
    if count > spaces or count == 1:
        by += ["appearance and concavity", *(["instance masks"] if masks else [])]
    return " and ".join(by)


def _objects_of_patches(of_point: Int[np.ndarray, " N"], found: SurfacePatches) -> Int[np.ndarray, " M"]:
    """Return what most points of each patch are of, numbered without gaps."""
    votes = np.zeros((len(found.size), int(of_point.max()) + 1))
    np.add.at(votes, (found.of_point, of_point), 1)
    return np.unique(votes.argmax(axis=1), return_inverse=True)[1]


def nearest_neighbour_components(position: Float[np.ndarray, "N 3"], k: int = 20) -> Int[np.ndarray, " N"]:
    """Return the connected components of each point's k nearest: objects only where none touch.

    The rule of published pipelines; numbered by their points, most first.
    """
    near = nearest_neighbours(position, k + 1)[:, 1:]
    rows = np.repeat(np.arange(len(position)), near.shape[1])
    return _number_by_size(connected_components(rows, near.ravel(), len(position)))


def _number_by_size(number: np.ndarray, size: np.ndarray | None = None) -> np.ndarray:
    """Return groups numbered anew, the largest first."""
    order = np.argsort(-np.bincount(number, size), kind="stable")
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    return rank[number]


def _check_cloud(cloud: FeatureCloud, count: int | None) -> None:
    if not cloud.count:
        raise UserError("There are no points to find objects in. Check what the pictures show.")
    if count is not None and not 1 <= count <= min(MAX_OBJECTS, cloud.count):
        raise UserError(
            f"{count} objects are to be found among {cloud.count} points. Ask for 1 to {min(MAX_OBJECTS, cloud.count)}."
        )


def _border_strength(found: SurfacePatches, borders: PatchBorders, config: ObjectSegmentationConfig) -> np.ndarray:
    """Return how well patches hold together: exp(-(difference / δ)² / 2 - (concavity / c)² / 2)."""
    unlike, fold = (border_difference(found, borders), np.maximum(border_concavity(found, borders), 0))
    usual = np.sqrt(np.average(unlike**2, weights=borders.length)) if len(unlike) else 0.0
    scale = config.unlike * max(float(usual), MIN_APPEARANCE_DIFFERENCE)
    return np.exp(-((unlike / scale) ** 2) / 2 - (fold / config.concave) ** 2 / 2)


def _cut_into_objects(
    graph: PatchGraph, count: int | None, config: ObjectSegmentationConfig, start: Int[np.ndarray, " M"]
) -> tuple[np.ndarray, list[GraphCut]]:
    """Cut where it costs least until there are ``count`` objects, or until it costs too much."""
    instance = start.copy()
    groups = (np.flatnonzero(instance == k) for k in range(int(instance.max()) + 1))
    possible = {k: best_graph_cut(graph.only(own), config.narrowest) for k, own in enumerate(groups)}
    made: list[GraphCut] = []
    while count is None or len(possible) < count:
        scores = {k: found.score for k, found in possible.items() if found is not None}
        if not scores or len(possible) == MAX_OBJECTS:
            break
        k = min(scores, key=scores.__getitem__)
        if count is None and scores[k] >= config.apart:
            break
        found, own, new = possible[k], np.flatnonzero(instance == k), len(possible)
        assert found is not None
        made.append(found)
        instance[own[found.side]] = new
        for piece in (k, new):
            nodes = np.flatnonzero(instance == piece)
            possible[piece] = best_graph_cut(graph.only(nodes), config.narrowest)
    return instance, made


def _object_confidence(graph: PatchGraph, instance: np.ndarray) -> np.ndarray:
    same = instance[graph.first] == instance[graph.second]
    own, other = np.zeros(len(instance)), np.zeros(len(instance))
    for ends in (graph.first, graph.second):
        own += np.bincount(ends, graph.weight * same, len(instance))
        other += np.bincount(ends, graph.weight * ~same, len(instance))
    return np.where(own + other > 0, own / np.maximum(own + other, 1e-300), 1.0)


def _count_warnings(count: int | None, instance: np.ndarray, config: ObjectSegmentationConfig) -> list[str]:
    found = int(instance.max()) + 1
    if count is None:
        by = "where the scene is narrow, appearance and notches"
        if not config.apart:
            by = "the space between them; touching objects count as one"
        was = "was" if found == 1 else "were"
        return [f"The number of objects was not given: {found} {was} counted, by {by}. Give --count if it is known."]
    if found < count:
        return [f"{count} objects are to be found; there are points for {found} only."]
    return []


def _doubt_warnings(found: SurfacePatches, instance: np.ndarray, cuts: list[GraphCut]) -> list[str]:
    """Return where another answer is nearly as good, and where objects are too thin to be sure of."""
    doubts = []
    if any(made.other < DOUBTFUL_SCORE_RATIO * made.score for made in cuts):
        doubts.append("Another segmentation into objects is nearly as good as this one. Instance masks would decide.")
    thin = count_stacked_objects(found, instance)
    if thin:
        doubts.append(
            f"{thin} of the objects {'lies' if thin == 1 else 'lie'} flat on or under another and "
            f"{'is' if thin == 1 else 'are'} thin. Where such objects meet little is seen, and "
            "stacks of them are often segmented wrongly. Instance masks would decide."
        )
    return doubts

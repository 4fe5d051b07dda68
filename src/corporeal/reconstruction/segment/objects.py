"""Which points are one object, where objects touch.

Settled objects always touch, so that nearness does not segment them. What does: the surface
folds inwards where they meet, they look unlike, and the place where they meet is narrow. Points
become patches, patches a graph, and the graph is cut in two, again and again, until there are as
many objects as are known to be there.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from corporeal.core.errors import UserError
from corporeal.core.types import Cloud
from corporeal.multiview.local_shape import neighbours
from corporeal.reconstruction.segment.cut_proposals import Graph
from corporeal.reconstruction.segment.cuts import Cut, cut
from corporeal.reconstruction.segment.masks import agreement
from corporeal.reconstruction.segment.patches import (
    Borders,
    Patches,
    concavity,
    difference,
    joined,
    patches,
)
from corporeal.reconstruction.segment.reduce import reduced
from corporeal.reconstruction.segment.space import at_most
from corporeal.reconstruction.segment.stacks import stacked

LEAST_UNLIKE = 0.04
"""Least difference of appearance that counts, however much alike all is."""
LEAST_HELD = 1e-9
"""Of a border's weight: nothing is cut for nothing."""
DOUBTFUL = 1.3
"""Cuts whose scores differ by less than this factor are equally good."""
MOST = 200
"""Objects in one scene."""


@dataclass(frozen=True)
class ObjectsConfig:
    """How objects are segmented."""

    patches: int = 2000
    """Into which the points are cut, about."""
    unlike: float = 1.5
    """Difference of appearance at which two patches hold together by e^-1/2, over the scene's own
    root mean square difference between neighbours."""
    concave: float = 0.2
    """Inward fold at which two patches hold together by e^-1/2: roughly the sine of the angle."""
    disagreement: float = 0.3
    """Share of views that take two patches for two objects at which they hold together by
    e^-1/2."""
    narrowest: float = 0.003
    """Share of all borders that a cut counts for at least, so that crumbs are not cut off."""
    apart: float = 0.018
    """Score below which a cut is made where their number is unknown."""


DEFAULT = ObjectsConfig()
TOUCHING_IS_ONE = ObjectsConfig(apart=0.0)
"""Only space, or a number that is told, makes several objects."""


@dataclass(frozen=True)
class Split:
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


def objects(
    cloud: Cloud,
    count: int | None = None,
    normals: Float[np.ndarray, "N 3"] | None = None,
    masks: Int[np.ndarray, "V N"] | None = None,
    config: ObjectsConfig = DEFAULT,
    piece_of_point: Int[np.ndarray, " N"] | None = None,
) -> Split:
    """Segment objects that may touch.

    Args:
        cloud: Points with features; ``semantic`` decides, or ``structural`` where that is empty.
        count: How many objects there are, if known.
        normals: Unit, outward; None: found from the points, which is less sure.
        masks: What each view takes each point for, where somebody drew instance masks (see
            ``masks.lifted``); -1: unknown.
        config: How objects are segmented.
        piece_of_point: Which connected piece each is of, from 0, where somebody saw empty space
            between these; None: all may be one.

    Raises:
        UserError: There are no points, or more objects than can be.

    """
    _check(cloud, count)
    # Points become patches, and patches that meet a graph.
    appearance = reduced(cloud.semantic if cloud.semantic.shape[1] else cloud.structural)
    found, meeting = patches(cloud.position, appearance, normals, config.patches)
    borders = joined(found, meeting)
    # Patches hold together where they look alike and do not fold inwards, and where masks agree.
    held = _held(found, borders, config)
    if masks is not None:
        agreed = agreement(masks, found, borders)
        held = held * np.exp(-(((1 - agreed) / config.disagreement) ** 2) / 2)
    graph = Graph(
        borders.first,
        borders.second,
        borders.length * np.maximum(held, LEAST_HELD),
        borders.length,
        found.size.astype(np.float64),
        found.appearance.astype(np.float64),
    )
    # What has space between is apart already; the rest is cut where that costs least.
    start = np.zeros(len(found.size), np.int64)
    if piece_of_point is not None:
        start = _of_patches(at_most(piece_of_point, cloud.position, count), found)
    instance, cuts = _cut(graph, count, config, start)
    spaces = int(start.max()) + 1
    instance = _by_size(instance, found.size)
    return Split(
        instance[found.of_point],
        _confidence(graph, instance)[found.of_point],
        (*_counted(count, instance, config), *_doubts(found, instance, cuts)),
        _found_by(spaces, int(instance.max()) + 1, masks is not None),
    )


def _found_by(spaces: int, count: int, masks: bool) -> str:
    """Say by what objects were segmented, in a clause."""
    by = ["the space between them"] if spaces > 1 else []
    if count > spaces or count == 1:
        by += ["appearance and concavity", *(["instance masks"] if masks else [])]
    return " and ".join(by)


def _of_patches(of_point: Int[np.ndarray, " N"], found: Patches) -> Int[np.ndarray, " M"]:
    """Return what most points of each patch are of, numbered without gaps."""
    votes = np.zeros((len(found.size), int(of_point.max()) + 1))
    np.add.at(votes, (found.of_point, of_point), 1)
    return np.unique(votes.argmax(axis=1), return_inverse=True)[1]


def components(position: Float[np.ndarray, "N 3"], k: int = 20) -> Int[np.ndarray, " N"]:
    """Return the connected components of each point's k nearest: objects only where none touch.

    The rule of published pipelines; numbered by their points, most first.
    """
    near = neighbours(position, k + 1)[:, 1:]
    rows = np.repeat(np.arange(len(position)), near.shape[1])
    graph = csr_array(
        (np.ones(near.size, np.int8), (rows, near.ravel())), shape=(len(position),) * 2
    )
    return _by_size(connected_components(graph, directed=False)[1])


def _by_size(number: np.ndarray, size: np.ndarray | None = None) -> np.ndarray:
    """Return groups numbered anew, the largest first."""
    order = np.argsort(-np.bincount(number, size), kind="stable")
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    return rank[number]


def _check(cloud: Cloud, count: int | None) -> None:
    if not cloud.count:
        raise UserError("There are no points to find objects in. Check what the pictures show.")
    if count is not None and not 1 <= count <= min(MOST, cloud.count):
        raise UserError(
            f"{count} objects are to be found among {cloud.count} points. "
            f"Ask for 1 to {min(MOST, cloud.count)}."
        )


def _held(found: Patches, borders: Borders, config: ObjectsConfig) -> np.ndarray:
    """Return how well patches hold together: exp(-(difference / δ)² / 2 - (concavity / c)² / 2)."""
    unlike, fold = difference(found, borders), np.maximum(concavity(found, borders), 0)
    usual = np.sqrt(np.average(unlike**2, weights=borders.length)) if len(unlike) else 0.0
    scale = config.unlike * max(float(usual), LEAST_UNLIKE)
    return np.exp(-((unlike / scale) ** 2) / 2 - (fold / config.concave) ** 2 / 2)


def _cut(
    graph: Graph, count: int | None, config: ObjectsConfig, start: Int[np.ndarray, " M"]
) -> tuple[np.ndarray, list[Cut]]:
    """Cut where it costs least until there are ``count`` objects, or until it costs too much."""
    instance = start.copy()
    groups = (np.flatnonzero(instance == k) for k in range(int(instance.max()) + 1))
    possible = {k: cut(graph.only(own), config.narrowest) for k, own in enumerate(groups)}
    made: list[Cut] = []
    while count is None or len(possible) < count:
        scores = {k: found.score for k, found in possible.items() if found is not None}
        if not scores or len(possible) == MOST:
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
            possible[piece] = cut(graph.only(nodes), config.narrowest)
    return instance, made


def _confidence(graph: Graph, instance: np.ndarray) -> np.ndarray:
    same = instance[graph.first] == instance[graph.second]
    own, other = np.zeros(len(instance)), np.zeros(len(instance))
    for ends in (graph.first, graph.second):
        own += np.bincount(ends, graph.weight * same, len(instance))
        other += np.bincount(ends, graph.weight * ~same, len(instance))
    return np.where(own + other > 0, own / np.maximum(own + other, 1e-300), 1.0)


def _counted(count: int | None, instance: np.ndarray, config: ObjectsConfig) -> list[str]:
    found = int(instance.max()) + 1
    if count is None:
        by = "where the scene is narrow, appearance and notches"
        if not config.apart:
            by = "the space between them; what touches was taken for one"
        was = "was" if found == 1 else "were"
        return [
            f"The number of objects was not given: {found} {was} counted, by {by}. Say the number "
            "where it is known."
        ]
    if found < count:
        return [f"{count} objects are to be found; there are points for {found} only."]
    return []


def _doubts(found: Patches, instance: np.ndarray, cuts: list[Cut]) -> list[str]:
    """Say where another answer is nearly as good, and where objects are too thin to be sure of."""
    doubts = []
    if any(made.other < DOUBTFUL * made.score for made in cuts):
        doubts.append(
            "Another segmentation into objects is nearly as good as this one. Instance "
            "masks would decide."
        )
    thin = stacked(found, instance)
    if thin:
        doubts.append(
            f"{thin} of the objects {'lies' if thin == 1 else 'lie'} flat on or under another and "
            f"{'is' if thin == 1 else 'are'} thin. Where such objects meet little is seen, and "
            "stacks of them are often segmented wrongly. Instance masks would decide."
        )
    return doubts

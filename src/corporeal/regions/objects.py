"""Which points are one thing, where things touch.

Settled things always touch, so that nearness does not tell them apart. What does: the surface folds
inwards where they meet, they look unlike, and the place where they meet is narrow. Points become
patches, patches a graph, and the graph is cut in two, again and again, until there are as many
things as somebody counted.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from corporeal.errors import UserError
from corporeal.geometry.local_shape import neighbours
from corporeal.regions.cuts import Cut, Graph, cut
from corporeal.regions.patches import Borders, Patches, concavity, difference, joined, patches
from corporeal.regions.reduce import reduced
from corporeal.types import Cloud

LEAST_UNLIKE = 0.04
"""Differences of looks are told from this on, however much alike all is."""
MOST = 200
"""Things in one scene."""


@dataclass(frozen=True)
class ObjectsConfig:
    """How things are told apart."""

    patches: int = 2000
    """Into which the points are cut, about."""
    unlike: float = 1.5
    """Difference of looks at which two patches hold together by e^-1/2, over the scene's own root
    mean square difference between neighbours."""
    concave: float = 0.2
    """Inward fold at which two patches hold together by e^-1/2: roughly the sine of the angle."""
    narrowest: float = 0.003
    """Share of all borders that a cut counts for at least, so that crumbs are not cut off."""
    apart: float = 0.018
    """Score up to which a cut is made where nobody counted the things."""


DEFAULT = ObjectsConfig()


@dataclass(frozen=True)
class Split:
    """Which point belongs to which thing."""

    object_of_point: Int[np.ndarray, " N"]
    """0 … the number of things - 1, what has most points first."""
    confidence: Float[np.ndarray, " N"]
    """In [0, 1]: how much more a point's patch holds to its own thing than to others."""
    warnings: tuple[str, ...]
    """What a reader of the report should know, in sentences."""
    found_by: str
    """How things were told apart, in a clause."""


def objects(
    cloud: Cloud,
    count: int | None = None,
    normals: Float[np.ndarray, "N 3"] | None = None,
    config: ObjectsConfig = DEFAULT,
) -> Split:
    """Tell things apart that may touch.

    Args:
        cloud: Points with features; what they are, ``semantic``, decides.
        count: How many things there are, if somebody said so.
        normals: Unit, outward; None: found from the points.
        config: How things are told apart.

    Raises:
        UserError: There are no points, or more things than can be.

    """
    _check(cloud, count)
    look = reduced(cloud.semantic)
    found, meeting = patches(cloud.position, look, normals, config.patches)
    whole = joined(found, meeting)
    graph = _graph(found, whole, config)
    thing, _ = _cut(graph, count, config)
    order = np.argsort(-np.bincount(thing, found.size), kind="stable")
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    thing = rank[thing]
    return Split(
        thing[found.of_point],
        _confidence(graph, thing)[found.of_point],
        _warnings(count, len(order)),
        "superpoints cut by look and concavity",
    )


def components(position: Float[np.ndarray, "N 3"], k: int = 20) -> Int[np.ndarray, " N"]:
    """Return the connected components of each point's k nearest: things only where none touch.

    The rule of published pipelines; numbered by their points, most first.
    """
    near = neighbours(position, k + 1)[:, 1:]
    rows = np.repeat(np.arange(len(position)), near.shape[1])
    graph = csr_array(
        (np.ones(near.size, np.int8), (rows, near.ravel())), shape=(len(position),) * 2
    )
    piece = connected_components(graph, directed=False)[1]
    order = np.argsort(-np.bincount(piece), kind="stable")
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    return rank[piece]


def _check(cloud: Cloud, count: int | None) -> None:
    if not cloud.count:
        raise UserError("There are no points to find things in. Check what the pictures show.")
    if count is not None and not 1 <= count <= min(MOST, cloud.count):
        raise UserError(
            f"{count} things are to be found among {cloud.count} points. "
            f"Ask for 1 to {min(MOST, cloud.count)}."
        )


def _graph(found: Patches, borders: Borders, config: ObjectsConfig) -> Graph:
    """Weigh borders: w = length exp(-(difference / δ)² / 2 - (concavity / c)² / 2)."""
    unlike, fold = difference(found, borders), np.maximum(concavity(found, borders), 0)
    usual = np.sqrt(np.average(unlike**2, weights=borders.length)) if len(unlike) else 0.0
    scale = config.unlike * max(float(usual), LEAST_UNLIKE)
    holds = np.exp(-((unlike / scale) ** 2) / 2 - (fold / config.concave) ** 2 / 2)
    return Graph(
        borders.first,
        borders.second,
        borders.length * np.maximum(holds, 1e-9),
        borders.length,
        found.size.astype(np.float64),
        found.look.astype(np.float64),
    )


def _cut(graph: Graph, count: int | None, config: ObjectsConfig) -> tuple[np.ndarray, list[float]]:
    """Cut where it costs least until there are ``count`` things, or until it costs too much."""
    thing = np.zeros(len(graph.size), np.int64)
    open_cuts: dict[int, Cut | None] = {0: cut(graph, config.narrowest)}
    scores = []
    while count is None or len(open_cuts) < count:
        possible = {k: found.score for k, found in open_cuts.items() if found is not None}
        if not possible or len(open_cuts) == MOST:
            break
        k = min(possible, key=possible.__getitem__)
        if count is None and possible[k] > config.apart:
            break
        scores.append(possible[k])
        found, own = open_cuts[k], np.flatnonzero(thing == k)
        assert found is not None
        thing[own[found.side]] = new = len(open_cuts)
        for piece in (k, new):
            nodes = np.flatnonzero(thing == piece)
            open_cuts[piece] = cut(graph.only(nodes), config.narrowest)
    return thing, scores


def _confidence(graph: Graph, thing: np.ndarray) -> np.ndarray:
    same = thing[graph.first] == thing[graph.second]
    own, other = np.zeros(len(thing)), np.zeros(len(thing))
    for ends in (graph.first, graph.second):
        own += np.bincount(ends, graph.weight * same, len(thing))
        other += np.bincount(ends, graph.weight * ~same, len(thing))
    return np.where(own + other > 0, own / np.maximum(own + other, 1e-300), 1.0)


def _warnings(count: int | None, found: int) -> tuple[str, ...]:
    if count is None:
        return (
            f"Nobody said how many things there are: {found} were counted by where the scene is "
            "narrow. Say the number where it is known.",
        )
    return ()

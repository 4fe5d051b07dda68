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
from corporeal.regions.cuts import Cut, cut
from corporeal.regions.families import Graph
from corporeal.regions.masks import agreement
from corporeal.regions.patches import Borders, Patches, concavity, difference, joined, patches
from corporeal.regions.reduce import reduced
from corporeal.regions.space import with_space_between
from corporeal.regions.stacks import stacked
from corporeal.types import Cloud

LEAST_UNLIKE = 0.04
"""Differences of looks are told from this on, however much alike all is."""
LEAST_HELD = 1e-9
"""Of a border's weight: nothing is cut for nothing."""
DOUBTFUL = 1.3
"""Cuts whose scores differ by less than this factor are equally good."""
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
    disagreement: float = 0.3
    """Share of views that take two patches for two things at which they hold together by e^-1/2."""
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

    @property
    def statement(self) -> str:
        """What a reader of the report should know, in a sentence."""
        count = int(self.object_of_point.max()) + 1
        return f"{count} object{'s' * (count != 1)}, told apart by {self.found_by}."


def objects(
    cloud: Cloud,
    count: int | None = None,
    normals: Float[np.ndarray, "N 3"] | None = None,
    masks: Int[np.ndarray, "V N"] | None = None,
    config: ObjectsConfig = DEFAULT,
) -> Split:
    """Tell things apart that may touch.

    Args:
        cloud: Points with features; ``semantic`` decides, or ``structural`` where that is empty.
        count: How many things there are, if somebody said so.
        normals: Unit, outward; None: found from the points, which is less sure.
        masks: What each view takes each point for, where somebody drew instance masks (see
            ``masks.lifted``); -1: not said.
        config: How things are told apart.

    Raises:
        UserError: There are no points, or more things than can be.

    """
    _check(cloud, count)
    look = reduced(cloud.semantic if cloud.semantic.shape[1] else cloud.structural)
    found, meeting = patches(cloud.position, look, normals, config.patches)
    borders = joined(found, meeting)
    held = _held(found, borders, config)
    if masks is not None:
        said = agreement(masks, found, borders)
        held = held * np.exp(-(((1 - said) / config.disagreement) ** 2) / 2)
    graph = Graph(
        borders.first,
        borders.second,
        borders.length * np.maximum(held, LEAST_HELD),
        borders.length,
        found.size.astype(np.float64),
        found.look.astype(np.float64),
    )
    start = _of_patches(with_space_between(cloud.position, count), found)
    thing, cuts = _cut(graph, count, config, start)
    spaces = int(start.max()) + 1
    thing = _by_size(thing, found.size)
    return Split(
        thing[found.of_point],
        _confidence(graph, thing)[found.of_point],
        (*_counted(count, int(thing.max()) + 1), *_doubts(found, thing, cuts)),
        _told_by(spaces, int(thing.max()) + 1, masks is not None),
    )


def _told_by(spaces: int, things: int, masks: bool) -> str:
    """Say what told things apart, in a clause."""
    by = ["the space between them"] if spaces > 1 else []
    if things > spaces or things == 1:
        by += ["look and concavity", *(["instance masks"] if masks else [])]
    return " and ".join(by)


def _of_patches(of_point: Int[np.ndarray, " N"], found: Patches) -> Int[np.ndarray, " M"]:
    """Return what most points of each patch are of, numbered without gaps."""
    votes = np.zeros((len(found.size), int(of_point.max()) + 1))
    np.add.at(votes, (found.of_point, of_point), 1)
    return np.unique(votes.argmax(axis=1), return_inverse=True)[1]


def components(position: Float[np.ndarray, "N 3"], k: int = 20) -> Int[np.ndarray, " N"]:
    """Return the connected components of each point's k nearest: things only where none touch.

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
        raise UserError("There are no points to find things in. Check what the pictures show.")
    if count is not None and not 1 <= count <= min(MOST, cloud.count):
        raise UserError(
            f"{count} things are to be found among {cloud.count} points. "
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
    """Cut where it costs least until there are ``count`` things, or until it costs too much."""
    thing = start.copy()
    groups = (np.flatnonzero(thing == k) for k in range(int(thing.max()) + 1))
    possible = {k: cut(graph.only(own), config.narrowest) for k, own in enumerate(groups)}
    made: list[Cut] = []
    while count is None or len(possible) < count:
        scores = {k: found.score for k, found in possible.items() if found is not None}
        if not scores or len(possible) == MOST:
            break
        k = min(scores, key=scores.__getitem__)
        if count is None and scores[k] > config.apart:
            break
        found, own, new = possible[k], np.flatnonzero(thing == k), len(possible)
        assert found is not None
        made.append(found)
        thing[own[found.side]] = new
        for piece in (k, new):
            nodes = np.flatnonzero(thing == piece)
            possible[piece] = cut(graph.only(nodes), config.narrowest)
    return thing, made


def _confidence(graph: Graph, thing: np.ndarray) -> np.ndarray:
    same = thing[graph.first] == thing[graph.second]
    own, other = np.zeros(len(thing)), np.zeros(len(thing))
    for ends in (graph.first, graph.second):
        own += np.bincount(ends, graph.weight * same, len(thing))
        other += np.bincount(ends, graph.weight * ~same, len(thing))
    return np.where(own + other > 0, own / np.maximum(own + other, 1e-300), 1.0)


def _counted(count: int | None, found: int) -> list[str]:
    if count is None:
        return [
            f"Nobody said how many things there are: {found} were counted by where the scene is "
            "narrow, look and notches. Say the number where it is known."
        ]
    if found < count:
        return [f"{count} things are to be found; there are points for {found} only."]
    return []


def _doubts(found: Patches, thing: np.ndarray, cuts: list[Cut]) -> list[str]:
    """Say where another answer is nearly as good, and where things are too thin to be sure of."""
    told = []
    if any(made.other < DOUBTFUL * made.score for made in cuts):
        told.append(
            "Things could be told apart in quite another way that is nearly as good. Instance "
            "masks would decide."
        )
    thin = stacked(found, thing)
    if thin:
        told.append(
            f"{thin} of the things {'lies' if thin == 1 else 'lie'} flat on or under another and "
            f"{'is' if thin == 1 else 'are'} thin. Where such things meet little is seen, and "
            "stacks of them are often told apart wrongly. Instance masks would decide."
        )
    return told

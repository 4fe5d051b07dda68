"""Cut a graph in two where it is narrow and the halves are not too unequal.

    score = (cut / all + narrowest) (1 / A + 1 / (1 - A)) (1 - R²)²

cut: the weight of what is cut; all: the weight that nothing would have taken from; A: the share of
one side; R²: the share of the variance of looks that the sides explain. With the weights' degrees
for sizes and the first two factors' ``cut`` alone it is the normalised cut of Shi and Malik
("Normalized cuts and image segmentation", 2000), which would rather cut off a crumb that hangs by
nothing, and does not know that a table is brown and a cat is black. The sides are found as they do:
sorted by one of the first eigenvectors of the normalised weights, and cut at the best place.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import eigsh

VECTORS = 4
"""Eigenvectors that are tried beside the one that is the same everywhere."""
ANOTHER = 0.7
"""Cuts that overlap less, in the mean of both sides, are quite another."""
FEW = 60
"""Nodes of a graph for which all eigenvectors are found at once."""


@dataclass(frozen=True)
class Graph:
    """M nodes, E weighted pairs; in one piece."""

    first: Int[np.ndarray, " E"]
    second: Int[np.ndarray, " E"]
    weight: Float[np.ndarray, " E"]
    whole: Float[np.ndarray, " E"]
    """What the weight would be were there nothing against it."""
    size: Float[np.ndarray, " M"]
    look: Float[np.ndarray, "M C"]

    def only(self, nodes: Int[np.ndarray, " m"]) -> "Graph":
        """Return what some of the nodes make up, in their order."""
        number = np.full(len(self.size), -1)
        number[nodes] = np.arange(len(nodes))
        i, j = number[self.first], number[self.second]
        kept = (i >= 0) & (j >= 0)
        edges = i[kept], j[kept], self.weight[kept], self.whole[kept]
        return Graph(*edges, self.size[nodes], self.look[nodes])


@dataclass(frozen=True)
class Cut:
    """Two sides."""

    side: Bool[np.ndarray, " M"]
    score: float
    other: float
    """Best score of a cut that is quite another; inf: there is none."""


def cut(graph: Graph, narrowest: float) -> Cut | None:
    """Return the best cut in two; None where there is nothing to cut."""
    if len(graph.size) < 2:
        return None
    orders = [np.argsort(field, kind="stable") for field in _fields(graph)]
    scores = [_scores(graph, order, narrowest) for order in orders]
    best = int(np.argmin([s.min() for s in scores]))
    last = int(np.argmin(scores[best]))
    side = np.zeros(len(graph.size), bool)
    side[orders[best][: last + 1]] = True
    others = [
        np.min(s, where=_alike(graph, o, side) < ANOTHER, initial=np.inf)
        for s, o in zip(scores, orders, strict=True)
    ]
    return Cut(side, float(scores[best][last]), float(min(others)))


def _alike(graph: Graph, order: np.ndarray, side: np.ndarray) -> np.ndarray:
    """Return how much the cut between each two in the order is the one given: mean overlap.

    Mean over the sides of the intersection over the union with the side that fits.
    """
    size, total = graph.size[order], graph.size.sum()
    before, within = np.cumsum(size)[:-1], np.cumsum(size * side[order])[:-1]
    inside = graph.size[side].sum()

    def overlap(one: np.ndarray, two: float, both: np.ndarray) -> np.ndarray:
        first = both / (one + two - both)
        rest = total - one - two + both
        return (first + rest / (total - both)) / 2

    same = overlap(before, inside, within)
    return np.maximum(same, overlap(before, total - inside, before - within))


def _fields(graph: Graph) -> np.ndarray:
    """Return the first eigenvectors that are not the same everywhere, one a row."""
    i, j, count = graph.first, graph.second, len(graph.size)
    both = np.concatenate([i, j]), np.concatenate([j, i])
    weights = csr_array((np.tile(graph.weight, 2), both), shape=(count, count))
    root = 1 / np.sqrt(np.maximum(weights.sum(axis=1), 1e-300))
    scaled = diags_array(root) @ weights @ diags_array(root) + diags_array(np.ones(count))
    if count <= FEW:
        vectors = np.linalg.eigh(scaled.toarray())[1][:, ::-1][:, : VECTORS + 1]
    else:
        start = np.random.default_rng(0).uniform(0.5, 1.0, count)
        values, vectors = eigsh(scaled, k=VECTORS + 1, which="LA", v0=start)
        vectors = vectors[:, np.argsort(-values)]
    return (vectors[:, 1:] * root[:, None]).T


def _scores(graph: Graph, order: np.ndarray, narrowest: float) -> np.ndarray:
    """Return the score of cutting between each two in the order."""
    count = len(order)
    rank = np.empty(count, np.int64)
    rank[order] = np.arange(count)
    i, j = rank[graph.first], rank[graph.second]
    begins = np.bincount(np.minimum(i, j), graph.weight, count)
    ends = np.bincount(np.maximum(i, j), graph.weight, count)
    across = np.maximum(np.cumsum(begins - ends)[:-1], 0) / max(graph.whole.sum(), 1e-300)
    share = np.cumsum(graph.size[order])[:-1] / graph.size.sum()
    unequal = 1 / share + 1 / (1 - share)
    return (across + narrowest) * unequal * (1 - _explained(graph, order, unequal)) ** 2


def _explained(graph: Graph, order: np.ndarray, unequal: np.ndarray) -> np.ndarray:
    """Return R²: the share of the variance of looks that is between the sides, not within."""
    part = graph.size / graph.size.sum()
    look = graph.look - part @ graph.look
    variance = float(np.sum(part[:, None] * look**2))
    first = np.cumsum(part[order, None] * look[order], axis=0)[:-1]
    between = np.sum(first**2, axis=1) * unequal
    return np.minimum(between / max(variance, 1e-300), 1.0) if variance > 0 else 0 * between

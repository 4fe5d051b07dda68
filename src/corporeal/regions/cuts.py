"""Cut a graph in two where it is narrow and the halves are not too unequal.

    score = (cut / all + narrowest) (1 / A + 1 / (1 - A))

cut: the weight of what is cut; all: the weight that nothing would have taken from; A: the share of
one side. Without ``narrowest`` it is the normalised cut of Shi and Malik ("Normalized cuts and
image segmentation", 2000) with sizes for degrees, which would rather cut off a crumb that hangs by
nothing. The sides are found as they do: sorted by one of the first eigenvectors of the normalised
weights, and cut at the best place.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import eigsh

VECTORS = 4
"""Eigenvectors that are tried beside the one that is the same everywhere."""
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

    def only(self, nodes: Int[np.ndarray, " m"]) -> "Graph":
        """Return what some of the nodes make up, in their order."""
        number = np.full(len(self.size), -1)
        number[nodes] = np.arange(len(nodes))
        i, j = number[self.first], number[self.second]
        kept = (i >= 0) & (j >= 0)
        return Graph(i[kept], j[kept], self.weight[kept], self.whole[kept], self.size[nodes])


@dataclass(frozen=True)
class Cut:
    """Two sides."""

    side: Bool[np.ndarray, " M"]
    score: float


def cut(graph: Graph, narrowest: float) -> Cut | None:
    """Return the best cut in two; None where there is nothing to cut."""
    if len(graph.size) < 2:
        return None
    best = None
    for field in _fields(graph):
        order = np.argsort(field, kind="stable")
        scores = _scores(graph, order, narrowest)
        k = int(np.argmin(scores))
        if best is None or scores[k] < best.score:
            side = np.zeros(len(order), bool)
            side[order[: k + 1]] = True
            best = Cut(side, float(scores[k]))
    return best


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
    return (across + narrowest) * (1 / share + 1 / (1 - share))

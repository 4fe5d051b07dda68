"""Cut proposals: two sets of ways to cut a graph in two, ``SweepProposals`` and ``MergeTreeProposals``.

``SweepProposals``: nodes sorted by a number, cut between each two. ``MergeTreeProposals``: nodes merged pair by pair,
what holds best first, and each of what they merge into cut from the rest.
"""

import heapq
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from jaxtyping import Bool, Float, Int

MERGE_SIZE_POWER = 0.5
"""Small objects merge sooner: their cost counts by this power of the smaller one's size."""


@dataclass(frozen=True)
class PatchGraph:
    """M nodes, E weighted pairs."""

    first: Int[np.ndarray, " E"]
    second: Int[np.ndarray, " E"]
    weight: Float[np.ndarray, " E"]
    whole: Float[np.ndarray, " E"]
    """What the weight would be were there nothing against it."""
    size: Float[np.ndarray, " M"]
    appearance: Float[np.ndarray, "M C"]

    def only(self, nodes: Int[np.ndarray, " m"]) -> "PatchGraph":
        """Return what some of the nodes make up, in their order."""
        number = np.full(len(self.size), -1)
        number[nodes] = np.arange(len(nodes))
        i, j = number[self.first], number[self.second]
        kept = (i >= 0) & (j >= 0)
        edges = i[kept], j[kept], self.weight[kept], self.whole[kept]
        return PatchGraph(*edges, self.size[nodes], self.appearance[nodes])


class CutProposals(Protocol):
    """Candidates 0 … K - 1, each a set of nodes."""

    def sums(self, values: Float[np.ndarray, "M C"]) -> Float[np.ndarray, "K C"]:
        """Return the sum of the nodes' values over each candidate."""
        ...

    def across(self) -> Float[np.ndarray, " K"]:
        """Return the weight between each candidate and the rest."""
        ...

    def side(self, candidate: int) -> Bool[np.ndarray, " M"]:
        """Return a candidate's nodes."""
        ...


class SweepProposals:
    """Nodes in an order, cut between each two."""

    def __init__(self, graph: PatchGraph, order: Int[np.ndarray, " M"]) -> None:
        self.order = order
        rank = np.empty(len(order), np.int64)
        rank[order] = np.arange(len(order))
        i, j = rank[graph.first], rank[graph.second]
        begins = np.bincount(np.minimum(i, j), graph.weight, len(order))
        ends = np.bincount(np.maximum(i, j), graph.weight, len(order))
        self._across = np.maximum(np.cumsum(begins - ends)[:-1], 0)

    def sums(self, values: np.ndarray) -> np.ndarray:
        """Return the sum over the nodes up to each place."""
        return np.cumsum(values[self.order], axis=0)[:-1]

    def across(self) -> np.ndarray:
        """Return the weight across each place."""
        return self._across

    def side(self, candidate: int) -> np.ndarray:
        """Return the nodes up to a place."""
        made = np.zeros(len(self.order), bool)
        made[self.order[: candidate + 1]] = True
        return made


class MergeTreeProposals:
    """What nodes merge into, neighbours at the least cost first.

    cost = (1 - weight / whole) min(size_i, size_j)^½, the first factor being the mean over their
    border (compare Felzenszwalb and Huttenlocher, "Efficient graph-based image segmentation",
    2004, where small regions also merge sooner).
    """

    def __init__(self, graph: PatchGraph) -> None:
        self.pairs, held = _merge_order(graph)
        self.leaves = len(graph.size)
        outward = np.bincount(graph.first, graph.weight, self.leaves)
        outward += np.bincount(graph.second, graph.weight, self.leaves)
        self._across = self._down(outward[:, None], -2 * np.array(held))[:, 0]

    def sums(self, values: np.ndarray) -> np.ndarray:
        """Return the sum over each merged group's nodes."""
        return self._down(values, np.zeros(len(self.pairs)))

    def across(self) -> np.ndarray:
        """Return the weight between each merged group and the rest."""
        return np.maximum(self._across, 0)

    def side(self, candidate: int) -> np.ndarray:
        """Return a merged group's nodes."""
        made, waiting = np.zeros(self.leaves, bool), [self.leaves + candidate]
        while waiting:
            node = waiting.pop()
            if node < self.leaves:
                made[node] = True
            else:
                waiting += self.pairs[node - self.leaves]
        return made

    def _down(self, values: np.ndarray, extra: np.ndarray) -> np.ndarray:
        """Add up from the leaves; the last group is everything, and no candidate."""
        total = np.concatenate([values, np.zeros((len(self.pairs), values.shape[1]))])
        for k, (a, b) in enumerate(self.pairs):
            total[self.leaves + k] = total[a] + total[b] + extra[k]
        return total[self.leaves : -1]


def _merge_order(graph: PatchGraph) -> tuple[list[tuple[int, int]], list[float]]:
    """Return which two groups merge, one after the other, and the weight between them."""
    count = len(graph.size)
    size = [*graph.size.tolist(), *[0.0] * count]
    near: list[dict[int, tuple[float, float]]] = [{} for _ in size]
    edges = (graph.first, graph.second, graph.weight, graph.whole)
    for i, j, weight, whole in zip(*(e.tolist() for e in edges), strict=True):
        near[i][j] = near[j][i] = (weight, whole)

    def entry(a: int, b: int) -> tuple[float, int, int]:
        weight, whole = near[a][b]
        return (1 - weight / whole) * min(size[a], size[b]) ** MERGE_SIZE_POWER, a, b

    heap = [entry(a, b) for a in range(count) for b in near[a] if a < b]
    heapq.heapify(heap)
    alive, pairs, held = set(range(count)), [], []
    while heap:
        _, a, b = heapq.heappop(heap)
        if a not in alive or b not in alive:
            continue
        held.append(near[a][b][0])
        new = _join_groups(near, a, b, count + len(pairs))
        size[new] = size[a] + size[b]
        pairs.append((a, b))
        alive -= {a, b}
        alive.add(new)
        for other in near[new]:
            heapq.heappush(heap, entry(other, new))
    apart = sorted(alive)  # what is in several pieces is joined by nothing
    while len(apart) > 1:
        pairs.append((apart.pop(), apart.pop()))
        held.append(0.0)
        apart.append(count + len(pairs) - 1)
    return pairs, held


def _join_groups(near: list[dict[int, tuple[float, float]]], a: int, b: int, new: int) -> int:
    """Give two groups' neighbours to a new one."""
    more, less = (near[a], near[b]) if len(near[a]) >= len(near[b]) else (near[b], near[a])
    for other, (weight, whole) in less.items():
        known = more.get(other, (0.0, 0.0))
        more[other] = (known[0] + weight, known[1] + whole)
    more.pop(a, None)
    more.pop(b, None)
    for other, border in more.items():
        near[other].pop(a, None)
        near[other].pop(b, None)
        near[other][new] = border
    near[new], near[a], near[b] = more, {}, {}
    return new

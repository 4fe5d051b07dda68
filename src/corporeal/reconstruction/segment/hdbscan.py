"""Density-based clustering (HDBSCAN).

Campello, Moulavi and Sander, "Density-based clustering based on hierarchical density estimates" (PAKDD 2013). For a few
thousand points: all distances are held at once.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial.distance import pdist, squareform

NOISE_LABEL = -1
ClusterSelection = Literal["mass", "leaf"]


@dataclass(frozen=True)
class DenseClusters:
    """Which point belongs to which cluster; N points."""

    cluster_of_point: Int[np.ndarray, " N"]
    """-1: noise."""
    strength: Float[np.ndarray, " N"]
    """How far inside its cluster: 1 at its densest, 0 for noise."""


@dataclass
class _CondensedTree:
    """Clusters of the condensed tree, parents before children; the first is everything."""

    parent: list[int]
    birth: list[float]
    """λ = 1 / distance at which a cluster splits off."""
    mass: list[float]
    """Excess of mass: Σ over its points of λ at which they leave less λ at birth."""
    left: Float[np.ndarray, " N"]
    """λ at which each point leaves the last cluster that it is in."""
    last: Int[np.ndarray, " N"]
    """That cluster."""

    def children(self, cluster: int) -> list[int]:
        return [c for c, p in enumerate(self.parent) if p == cluster]


def hdbscan(
    points: Float[np.ndarray, "N D"], smallest: int = 20, samples: int = 5, selection: ClusterSelection = "mass"
) -> DenseClusters:
    """Find dense clusters. Everything is never one cluster; where nothing parts, all is noise.

    Args:
        points: In any space where Euclid's distance means something; at most a few thousand.
        smallest: Number of points that make a cluster.
        samples: A point is in a dense place where this many, itself included, are near.
        selection: The clusters that persist longest over all densities ("mass"), or the finest
            ones ("leaf").
    """
    if len(points) < 2:
        return DenseClusters(np.full(len(points), NOISE_LABEL), np.zeros(len(points)))
    tree = _condense_tree(_single_linkage(points, samples), len(points), smallest)
    chosen = _leaf_clusters(tree) if selection == "leaf" else _clusters_of_most_mass(tree)
    return _label_points(tree, chosen)


def _single_linkage(points: np.ndarray, samples: int) -> np.ndarray:
    """Return the single-linkage merges of mutual reachability: two nodes, distance, size."""
    from scipy.cluster.hierarchy import linkage  # models are never divided by clusters

    apart = squareform(pdist(points.astype(np.float64)))
    nth = min(samples, len(points)) - 1
    core = np.partition(apart, nth, axis=1)[:, nth]
    reach = np.maximum(apart, np.maximum(core[:, None], core[None]))
    np.fill_diagonal(reach, 0)
    return linkage(squareform(reach, checks=False), "single")


def _condense_tree(merges: np.ndarray, count: int, smallest: int) -> _CondensedTree:
    """Walk the merges from the top: only splits into two large halves make clusters."""
    members = _members_of_nodes(merges, count)
    tree = _CondensedTree([-1], [0.0], [0.0], np.zeros(count), np.zeros(count, np.int64))
    at = [(len(members) - 1, 0)]
    while at:
        node, cluster = at.pop()
        if node < count:
            continue
        *halves, distance, _ = merges[node - count]
        density = 1 / max(distance, 1e-12)
        large = [int(h) for h in halves if len(members[int(h)]) >= smallest]
        staying = len(members[large[0]]) if len(large) == 1 else 0
        tree.mass[cluster] += (len(members[node]) - staying) * (density - tree.birth[cluster])
        rows = members[node] if not large else _small_half(members, halves, large)
        tree.left[rows], tree.last[rows] = density, cluster
        at += [(h, _add_cluster(tree, cluster, density) if len(large) == 2 else cluster) for h in large]
    return tree


def _members_of_nodes(merges: np.ndarray, count: int) -> list[np.ndarray]:
    """Return the points below every node: slices of one order, in which each node is a run."""
    start, size = np.zeros(2 * count - 1, np.int64), np.ones(2 * count - 1, np.int64)
    size[count:] = merges[:, 3].astype(np.int64)
    for k in range(len(merges) - 1, -1, -1):
        a, b = merges[k, :2].astype(np.int64)
        start[a], start[b] = start[count + k], start[count + k] + size[a]
    order = np.argsort(start[:count])
    return [order[s : s + n] for s, n in zip(start, size, strict=True)]


def _small_half(members: list[np.ndarray], halves: list[float], large: list[int]) -> np.ndarray:
    """Return the points of the half that is too small to go on; none where both are large."""
    rest = [members[int(h)] for h in halves if int(h) not in large]
    return np.concatenate(rest) if rest else np.zeros(0, np.int64)


def _add_cluster(tree: _CondensedTree, parent: int, density: float) -> int:
    tree.parent.append(parent)
    tree.birth.append(density)
    tree.mass.append(0.0)
    return len(tree.parent) - 1


def _leaf_clusters(tree: _CondensedTree) -> list[int]:
    return sorted(set(range(1, len(tree.parent))) - set(tree.parent))


def _clusters_of_most_mass(tree: _CondensedTree) -> list[int]:
    """Choose clusters, none inside another, with the most excess of mass in sum."""
    best, chosen = list(tree.mass), {k: [k] for k in range(len(tree.parent))}
    for k in range(len(tree.parent) - 1, -1, -1):
        below = tree.children(k)
        inside = sum(best[c] for c in below)
        if below and (k == 0 or inside > tree.mass[k]):
            best[k] = inside
            chosen[k] = [leaf for c in below for leaf in chosen[c]]
    return sorted(set(chosen[0]) - {0})


def _label_points(tree: _CondensedTree, chosen: list[int]) -> DenseClusters:
    """Give each point the chosen cluster that it was last in, or was in above its last."""
    number = np.full(len(tree.parent), NOISE_LABEL)
    for k in range(len(tree.parent)):
        inherited = number[tree.parent[k]] if k else NOISE_LABEL
        number[k] = chosen.index(k) if k in chosen else inherited
    cluster = number[tree.last]
    strength = np.zeros(len(cluster))
    for k in range(len(chosen)):
        own = cluster == k
        strength[own] = tree.left[own] / tree.left[own].max()
    return DenseClusters(cluster, strength)

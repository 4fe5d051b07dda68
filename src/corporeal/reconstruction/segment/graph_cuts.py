"""Graph cuts by narrowness, difference of appearance and size.

    score = (cut / all + narrowest) (1 / A + 1 / (1 - A)) (1 - R²)²

cut: the weight of what is cut; all: the weight that nothing would have taken from; A: the share of one side; R²: the
share of the variance of appearance features that the sides explain. With the weights' degrees for sizes and the first
two factors' ``best_graph_cut`` alone it is the normalised cut of Shi and Malik ("Normalized cuts and image
segmentation", 2000), which would rather cut off a crumb that hangs by nothing, and does not know that a table is brown
and a cat is black. Sides are looked for as they do, sorted by the first eigenvectors of the normalised weights, and
among what merges first.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.linalg import eigsh

from corporeal.reconstruction.segment.cut_proposals import CutProposals, MergeTreeProposals, PatchGraph, SweepProposals

TRIED_EIGENVECTORS = 4
"""Eigenvectors that are tried beside the one that is the same everywhere."""
MAX_SAME_CUT_OVERLAP = 0.7
"""Cuts that overlap less, in the mean of both sides, are quite another."""
MIN_APPEARANCE_VARIANCE = 1e-3
"""Least variance of appearance features that counts: uniform points are not segmented by noise."""
EIGENVALUE_SHIFT = 2 + 1e-6
"""A little more than the largest eigenvalue."""
MAX_DENSE_NODES = 60
"""Nodes of a graph for which all eigenvectors are found at once."""


@dataclass(frozen=True)
class GraphCut:
    """Two sides."""

    side: Bool[np.ndarray, " M"]
    score: float
    other: float
    """Best score of a cut that is quite another; inf: there is none."""


def best_graph_cut(graph: PatchGraph, narrowest: float) -> GraphCut | None:
    """Return the best cut in two; None where there is nothing to cut."""
    if len(graph.size) < 2:
        return None
    families: list[CutProposals] = [SweepProposals(graph, np.argsort(f, kind="stable")) for f in _eigenvectors(graph)]
    families.append(MergeTreeProposals(graph))
    scores = [_cut_scores(graph, proposals, narrowest) for proposals in families]
    best = int(np.argmin([s.min(initial=np.inf) for s in scores]))
    last = int(np.argmin(scores[best]))
    side = families[best].side(last)
    others = [
        np.min(s, where=_cut_similarity(graph, f, side) < MAX_SAME_CUT_OVERLAP, initial=np.inf)
        for s, f in zip(scores, families, strict=True)
    ]
    return GraphCut(side, float(scores[best][last]), float(min(others)))


def _eigenvectors(graph: PatchGraph) -> np.ndarray:
    """Return the first eigenvectors that are not the same everywhere, one a row."""
    i, j, count = graph.first, graph.second, len(graph.size)
    both = np.concatenate([i, j]), np.concatenate([j, i])
    weights = csr_array((np.tile(graph.weight, 2), both), shape=(count, count))
    root = 1 / np.sqrt(np.maximum(weights.sum(axis=1), 1e-300))
    scaled = diags_array(root) @ weights @ diags_array(root) + diags_array(np.ones(count))
    if count <= MAX_DENSE_NODES:
        vectors = np.linalg.eigh(scaled.toarray())[1][:, ::-1][:, : TRIED_EIGENVECTORS + 1]
    else:
        start = np.random.default_rng(0).uniform(0.5, 1.0, count)
        # Inverted about a place above all eigenvalues, which are 2 at most: those of pieces that hang by next to
        # nothing are nearly the same, and are not found otherwise.
        values, vectors = eigsh(csc_array(scaled), k=TRIED_EIGENVECTORS + 1, sigma=EIGENVALUE_SHIFT, v0=start)
        vectors = vectors[:, np.argsort(-values)]
    return (vectors[:, 1:] * root[:, None]).T


def _cut_scores(graph: PatchGraph, proposals: CutProposals, narrowest: float) -> Float[np.ndarray, " K"]:
    part = graph.size / graph.size.sum()
    share = np.clip(proposals.sums(part[:, None])[:, 0], 1e-9, 1 - 1e-9)
    unequal = 1 / share + 1 / (1 - share)
    across = proposals.across() / max(graph.whole.sum(), 1e-300)
    explained = _explained_variance(graph.appearance, part, proposals) * unequal
    return (across + narrowest) * unequal * (1 - np.minimum(explained, 1)) ** 2


def _explained_variance(appearance: np.ndarray, part: np.ndarray, proposals: CutProposals) -> np.ndarray:
    """Return A (1 - A) R², R² the share of the variance of appearance between the sides."""
    away = appearance - part @ appearance
    variance = max(float(np.sum(part[:, None] * away**2)), MIN_APPEARANCE_VARIANCE)
    return np.sum(proposals.sums(part[:, None] * away) ** 2, axis=1) / variance


def _cut_similarity(graph: PatchGraph, proposals: CutProposals, side: np.ndarray) -> Float[np.ndarray, " K"]:
    """Return how much each candidate is the cut given.

    Mean over the sides of the intersection over the union with the side that fits.
    """
    total, inside = graph.size.sum(), graph.size[side].sum()
    before, within = proposals.sums(np.stack([graph.size, graph.size * side], axis=1)).T

    def overlap(other: float, both: np.ndarray) -> np.ndarray:
        first = both / (before + other - both)
        rest = (total - before - other + both) / (total - both)
        return (first + rest) / 2

    return np.maximum(overlap(inside, within), overlap(total - inside, before - within))

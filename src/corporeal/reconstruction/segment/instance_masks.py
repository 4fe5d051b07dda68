"""Lifting of instance masks to points.

Numbers need not mean the same from view to view: what counts is whether two points have one number where both are seen.
Some views take two objects for one, some take one for several; over all views, what belongs together mostly has one
number.
"""

from collections.abc import Callable, Sequence
from typing import cast

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import csr_array

from corporeal.core.errors import UserError
from corporeal.reconstruction.segment.patch_graph import PatchBorders, SurfacePatches

COMPARED_POINTS = 10_000
"""Points by which masks of two views are compared, about."""
MIN_SHARED_POINTS_FRACTION = 0.5
"""Share of points from which on masks of two views show one instance."""


def lift_labels(
    weights: Callable[[int], csr_array], labels: Sequence[Int[np.ndarray, "H W"]], count: int
) -> Int[np.ndarray, "V N"]:
    """Return the label that most of each point's weight falls on in each view; -1: none.

    Args:
        weights: View → how much each pixel (columns, row by row) belongs to each point (rows).
        labels: Of each view, the instance that each pixel shows; -1: none.
        count: Number of points N.

    Raises:
        UserError: A view's labels and weights are of different sizes.
    """
    made = np.full((len(labels), count), -1, np.int64)
    for view, label in enumerate(labels):
        share, flat = weights(view), np.asarray(label).ravel()
        points, pixels = cast("tuple[int, int]", share.shape)
        if (points, pixels) != (count, len(flat)):
            raise UserError(
                f"View {view}'s mask has {' x '.join(map(str, np.shape(label)))} pixels; its "
                f"weights are of {points} points and {pixels} pixels, for {count} points. Make "
                "masks as large as the pictures."
            )
        known, number = np.unique(flat, return_inverse=True)
        votes = share @ np.eye(len(known))[number.ravel()]
        made[view] = np.where(votes.any(axis=1), known[votes.argmax(axis=1)], -1)
    return made


def renumber_labels(label_of_point: Int[np.ndarray, "V N"]) -> Int[np.ndarray, "V N"]:
    """Return labels that mean the same in all views, where masks of two views show one instance.

    Two masks do where they share more than half of the points that either has, of those that both views see: then no
    third shares as many with either. What is matched in that way, directly or through others, gets one number, pairs
    that share most points first; but no two masks of one view, whose drawer says that they are two objects. So a false
    match, where two views see only a rim in common, joins nothing that other views tell apart.
    """
    known, node = np.unique(_separate_labels(label_of_point), return_inverse=True)
    nodes = node.reshape(label_of_point.shape)
    nodes, first = nodes - (known[0] < 0), int(known[0] < 0)
    few = nodes[:, :: max(1, nodes.shape[1] // COMPARED_POINTS)]
    pairs = [_matching_labels(few[v], few[w]) for v in range(len(nodes)) for w in range(v)]
    number = np.arange(len(known) - first)
    seen_in = {int(k): {v} for v, view in enumerate(nodes) for k in np.unique(view[view >= 0])}
    found = np.concatenate([np.zeros((0, 3), np.int64), *pairs])
    for i, j, _ in found[np.argsort(-found[:, 2], kind="stable")]:
        one, other = int(number[i]), int(number[j])
        if one != other and not seen_in[one] & seen_in[other]:
            number[number == other] = one
            seen_in[one] |= seen_in.pop(other)
    return np.where(nodes < 0, -1, number[nodes])


def _separate_labels(label_of_point: np.ndarray) -> np.ndarray:
    """Return labels of which no two views share one; -1 stays."""
    most = int(label_of_point.max(initial=0)) + 1
    own = np.arange(len(label_of_point), dtype=np.int64)[:, None] * most
    return np.where(label_of_point < 0, -1, label_of_point + own)


def _matching_labels(a: np.ndarray, b: np.ndarray) -> Int[np.ndarray, "K 3"]:
    """Return pairs of labels that share most of their points, and how many; -1 is no label."""
    both = (a >= 0) & (b >= 0)
    first, i = np.unique(a[both], return_inverse=True)
    second, j = np.unique(b[both], return_inverse=True)
    shared = np.zeros((len(first), len(second)))
    np.add.at(shared, (i, j), 1)
    either = shared.sum(axis=1, keepdims=True) + shared.sum(axis=0) - shared
    x, y = np.nonzero(shared > MIN_SHARED_POINTS_FRACTION * np.maximum(either, 1))
    return np.stack([first[x], second[y], shared[x, y].astype(np.int64)], axis=1)


def label_agreement(
    label_of_point: Int[np.ndarray, "V N"], found: SurfacePatches, borders: PatchBorders
) -> Float[np.ndarray, " E"]:
    """Return how often two patches that meet have one label where both are seen, in [0, 1].

    1 where no view shows both: none says that they are not one.
    """
    same, both = np.zeros(len(borders.first)), np.zeros(len(borders.first))
    for labels in label_of_point:
        shares = _label_fractions(labels, found)
        first, second = shares[borders.first], shares[borders.second]
        same += np.asarray(first.multiply(second).sum(axis=1)).ravel()
        both += np.asarray(first.sum(axis=1) * second.sum(axis=1)).ravel()
    return np.where(both > 0, same / np.where(both > 0, both, 1), 1.0)


def _label_fractions(labels: np.ndarray, found: SurfacePatches) -> csr_array:
    """Return the share of each label among each patch's labelled points; patches without: 0."""
    seen = np.flatnonzero(labels >= 0)
    known, number = np.unique(labels[seen], return_inverse=True)
    shape = len(found.size), max(len(known), 1)
    counted = csr_array((np.ones(len(seen)), (found.of_point[seen], number)), shape=shape)
    total = np.asarray(counted.sum(axis=1)).ravel()
    return csr_array(counted.multiply(1 / np.maximum(total, 1)[:, None]))

"""Instance assignment: by masks, by appearance and concavity, or by the published rule."""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

from corporeal.core.errors import UserError
from corporeal.core.types import Cloud
from corporeal.io.photographs import NO_INSTANCES
from corporeal.reconstruction.segment.masks import renumbered
from corporeal.reconstruction.segment.objects import (
    DEFAULT,
    MOST,
    TOUCHING_IS_ONE,
    Split,
    components,
    objects,
)
from corporeal.reconstruction.segment.rule import Rule
from corporeal.reconstruction.segment.space import Space

SAME = 0.9
"""Share of what views say of points that must be one number each, for numbers to mean the same in
all views; two objects numbered at random in each view give 0.6."""
CRUMB = 0.003
"""Share of the points below which what masks or neighbours separate is no object."""
PUBLISHED = "the connected components of each point's 20 nearest, as published: a control"
NUMBERED = "instance masks, whose numbers mean the same in all pictures"
MATCHED = "instance masks, matched from picture to picture by the points that they share"


def assign_instances(
    cloud: Cloud,
    rule: Rule = "auto",
    count: int | None = None,
    normals: Float[np.ndarray, "N 3"] | None = None,
    masks: Int[np.ndarray, "V N"] | None = None,
    space: Space | None = None,
) -> Split:
    """Segment objects.

    Args:
        cloud: Points with features.
        rule: auto: by instance masks where there are any, else by appearance and concavity.
        count: How many objects there are, if known.
        normals: Unit, outward; None: found from the points.
        masks: What each view takes each point for; -1: unknown. None: nobody drew any.
        space: What space tells; where that alone does, appearance and concavity segment nothing
            that touches, unless the rule asks for it or ``count`` is given. None: nothing.

    Raises:
        UserError: Masks are asked for and there are none, there are no points, or more objects than
            can be.

    """
    if rule == "components":
        return _by_neighbours(cloud, count)
    if rule == "masks" and masks is None:
        raise UserError(NO_INSTANCES)
    pieces = None if space is None else space.piece_of_point
    if masks is None or rule == "look":
        whole = space is not None and space.alone and rule == "auto"
        config = TOUCHING_IS_ONE if whole else DEFAULT
        return objects(cloud, count, normals, config=config, piece_of_point=pieces)
    named = by_numbers(cloud, masks, count, NUMBERED)
    named = named or by_numbers(cloud, renumbered(masks), count, MATCHED)
    return named or _by_masks(cloud, masks, count, normals, pieces)


def by_numbers(
    cloud: Cloud, masks: Int[np.ndarray, "V N"], count: int | None, found_by: str
) -> Split | None:
    """Give each point the number that most views give it; None: numbers differ between views.

    What no view says anything of goes with the nearest that some view does.

    Args:
        cloud: Points.
        masks: What each view takes each point for; -1: unknown.
        count: How many objects there are, if known.
        found_by: What the numbers are, in a clause.

    """
    known, number = np.unique(masks, return_inverse=True)
    votes = np.zeros((cloud.count, len(known)), np.int64)
    for view in number.reshape(masks.shape):
        votes[np.arange(cloud.count), view] += 1
    votes = votes[:, known >= 0]
    best, total = votes.max(axis=1, initial=0), votes.sum(axis=1)
    if not total.any() or best.sum() < SAME * total.sum():
        return None
    sure = np.where(total > 0, best / np.maximum(total, 1), 0.0)
    owner = _without_crumbs(cloud, np.where(total > 0, votes.argmax(axis=1), -1))
    return Split(owner, sure, tuple(_otherwise(count, owner, "instance masks")), found_by)


def _by_masks(
    cloud: Cloud,
    masks: Int[np.ndarray, "V N"],
    count: int | None,
    normals: Float[np.ndarray, "N 3"] | None,
    pieces: Int[np.ndarray, " N"] | None,
) -> Split:
    """Let masks whose numbers differ from view to view say where patches hold together."""
    seen = max((len(np.unique(view[view >= 0])) for view in masks), default=0)
    most = min(seen, MOST, cloud.count) or None
    return objects(cloud, count or most, normals, masks, piece_of_point=pieces)


def _by_neighbours(cloud: Cloud, count: int | None) -> Split:
    owner = _without_crumbs(cloud, components(cloud.position))
    doubts = tuple(_otherwise(count, owner, "nearest neighbours"))
    return Split(owner, np.ones(cloud.count), doubts, PUBLISHED)


def _without_crumbs(cloud: Cloud, number: Int[np.ndarray, " N"]) -> Int[np.ndarray, " N"]:
    """Return objects from 0, what has most points first; crumbs and -1 go with what is nearest."""
    known, index, sizes = np.unique(number, return_inverse=True, return_counts=True)
    sizes = np.where(known < 0, 0, sizes)
    kept = [k for k in np.argsort(-sizes, kind="stable") if sizes[k] >= CRUMB * cloud.count]
    rank = np.full(len(known), -1, np.int64)
    rank[kept] = np.arange(len(kept))
    owner = rank[index]
    own, rest = np.flatnonzero(owner >= 0), np.flatnonzero(owner < 0)
    if len(rest):
        nearest = np.asarray(KDTree(cloud.position[own]).query(cloud.position[rest])[1])
        owner[rest] = owner[own[nearest]]
    return owner


def _otherwise(count: int | None, owner: Int[np.ndarray, " N"], who: str) -> list[str]:
    found = int(owner.max()) + 1
    if count is None or count == found:
        return []
    return [f"{count} objects were named or counted, but {who} show {found}: these were kept."]

"""Instance assignment: by masks, by appearance and concavity, or by the published rule."""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import KDTree

from corporeal.core.errors import UserError
from corporeal.core.types import FeatureCloud
from corporeal.io.photos.posed_photos import NO_INSTANCES_MESSAGE
from corporeal.reconstruction.reconstruct_config import SegmentationRule
from corporeal.reconstruction.segment.instance_masks import renumber_labels
from corporeal.reconstruction.segment.object_segmentation import (
    DEFAULT_OBJECT_SEGMENTATION,
    MAX_OBJECTS,
    TOUCHING_IS_ONE_CONFIG,
    ObjectSegmentation,
    SpacePieces,
    nearest_neighbour_components,
    segment_objects,
)

MIN_SAME_NUMBER_FRACTION = 0.9
"""Share of what views say of points that must be one number each, for numbers to mean the same in all views; two
objects numbered at random in each view give 0.6."""
MIN_OBJECT_POINTS_FRACTION = 0.003
"""Share of the points below which what masks or neighbours separate is no object."""
FOUND_BY_PUBLISHED_RULE = "the connected components of each point's 20 nearest, as published: a control"
FOUND_BY_NUMBERS = "instance masks, whose numbers mean the same in all pictures"
FOUND_BY_MATCHED_MASKS = "instance masks, matched from picture to picture by the points that they share"


def assign_instances(
    cloud: FeatureCloud,
    rule: SegmentationRule = "auto",
    count: int | None = None,
    normals: Float[np.ndarray, "N 3"] | None = None,
    masks: Int[np.ndarray, "V N"] | None = None,
    space: SpacePieces | None = None,
) -> ObjectSegmentation:
    """Segment objects.

    Args:
        cloud: Points with features.
        rule: auto: by instance masks where there are any, else by appearance and concavity.
        count: How many objects there are, if known.
        normals: Unit, outward; None: found from the points.
        masks: What each view takes each point for; -1: unknown. None: there are none.
        space: What space tells; where that alone does, appearance and concavity segment nothing that touches, unless
            the rule asks for it or ``count`` is given. None: nothing.

    Raises:
        UserError: Masks are asked for and there are none, there are no points, or more objects than can be.
    """
    if rule == "components":
        return _assign_by_neighbours(cloud, count)
    if rule == "masks" and masks is None:
        raise UserError(NO_INSTANCES_MESSAGE)
    pieces = None if space is None else space.piece_of_point
    if masks is None or rule == "look":
        whole = space is not None and space.alone and rule == "auto"
        config = TOUCHING_IS_ONE_CONFIG if whole else DEFAULT_OBJECT_SEGMENTATION
        return segment_objects(cloud, count, normals, config=config, piece_of_point=pieces)
    named = assign_by_numbers(cloud, masks, count, FOUND_BY_NUMBERS)
    named = named or assign_by_numbers(cloud, renumber_labels(masks), count, FOUND_BY_MATCHED_MASKS)
    return named or _assign_by_masks(cloud, masks, count, normals, pieces)


def assign_by_numbers(
    cloud: FeatureCloud, masks: Int[np.ndarray, "V N"], count: int | None, found_by: str
) -> ObjectSegmentation | None:
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
    if not total.any() or best.sum() < MIN_SAME_NUMBER_FRACTION * total.sum():
        return None
    sure = np.where(total > 0, best / np.maximum(total, 1), 0.0)
    owner = _without_crumbs(cloud, np.where(total > 0, votes.argmax(axis=1), -1))
    return ObjectSegmentation(owner, sure, tuple(_other_count_warnings(count, owner, "instance masks")), found_by)


def _assign_by_masks(
    cloud: FeatureCloud,
    masks: Int[np.ndarray, "V N"],
    count: int | None,
    normals: Float[np.ndarray, "N 3"] | None,
    pieces: Int[np.ndarray, " N"] | None,
) -> ObjectSegmentation:
    """Let masks whose numbers differ from view to view say where patches hold together."""
    seen = max((len(np.unique(view[view >= 0])) for view in masks), default=0)
    most = min(seen, MAX_OBJECTS, cloud.count) or None
    return segment_objects(cloud, count or most, normals, masks, piece_of_point=pieces)


def _assign_by_neighbours(cloud: FeatureCloud, count: int | None) -> ObjectSegmentation:
    owner = _without_crumbs(cloud, nearest_neighbour_components(cloud.position))
    doubts = tuple(_other_count_warnings(count, owner, "nearest neighbours"))
    return ObjectSegmentation(owner, np.ones(cloud.count), doubts, FOUND_BY_PUBLISHED_RULE)


def _without_crumbs(cloud: FeatureCloud, number: Int[np.ndarray, " N"]) -> Int[np.ndarray, " N"]:
    """Return objects from 0, what has most points first; crumbs and -1 go with what is nearest."""
    known, index, sizes = np.unique(number, return_inverse=True, return_counts=True)
    sizes = np.where(known < 0, 0, sizes)
    kept = [k for k in np.argsort(-sizes, kind="stable") if sizes[k] >= MIN_OBJECT_POINTS_FRACTION * cloud.count]
    rank = np.full(len(known), -1, np.int64)
    rank[kept] = np.arange(len(kept))
    owner = rank[index]
    own, rest = np.flatnonzero(owner >= 0), np.flatnonzero(owner < 0)
    if len(rest):
        nearest = np.asarray(KDTree(cloud.position[own]).query(cloud.position[rest])[1])
        owner[rest] = owner[own[nearest]]
    return owner


def _other_count_warnings(count: int | None, owner: Int[np.ndarray, " N"], who: str) -> list[str]:
    found = int(owner.max()) + 1
    if count is None or count == found:
        return []
    return [f"{count} objects were named or counted, but {who} show {found}: these were kept."]

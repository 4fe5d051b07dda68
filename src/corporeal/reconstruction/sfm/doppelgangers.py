"""Detection of wrong registrations of similar sides (doppelgangers).

Two sides of an object that look alike, such as those of a block, are taken for one: the pictures of
one side are put among those of the other, by points on the object alone, with a low reprojection
error. But from one place one floor is seen. So where two pictures from nearly one direction
share points in a part only of what both show, they are not from there: what is missing tells
(Zach, Irschara and Bischof, "What can missing correspondences tell us about 3D structure and
motion?", CVPR 2008).

Detection of mirrored photographs of front cameras.

A printed sheet that is seen in a mirror is a sheet that is seen from below: both fit one model, with a low reprojection
error, half of its cameras under the floor and what stands on it there twice. But no camera sees one point of a surface
from both of its sides.
"""

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from corporeal.io.photos.colmap import ColmapModel, read_colmap
from corporeal.reconstruction.sfm.pose_acceptance import MIN_POINTS_PER_PICTURE, model_doubts, only_sparse
from corporeal.reconstruction.sfm.prepare_images import PreparedImages
from corporeal.reconstruction.sfm.sfm_run import MIN_REGISTERED_FRACTION, SfmRun, pairs_to_match, remove_pictures

PLANE_SAMPLES = 300
"""Planes through three points that are tried."""
ON_PLANE_FRACTION = 0.01
"""Distance from a plane of what is on it, in the cameras' distance from the points' middle."""
MIN_POINTS_BOTH_SIDES = 30
"""Points on it that both sides see."""
MIN_BOTH_SIDES_FRACTION = 0.1
"""Of all points on it, how many these must be: .33 where half of the pictures are mirrored, .03 for a thin axe head
that was turned over, 0 for twenty other sets."""
ONE_CAMERA_HINT = (
    "Take all with one camera, and no mirrored pictures of a phone's front camera; or turn "
    "those back that are mirrored."
)


def describe_mirrored(model: ColmapModel) -> str | None:
    """Return in a clause that cameras stand on both sides of what they all see, if they do."""
    if len(model.points) < MIN_POINTS_BOTH_SIDES or not len(model.sightings):
        return None
    eyes = np.stack([image.world_from_camera[:3, 3] for image in model.images])
    away = float(np.median(np.linalg.norm(eyes - np.median(model.points, axis=0), axis=1)))
    normal, offset = _dominant_plane(model.points, ON_PLANE_FRACTION * away)
    on_plane = np.abs(model.points @ normal - offset) < ON_PLANE_FRACTION * away
    above = eyes @ normal > offset
    both = _points_seen_from(model, above) & _points_seen_from(model, ~above) & on_plane
    if both.sum() < max(MIN_POINTS_BOTH_SIDES, MIN_BOTH_SIDES_FRACTION * on_plane.sum()):
        return None
    sides = sorted((int(above.sum()), int((~above).sum())), reverse=True)
    return (
        f"{sides[0]} pictures would see one surface from one side and {sides[1]} the same points "
        "of it from the other: some of the pictures are mirrored"
    )


def _dominant_plane(points: Float[np.ndarray, "N 3"], near: float) -> tuple[Float[np.ndarray, "3"], float]:
    """Return normal and offset of the plane through three points that most are on."""
    rng = np.random.default_rng(0)
    corners = points[rng.integers(0, len(points), (PLANE_SAMPLES, 3))]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.maximum(length, np.finfo(float).tiny)
    offsets = (normals * corners[:, 0]).sum(axis=1)
    counts = [(np.abs(points @ n - d) < near).sum() for n, d in zip(normals, offsets, strict=True)]
    best = int(np.argmax(np.where(length[:, 0] > 0, counts, 0)))
    return normals[best], float(offsets[best])


def _points_seen_from(model: ColmapModel, which: Bool[np.ndarray, " V"]) -> Bool[np.ndarray, " N"]:
    """Return which points some of the images show."""
    seen = np.zeros(len(model.points), bool)
    seen[model.sightings[which[model.sightings[:, 0]], 1]] = True
    return seen


MAX_COMPARED_ANGLE_DEG = 18.0
"""Largest angle between the lines of sight of two pictures that are compared, the median [deg]. At 20° to 25° right
ones of a dark chair before a wall share points in .28 to .45 only."""
MIN_POINTS_WITHIN = 20
"""Points of a picture that must lie within the other."""
CELLS_ACROSS_PICTURE, MIN_POINTS_PER_CELL = 10, 3
"""Cells of a picture along each side; points without which a cell says nothing."""
NEUTRAL_COVERAGE = 0.55
"""Share of the cells in which neighbours share points, that is as likely of one place as of two that look alike: of
right poses of seven sets the median is .78 to 1 and the fifth percentile .58 to 1; five pictures of a block among those
of its other side have .4 to .5 in the median."""
MIN_DISAGREEING_PAIRS = 3
"""Neighbours that do not agree, without which two groups are taken for one place: a single picture may be smeared."""
MIN_MOVE_GAIN = 1e-9
"""Below it nothing is gained by moving a picture to another group."""


def remove_doppelgangers(attempt: SfmRun, place: Path, gathered: PreparedImages) -> SfmRun:
    """Take pictures that stand where they cannot out of a model; return what is left of it.

    Where these are too many, it is left as it is: an object that was turned over between two rounds on one card parts
    them as well, and masks can tell.

    Args:
        attempt: An attempt at the poses.
        place: Holds the model, which is changed.
        gathered: All pictures.
    """
    if model_doubts(attempt):
        return attempt
    order = gathered.names
    compared = [(order[a], order[b]) for a, b in pairs_to_match(gathered, attempt.way)]
    groups = doppelganger_groups(read_colmap(place), compared)
    misplaced = tuple(sorted(name for group in groups[1:] for name in group))
    if not misplaced:
        return attempt
    if len(groups[0]) < MIN_REGISTERED_FRACTION * attempt.registered:
        return replace(attempt, parted=tuple(len(group) for group in groups))
    registered, points = remove_pictures(place, misplaced)
    return replace(attempt, registered=registered, points=points, misplaced=misplaced)


def doppelganger_groups(model: ColmapModel, compared: Collection[tuple[str, str]]) -> tuple[tuple[str, ...], ...]:
    """Return groups of pictures that cannot all stand where a model puts them, the largest first.

    Args:
        model: With tracks. Without, or where all agree, there is one group.
        compared: Names of the pictures that were matched with one another, in either order.
    """
    names = [image.name for image in model.images]
    if not len(model.sightings):
        return (tuple(names),)
    groups = agreeing_groups(np.nan_to_num(_pair_agreement(model, compared)))
    return tuple(tuple(sorted(names[k] for k in group)) for group in groups)


def neighbours_support_model(attempt: SfmRun, place: Path, gathered: PreparedImages) -> bool:
    """Return whether neighbours speak for a model against which only is that its points are few.

    Many pictures of little that has a pattern share few points, of which each sees enough: what places it are those.
    That nothing contradicts is not enough: neighbours must agree, and join all that must be placed.
    """
    if not only_sparse(attempt):
        return False
    model, order = read_colmap(place), gathered.names
    if len(model.sightings) < MIN_POINTS_PER_PICTURE * len(model.images):
        return False
    compared = [(order[a], order[b]) for a, b in pairs_to_match(gathered, attempt.way)]
    agreed = _pair_agreement(model, compared)
    _, label = connected_components(csr_array(agreed > 0), directed=False)
    joined = int(np.bincount(label).max())
    return len(agreeing_groups(np.nan_to_num(agreed))) == 1 and joined >= MIN_REGISTERED_FRACTION * attempt.pictures


def _pair_agreement(model: ColmapModel, compared: Collection[tuple[str, str]]) -> Float[np.ndarray, "N N"]:
    """Return how far pairs speak for one place; NaN: they are no neighbours, or not compared."""
    names = [image.name for image in model.images]
    place = {name: k for k, name in enumerate(names)}
    known = np.zeros((len(names), len(names)), bool)
    for a, b in compared:
        if a in place and b in place:
            known[place[a], place[b]] = known[place[b], place[a]] = True
    return np.where(known, shared_coverage(model) - NEUTRAL_COVERAGE, np.nan)


def shared_coverage(model: ColmapModel) -> Float[np.ndarray, "N N"]:
    """Return in which share of what two pictures both show they share points; NaN: not neighbours.

    Of both ways the larger counts, since one of two may be blurred, or farther away.
    """
    seen = np.zeros((len(model.images), len(model.points)), bool)
    seen[model.sightings[:, 0], model.sightings[:, 1]] = True
    cell, sight = np.zeros(seen.shape, np.int64), np.zeros((*seen.shape, 3), np.float32)
    for k in range(len(model.images)):
        cell[k], sight[k] = _point_cells(model, k)
    made = np.full((len(seen), len(seen)), np.nan)
    for a, b in np.ndindex(made.shape):
        both = np.flatnonzero(seen[a] & (cell[a] >= 0) & (cell[b] >= 0))
        if a == b or len(both) < MIN_POINTS_WITHIN:
            continue
        cosine = np.median((sight[a, both] * sight[b, both]).sum(axis=1))
        if cosine < np.cos(np.radians(MAX_COMPARED_ANGLE_DEG)):
            continue
        there = np.bincount(cell[a, both], minlength=CELLS_ACROSS_PICTURE**2)
        shared = np.bincount(cell[a, both[seen[b, both]]], minlength=CELLS_ACROSS_PICTURE**2)
        if (there >= MIN_POINTS_PER_CELL).any():
            made[a, b] = (shared[there >= MIN_POINTS_PER_CELL] > 0).mean()
    return np.fmax(made, made.T)


def _point_cells(model: ColmapModel, k: int) -> tuple[np.ndarray, np.ndarray]:
    """Return in which cell of a picture each point lies (P,), −1: in none; and the way to it."""
    image = model.images[k]
    lens, pose = model.lens(image), image.world_from_camera
    away = model.points - pose[:3, 3]
    local = away @ pose[:3, :3]
    ahead = local[:, 2] > 0
    pixel = (local @ lens.K.T)[:, :2] / np.where(ahead, local[:, 2], 1)[:, None]
    at = np.floor(CELLS_ACROSS_PICTURE * pixel / [lens.width, lens.height]).astype(np.int64)
    inside = ahead & ((at >= 0) & (at < CELLS_ACROSS_PICTURE)).all(axis=1)
    cell = np.where(inside, CELLS_ACROSS_PICTURE * at[:, 0] + at[:, 1], -1)
    return cell, away / np.linalg.norm(away, axis=1, keepdims=True)


def agreeing_groups(agreed: Float[np.ndarray, "N N"]) -> list[list[int]]:
    """Part pictures so that what agrees is together and what does not is apart; largest first.

    Correlation clustering: groups are joined while the sum between two is positive, the largest first (Keuper et al.,
    "Efficient decomposition of image and mesh graphs by lifted multicuts", ICCV 2015); then pictures change sides while
    that gains (Kernighan and Lin 1970). Groups between which too little is negative are joined in the end: nothing says
    that they are two places.

    Args:
        agreed: Positive: in favour of one place; 0: nothing is known.
    """
    label = np.arange(len(agreed))
    between = agreed.astype(float)
    np.fill_diagonal(between, 0)
    label = _move_between_groups(_merge_groups(label, between, 0.0), between)
    against = -(between < 0).astype(float)
    label = _merge_groups(label, against, -MIN_DISAGREEING_PAIRS)
    groups = [np.flatnonzero(label == k).tolist() for k in np.unique(label)]
    return sorted(groups, key=len, reverse=True)


def _merge_groups(label: np.ndarray, between: np.ndarray, least: float) -> np.ndarray:
    """Join groups whose sum is more than the least, the largest sum first."""
    label = label.copy()
    while True:
        names = np.unique(label)
        member = (label == names[:, None]).astype(float)
        total = member @ between @ member.T
        np.fill_diagonal(total, -np.inf)
        a, b = np.unravel_index(int(total.argmax()), total.shape)
        if len(names) == 1 or total[a, b] <= least:
            return label
        label[label == names[b]] = names[a]


def _move_between_groups(label: np.ndarray, between: np.ndarray) -> np.ndarray:
    """Move single pictures to the group that they agree with best, while that gains."""
    label = label.copy()
    for _ in range(len(label) ** 2):
        names = np.unique(label)
        with_each = between @ (label[:, None] == names)
        own = with_each[np.arange(len(label)), np.searchsorted(names, label)]
        gain = with_each.max(axis=1) - own
        k = int(gain.argmax())
        if gain[k] <= MIN_MOVE_GAIN:
            break
        label[k] = names[with_each[k].argmax()]
    return label

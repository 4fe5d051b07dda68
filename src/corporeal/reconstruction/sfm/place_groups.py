"""Grouping of photographs by place on downscaled copies, before pose estimation.

A folder of which a part shows something else would cost many minutes before COLMAP says that the pictures fall apart.
Small pictures share enough points with their neighbours to see two separate circles of pictures, each well joined
within; where they share few, there is no result. Real sets of 48, 49 and 97 photographs are one group each, with 5 to
27 partners in the median; 16 of a banana, far apart, fall into groups of 7, 4 and 3 whose median is 2.
"""

import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Int
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from corporeal.core.process_resources import usable_cores
from corporeal.core.types import Note, NoteKind
from corporeal.reconstruction.sfm.one_viewpoint import (
    PointPair,
    describe_one_viewpoint,
    is_same_viewpoint,
    pairs_of_rotation,
)
from corporeal.reconstruction.sfm.pose_acceptance import some_names
from corporeal.reconstruction.sfm.prepare_images import IMAGES_FOLDER, PreparedImages
from corporeal.reconstruction.sfm.sfm_run import require_pycolmap
from corporeal.reconstruction.sfm.watermarks import WATERMARKS_FOLDER as STAMPS
from corporeal.reconstruction.sfm.watermarks import PictureSize, WatermarkDetector, write_watermark_masks

SMALL_COPY_PX, FEATURES_PER_SMALL_COPY = 480, 1024
"""Longer side of the copies [px]; points of each."""
RANSAC_TRIALS = 1000
"""Samples of a pair: most of the time would go to pairs that share nothing."""
MIN_SHARED_POINTS = 15
"""Points that two pictures share by epipolar geometry, as COLMAP asks of a pair."""
WELL_JOINED_PICTURES = 8
"""Pictures that each is joined with, in the median, from which on the finest points are spared, which are two thirds of
the cost of looking for points."""
LARGE_PICTURE_RATIO = 2
"""Times as long as the copies, at least, the pictures are of which that is true."""
MIN_JOINED_PICTURES = 4
"""Pictures that each of a group is joined with, in the median: then it is one place for certain."""
MIN_GROUP_PICTURES, MIN_GROUP_FRACTION = 5, 0.1
"""Pictures of a group, and its share of all, from which on it is a place of its own."""
MAX_NAMED_PLACES = 4
SORT_PHOTOGRAPHS_HINT = (
    "Put the photographs of each into a folder of their own. If all show one object that was moved "
    "or turned over, give masks of it."
)
MAX_ALONE_FRACTION = 0.2
"""Share of pictures of no place, above which the one that is meant is searched without them: COLMAP leaves out fewer
itself, and of more it would seem that nothing fits together."""
ALONE_EXPLANATION = (
    "They show another place, or sides from which nothing with a pattern is seen: put a newspaper "
    "under the object, and photograph it in steps of at most 15°."
)
WALK_AROUND_HINT = (
    "Walk around the object; an object that is turned before a camera that stands needs a "
    "background "
    "without any pattern, or masks."
)
MEANT_GROUP_RATIO = 3.0
"""So many times as large as the next, a group is what was meant."""


MIN_JOINED_FRACTION = 0.4
"""Share of the pictures that must share points with another, or the long search is in vain: of sets that were posed at
last .88 to 1 do, also where the plain attempt placed two of 24."""


@dataclass(frozen=True)
class PlaceGroups:
    """Pictures that belong together, by number."""

    certain: tuple[tuple[int, ...], ...]
    """Places of their own, the largest first."""
    alone: tuple[int, ...] = ()
    """Many pictures that share points with few others or none, beside a place that most show."""

    @property
    def mixed(self) -> bool:
        """Whether the folder shows several places, and none is clearly meant."""
        return len(self.certain) > 1 and len(self.certain[0]) < MEANT_GROUP_RATIO * len(self.certain[1])

    @property
    def beside(self) -> tuple[int, ...]:
        """Pictures of other places than the one that is meant."""
        if self.mixed:
            return ()
        return tuple(sorted([*(k for group in self.certain[1:] for k in group), *self.alone]))


def place_groups(shared: Int[np.ndarray, "N N"]) -> PlaceGroups:
    """Return the groups of pictures that are joined well within and not at all with one another."""
    joined = shared >= MIN_SHARED_POINTS
    _, label = connected_components(csr_array(joined), directed=False)
    least = max(MIN_GROUP_PICTURES, MIN_GROUP_FRACTION * len(shared))
    members = [np.flatnonzero(label == k) for k in np.unique(label)]
    large = [m for m in members if len(m) >= least and np.median(joined[m].sum(axis=1)) >= MIN_JOINED_PICTURES]
    large.sort(key=len, reverse=True)
    placed = {int(k) for m in large for k in m}
    alone = tuple(k for k in range(len(shared)) if k not in placed)
    most = bool(large) and len(large[0]) > len(shared) / 2
    if not most or len(alone) <= MAX_ALONE_FRACTION * (len(large[0]) + len(alone)):
        alone = ()
    return PlaceGroups(tuple(tuple(m.tolist()) for m in large), alone)


def copies_share_enough(shared: Int[np.ndarray, "N N"], sizes: Sequence[tuple[int, int]]) -> bool:
    """Return whether small copies share so much that large ones need no finer points than their own.

    Args:
        shared: Points that each two pictures share.
        sizes: Of the large ones [px]; those that are hardly larger have no more points than copies.
    """
    if min(max(size) for size in sizes) < LARGE_PICTURE_RATIO * SMALL_COPY_PX:
        return False
    return float(np.median((shared >= MIN_SHARED_POINTS).sum(axis=1))) >= WELL_JOINED_PICTURES


def hopelessness_reason(shared: Int[np.ndarray, "N N"]) -> str | None:
    """Return in a clause why a long search cannot find poses; None: it may."""
    joined = int((shared >= MIN_SHARED_POINTS).any(axis=1).sum())
    if joined >= MIN_JOINED_FRACTION * len(shared):
        return None
    count = f"only {joined}" if joined else "none"
    return f"{count} of {len(shared)} pictures share points with any other"


def describe_places(groups: PlaceGroups, names: Sequence[str]) -> str:
    """Return which places a folder shows, each by its first picture."""
    each = [f"{len(group)} like {names[group[0]]}" for group in groups.certain[:MAX_NAMED_PLACES]]
    return f"the photographs show {len(groups.certain)} objects or places that share nothing: {', '.join(each)}."


def describe_missing_poses(doubts: Sequence[str], others: int) -> str:
    """Return why poses were not found, and how many pictures of other places were not looked at."""
    why = f"where the pictures were taken from cannot be found: {'; '.join(doubts)}"
    return f"{why}; {others} more show another place." if others else f"{why}."


def drop_other_places(gathered: PreparedImages, groups: PlaceGroups) -> PreparedImages:
    """Leave out what is beside the place that is meant, and say so, and why."""
    kept = [k for k in range(len(gathered.names)) if k not in groups.beside]
    elsewhere = tuple(gathered.names[k] for group in groups.certain[1:] for k in group)
    alone = tuple(gathered.names[k] for k in groups.alone)
    said = []
    if elsewhere:
        what = f"{len(elsewhere)} photographs show another place"
        said.append(Note(f"{what} and were left out: {some_names(elsewhere)}.", NoteKind.LEFT_OUT))
    if alone:
        what = f"{len(alone)} photographs share too few points with the others"
        said.append(Note(f"{what} and were left out: {some_names(alone)}. {ALONE_EXPLANATION}", NoteKind.LEFT_OUT))
    return replace(
        gathered,
        names=tuple(gathered.names[k] for k in kept),
        sizes=tuple(gathered.sizes[k] for k in kept),
        reduced=tuple(gathered.reduced[k] for k in kept if gathered.reduced),
        said=(*gathered.said, *said),
    )


@dataclass(frozen=True)
class SmallCopyMatches:
    """What small copies of N pictures say."""

    shared: Int[np.ndarray, "N N"]
    """Points that each two share."""
    same: Bool[np.ndarray, "N N"]
    """Whether both were taken from one viewpoint."""
    turned: Bool[np.ndarray, "N N"]
    """Whether both were, by a camera that turned on the spot."""
    stamps: Mapping[PictureSize, Bool[np.ndarray, "R C"]] = field(default_factory=dict)
    """Cells of pictures of a size about what stands at the same place of all of them."""
    said: str = ""
    """A message about that, and that no points were looked for there; empty: there is no such place."""

    @property
    def stood_still(self) -> str | None:
        """Return in a clause that all were, if they were."""
        joined = self.shared >= MIN_SHARED_POINTS
        return describe_one_viewpoint(joined, self.same) or describe_one_viewpoint(
            joined, self.same | self.turned, "how a camera turns on the spot"
        )


def match_small_copies(folder: Path, gathered: PreparedImages, progress: Callable[[float], None]) -> SmallCopyMatches:
    """Look for points that each two of the pictures share, in small copies.

    Where something stands at the same place of all of them, they are looked at again without it.

    Args:
        folder: Holds ``images``; gets ``stamps`` where there are some.
        gathered: What lies there.
        progress: Called with the fraction done.
    """
    pycolmap = require_pycolmap()
    shutil.rmtree(folder / STAMPS, ignore_errors=True)
    first = _match_copies(pycolmap, folder, gathered)
    progress(0.5)
    if first.stamps:
        said = write_watermark_masks(first.stamps, gathered.names, gathered.sizes, folder / STAMPS)
        first = replace(_match_copies(pycolmap, folder, gathered), said=said)
    progress(1.0)
    return first


def _match_copies(pycolmap: Any, folder: Path, gathered: PreparedImages) -> SmallCopyMatches:
    pycolmap.set_random_seed(0)
    database = folder / "small.db"
    database.unlink(missing_ok=True)
    sift = pycolmap.FeatureExtractionOptions()
    # Two would number pictures as they finish, and a pair the other way round shares others.
    sift.num_threads, sift.use_gpu, sift.max_image_size = 1, False, SMALL_COPY_PX
    sift.sift.max_num_features, sift.sift.first_octave = FEATURES_PER_SMALL_COPY, 0
    reading = pycolmap.ImageReaderOptions()
    reading.camera_model = "SIMPLE_RADIAL"
    if (folder / STAMPS).is_dir():
        reading.mask_path = folder / STAMPS
    pycolmap.extract_features(
        database,
        folder / IMAGES_FOLDER,
        image_names=list(gathered.names),
        camera_mode=pycolmap.CameraMode.PER_IMAGE,
        reader_options=reading,
        extraction_options=sift,
        device=pycolmap.Device.cpu,
    )
    matching = pycolmap.FeatureMatchingOptions()
    matching.num_threads, matching.use_gpu = usable_cores(), False
    checking = pycolmap.TwoViewGeometryOptions()
    checking.ransac.random_seed, checking.ransac.max_num_trials = 0, RANSAC_TRIALS
    pycolmap.match_exhaustive(
        database, matching_options=matching, verification_options=checking, device=pycolmap.Device.cpu
    )
    found = _read_matches(pycolmap, database, gathered)
    database.unlink()
    return found


def _read_matches(pycolmap: Any, database: Path, gathered: PreparedImages) -> SmallCopyMatches:
    opened = pycolmap.Database.open(str(database))
    number = {name: k for k, name in enumerate(gathered.names)}
    images = {number[image.name]: image.image_id for image in opened.read_all_images()}
    points = [np.asarray(opened.read_keypoints(images[k]))[:, :2].astype(float) for k in sorted(images)]
    place = {image: k for k, image in images.items()}
    shared = np.zeros((len(number), len(number)), np.int64)
    same = np.zeros(shared.shape, np.bool_)
    pairs: dict[tuple[int, int], PointPair] = {}
    sizes = np.array(gathered.sizes, float)
    stamps = WatermarkDetector(gathered.sizes, points)
    for pair, geometry in zip(*opened.read_two_view_geometries(), strict=True):
        own = pycolmap.pair_id_to_image_pair(pair)
        a, b = (place[k] for k in own)
        possible = np.asarray(opened.read_matches(*own)).reshape(-1, 2)
        stamps.look(a, b, points[a][possible[:, 0]], points[b][possible[:, 1]])
        shared[a, b] = shared[b, a] = len(geometry.inlier_matches)
        if shared[a, b] >= MIN_SHARED_POINTS:
            m, n = geometry.inlier_matches.T
            same[a, b] = same[b, a] = is_same_viewpoint(points[a][m], points[b][n], longest=SMALL_COPY_PX)
            own, other = ((points[k][i] - sizes[k] / 2) / max(sizes[k]) for k, i in ((a, m), (b, n)))
            pairs[a, b] = own, other
    opened.close()
    spun = np.zeros(same.shape, np.bool_)
    for (a, b), by_turning in zip(pairs, pairs_of_rotation(list(pairs.values())), strict=True):
        spun[a, b] = spun[b, a] = by_turning
    return SmallCopyMatches(shared, same, spun, stamps.found())

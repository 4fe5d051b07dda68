"""One run of COLMAP through pycolmap, on the CPU.

SIFT, matching, and incremental mapping (Schönberger & Frahm, "Structure-from-Motion Revisited",
CVPR 2016). Nothing that would be fetched over the network is asked for: no learned features, and
no vocabulary tree (loop detection).

Choice of picture pairs for matching.

All pairs grow with the square of the pictures. Small copies have shown which two share points (``groups.py``): of many
partners a picture needs the best, whose points join it with the others.
"""

import shutil
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from functools import partial
from itertools import count
from pathlib import Path
from signal import SIG_DFL, SIGTERM, getsignal, signal
from threading import current_thread, main_thread
from typing import Any, Literal

import numpy as np
from jaxtyping import Int
from PIL import Image

from corporeal.core.errors import UserError
from corporeal.core.process_resources import usable_cores
from corporeal.core.progress import Progress
from corporeal.geometry.connected_components import connected_components
from corporeal.io.photos.posed_photos import MASK_FOLDERS
from corporeal.reconstruction.sfm.model_refinement import LensPrior, refine_model
from corporeal.reconstruction.sfm.prepare_images import IMAGES_FOLDER, MAX_PICTURE_PX, PreparedImages, focal_from_exif
from corporeal.reconstruction.sfm.watermarks import WATERMARKS_FOLDER as STAMPS

MAX_EXHAUSTIVE_PICTURES = 80
"""Pictures up to which all pairs are matched, but for those that small copies speak against."""
NAME_DISTANCES = (*range(1, 11), 16, 32, 64)
"""Distances by name at which more pictures are then matched."""
MAX_PARTNERS = 16
"""Of pictures that share points with it when small, so many are matched, which share most."""
FEW_PARTNERS = 4
"""Partners when small below which a picture is matched as if small copies gave no result: pairs of a banana that share
nothing when small carry its model."""
ALWAYS_MATCHED_DISTANCE = 3
"""Distance by name up to which pictures are matched whatever small copies say."""
PicturePairs = list[tuple[int, int]]


def match_pairs(total: int) -> PicturePairs:
    """Return which of so many pictures, in order of their names, are matched with one another."""
    return _pairs_at_distance(range(1, total) if total <= MAX_EXHAUSTIVE_PICTURES else NAME_DISTANCES, total)


def match_partners(shared: Int[np.ndarray, "N N"]) -> PicturePairs:
    """Return the same of pictures of which small copies were matched.

    Args:
        shared: Points that each two share when small; 0: they are not joined.
    """
    total = len(shared)
    few = ((shared > 0).sum(axis=1) < FEW_PARTNERS).tolist()
    best = np.argsort(-shared, axis=1, kind="stable")[:, :MAX_PARTNERS].tolist()
    kept = [(a, b) for a, row in enumerate(best) for b in row if shared[a, b] > 0]
    alike = {(min(a, b), max(a, b)) for a, b in kept}
    unsure = {(a, b) for a, b in match_pairs(total) if few[a] or few[b]}
    return sorted(alike | unsure | set(_pairs_at_distance(range(1, ALWAYS_MATCHED_DISTANCE + 1), total)))


def _pairs_at_distance(apart: range | tuple[int, ...], total: int) -> PicturePairs:
    return [(k, k + d) for k in range(total) for d in apart if k + d < total]


SfmStrategy = Literal["plain", "masked", "thorough"]
"""masked: points on objects alone, for objects that were turned over or moved between pictures. thorough: affine
shapes, pooling over scales, guided matching, lower minima, and points that two pictures alone share, for pictures that
are far apart."""
STRATEGY_PREFIXES: dict[SfmStrategy, str] = {
    "plain": "",
    "masked": "attempt on masks alone: ",
    "thorough": "thorough attempt: ",
}

MAX_FEATURES_PER_IMAGE = 4096
"""Points of a picture that are matched, the largest ones. Twice as many take four times as long."""
PICTURES_PER_BATCH, PAIRS_PER_BATCH = 4, 100
"""Pictures and pairs that are worked on before progress is reported."""
MIN_REGISTERED_FRACTION = 0.7
"""Of the pictures that must be registered."""
MAX_GROUP_ROTATION_DEG = 5.0
"""Median angle by which two groups turn pictures apart, from which on one is wrong [deg]."""
MASK_THRESHOLD_U8 = 127
"""Of 255: more than that in a mask is on the object."""
DATABASE_FILE = "database.db"
FEATURES_PROGRESS, MATCHES_PROGRESS = 0.2, 0.6
"""Share of the work that is done after each step."""
INTERRUPT_POLL_S = 0.5
"""How often Ctrl-C is looked for [s]."""


@dataclass(frozen=True)
class SfmRun:
    """What came of one attempt."""

    way: SfmStrategy
    pictures: int
    registered: int = 0
    points: int = 0
    reprojection: float = 0.0
    """Mean reprojection error [px]."""
    others: tuple[int, ...] = ()
    """Pictures in the other groups, beside those that are in the first, too."""
    focal: float = 0.0
    """Focal length over the longer side, of the camera that is furthest from one [-]."""
    bent: float = 0.0
    """Largest |k1| of its lens [-]."""
    left_out: tuple[str, ...] = ()
    misplaced: tuple[str, ...] = ()
    """Registered pictures beside others that they share too little with, as another side that looks alike does. They
    were taken out of the model, as were the next."""
    parted: tuple[int, ...] = ()
    """The same of so many pictures that it is unknown which are right: sizes of their groups."""
    astray: tuple[str, ...] = ()
    """Registered pictures in which masks say that the object is elsewhere."""
    filled: float = 1.0
    """Share of a mask that the visual hull of all fills, the median; 1 without masks [-]."""
    joined: int | None = None
    """Pictures that points join with one another, directly or through others: the most that can be placed. None: it was
    not counted."""


def require_pycolmap() -> Any:
    """Return pycolmap.

    Raises:
        UserError: It is not installed.
    """
    try:
        import pycolmap
    except ImportError as missing:
        raise UserError(
            "Photographs without poses need pycolmap. Install it with: pip install "
            "'corporeal[poses]'; or pose them, for example with COLMAP."
        ) from missing
    pycolmap.logging.minloglevel = pycolmap.logging.FATAL.value
    # With it comes a handler of its log's, which prints the stack of whoever is asked to end.
    if current_thread() is main_thread():
        signal(SIGTERM, getsignal(SIGTERM) or SIG_DFL)
    return pycolmap


def run_sfm(folder: Path, out: Path, gathered: PreparedImages, way: SfmStrategy, progress: Progress) -> SfmRun:
    """Find poses, and write the largest model as text to ``out / "sparse" / "0"``.

    What an interrupted attempt left in the database is not done again.

    Args:
        folder: Holds ``images``, and ``masks`` where points are looked for on objects alone.
        out: Gets the database and the model.
        gathered: What lies there.
        way: How points are found and matched.
        progress: Called with the fraction done and a description.
    """
    pycolmap = require_pycolmap()
    out.mkdir(parents=True, exist_ok=True)
    pycolmap.set_random_seed(0)
    work = _SfmSteps(pycolmap, folder, out, gathered, way)
    steps = (
        (work.extract, 0.0, FEATURES_PROGRESS, "looking for points"),
        (work.match, FEATURES_PROGRESS, MATCHES_PROGRESS, "matching pictures"),
        (work.place, MATCHES_PROGRESS, 1.0, "placing cameras"),
    )
    for step, begin, end, what in steps:

        def report(share: float, begin: float = begin, end: float = end, what: str = what) -> None:
            progress(begin + (end - begin) * share, STRATEGY_PREFIXES[way] + what)

        _run_interruptibly(pycolmap, partial(step, report))
    return replace(_summarise_models(work.models, folder / IMAGES_FOLDER, out, gathered, way), joined=work.joined)


def _run_interruptibly(pycolmap: Any, work: Callable[[Any], None]) -> None:
    """Do some work in a thread, so that Ctrl-C ends it at once."""
    token = pycolmap.CancellationToken()
    with ThreadPoolExecutor(1) as pool:
        doing = pool.submit(work, token)
        try:
            while wait([doing], INTERRUPT_POLL_S).not_done:
                pass
        except BaseException:
            token.cancel()
            raise
        doing.result()


def remove_pictures(place: Path, names: Collection[str]) -> tuple[int, int]:
    """Drop pictures from a model; return how many pictures and points are left."""
    model = require_pycolmap().Reconstruction(str(place))
    for image in [i for i in model.images.values() if i.name in names]:
        model.deregister_frame(image.frame_id)
    model.write_text(str(place))
    return model.num_reg_images(), model.num_points3D()


def pairs_to_match(gathered: PreparedImages, way: SfmStrategy) -> PicturePairs:
    """Return which pictures are matched with one another, by number.

    The thorough attempt finds what small copies do not.
    """
    if gathered.pairs is None or way == "thorough":
        return match_pairs(len(gathered.names))
    return list(gathered.pairs)


class _SfmSteps:
    """The steps of one attempt; each takes whom to tell the share that is done, and a token.

    Nothing else opens the database meanwhile: a second library of SQLite in one process breaks the locks of the first
    (sqlite.org/howtocorrupt.html, 2.2.1).
    """

    def __init__(self, pycolmap: Any, folder: Path, out: Path, gathered: PreparedImages, way: SfmStrategy) -> None:
        self.pycolmap, self.images, self.out = pycolmap, folder / IMAGES_FOLDER, out
        self.gathered, self.thorough = gathered, way == "thorough"
        self.way: SfmStrategy = way
        self.masks = folder / MASK_FOLDERS[0] if way == "masked" else None
        self.stamps = folder / STAMPS
        self.least = 10 if self.thorough else 15
        self.database = out / DATABASE_FILE
        self.models: Any = {}
        self.joined = 0

    def extract(self, report: Callable[[float], None], token: Any) -> None:
        """Find points; pictures of one size share a camera, if their lenses are stated alike."""
        reading = self.pycolmap.ImageReaderOptions()
        reading.camera_model = "SIMPLE_RADIAL"
        if self.masks is not None:
            reading.mask_path = _write_feature_masks(self.masks, self.out, self.gathered)
        elif self.stamps.is_dir():
            reading.mask_path = self.stamps
        sift = self.pycolmap.FeatureExtractionOptions()
        sift.num_threads, sift.use_gpu, sift.max_image_size = usable_cores(), False, MAX_PICTURE_PX
        sift.sift.max_num_features = MAX_FEATURES_PER_IMAGE
        sift.sift.estimate_affine_shape = sift.sift.domain_size_pooling = self.thorough
        if not self.thorough and not self.gathered.doubled:
            sift.sift.first_octave = 0
        done = 0
        for camera, names in enumerate(names_by_camera(self.images, self.gathered)):
            for first in range(0, len(names), PICTURES_PER_BATCH):
                if token.is_cancelled:
                    return
                # The first batch makes the camera; cameras are numbered from 1.
                reading.existing_camera_id = camera + 1 if first else -1
                self.pycolmap.extract_features(
                    self.database,
                    self.images,
                    image_names=names[first : first + PICTURES_PER_BATCH],
                    camera_mode=self.pycolmap.CameraMode.SINGLE,
                    reader_options=reading,
                    extraction_options=sift,
                    device=self.pycolmap.Device.cpu,
                    cancellation_token=token,
                )
                done += len(names[first : first + PICTURES_PER_BATCH])
                report(done / len(self.gathered.names))

    def match(self, report: Callable[[float], None], token: Any) -> None:
        """Find which points of two pictures are one, and check that by epipolar geometry."""
        matching = self.pycolmap.FeatureMatchingOptions()
        matching.num_threads, matching.use_gpu = usable_cores(), False
        matching.guided_matching = self.thorough
        checking = self.pycolmap.TwoViewGeometryOptions()
        checking.ransac.random_seed = 0
        names, pairs = self.gathered.names, pairs_to_match(self.gathered, self.way)
        pairing = self.pycolmap.ImportedPairingOptions()
        pairing.match_list_path = str(self.out / "pairs.txt")
        for first in range(0, len(pairs), PAIRS_PER_BATCH):
            if token.is_cancelled:
                return
            rows = [f"{names[a]} {names[b]}\n" for a, b in pairs[first : first + PAIRS_PER_BATCH]]
            (self.out / "pairs.txt").write_text("".join(rows), encoding="utf-8")
            self.pycolmap.match_image_pairs(
                self.database,
                matching_options=matching,
                pairing_options=pairing,
                verification_options=checking,
                device=self.pycolmap.Device.cpu,
                cancellation_token=token,
            )
            report(min((first + PAIRS_PER_BATCH) / len(pairs), 1.0))
        self.joined = _joined_pictures(self.pycolmap, self.database, self.least)

    def place(self, report: Callable[[float], None], token: Any) -> None:
        """Place cameras one after the other, in groups that share points."""
        options = self.pycolmap.IncrementalPipelineOptions()
        options.num_threads, options.random_seed, options.min_model_size = usable_cores(), 0, 3
        options.mapper.random_seed = options.triangulation.random_seed = 0
        options.min_num_matches = self.least
        if self.thorough:  # believe less: pictures are far apart; the whole is judged afterwards
            options.mapper.init_min_num_inliers = 40
            options.mapper.abs_pose_min_num_inliers = 12
            options.mapper.abs_pose_min_inlier_ratio = 0.15
            options.triangulation.ignore_two_view_tracks = False
        placed = count(1)
        total = len(self.gathered.names)
        if self.joined < MIN_REGISTERED_FRACTION * total:  # whatever is placed, it would not be accepted
            return
        shutil.rmtree(self.out / "models", ignore_errors=True)
        (self.out / "models").mkdir()
        self.models = self.pycolmap.incremental_mapping(
            self.database,
            self.images,
            self.out / "models",
            options,
            next_image_callback=lambda: report(min(next(placed) / total, 1.0)),
            cancellation_token=token,
        )


def names_by_camera(images: Path, gathered: PreparedImages) -> list[list[str]]:
    """Return the names of pictures that one camera took: of one size, and one focal length in EXIF."""
    made: dict[tuple[tuple[int, int], float], list[str]] = {}
    for name, size in zip(gathered.names, gathered.sizes, strict=True):
        made.setdefault((size, focal_from_exif(images / name)), []).append(name)
    return list(made.values())


def lens_priors(images: Path, gathered: PreparedImages) -> dict[str, LensPrior]:
    """Return what is known of how each picture was taken, by its name."""
    reduced = gathered.reduced or (1.0,) * len(gathered.names)
    each = zip(gathered.names, reduced, strict=True)
    return {name: LensPrior(focal_from_exif(images / name), share) for name, share in each}


def _write_feature_masks(masks: Path, out: Path, gathered: PreparedImages) -> Path:
    """Write masks as COLMAP looks for them: named after pictures, and as large as these.

    A picture without a mask gets a black one, so no points.
    """
    place = out / "masks"
    place.mkdir(exist_ok=True)
    for name, size in zip(gathered.names, gathered.sizes, strict=True):
        file, own = masks / f"{Path(name).stem}.png", Image.new("L", size)
        if file.exists():
            with Image.open(file) as mask:
                own = mask.convert("L").resize(size, Image.Resampling.NEAREST)
        allowed = np.uint8(255) * (np.asarray(own) > MASK_THRESHOLD_U8)
        Image.fromarray(allowed).save(place / f"{name}.png")
    return place


def _summarise_models(models: Any, images: Path, out: Path, gathered: PreparedImages, way: SfmStrategy) -> SfmRun:
    total = len(gathered.names)
    first = best = max(models.values(), key=lambda m: m.num_reg_images(), default=None)
    if best is None:
        return SfmRun(way, total, left_out=gathered.names)
    if best.num_reg_images() >= MIN_REGISTERED_FRACTION * total:  # of two pictures nothing can be adjusted
        best = refine_model(require_pycolmap(), best, lens_priors(images, gathered), images)
    place = out / "sparse" / "0"
    place.mkdir(parents=True, exist_ok=True)
    best.write_text(str(place))
    placed = _registered_names(best)
    beside = (pictures_beside_first(best, m) for m in models.values() if m is not first)
    focal, bent = _extreme_lens([c for c in best.cameras.values()])
    return SfmRun(
        way,
        total,
        registered=best.num_reg_images(),
        points=best.num_points3D(),
        reprojection=round(best.compute_mean_reprojection_error(), 3),
        others=tuple(sorted(filter(None, beside), reverse=True)),
        focal=focal,
        bent=bent,
        left_out=tuple(n for n in gathered.names if n not in placed),
    )


def _registered_names(model: Any) -> set[str]:
    return {image.name for image in model.images.values() if image.has_pose}


def pictures_beside_first(first: Any, other: Any) -> int:
    """Return how many pictures another group holds that the first does not; all: they contradict.

    COLMAP begins anew at pictures that it has placed before: such a group may say the same.
    """
    both = [
        {i.name: i.cam_from_world().rotation.matrix() for i in m.images.values() if i.has_pose} for m in (first, other)
    ]
    common = sorted(both[0].keys() & both[1].keys())
    turns = np.array([both[0][name].T @ both[1][name] for name in common]).reshape(-1, 3, 3)
    between = np.einsum("aij,bij->ab", turns, turns)  # traces: 3 where two turns are one
    cosine = np.clip((between[np.triu_indices(len(common), 1)] - 1) / 2, -1, 1)
    if len(cosine) and np.degrees(np.arccos(np.median(cosine))) > MAX_GROUP_ROTATION_DEG:
        return len(both[1])
    return len(both[1]) - len(common)


def _joined_pictures(pycolmap: Any, database: Path, least: int) -> int:
    """Return how many pictures are joined by pairs that share at least so many points."""
    opened = pycolmap.Database.open(str(database))
    number = {image.image_id: k for k, image in enumerate(opened.read_all_images())}
    ends = [
        [number[k] for k in pycolmap.pair_id_to_image_pair(pair)]
        for pair, geometry in zip(*opened.read_two_view_geometries(), strict=True)
        if len(geometry.inlier_matches) >= least
    ]
    opened.close()
    if not ends:
        return 0
    a, b = np.array(ends).T
    return int(np.bincount(connected_components(a, b, len(number))).max())


def _extreme_lens(cameras: Sequence[Any]) -> tuple[float, float]:
    """Return the strangest focal length over the longer side, and the largest |k1|."""
    ratios = [c.params[0] / max(c.width, c.height) for c in cameras]
    strange = max(ratios, key=lambda r: max(r, 1 / max(r, 1e-9)))
    return round(float(strange), 3), round(float(max(abs(c.params[3]) for c in cameras)), 3)

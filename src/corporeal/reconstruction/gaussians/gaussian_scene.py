"""Gaussians trained on photographs, or read from a splat."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, UInt8

from corporeal.core.errors import UserError
from corporeal.core.progress import Progress, no_progress, subprogress
from corporeal.core.types import Camera, Gaussians, Note, NoteKind, Vector, Views
from corporeal.geometry.gaussian_transforms import UpAxis, UpAxisChoice
from corporeal.geometry.spherical_harmonics import SH_DC_COEFFICIENT
from corporeal.io.input_files import input_kind
from corporeal.io.photos.posed_photos import NO_INSTANCES_MESSAGE, PosedPhotos, read_posed_photos
from corporeal.io.registry import reader_of
from corporeal.io.splat.load_splat import load_splat
from corporeal.multiview.feature_matching import FEATURE_IMAGE_SIDE_PX
from corporeal.multiview.lines_of_sight import LinesOfSight
from corporeal.multiview.pose_consistency import check_pose_consistency
from corporeal.multiview.silhouette_outliers import are_masks_inverted, outlier_views
from corporeal.multiview.similarity_transform import (
    apply_similarity_to_cameras,
    apply_similarity_to_gaussians,
    similarity_matrix,
)
from corporeal.multiview.view_coverage import unseen_half_text
from corporeal.multiview.world_alignment import StatedFrame, WorldAlignment, align_world
from corporeal.reconstruction.gaussians.floor_from_outlines import floor_height_from_outlines
from corporeal.reconstruction.gaussians.gaussian_initialisation import StartPoints
from corporeal.reconstruction.gaussians.heldout_quality import HeldOutQuality
from corporeal.reconstruction.gaussians.mask_contamination import drop_thin_pieces, mask_contamination
from corporeal.reconstruction.gaussians.rasteriser_numba import render
from corporeal.reconstruction.gaussians.swept_floor_masks import masks_above_floor
from corporeal.reconstruction.gaussians.train_gaussians import MIN_TRIAL_GAIN_DB, TrainedGaussians, train_gaussians
from corporeal.reconstruction.gaussians.training_schedule import TRAINING_PRESETS, TrainConfig

MIN_SOLID_OPACITY = 0.5
"""Opacity from which on a Gaussian says where something is."""
MASK_MIN_U8 = 128
"""Of 255: from here on a pixel of a mask belongs to objects."""
POOR_PSNR_DB = 20.0
"""Held-out photographs agree worse than this only where something is wrong [dB]."""
CUT_ABOVE_FLOOR_STATEMENT = (
    "There were no masks: everything above the floor was assumed to be objects. Objects on it "
    "thinner than 0.5 % of the scene are lost."
)
NO_FLOOR_NOTE = Note(
    "There were no masks and no floor to separate objects from: all that most photographs show was "
    "assumed to be objects. Give masks, or the height of the floor with --floor-at.",
    NoteKind.ASSUMED,
)
INVERTED_MASKS_MESSAGE = (
    "The masks are black in the middle of what all cameras look at, and white along the borders of "
    "the pictures: they are inverted, or of the background. White is what counts: invert them."
)
MIN_CONTAMINATION_FRACTION = 0.01
"""Share of grown masks from which on training again without it is worth while: of pieces that are not thin."""
RETRAINING_CHECKPOINT = "training-again"
"""Name of the file in which that is kept."""
FIRST_TRAINING_PROGRESS = 0.8
"""Share of the work that is done when such masks were learned from once: four of 21 sets are learned from again, so
that 1.2 trainings are to be expected."""
OVERVIEW_PICTURES = 4
"""Pictures of the whole scene for questions to a model."""
UP_BY_AXIS = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


@dataclass(frozen=True)
class GaussianScene:
    """What there is to begin with."""

    gaussians: Gaussians
    cameras: tuple[Camera, ...] = ()
    """Empty: it came without any."""
    views: Views | None = None
    """The photographs; their cameras stay as the file has them."""
    masks: Bool[np.ndarray, "V H W"] | None = None
    """Which pixels are on objects; None: unknown."""
    coloured: Bool[np.ndarray, "V H W"] | None = None
    """Which pixels have the colours of objects, where that is unreliable alone."""
    z_up: bool = False
    """The file's kind says so, and that its unit is the metre."""
    usual: Vector | None = None
    """What is up in such files as a rule."""
    floor: bool = False
    """Whether the floor is among the Gaussians."""
    world_from_file: Float[np.ndarray, "4 4"] = field(default_factory=lambda: np.eye(4))
    """How it was turned and shifted since it was read."""
    seen: Float[np.ndarray, "N 3"] | None = None
    """Sparse points on all that the photographs show, the floor too; None: the file has none."""
    doubts: tuple[str, ...] = ()
    """Where shapes are unreliable, in sentences."""
    quality: HeldOutQuality | None = None
    """How well pictures of the Gaussians agree with photographs held back; None: none was."""
    statements: tuple[str, ...] = ()
    """How it came about, in sentences, for the report."""
    warnings: tuple[str, ...] = ()

    @property
    def solid(self) -> np.ndarray:
        """Means of Gaussians that say where something is (M, 3)."""
        g = self.gaussians
        return g.mean[g.opacity > MIN_SOLID_OPACITY].astype(np.float64)

    def pictures(self) -> Sequence[UInt8[np.ndarray, "H W 3"]]:
        """Return the photographs, or pictures of a splat that came without any."""
        if self.views is not None:
            return list(self.views.rgb)
        return [render_on_black(self.gaussians, camera) for camera in self.cameras]

    def some(self) -> dict[int, UInt8[np.ndarray, "H W 3"]]:
        """Return a few pictures from all sides, each with the number of its camera."""
        count = len(self.cameras)
        which = np.unique(np.linspace(0, count - 1, min(count, OVERVIEW_PICTURES)).round().astype(int))
        own = None if self.views is None else self.views.rgb
        pairs = ((k, self.cameras[k]) for k in which.tolist())
        return {k: render_on_black(self.gaussians, c) if own is None else own[k] for k, c in pairs}

    def painted(self, rgb: Float[np.ndarray, "N 3"]) -> list[UInt8[np.ndarray, "H W 3"]]:
        """Return the same pictures, each followed by itself with Gaussians in flat sRGB."""
        flat = replace(self.gaussians, sh=((rgb - 0.5)[:, None] / SH_DC_COEFFICIENT).astype(np.float32))
        pairs = ((shown, render_on_black(flat, self.cameras[k])) for k, shown in self.some().items())
        return [one for pair in pairs for one in pair]


def render_on_black(gaussians: Gaussians, camera: Camera) -> UInt8[np.ndarray, "H W 3"]:
    """Return a picture of Gaussians before black."""
    rgb = render(gaussians, camera).rgb
    return np.round(255 * np.clip(rgb, 0, 1)).astype(np.uint8)


@dataclass(frozen=True)
class MaskSource:
    """Source of the masks of objects in photographs."""

    by: Path | None = None
    """A folder of masks; None: the photographs' own, if there are any."""
    grown: bool = False
    """Whether these were grown, not given or made by a model: what no other photograph shows in them is left out."""
    bare: bool = False
    """Whether masks beside the photographs are ignored."""


MASKS_BESIDE_PICTURES = MaskSource()


def load_or_train_gaussians(
    source: Path,
    training: TrainConfig,
    checkpoint: Path | None = None,
    progress: Progress = no_progress,
    instances: bool = False,
    masked: MaskSource = MASKS_BESIDE_PICTURES,
) -> GaussianScene:
    """Read a splat, or photographs and learn Gaussians from them, in the file's own frame and unit.

    Args:
        source: A folder of photographs with poses, or a splat.
        training: How to learn.
        checkpoint: Where a training that is cut off leaves what it has.
        progress: Called with the fraction done and what is being done.
        instances: Whether masks must segment objects.
        masked: By what.

    Raises:
        UserError: The input cannot be used.
    """
    progress(0.0, f"reading {source.name}")
    if input_kind([source]) == "splat":
        if instances:
            raise UserError(f"{source} is a splat, which has no instance masks. Leave --apart out.")
        return _load_splat(source)
    shown, masks = _load_photographs(source, TRAINING_PRESETS[training.preset].longest, instances, masked)
    doubt = pose_warnings(source, masked, shown)
    points = _sparse_points(shown)
    wrong = [said for said in shown.warnings if said not in shown.done]
    # With masks, where sparse points are says less than what masks carve; what they are seen through is empty.
    start = points if masks is None else shown.lines
    learning = _TrainingInput(shown.views, start, training, checkpoint, progress)
    try:
        if masks is None or not masked.grown:
            trained, cut = learning.of(masks), ()
        else:
            trained, masks, cut = learning.of_grown(masks)
    except UserError as problem:
        raise UserError(" ".join([str(problem), *doubt])) from problem
    poor = _training_warnings(trained, len(shown.names))
    return GaussianScene(
        trained.gaussians,
        shown.views.cameras,
        shown.views,
        masks,
        z_up=shown.z_up,
        seen=None if points is None else points.position,
        doubts=tuple(filter(None, [unseen_half_text(shown.views.cameras, shown.names), *poor])),
        quality=trained.quality,
        statements=(*shown.done, *cut, *_training_statements(trained, len(shown.views.cameras))),
        warnings=(*wrong, *doubt, *poor),
    )


def _load_splat(source: Path) -> GaussianScene:
    given = load_splat(source)
    reader = reader_of(source, "splat")
    usual = _stated_up(reader.usual_up if reader else "-y")
    read = (f"{given.count:,} Gaussians were read from {source.name}.",)
    return GaussianScene(given, usual=usual, statements=read, warnings=given.warnings)


def _load_photographs(
    source: Path, longest: int, instances: bool, masked: MaskSource
) -> tuple[PosedPhotos, Bool[np.ndarray, "V H W"] | None]:
    """Return photographs that agree with one another, and masks, if there are any.

    Raises:
        UserError: They cannot be used, lack masks that segment objects, or these are inverted.
    """
    shown = _drop_inconsistent(read_posed_photos(source, longest, masked.by, masked.bare, close=True))
    if instances and shown.views.object_of_pixel is None:
        raise UserError(f"{source}: {NO_INSTANCES_MESSAGE}")
    masks = None if shown.masks is None else shown.masks >= MASK_MIN_U8
    if masks is not None and are_masks_inverted(masks, shown.views.cameras):
        raise UserError(f"{source}: {INVERTED_MASKS_MESSAGE}")
    return shown, masks


@dataclass(frozen=True)
class _TrainingInput:
    """What Gaussians are learned from beside masks, and how; as ``train_gaussians`` is given it."""

    views: Views
    start: StartPoints | LinesOfSight | None
    how: TrainConfig
    checkpoint: Path | None
    progress: Progress

    def of(self, masks: Bool[np.ndarray, "V H W"] | None) -> TrainedGaussians:
        """Learn from masks that are right, or without any."""
        return train_gaussians(self.views, masks, self.start, self.how, self.checkpoint, self.progress)

    def of_grown(
        self, masks: Bool[np.ndarray, "V H W"]
    ) -> tuple[TrainedGaussians, Bool[np.ndarray, "V H W"], tuple[str, ...]]:
        """Train from grown masks, without what no other photograph shows in them.

        Returns:
            What was learned, from which masks, and what was left out of these, in a sentence.
        """
        trained = replace(self, progress=subprogress(self.progress, 0.0, FIRST_TRAINING_PROGRESS)).of(masks)
        odd = mask_contamination(trained.gaussians, self.views, masks)
        if np.count_nonzero(drop_thin_pieces(odd, masks)) <= MIN_CONTAMINATION_FRACTION * np.count_nonzero(masks):
            return trained, masks, ()
        kept = None if self.checkpoint is None else self.checkpoint.with_stem(RETRAINING_CHECKPOINT)
        later = subprogress(self.progress, FIRST_TRAINING_PROGRESS, 1.0, ", without what is not the object")
        left = masks & ~odd
        share = np.count_nonzero(odd) / np.count_nonzero(masks)
        views = np.count_nonzero(odd.any(axis=(1, 2)))
        said = (
            f"{share:.1%} of what masks hold is in {views} of {len(masks)} photographs "
            "inconsistent with all others: it is background, and was left out."
        )
        return replace(self, checkpoint=kept, progress=later).of(left), left, (said,)


def turn_upright(taken: GaussianScene, up: UpAxisChoice = "auto", floor: float | None = None) -> GaussianScene:
    """Return the same with +z up, the floor at z = 0, and what is looked at above the origin.

    Photographs without masks get some.

    Args:
        taken: In the file's own frame.
        up: Which axis of the file points up; auto: what the file or the cameras say.
        floor: Its height along up, in the file's unit; None: it is looked for.
    """
    alone = taken.masks is not None and taken.seen is None  # nothing but objects is known
    sparse = taken.seen
    points = taken.solid if sparse is None or taken.masks is None else sparse
    of_things = None if taken.masks is None else taken.solid
    stated = StatedFrame(_stated_up(up), floor)
    seen = points[:0] if alone else points
    frame = align_world(taken.cameras, seen, taken.z_up, of_things, taken.usual, stated)
    if frame.floor_by == "objects" and taken.masks is None and sparse is not None:
        # Gaussians of a poorly learned room may be anywhere; points that pictures share are not.
        other = align_world(taken.cameras, sparse, taken.z_up, of_things, taken.usual, stated)
        frame = other if other.floor_by == "plane" else frame
    if frame.floor_by == "objects" and taken.views is not None and taken.masks is not None:
        frame = _lower_to_silhouettes(frame, taken.views, taken.masks)
    made = replace(
        taken,
        gaussians=apply_similarity_to_gaussians(taken.gaussians, frame.world_from_file),
        cameras=apply_similarity_to_cameras(taken.cameras, frame.world_from_file),
        floor=taken.masks is None and (frame.floor_by == "plane" or floor is not None),
        world_from_file=frame.world_from_file,
        statements=(*taken.statements, frame.reason),
        warnings=(*taken.warnings, *frame.warnings),
    )
    return made if made.views is None or made.masks is not None else _add_masks_above_floor(made)


def _lower_to_silhouettes(frame: WorldAlignment, views: Views, masks: Bool[np.ndarray, "V H W"]) -> WorldAlignment:
    """Put the floor where the outlines in masks say that objects touch it."""
    cameras = apply_similarity_to_cameras(views.cameras, frame.world_from_file)
    try:
        height = floor_height_from_outlines(Views(views.rgb, cameras), masks)
    except UserError:  # masks agree nowhere: Gaussians are all there is
        return frame
    if height is None:
        return frame
    reason = f"{frame.reason} Their height is from outlines in masks."
    way = similarity_matrix(shift=(0.0, 0.0, -height)) @ frame.world_from_file
    return replace(frame, world_from_file=way, reason=reason)


def _add_masks_above_floor(taken: GaussianScene) -> GaussianScene:
    """Return the same with masks of what is above the floor, where none are given."""
    warning = CUT_ABOVE_FLOOR_STATEMENT if taken.floor else NO_FLOOR_NOTE
    masks = masks_above_floor(taken.gaussians, taken.cameras, taken.floor)
    return replace(taken, masks=masks, warnings=(*taken.warnings, warning))


def _drop_inconsistent(shown: PosedPhotos) -> PosedPhotos:
    """Leave out photographs whose silhouettes contradict all others', and say which."""
    if shown.masks is None:
        return shown
    wrong = outlier_views(shown.masks, shown.views.cameras)
    if not wrong:
        return shown
    names = ", ".join(shown.names[k] for k in wrong)
    said = Note(
        f"{len(wrong)} of {len(shown.names)} photographs were left out, as they show the object "
        f"where the others' masks do not have it: {names}. Their poses, or their masks, are wrong.",
        NoteKind.LEFT_OUT,
    )
    kept = np.setdiff1d(np.arange(len(shown.names)), wrong)
    return replace(shown.only(kept.tolist()), warnings=(*shown.warnings, said))


def pose_warnings(
    source: Path, masked: MaskSource = MASKS_BESIDE_PICTURES, shown: PosedPhotos | None = None
) -> tuple[str, ...]:
    """Return what seems wrong with the poses, as warnings.

    Points are matched in pictures as large as that was measured on: where little ones are learned from, a third of the
    points that wrong poses contradict would still be near enough.

    Args:
        source: A folder of photographs with poses.
        masked: Which masks are read.
        shown: What was read of them and is used: no other counts, and it serves if it is large enough.

    Raises:
        UserError: They are certainly wrong.
    """
    looked = shown
    if looked is None or max(looked.views.rgb.shape[1:3]) < FEATURE_IMAGE_SIDE_PX:
        looked = read_posed_photos(source, FEATURE_IMAGE_SIDE_PX, masked.by, masked.bare, close=True)
        if shown is not None:
            kept = [k for k, name in enumerate(looked.names) if name in shown.names]
            looked = looked.only(kept)
    found = check_pose_consistency(looked.views, looked.masks)
    if found.hopeless:
        raise UserError(f"{source}: {found.doubt}")
    return () if found.doubt is None else (found.doubt,)


def _training_warnings(trained: TrainedGaussians, photographs: int) -> tuple[str, ...]:
    """Return where what was learned is not what photographs show, or where none was left to tell."""
    if trained.quality is None:
        return (
            Note(
                f"{photographs} photographs are too few for a validation set: unseen surfaces are "
                "invented. Take 20 to 50, from all sides.",
                NoteKind.GRAVE,
            ),
        )
    if trained.quality.psnr >= POOR_PSNR_DB:
        return ()
    return (
        Note(
            "Held-out photographs differ from their rendering "
            f"({trained.quality.psnr:.1f} dB): shapes are unreliable. Check poses, lenses and "
            "moving objects, and take more pictures.",
            NoteKind.GRAVE,
        ),
    )


def _stated_up(up: UpAxisChoice | UpAxis) -> Vector | None:
    if up == "auto":
        return None
    sign = -1.0 if up[0] == "-" else 1.0
    x, y, z = UP_BY_AXIS[up[-1]]
    return sign * x, sign * y, sign * z


def _sparse_points(shown: PosedPhotos) -> StartPoints | None:
    if shown.points is None or shown.colours is None:
        return None
    return StartPoints(shown.points, shown.colours / 255)


def _training_statements(trained: TrainedGaussians, photographs: int) -> tuple[str, ...]:
    count = f"{trained.gaussians.count:,}"
    sentences = [f"{count} Gaussians were learned from {photographs} photographs."]
    if np.isfinite(trained.ahead):
        inside, better = trained.ahead > MIN_TRIAL_GAIN_DB, f"{trained.ahead:+.1f} dB on objects"
        where = "and inside of it" if inside else "alone"
        sentences.append(
            f"They began on the visual hull of the masks {where}: to begin inside, too, made "
            f"{better} in a small training."
        )
    return (*sentences, *(() if trained.quality is None else (_agreement_words(trained.quality),)))


def _agreement_words(quality: HeldOutQuality) -> str:
    shown = "" if quality.psnr_on_objects is None else f", {quality.psnr_on_objects:.1f} dB on objects"
    return (
        f"Pictures of them agree with {len(quality.views)} photographs that they were not learned "
        f"from to {quality.psnr:.1f} dB{shown}."
    )

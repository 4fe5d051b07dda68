"""Gaussians from whatever a person has: photographs that they are learned from, or a splat."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, UInt8

from corporeal.core.errors import UserError
from corporeal.core.progress import Progress, within
from corporeal.core.types import Camera, Gaussians, Note, NoteKind, Vector, Views
from corporeal.geometry.gaussians import AskedUp
from corporeal.geometry.harmonics import DC
from corporeal.io.photographs import NO_INSTANCES, Photographs, read_photographs
from corporeal.io.sources import kind_of
from corporeal.io.splats import read_splat
from corporeal.multiview.agreement import agreement
from corporeal.multiview.inverted_masks import inverted
from corporeal.multiview.lines_of_sight import LinesOfSight
from corporeal.multiview.matching import SIDE
from corporeal.multiview.silhouette_outliers import outliers
from corporeal.multiview.similarity import moved_cameras, moved_gaussians, similarity
from corporeal.multiview.unseen_side import unseen_half
from corporeal.multiview.upright import Stated, Upright, upright
from corporeal.reconstruction.gaussians.cutout import cut_out
from corporeal.reconstruction.gaussians.lowest import lowest
from corporeal.reconstruction.gaussians.quality import Quality
from corporeal.reconstruction.gaussians.raster import render
from corporeal.reconstruction.gaussians.start import Points
from corporeal.reconstruction.gaussians.train import GAIN, Trained, train
from corporeal.reconstruction.gaussians.training_schedule import PRESETS, TrainConfig
from corporeal.reconstruction.gaussians.unexplained import unexplained, wide

SOLID = 0.5
"""Opacity from which on a Gaussian says where something is."""
ON = 128
"""Of 255: from here on a pixel of a mask belongs to objects."""
POOR = 20.0
"""Held-out photographs agree worse than this only where something is wrong [dB]."""
CUT_OUT = (
    "There were no masks: what is above the floor was taken for objects. What lies on it and is "
    "thinner than 0.5 % of the scene is lost."
)
NO_FLOOR = Note(
    "There were no masks, and no floor to tell objects from: all that most photographs "
    "show was taken for objects. Give masks, or say where the floor is with --floor-at.",
    NoteKind.ASSUMED,
)
INVERTED = (
    "The masks are black in the middle of what all cameras look at, and white along the borders of "
    "the pictures: they are inverted, or of the background. White is what counts: invert them."
)
ODD = 0.01
"""Share of masks that nobody gave from which on it is worth learning again without: of pieces that
are not thin."""
AGAIN = "training-again"
"""Name of the file in which that is kept."""
ONCE = 0.8
"""Share of the work that is done when such masks were learned from once: four of 21 sets are
learned from again, so that 1.2 trainings are to be expected."""
SHOWN = 4
"""Pictures that somebody is shown of the whole scene."""
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
USUAL: dict[str, Vector] = {".spz": (0.0, 1.0, 0.0)}
"""What is up in files of a kind as a rule; in others it is -y."""


@dataclass(frozen=True)
class Intake:
    """What there is to begin with."""

    gaussians: Gaussians
    cameras: tuple[Camera, ...] = ()
    """Empty: it came without any."""
    views: Views | None = None
    """The photographs; their cameras stay as the file has them."""
    masks: Bool[np.ndarray, "V H W"] | None = None
    """Which pixels are on objects; None: unknown."""
    coloured: Bool[np.ndarray, "V H W"] | None = None
    """Which pixels have the colours of objects, where that is not to be believed alone."""
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
    """Where shapes are not to be believed, in sentences."""
    quality: Quality | None = None
    """How well pictures of the Gaussians agree with photographs held back; None: none was."""
    statements: tuple[str, ...] = ()
    """How it came about, in sentences, for the report."""
    warnings: tuple[str, ...] = ()

    @property
    def solid(self) -> np.ndarray:
        """Means of Gaussians that say where something is (M, 3)."""
        g = self.gaussians
        return g.mean[g.opacity > SOLID].astype(np.float64)

    def pictures(self) -> Sequence[UInt8[np.ndarray, "H W 3"]]:
        """Return the photographs, or pictures of a splat that came without any."""
        if self.views is not None:
            return list(self.views.rgb)
        return [picture(self.gaussians, camera) for camera in self.cameras]

    def some(self) -> dict[int, UInt8[np.ndarray, "H W 3"]]:
        """Return a few pictures from all sides, each with the number of its camera."""
        count = len(self.cameras)
        which = np.unique(np.linspace(0, count - 1, min(count, SHOWN)).round().astype(int))
        own = None if self.views is None else self.views.rgb
        pairs = ((k, self.cameras[k]) for k in which.tolist())
        return {k: picture(self.gaussians, c) if own is None else own[k] for k, c in pairs}

    def painted(self, rgb: Float[np.ndarray, "N 3"]) -> list[UInt8[np.ndarray, "H W 3"]]:
        """Return the same pictures, each followed by itself with Gaussians in flat sRGB."""
        flat = replace(self.gaussians, sh=((rgb - 0.5)[:, None] / DC).astype(np.float32))
        pairs = ((shown, picture(flat, self.cameras[k])) for k, shown in self.some().items())
        return [one for pair in pairs for one in pair]


def picture(gaussians: Gaussians, camera: Camera) -> UInt8[np.ndarray, "H W 3"]:
    """Return a picture of Gaussians before black."""
    rgb = render(gaussians, camera).rgb
    return np.round(255 * np.clip(rgb, 0, 1)).astype(np.uint8)


@dataclass(frozen=True)
class Masked:
    """By what it is said which pixels of photographs are on objects."""

    by: Path | None = None
    """A folder of masks; None: the photographs' own, if there are any."""
    grown: bool = False
    """Whether nobody, and no model, made these: what is in them that no other photograph shows is
    left out."""


OWN_MASKS = Masked()


def take_in(
    source: Path,
    training: TrainConfig,
    checkpoint: Path | None = None,
    progress: Progress = lambda fraction, words: None,
    instances: bool = False,
    masked: Masked = OWN_MASKS,
) -> Intake:
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
    if kind_of([source]) == "splat":
        if instances:
            raise UserError(f"{source} is a splat, which has no instance masks. Leave --apart out.")
        return _of_splat(source)
    shown, masks = _photographed(source, PRESETS[training.preset].longest, instances, masked)
    doubt = doubt_of_poses(source, masked.by, shown)
    points = _points(shown)
    wrong = [said for said in shown.warnings if said not in shown.done]
    # With masks, where sparse points are says less than what masks carve; what they are seen
    # through is empty.
    start = points if masks is None else shown.lines
    learning = _Learning(shown.views, start, training, checkpoint, progress)
    try:
        if masks is None or not masked.grown:
            trained, cut = learning.of(masks), ()
        else:
            trained, masks, cut = learning.of_grown(masks)
    except UserError as problem:
        raise UserError(" ".join([str(problem), *doubt])) from problem
    poor = _badly_learned(trained, len(shown.names))
    return Intake(
        trained.gaussians,
        shown.views.cameras,
        shown.views,
        masks,
        z_up=shown.z_up,
        seen=None if points is None else points.position,
        doubts=tuple(filter(None, [unseen_half(shown.views.cameras, shown.names), *poor])),
        quality=trained.quality,
        statements=(*shown.done, *cut, *_learned_how(trained, len(shown.views.cameras))),
        warnings=(*wrong, *doubt, *poor),
    )


def _of_splat(source: Path) -> Intake:
    given = read_splat(source)
    usual = USUAL.get(source.suffix.lower(), (0.0, -1.0, 0.0))
    read = (f"{given.count:,} Gaussians were read from {source.name}.",)
    return Intake(given, usual=usual, statements=read, warnings=given.warnings)


def _photographed(
    source: Path, longest: int, instances: bool, masked: Masked
) -> tuple[Photographs, Bool[np.ndarray, "V H W"] | None]:
    """Return photographs that agree with one another, and masks, if there are any.

    Raises:
        UserError: They cannot be used, lack masks that segment objects, or these are inverted.

    """
    shown = _consistent(read_photographs(source, longest, masked.by, close=True))
    if instances and shown.views.object_of_pixel is None:
        raise UserError(f"{source}: {NO_INSTANCES}")
    masks = None if shown.masks is None else shown.masks >= ON
    if masks is not None and inverted(masks, shown.views.cameras):
        raise UserError(f"{source}: {INVERTED}")
    return shown, masks


@dataclass(frozen=True)
class _Learning:
    """What Gaussians are learned from beside masks, and how; as ``train`` is given it."""

    views: Views
    start: Points | LinesOfSight | None
    how: TrainConfig
    checkpoint: Path | None
    progress: Progress

    def of(self, masks: Bool[np.ndarray, "V H W"] | None) -> Trained:
        """Learn from masks that are right, or without any."""
        return train(self.views, masks, self.start, self.how, self.checkpoint, self.progress)

    def of_grown(
        self, masks: Bool[np.ndarray, "V H W"]
    ) -> tuple[Trained, Bool[np.ndarray, "V H W"], tuple[str, ...]]:
        """Learn from masks that nobody made, without what no other photograph shows in them.

        Returns:
            What was learned, from which masks, and what was left out of these, in a sentence.

        """
        trained = replace(self, progress=within(self.progress, 0.0, ONCE)).of(masks)
        odd = unexplained(trained.gaussians, self.views, masks)
        if np.count_nonzero(wide(odd, masks)) <= ODD * np.count_nonzero(masks):
            return trained, masks, ()
        kept = None if self.checkpoint is None else self.checkpoint.with_stem(AGAIN)
        later = within(self.progress, ONCE, 1.0, ", without what is not the thing")
        left = masks & ~odd
        share = np.count_nonzero(odd) / np.count_nonzero(masks)
        views = np.count_nonzero(odd.any(axis=(1, 2)))
        said = (
            f"{share:.1%} of what masks hold shows in {views} of {len(masks)} photographs what no "
            "other shows at the same place: it stands behind, and was left out."
        )
        return replace(self, checkpoint=kept, progress=later).of(left), left, (said,)


def turned_upright(taken: Intake, up: AskedUp = "auto", floor: float | None = None) -> Intake:
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
    stated = Stated(_stated(up), floor)
    seen = points[:0] if alone else points
    frame = upright(taken.cameras, seen, taken.z_up, of_things, taken.usual, stated)
    if frame.floor_by == "objects" and taken.masks is None and sparse is not None:
        # Gaussians of a poorly learned room may be anywhere; points that pictures share are not.
        other = upright(taken.cameras, sparse, taken.z_up, of_things, taken.usual, stated)
        frame = other if other.floor_by == "plane" else frame
    if frame.floor_by == "objects" and taken.views is not None and taken.masks is not None:
        frame = _lowered(frame, taken.views, taken.masks)
    made = replace(
        taken,
        gaussians=moved_gaussians(taken.gaussians, frame.world_from_file),
        cameras=moved_cameras(taken.cameras, frame.world_from_file),
        floor=taken.masks is None and (frame.floor_by == "plane" or floor is not None),
        world_from_file=frame.world_from_file,
        statements=(*taken.statements, frame.reason),
        warnings=(*taken.warnings, *frame.warnings),
    )
    return made if made.views is None or made.masks is not None else _with_masks(made)


def _lowered(frame: Upright, views: Views, masks: Bool[np.ndarray, "V H W"]) -> Upright:
    """Put the floor where the outlines in masks say that objects touch it."""
    cameras = moved_cameras(views.cameras, frame.world_from_file)
    try:
        height = lowest(Views(views.rgb, cameras), masks)
    except UserError:  # masks agree nowhere: Gaussians are all there is
        return frame
    if height is None:
        return frame
    reason = f"{frame.reason} How low these are, outlines in masks say."
    way = similarity(shift=(0.0, 0.0, -height)) @ frame.world_from_file
    return replace(frame, world_from_file=way, reason=reason)


def _with_masks(taken: Intake) -> Intake:
    """Return the same with masks of what is above the floor, where none are given."""
    warning = CUT_OUT if taken.floor else NO_FLOOR
    masks = cut_out(taken.gaussians, taken.cameras, taken.floor)
    return replace(taken, masks=masks, warnings=(*taken.warnings, warning))


def _consistent(shown: Photographs) -> Photographs:
    """Leave out photographs whose silhouettes contradict all others', and say which."""
    if shown.masks is None:
        return shown
    wrong = outliers(shown.masks, shown.views.cameras)
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


def doubt_of_poses(
    source: Path, masked_by: Path | None = None, shown: Photographs | None = None
) -> tuple[str, ...]:
    """Return what seems wrong with the poses, as warnings.

    Points are matched in pictures as large as that was measured on: where little ones are learned
    from, a third of the points that wrong poses contradict would still be near enough.

    Args:
        source: A folder of photographs with poses.
        masked_by: A folder of masks instead of the photographs' own.
        shown: What was read of them and is used: no other counts, and it serves if it is large
            enough.

    Raises:
        UserError: They are certainly wrong.

    """
    looked = shown
    if looked is None or max(looked.views.rgb.shape[1:3]) < SIDE:
        looked = read_photographs(source, SIDE, masked_by, close=True)
        if shown is not None:
            kept = [k for k, name in enumerate(looked.names) if name in shown.names]
            looked = looked.only(kept)
    found = agreement(looked.views, looked.masks)
    if found.hopeless:
        raise UserError(f"{source}: {found.doubt}")
    return () if found.doubt is None else (found.doubt,)


def _badly_learned(trained: Trained, photographs: int) -> tuple[str, ...]:
    """Say where what was learned is not what photographs show, or where none was left to tell."""
    if trained.quality is None:
        return (
            Note(
                f"{photographs} photographs are so few that none was held back to compare with: "
                "what they do not show is made up. Take 20 to 50, from all sides.",
                NoteKind.GRAVE,
            ),
        )
    if trained.quality.psnr >= POOR:
        return ()
    return (
        Note(
            "Photographs that were not learned from look otherwise "
            f"({trained.quality.psnr:.1f} dB): shapes are not to be trusted. Look at poses and "
            "lenses, at what moved, and take more pictures.",
            NoteKind.GRAVE,
        ),
    )


def _stated(up: AskedUp) -> Vector | None:
    if up == "auto":
        return None
    sign = -1.0 if up[0] == "-" else 1.0
    x, y, z = AXES[up[-1]]
    return sign * x, sign * y, sign * z


def _points(shown: Photographs) -> Points | None:
    if shown.points is None or shown.colours is None:
        return None
    return Points(shown.points, shown.colours / 255)


def _learned_how(trained: Trained, photographs: int) -> tuple[str, ...]:
    count = f"{trained.gaussians.count:,}"
    sentences = [f"{count} Gaussians were learned from {photographs} photographs."]
    if np.isfinite(trained.ahead):
        inside, better = trained.ahead > GAIN, f"{trained.ahead:+.1f} dB on objects"
        where = "and inside of it" if inside else "alone"
        sentences.append(
            f"They began on the visual hull of the masks {where}: to begin inside, too, made "
            f"{better} in a small training."
        )
    return (*sentences, *(() if trained.quality is None else (_agreed(trained.quality),)))


def _agreed(quality: Quality) -> str:
    shown = "" if quality.psnr_things is None else f", {quality.psnr_things:.1f} dB on objects"
    return (
        f"Pictures of them agree with {len(quality.views)} photographs that they were not learned "
        f"from to {quality.psnr:.1f} dB{shown}."
    )

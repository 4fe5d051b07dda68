"""What pictures or a splat give: poses and masks where nobody gave them, and Gaussians."""

import shutil
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool

from corporeal.core.errors import BadFileError, noticed
from corporeal.core.progress import Progress, within
from corporeal.core.types import Note, NoteKind
from corporeal.io.mask_files import corrected
from corporeal.io.photographs import MASKS, has_masks, listed, read_photographs
from corporeal.io.sources import kind_of, unposed
from corporeal.reconstruction.features.maskers import split
from corporeal.reconstruction.gaussians.intake import ON, Intake, Masked, doubt_of_poses, take_in
from corporeal.reconstruction.gaussians.training_schedule import TrainConfig
from corporeal.reconstruction.masks.grown_masks import GrownMasks, grown_masks
from corporeal.reconstruction.masks_by_model import CORRECT, masks_by_model
from corporeal.reconstruction.masks_figure import FIGURE, masks_figure
from corporeal.reconstruction.reconstruct_config import AUTO, NONE, ReconstructConfig
from corporeal.reconstruction.sfm.pose import (
    POSES,
    Posed,
    moved_within,
    pose,
    pose_object,
    without_strangers,
)

POSED = 0.5
"""Share of learning from pictures that is done when poses that nobody gave are found."""
MASKED = 0.1
"""The same, of finding masks."""
WHOLE, TESTED, AGAIN = 0.7, 0.8, 0.9
"""Share of finding poses that is done when whole pictures fit together, when masks were asked about
it, and when they were asked again without pictures of something else."""
SEEN, OBJECT_POSES = "poses-seen", "poses-object"
"""Folders of masks that found poses are tested by, and of poses that are found from them."""
ALIKE, ALIKE_SEEN = "poses-alike", "poses-alike-seen"
"""The same of poses without pictures that show something else, where masks were in doubt by these.
"""
STAND_STILL = (
    "Photograph it while neither it nor what is around it moves, give masks (a folder 'masks' with "
    "the names of the pictures), or go on all the same with --force."
)
STAND_OUT = (
    "Put it on something with a pattern that does not repeat, such as a newspaper, and photograph "
    "it in steps of at most 15°. "
)
"""What helps where pictures may have been put in wrong places."""
LOOK_AT_MASKS = "Look at the masks, too. --force goes on all the same."
"""What else helps, where somebody gave masks."""
ALL_OF_IT = (
    "Give masks (a folder 'masks' with the names of the pictures), or grow them with 'corporeal "
    "masks' and correct them; or photograph it on a ground of another colour, from more sides. "
    "--force goes on with what was found."
)


def take_pictures(
    source: Path, config: ReconstructConfig, folder: Path | None, progress: Progress
) -> tuple[Intake, bool]:
    """Read a splat, or learn Gaussians from pictures, whose poses are found if nobody gave any.

    Returns:
        What there is, and whether somebody said which pixels are objects.

    Raises:
        BadFileError: Where pictures were taken from, or what they are of, cannot be told.

    """
    training = TrainConfig(config.training, seed=config.training_seed, rasteriser=config.rasteriser)
    kept = None if folder is None else folder / "training.npz"
    instances = config.apart == "masks"
    if kind_of([source]) == "splat":
        return take_in(source, training, kept, progress, instances), False
    posed = _posed(source, config, folder, progress)
    begun = 0.0 if posed is None else POSED
    posed = posed or Posed(source, (), ())
    with noticed(posed.warnings):
        found = masks_for(config, posed.folder, folder, within(progress, begun, begun + MASKED))
    with noticed((*posed.warnings, *found.warnings)):
        if found.incomplete and not config.force:
            # Under wrong poses nothing is found whole: then that is what is to be said.
            doubt = doubt_of_poses(posed.folder)
            raise BadFileError(source, " ".join([*doubt, f"{found.incomplete}."]), ALL_OF_IT)
        later = within(progress, begun + MASKED, 1.0)
        if folder is not None:
            (folder / FIGURE).unlink(missing_ok=True)
            masks_figure(posed.folder, found.folder, folder / FIGURE)
        # What somebody corrected is to be believed.
        grown = found.grown and found.folder is not None and not corrected(found.folder)
        masked = Masked(found.folder, grown)
        taken = take_in(posed.folder, training, kept, later, instances, masked)
    made = replace(
        taken,
        coloured=None if found.doubted is None else _sized(taken, posed.folder, found.doubted),
        statements=(*posed.statements, *found.statements, *taken.statements),
        warnings=(*posed.warnings, *found.warnings, *taken.warnings),
    )
    return made, taken.masks is not None and not found.grown


@dataclass(frozen=True)
class _Masks:
    """Where masks are, if they are not beside the photographs."""

    folder: Path | None = None
    statements: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    grown: bool = False
    """Whether nobody, and no model, said what an object is."""
    doubted: Path | None = None
    """Where masks are that are not to be believed."""
    incomplete: str = ""
    """Why they are not of all that the photographs are of, in a clause; empty: they are."""


def masks_for(
    config: ReconstructConfig, source: Path, folder: Path | None, progress: Progress
) -> _Masks:
    """Take masks from a folder, find them with a model, or grow them where there are none."""
    if config.masks not in (AUTO, NONE) and split(config.masks) is None:
        return _Masks(Path(config.masks))
    shots = listed(source).shots
    if config.masks == NONE or (config.masks == AUTO and has_masks(shots)):
        return _Masks()
    place = folder or Path(tempfile.mkdtemp(prefix="corporeal-"))
    if config.masks != AUTO:
        return _Masks(*masks_by_model(config, source, place, progress))
    grown = grown_masks(source, place, progress=progress)
    if grown.folder is None:
        return _Masks(None, (), grown.said, False, grown.doubted, grown.incomplete)
    kind = NoteKind.GRAVE if grown.incomplete else NoteKind.ASSUMED
    said = Note(" ".join(("There were no masks.", *grown.said, CORRECT)), kind)
    warnings = (said, *[Note(grown.beside, NoteKind.LEFT_OUT)] * bool(grown.beside))
    return _Masks(grown.folder, (), warnings, True, incomplete=grown.incomplete)


def _sized(taken: Intake, source: Path, folder: Path) -> Bool[np.ndarray, "V H W"] | None:
    """Read masks from a folder, as large as pictures are; None: not of all of them."""
    if taken.views is None:
        return None
    shape = taken.views.rgb.shape[:3]
    masks = read_photographs(source, max(shape[1:]), folder).masks
    return masks >= ON if masks is not None and masks.shape == shape else None


def _posed(
    source: Path, config: ReconstructConfig, folder: Path | None, progress: Progress
) -> Posed | None:
    """Find where pictures were taken from; None: that is known, or there are none.

    Raises:
        BadFileError: It cannot be found, or is right about what is around the object alone.

    """
    if not unposed(source):
        return None
    place = Path(tempfile.mkdtemp(prefix="corporeal-")) if folder is None else folder
    posed = pose(source, place / POSES, within(progress, 0.0, POSED * WHOLE))
    with noticed(posed.warnings):
        if config.masks != AUTO:
            return _doubted(source, posed, force=True)
        if has_masks(listed(posed.folder).shots):
            masks = posed.folder / MASKS[0]
            sure = config.force or not posed.doubt or moved_within(posed, masks) is None
            return _doubted(source, posed, sure, LOOK_AT_MASKS)
        return _seen_to_agree(source, posed, config.force, place, progress)


def _seen_to_agree(
    source: Path, posed: Posed, force: bool, place: Path, progress: Progress
) -> Posed:
    """Ask masks that are grown under found poses whether the object kept its place, too.

    Poses are in doubt where less than seven tenths of the pictures agree about what neighbours
    share. To leave out the third of them that masks speak against at most cannot mend that, so that
    it is not tried.

    Raises:
        BadFileError: It did not.

    """
    asking = within(progress, POSED * WHOLE, POSED * TESTED, ", to test the poses")
    doubted = bool(posed.doubt)
    grown = grown_masks(posed.folder, place / SEEN, None, asking, testing=True, doubted=doubted)
    if not doubted and grown.contradict and grown.doubted is not None:
        less = within(progress, POSED * TESTED, POSED * AGAIN, ", without what is something else")
        posed, grown = _less_strangers(posed, grown, grown.doubted / MASKS[0], place, less)
    if grown.folder is None:
        return _doubted(source, posed, force)
    masks = grown.folder / MASKS[0]
    if (why := moved_within(posed, masks)) is None:
        return _doubted(source, without_strangers(posed, masks), force=True)
    later = within(progress, POSED * AGAIN, POSED)
    again = pose_object(posed, masks, place / OBJECT_POSES, later)
    said = f"{why[0].upper()}{why[1:]}."
    if again is not None:
        said += " Where each was taken from was found from points on the object alone."
        return replace(again, warnings=(Note(said, NoteKind.GRAVE), *again.warnings))
    if not force:
        step = STAND_OUT + STAND_STILL if posed.doubt else STAND_STILL
        raise BadFileError(source, f"{why}, and it has too few points of its own.", step)
    return replace(posed, warnings=(Note(said, NoteKind.GRAVE), *posed.warnings))


def _less_strangers(
    posed: Posed, grown: GrownMasks, doubted: Path, place: Path, progress: Progress
) -> tuple[Posed, GrownMasks]:
    """Leave out pictures that doubted masks speak against, if masks of the others are believed.

    Args:
        posed: Where pictures were taken from.
        grown: What is returned otherwise, with the poses.
        doubted: The masks, whose outlines contradict each other.
        place: Gets the other poses and masks.
        progress: Told the fraction done and what is being done.

    """
    other = replace(posed, folder=place / ALIKE)
    shutil.rmtree(other.folder, ignore_errors=True)
    shutil.copytree(posed.folder, other.folder)
    left = without_strangers(other, doubted)
    if left != other:
        again = grown_masks(left.folder, place / ALIKE_SEEN, progress=progress, testing=True)
        if again.folder is not None:
            return left, again
    shutil.rmtree(other.folder)
    return posed, grown


def _doubted(source: Path, posed: Posed, force: bool, step: str = STAND_STILL) -> Posed:
    """Refuse poses in which neighbours share too little, or say so in a warning.

    Args:
        source: The photographs.
        posed: Where they were taken from.
        force: Whether masks agree with that, or somebody wants to go on.
        step: What to do beside showing more of a pattern.

    Raises:
        BadFileError: They are such, and nothing speaks for them.

    """
    if not posed.doubt:
        return posed
    if not force:
        raise BadFileError(source, f"{posed.doubt}.", STAND_OUT + step)
    said = Note(f"{posed.doubt[0].upper()}{posed.doubt[1:]}.", NoteKind.GRAVE)
    return replace(posed, warnings=(said, *posed.warnings))

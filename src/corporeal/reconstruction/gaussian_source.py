"""Gaussians of pictures or a splat, with poses and masks if not given."""

import shutil
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool

from corporeal.core.errors import BadFileError, notes_on_error
from corporeal.core.progress import Progress, subprogress
from corporeal.core.types import Note, NoteKind
from corporeal.io.input_files import input_kind, lacks_poses
from corporeal.io.photos.mask_files import edited_masks
from corporeal.io.photos.posed_photos import MASK_FOLDERS, has_masks, list_posed_photos, read_posed_photos
from corporeal.reconstruction.features.mask_models import split_model_spec
from corporeal.reconstruction.gaussians.gaussian_scene import (
    MASK_MIN_U8,
    GaussianScene,
    MaskSource,
    load_or_train_gaussians,
    pose_warnings,
)
from corporeal.reconstruction.gaussians.training_schedule import TrainConfig
from corporeal.reconstruction.masks.grown_masks import GrownMasks, grown_masks
from corporeal.reconstruction.masks_figure import MASKS_FIGURE_FILE, masks_figure
from corporeal.reconstruction.masks_from_model import CORRECT_MASKS_HINT, masks_from_model
from corporeal.reconstruction.reconstruct_config import MASKS_AUTO, MASKS_NONE, ReconstructConfig
from corporeal.reconstruction.sfm.find_poses import (
    POSES_FOLDER,
    FoundPoses,
    describe_moved_object,
    drop_pictures_of_something_else,
    find_object_poses,
    find_poses,
)

POSED_PROGRESS = 0.5
"""Share of learning from pictures that is done when unknown poses are estimated."""
MASKED_PROGRESS = 0.1
"""The same, of finding masks."""
WHOLE_PICTURES_PROGRESS, MASKS_TESTED_PROGRESS, RETESTED_PROGRESS = 0.7, 0.8, 0.9
"""Share of finding poses that is done when whole pictures fit together, when masks were asked about it, and when they
were asked again without pictures of something else."""
SEEN_POSES_FOLDER, OBJECT_POSES_FOLDER = "poses-seen", "poses-object"
"""Folders of masks that found poses are tested by, and of poses that are found from them."""
ALIKE_POSES_FOLDER, ALIKE_SEEN_POSES_FOLDER = "poses-alike", "poses-alike-seen"
"""The same of poses without pictures that show something else, where masks were in doubt by these.
"""
STAND_STILL_HINT = (
    "Photograph it while neither it nor what is around it moves, give masks (a folder 'masks' with "
    "the names of the pictures), or continue with --force."
)
PATTERNED_GROUND_HINT = (
    "Put it on something with a pattern that does not repeat, such as a newspaper, and photograph "
    "it in steps of at most 15°. "
)
"""What helps where pictures may have been put in wrong places."""
LOOK_AT_MASKS_HINT = "Check the masks, too. --force continues anyway."
"""Advice if masks were given."""
GIVE_MASKS_HINT = (
    "Give masks (a folder 'masks' with the names of the pictures), or grow them with 'corporeal "
    "masks' and correct them; or photograph it on a ground of another colour, from more sides. "
    "--force goes on with what was found."
)


def gaussians_from_source(
    source: Path, config: ReconstructConfig, folder: Path | None, progress: Progress
) -> tuple[GaussianScene, bool]:
    """Read a splat, or learn Gaussians from pictures, whose poses are estimated if there are none.

    Returns:
        The scene, and whether masks were given or made by a model.

    Raises:
        BadFileError: Where pictures were taken from, or what they are of, cannot be determined.
    """
    if folder is None:
        with tempfile.TemporaryDirectory(prefix="corporeal-") as name:
            return gaussians_from_source(source, config, Path(name), progress)
    training = TrainConfig(
        config.training, seed=config.training_seed, rasteriser=config.rasteriser, hull=config.resolution.hull
    )
    kept = folder / "training.npz"
    instances = config.apart == "masks"
    if input_kind([source]) == "splat":
        return load_or_train_gaussians(source, training, kept, progress, instances), False
    posed = _find_source_poses(source, config, folder, progress)
    begun = 0.0 if posed is None else POSED_PROGRESS
    posed = posed or FoundPoses(source, (), ())
    with notes_on_error(posed.warnings):
        found = find_or_grow_masks(config, posed.folder, folder, subprogress(progress, begun, begun + MASKED_PROGRESS))
    with notes_on_error((*posed.warnings, *found.warnings)):
        if found.incomplete and not config.force:
            # Under wrong poses no object is found whole: then the poses are the error to report.
            doubt = pose_warnings(posed.folder)
            raise BadFileError(source, " ".join([*doubt, f"{found.incomplete}."]), GIVE_MASKS_HINT)
        later = subprogress(progress, begun + MASKED_PROGRESS, 1.0)
        (folder / MASKS_FIGURE_FILE).unlink(missing_ok=True)
        if config.masks != MASKS_NONE:
            masks_figure(posed.folder, found.folder, folder / MASKS_FIGURE_FILE)
        # corrected masks are reliable
        grown = found.grown and found.folder is not None and not edited_masks(found.folder)
        masked = MaskSource(found.folder, grown, bare=config.masks == MASKS_NONE)
        taken = load_or_train_gaussians(posed.folder, training, kept, later, instances, masked)
    made = replace(
        taken,
        coloured=None if found.doubted is None else _read_masks_at_size(taken, posed.folder, found.doubted),
        statements=(*posed.statements, *found.statements, *taken.statements),
        warnings=(*posed.warnings, *found.warnings, *taken.warnings),
    )
    return made, taken.masks is not None and not found.grown


@dataclass(frozen=True)
class _MasksFound:
    """Where masks are, if they are not beside the photographs."""

    folder: Path | None = None
    statements: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    grown: bool = False
    """Whether they were grown, not given or made by a model."""
    doubted: Path | None = None
    """Where masks are that are unreliable."""
    incomplete: str = ""
    """Why they are not of all that the photographs are of, in a clause; empty: they are."""


def find_or_grow_masks(config: ReconstructConfig, source: Path, folder: Path, progress: Progress) -> _MasksFound:
    """Take masks from a folder, find them with a model, or grow them where there are none, unless none are wanted."""
    if config.masks not in (MASKS_AUTO, MASKS_NONE) and split_model_spec(config.masks) is None:
        return _MasksFound(Path(config.masks))
    shots = list_posed_photos(source).shots
    if config.masks == MASKS_NONE or (config.masks == MASKS_AUTO and has_masks(shots)):
        return _MasksFound()
    if config.masks != MASKS_AUTO:
        return _MasksFound(*masks_from_model(config, source, folder, progress))
    grown = grown_masks(source, folder, progress=progress)
    if grown.folder is None:
        return _MasksFound(None, (), grown.said, False, grown.doubted, grown.incomplete)
    kind = NoteKind.GRAVE if grown.incomplete else NoteKind.ASSUMED
    said = Note(" ".join(("There were no masks.", *grown.said, CORRECT_MASKS_HINT)), kind)
    warnings = (said, *[Note(grown.beside, NoteKind.LEFT_OUT)] * bool(grown.beside))
    return _MasksFound(grown.folder, (), warnings, True, incomplete=grown.incomplete)


def _read_masks_at_size(taken: GaussianScene, source: Path, folder: Path) -> Bool[np.ndarray, "V H W"] | None:
    """Read masks from a folder, as large as pictures are; None: not of all of them."""
    if taken.views is None:
        return None
    shape = taken.views.rgb.shape[:3]
    masks = read_posed_photos(source, max(shape[1:]), folder).masks
    return masks >= MASK_MIN_U8 if masks is not None and masks.shape == shape else None


def _find_source_poses(source: Path, config: ReconstructConfig, folder: Path, progress: Progress) -> FoundPoses | None:
    """Estimate camera poses; None: they are known, or there are no photographs.

    Raises:
        BadFileError: They cannot be estimated, or are right for the surroundings of the object alone.
    """
    if not lacks_poses(source):
        return None
    posed = find_poses(
        source, folder / POSES_FOLDER, subprogress(progress, 0.0, POSED_PROGRESS * WHOLE_PICTURES_PROGRESS)
    )
    with notes_on_error(posed.warnings):
        if config.masks != MASKS_AUTO:
            return _refuse_doubted_poses(source, posed, force=True)
        if has_masks(list_posed_photos(posed.folder).shots):
            masks = posed.folder / MASK_FOLDERS[0]
            sure = config.force or not posed.doubt or describe_moved_object(posed, masks) is None
            return _refuse_doubted_poses(source, posed, sure, LOOK_AT_MASKS_HINT)
        return _test_poses_by_masks(source, posed, config.force, folder, progress)


def _test_poses_by_masks(source: Path, posed: FoundPoses, force: bool, place: Path, progress: Progress) -> FoundPoses:
    """Ask masks that are grown under found poses whether the object kept its place, too.

    Poses are in doubt where less than seven tenths of the pictures agree about what neighbours share. To leave out the
    third of them that masks speak against at most cannot mend that, so that it is not tried.

    Raises:
        BadFileError: It did not.
    """
    asking = subprogress(
        progress,
        POSED_PROGRESS * WHOLE_PICTURES_PROGRESS,
        POSED_PROGRESS * MASKS_TESTED_PROGRESS,
        ", to test the poses",
    )
    doubted = bool(posed.doubt)
    grown = grown_masks(posed.folder, place / SEEN_POSES_FOLDER, None, asking, testing=True, doubted=doubted)
    if not doubted and grown.contradict and grown.doubted is not None:
        less = subprogress(
            progress,
            POSED_PROGRESS * MASKS_TESTED_PROGRESS,
            POSED_PROGRESS * RETESTED_PROGRESS,
            ", without what is something else",
        )
        posed, grown = _drop_doubted_pictures(posed, grown, grown.doubted / MASK_FOLDERS[0], place, less)
    if grown.folder is None:
        return _refuse_doubted_poses(source, posed, force)
    masks = grown.folder / MASK_FOLDERS[0]
    if (why := describe_moved_object(posed, masks)) is None:
        return _refuse_doubted_poses(source, drop_pictures_of_something_else(posed, masks), force=True)
    later = subprogress(progress, POSED_PROGRESS * RETESTED_PROGRESS, POSED_PROGRESS)
    again = find_object_poses(posed, masks, place / OBJECT_POSES_FOLDER, later)
    said = f"{why[0].upper()}{why[1:]}."
    if again is not None:
        said += " Where each was taken from was found from points on the object alone."
        return replace(again, warnings=(Note(said, NoteKind.GRAVE), *again.warnings))
    if not force:
        step = PATTERNED_GROUND_HINT + STAND_STILL_HINT if posed.doubt else STAND_STILL_HINT
        raise BadFileError(source, f"{why}, and it has too few points of its own.", step)
    return replace(posed, warnings=(Note(said, NoteKind.GRAVE), *posed.warnings))


def _drop_doubted_pictures(
    posed: FoundPoses, grown: GrownMasks, doubted: Path, place: Path, progress: Progress
) -> tuple[FoundPoses, GrownMasks]:
    """Leave out pictures that doubted masks speak against, if masks of the others are accepted."""
    other = replace(posed, folder=place / ALIKE_POSES_FOLDER)
    shutil.rmtree(other.folder, ignore_errors=True)
    shutil.copytree(posed.folder, other.folder)
    left = drop_pictures_of_something_else(other, doubted)
    if left != other:
        again = grown_masks(left.folder, place / ALIKE_SEEN_POSES_FOLDER, progress=progress, testing=True)
        if again.folder is not None:
            return left, again
    shutil.rmtree(other.folder)
    return posed, grown


def _refuse_doubted_poses(source: Path, posed: FoundPoses, force: bool, step: str = STAND_STILL_HINT) -> FoundPoses:
    """Reject poses in which neighbours share too little, or say so in a warning.

    Raises:
        BadFileError: They are such, and nothing speaks for them.
    """
    if not posed.doubt:
        return posed
    if not force:
        raise BadFileError(source, f"{posed.doubt}.", PATTERNED_GROUND_HINT + step)
    said = Note(f"{posed.doubt[0].upper()}{posed.doubt[1:]}.", NoteKind.GRAVE)
    return replace(posed, warnings=(said, *posed.warnings))

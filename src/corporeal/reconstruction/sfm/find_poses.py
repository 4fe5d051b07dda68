"""Pose estimation of photographs in up to three attempts."""

import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from corporeal.core import store
from corporeal.core.deserialize import from_plain
from corporeal.core.errors import BadFileError, notes_on_error
from corporeal.core.progress import Progress, subprogress
from corporeal.core.types import Note, NoteKind, note_kinds, notes_with_kinds
from corporeal.io.input_files import VIDEO_SUFFIXES
from corporeal.io.photos.colmap import read_colmap
from corporeal.io.photos.posed_photos import MASK_FOLDERS, read_posed_photos
from corporeal.multiview.silhouette_coherence import MIN_MASK_FILLED_FRACTION
from corporeal.multiview.view_coverage import unseen_side_text
from corporeal.reconstruction.sfm.cameras_figure import cameras_figure
from corporeal.reconstruction.sfm.doppelgangers import (
    ONE_CAMERA_HINT,
    describe_mirrored,
    neighbours_support_model,
    remove_doppelgangers,
)
from corporeal.reconstruction.sfm.mask_consistency import (
    hull_fill_fraction,
    pictures_of_something_else,
    remove_by_masks,
)
from corporeal.reconstruction.sfm.picture_blur import blurred_pictures
from corporeal.reconstruction.sfm.place_groups import (
    SORT_PHOTOGRAPHS_HINT,
    WALK_AROUND_HINT,
    copies_share_enough,
    describe_missing_poses,
    describe_places,
    drop_other_places,
    hopelessness_reason,
    match_small_copies,
    place_groups,
)
from corporeal.reconstruction.sfm.pose_acceptance import (
    HOLD_STILL_HINT,
    MAX_BLURRED_FRACTION,
    MORE_OVERLAP_HINT,
    mask_contradiction_doubt,
    model_doubts,
    neighbour_doubt,
    some_names,
    thorough_in_vain,
    too_few_placed,
)
from corporeal.reconstruction.sfm.prepare_images import (
    IMAGES_FOLDER,
    PHOTOGRAPHS_HINT,
    PreparedImages,
    count_single_sizes,
    load_prepared_images,
    prepare_images,
)
from corporeal.reconstruction.sfm.principal_points import (
    CROPPED_SPREAD_FRACTION,
    SLIGHT_SPREAD_FRACTION,
    UNCROPPED_HINT,
    principal_point_spread,
    spread_clause,
    spread_sentence,
)
from corporeal.reconstruction.sfm.sfm_run import (
    SfmRun,
    SfmStrategy,
    match_partners,
    remove_pictures,
    require_pycolmap,
    run_sfm,
)
from corporeal.reconstruction.sfm.video_frames import write_video_frames

POSES_FOLDER = "poses"
"""Folder of a reconstruction in which they are kept."""
STRATEGY_CLAUSES: dict[SfmStrategy, str] = {
    "plain": "",
    "masked": ", from points on objects alone",
    "thorough": ", at the thorough attempt",
}
MIN_PHOTOGRAPHS = 6
"""Photographs: fewer that were taken all around are more than 60° apart, and share nothing."""
FOUND_POSES_FILE, BEGUN_POSES_FILE, CAMERAS_FIGURE_FILE = "poses.json", "begun.json", "cameras.png"
POSES_METHOD_VERSION = 9
"""Raised when other poses would be found: those of an older method are looked for again."""
PREPARED_PROGRESS = 0.1
"""Share of the work that is done when photographs are read."""
PLACES_PROGRESS = 0.15
"""The same, when it is known whether they show one place."""
SPARSE_POINTS_WARNING = (
    "Points that pictures share are few, but they agree with what neighbours show. A search for more was rejected."
)
LOOKING_MESSAGE = "looking whether all show one place"
STRATEGY_PROGRESS: dict[SfmStrategy, float] = {"plain": 0.5, "masked": 0.7, "thorough": 1.0}
"""The same, after each attempt, in their order."""


@dataclass(frozen=True)
class FoundPoses:
    """Photographs whose poses are known now."""

    folder: Path
    """Holds ``images`` and a COLMAP model, ``sparse/0``."""
    statements: tuple[str, ...]
    warnings: tuple[str, ...]
    doubt: str = ""
    """Why they are reliable only if masks agree with them, in a clause."""


@dataclass(frozen=True)
class _PosesRecord:
    """What ``poses.json`` holds."""

    statements: tuple[str, ...]
    warnings: tuple[str, ...]
    refused: str
    """Why there are no poses; "": there are."""
    attempts: tuple[SfmRun, ...]
    what_to_do: str = MORE_OVERLAP_HINT
    doubt: str = ""
    kind_of_warning: tuple[NoteKind, ...] = ()


def _save_record(folder: Path, found: _PosesRecord) -> None:
    store.write_json(folder / FOUND_POSES_FILE, replace(found, kind_of_warning=note_kinds(found.warnings)))


def _load_record(folder: Path) -> _PosesRecord:
    found = from_plain(_PosesRecord, store.read_json(folder / FOUND_POSES_FILE))
    return replace(found, warnings=notes_with_kinds(found.warnings, found.kind_of_warning))


def find_poses(source: Path, folder: Path, progress: Progress) -> FoundPoses:
    """Find the poses of photographs, or of frames of a video.

    Args:
        source: A folder of photographs, or a video.
        folder: Gets pictures and model. What is there of the same source is not done again.
        progress: Called with the fraction done and a description.

    Raises:
        UserError: pycolmap is not installed, or the poses cannot be found or not be accepted.
    """
    if not source.exists():
        raise BadFileError(source, "there is no such file or folder.", "Check the path.")
    require_pycolmap()
    begun = {"source": store.path_digest(source), "method": POSES_METHOD_VERSION}
    if not (folder / BEGUN_POSES_FILE).exists() or store.read_json(folder / BEGUN_POSES_FILE) != begun:
        shutil.rmtree(folder, ignore_errors=True)
        store.write_json(folder / BEGUN_POSES_FILE, begun)
    if (folder / FOUND_POSES_FILE).exists():
        kept = _load_record(folder)
    else:
        kept = _find_or_load_poses(source, folder, progress)
        _save_record(folder, kept)
    if kept.refused:
        with notes_on_error(kept.warnings):
            raise BadFileError(source, kept.refused, kept.what_to_do)
    return FoundPoses(folder, kept.statements, kept.warnings, kept.doubt)


def describe_moved_object(posed: FoundPoses, masks: Path) -> str | None:
    """Return in a clause that an object did not keep its place in what is around it; None: it did."""
    share = hull_fill_fraction(posed.folder / "sparse" / "0", masks)
    if share >= MIN_MASK_FILLED_FRACTION:
        return None
    wrong = "they were put in wrong places, as where a pattern repeats, " if posed.doubt else ""
    return (
        "the pictures fit together by what is around the object, but its outlines contradict one "
        f"another (together they leave {share:.0%} of what each shows): {wrong}some of them show "
        "something else, or it was moved or turned over between the pictures"
    )


def drop_pictures_of_something_else(posed: FoundPoses, masks: Path) -> FoundPoses:
    """Leave out pictures that show something else where the others show the object, and say so.

    What stood on the same floor is placed by this, as well as the object is. It is kept with the poses that they were
    left out.

    Args:
        posed: Poses that were found from whole pictures.
        masks: Of the object, grown under these, with the names of its pictures.
    """
    place = posed.folder / "sparse" / "0"
    names = pictures_of_something_else(place, masks)
    if not names:
        return posed
    remove_pictures(place, names)
    said = Note(
        f"{len(names)} photographs show something else where the others show the object, or show "
        "it moved: their outlines contradict those of the others. They were left out: "
        f"{some_names(names)}.",
        NoteKind.LEFT_OUT,
    )
    kept = _load_record(posed.folder)
    kept = replace(kept, warnings=(*kept.warnings, said))
    _save_record(posed.folder, kept)
    return replace(posed, warnings=kept.warnings)


def find_object_poses(posed: FoundPoses, masks: Path, folder: Path, progress: Progress) -> FoundPoses | None:
    """Find the poses again, from points on the object alone.

    Args:
        posed: What was found from whole pictures.
        masks: Of the object, under the names of these.
        folder: Gets pictures and model. What is there of the same is not done again.
        progress: Called with the fraction done and a description.

    Returns:
        Poses that can be accepted and that masks agree with; None: there are none.
    """
    begun = {
        "source": store.path_digest(posed.folder),
        "masks": store.path_digest(masks),
        "method": POSES_METHOD_VERSION,
    }
    if not (folder / BEGUN_POSES_FILE).exists() or store.read_json(folder / BEGUN_POSES_FILE) != begun:
        shutil.rmtree(folder, ignore_errors=True)
        store.write_json(folder / BEGUN_POSES_FILE, begun)
    if (folder / FOUND_POSES_FILE).exists():
        kept = _load_record(folder)
    else:
        for name, place in ((IMAGES_FOLDER, posed.folder / IMAGES_FOLDER), (MASK_FOLDERS[0], masks)):
            shutil.copytree(place, folder / name, dirs_exist_ok=True)
        gathered = load_prepared_images(folder)
        attempt = _check_model(run_sfm(folder, folder / "masked", gathered, "masked", progress), folder, gathered)
        why = [*model_doubts(attempt), *filter(None, [mask_contradiction_doubt(attempt)])]
        shutil.rmtree(folder / MASK_FOLDERS[0])  # they were grown under other poses
        if why:
            kept = _PosesRecord((), (), "; ".join(why), (attempt,))
        else:
            kept = _record_of_runs(folder, gathered, (), (attempt,), attempt)
        _save_record(folder, kept)
    return None if kept.refused else FoundPoses(folder, kept.statements, kept.warnings)


def _find_or_load_poses(source: Path, folder: Path, progress: Progress) -> _PosesRecord:
    said, gathered = _prepare_source(source, folder, subprogress(progress, 0.0, PREPARED_PROGRESS))
    if (count := len(gathered.names)) < MIN_PHOTOGRAPHS:
        few = f"{count} photographs are too few to find where they were taken from."
        return _PosesRecord((), gathered.said, few, (), PHOTOGRAPHS_HINT)
    looked = _find_places(folder, gathered, subprogress(progress, PREPARED_PROGRESS, PLACES_PROGRESS))
    if isinstance(looked, _PosesRecord):
        return looked
    gathered, others = looked
    tried, smeared = _try_strategies(folder, gathered, progress)
    best = _best_by_masks(tried, folder, gathered)
    if best is not None:
        if (why := too_few_placed(best, others)) is not None:
            return _refusal([why], gathered, smeared, tried=tuple(tried))
        place = folder / best.way / "sparse" / "0"
        if (why := describe_mirrored(read_colmap(place))) is not None:
            return _PosesRecord((), gathered.said, describe_missing_poses([why], others), tuple(tried), ONE_CAMERA_HINT)
        if (spread := principal_point_spread(place)) >= CROPPED_SPREAD_FRACTION:
            why = describe_missing_poses([spread_clause(spread)], others)
            return _PosesRecord((), gathered.said, why, tuple(tried), UNCROPPED_HINT)
        if spread >= SLIGHT_SPREAD_FRACTION:
            gathered = replace(gathered, said=(*gathered.said, spread_sentence(spread)))
        return _record_of_runs(folder, gathered, tuple(said), tuple(tried), best)
    best = max(tried, key=lambda attempt: attempt.registered)
    return _refusal(model_doubts(best), gathered, smeared, others, tuple(tried))


def _refusal(
    why: list[str], gathered: PreparedImages, smeared: tuple[str, ...], others: int = 0, tried: tuple[SfmRun, ...] = ()
) -> _PosesRecord:
    """Reject, and say which pictures are blurred, if that may be why."""
    total = len(gathered.names)
    if smeared:
        why = [*why, f"{len(smeared)} of {total} pictures are blurred ({some_names(smeared)})"]
    what_to_do = HOLD_STILL_HINT if len(smeared) >= MAX_BLURRED_FRACTION * total else MORE_OVERLAP_HINT
    what_to_do = UNCROPPED_HINT if count_single_sizes(gathered.sizes) else what_to_do
    return _PosesRecord((), gathered.said, describe_missing_poses(why, others), tried, what_to_do)


def _try_strategies(folder: Path, gathered: PreparedImages, progress: Progress) -> tuple[list[SfmRun], tuple[str, ...]]:
    """Attempt until one is accepted; return all, and which pictures are blurred if one was not."""
    tried: list[SfmRun] = []
    smeared: tuple[str, ...] = ()
    before = PLACES_PROGRESS
    for way, until in STRATEGY_PROGRESS.items():
        share, before = (before, until), until
        if not _is_worth_trying(way, folder, tried, len(smeared)):
            continue
        attempt = run_sfm(folder, folder / way, gathered, way, subprogress(progress, *share))
        tried.append(_check_model(attempt, folder, gathered))
        if not model_doubts(tried[-1]) and mask_contradiction_doubt(tried[-1]) is None:
            break
        smeared = smeared or blurred_pictures(folder / IMAGES_FOLDER, gathered.names)
    return tried, smeared


def _find_places(
    folder: Path, gathered: PreparedImages, progress: Progress
) -> tuple[PreparedImages, int] | _PosesRecord:
    """Look at small copies: which photographs show one place, or why the long search is in vain.

    Returns:
        What is searched, and how many photographs show another place.
    """
    if (folder / MASK_FOLDERS[0]).is_dir():  # what was turned over shares nothing, and masks help
        return gathered, 0
    looked = match_small_copies(folder, gathered, lambda f: progress(f, LOOKING_MESSAGE))
    if (why := hopelessness_reason(looked.shared)) is not None:
        return _refusal([why], gathered, blurred_pictures(folder / IMAGES_FOLDER, gathered.names))
    if (why := looked.stood_still) is not None:
        return _PosesRecord((), gathered.said, describe_missing_poses([why], 0), (), WALK_AROUND_HINT)
    gathered = replace(gathered, said=(*gathered.said, *filter(None, [looked.said])))
    groups = place_groups(looked.shared)
    if groups.mixed:
        return _PosesRecord((), gathered.said, describe_places(groups, gathered.names), (), SORT_PHOTOGRAPHS_HINT)
    kept = np.setdiff1d(np.arange(len(gathered.names)), groups.beside)
    if groups.beside:
        gathered = drop_other_places(gathered, groups)
    shared = looked.shared[np.ix_(kept, kept)]
    fine = not copies_share_enough(shared, gathered.sizes)
    pairs = tuple(match_partners(shared))
    return replace(gathered, doubled=fine, pairs=pairs), len(groups.beside)


def _check_model(attempt: SfmRun, folder: Path, gathered: PreparedImages) -> SfmRun:
    """Take out of a model which pictures cannot be where it has them, by neighbours and masks."""
    place = folder / attempt.way / "sparse" / "0"
    return remove_by_masks(remove_doppelgangers(attempt, place, gathered), folder, place)


def _best_by_masks(tried: list[SfmRun], folder: Path, gathered: PreparedImages) -> SfmRun | None:
    """Return the first attempt of those that masks agree with best, as masks may be poor; or None.

    Where its neighbours contradict, one that was doubted for few points alone, and with which neighbours and masks
    agree, is taken.
    """
    believed = [attempt for attempt in tried if not model_doubts(attempt)]
    best = max(believed, key=lambda attempt: attempt.filled, default=None)
    if best is None or not best.parted:
        return best
    for attempt in tried:
        place = folder / attempt.way / "sparse" / "0"
        if mask_contradiction_doubt(attempt) is None and neighbours_support_model(attempt, place, gathered):
            return attempt
    return best


def _is_worth_trying(way: SfmStrategy, folder: Path, tried: list[SfmRun], smeared: int) -> bool:
    """Return whether an attempt can better those before: thorough where none is accepted."""
    if way == "masked":
        return (folder / MASK_FOLDERS[0]).is_dir()
    if way == "plain":
        return True
    return all(model_doubts(attempt) for attempt in tried) and not thorough_in_vain(tried[0], smeared)


def _prepare_source(source: Path, folder: Path, progress: Progress) -> tuple[list[str], PreparedImages]:
    if source.suffix.lower() not in VIDEO_SUFFIXES:
        return [], prepare_images(source, folder, progress)
    frames = folder / "frames"
    said = write_video_frames(source, frames, subprogress(progress, 0.0, 0.7))
    gathered = prepare_images(frames, folder, subprogress(progress, 0.7, 1.0))
    shutil.rmtree(frames)
    return said, gathered


def _accept_model(out: Path, folder: Path) -> None:
    """Put the model where it is looked for, and drop what it was made of."""
    shutil.rmtree(folder / "sparse", ignore_errors=True)
    shutil.move(out / "sparse", folder / "sparse")
    for way in STRATEGY_PROGRESS:
        shutil.rmtree(folder / way, ignore_errors=True)


def _record_of_runs(
    folder: Path, gathered: PreparedImages, said: tuple[str, ...], tried: tuple[SfmRun, ...], last: SfmRun
) -> _PosesRecord:
    _accept_model(folder / last.way, folder)
    statement = (
        f"Where {last.registered} of {last.pictures} photographs were taken from was found by "
        f"COLMAP{STRATEGY_CLAUSES[last.way]}: {last.points:,} points, "
        f"{last.reprojection:.2f} px reprojection error, focal length {last.focal:.2f} × the "
        "longer side."
    )
    if model_doubts(last):
        said = (*said, SPARSE_POINTS_WARNING)
    warnings = list(gathered.said)
    if last.left_out:
        warnings.append(
            Note(
                f"{len(last.left_out)} of {last.pictures} photographs do not fit the others and "
                f"were left out: {some_names(last.left_out)}.",
                NoteKind.LEFT_OUT,
            )
        )
    if last.misplaced:
        warnings.append(
            Note(
                f"{len(last.misplaced)} photographs look like others that were taken from another "
                f"side of what looks alike, and were left out: {some_names(last.misplaced)}.",
                NoteKind.LEFT_OUT,
            )
        )
    if last.astray:
        warnings.append(
            Note(
                f"{len(last.astray)} photographs fit the others by what is around the object, but "
                f"not by their masks, and were left out: {some_names(last.astray)}. The floor's "
                "pattern repeats, or the mask shows something else.",
                NoteKind.LEFT_OUT,
            )
        )
    warnings += filter(None, [mask_contradiction_doubt(last)])
    seen = read_posed_photos(folder, longest=64)
    cameras_figure(seen, folder / CAMERAS_FIGURE_FILE)
    unseen = unseen_side_text(seen.views.cameras, seen.names)
    warnings += filter(None, [unseen])
    doubt = neighbour_doubt(last)
    return _PosesRecord((*said, statement), tuple(warnings), "", tried, doubt=doubt)

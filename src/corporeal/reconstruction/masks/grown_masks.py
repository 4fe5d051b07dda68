"""Grown masks of photographs, written to editable files."""

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from corporeal.core import store
from corporeal.core.progress import Progress, no_progress, subprogress
from corporeal.core.types import Views
from corporeal.io.photos.mask_files import (
    MASK_RECORD_FILE,
    edited_masks,
    mask_file_names,
    mask_in_photo_pixels,
    read_mask_record,
    write_mask,
    write_mask_record,
)
from corporeal.io.photos.posed_photos import MASK_FOLDERS, PosedPhotos, list_posed_photos, read_posed_photos
from corporeal.reconstruction.masks.mask_prompts import MaskPrompt, picture_prompt, seeds_from_prompt
from corporeal.reconstruction.masks.mask_quality import (
    MAX_COLOUR_OVERLAP,
    bordering_fraction,
    incompleteness_reason,
    lacking_attachment_reason,
    mask_doubt,
    outlines_contradict,
    thinness_reason,
)
from corporeal.reconstruction.masks.mask_seeds import MaskSeeds, seeds_from_cameras
from corporeal.reconstruction.masks.merge_attachments import merge_attachments
from corporeal.reconstruction.masks.reduce_views import reduce_views
from corporeal.reconstruction.masks.region_growing import (
    MASK_PICTURE_PX,
    ROUND_PICTURE_PX,
    RegionGrowingResult,
    grow_masks,
)

FLAT_TAKEN_STATEMENT = "Flat areas of their colours on the floor were segmented as objects, too."
OTHER_COLOURS_STATEMENT = "What stands there and borders on it in other colours was taken in."
BY_FLOOR_STATEMENT = "It was separated from a floor of its colours by the floor's texture."
DOUBTED_FOLDER = "doubted"
"""Folder of masks that are unreliable: what colours alone would take for objects."""
MASKS_METHOD_VERSION = 15
"""Raised when other masks would be grown: those of an older method are grown again."""
PAINT_MASKS_HINT = (
    "If it is meant, too, paint it white in the masks, or give masks of all (a folder 'masks' with "
    "the names of the pictures); 'corporeal masks' with --at grows masks of it alone."
)
UNSURE_OVERLAP_FRACTION = 0.5
"""Share of the overlap of colours that is doubted, from which on the floor is asked, too. Not where masks test poses:
outlines of what was turned over leave some of it in what is around it."""
GROWN_PROGRESS = 0.8
"""Share of the work that is done when masks are grown."""
GROWN_ONCE_PROGRESS, GROWN_TWICE_PROGRESS, GROWN_THRICE_PROGRESS = 0.4, 0.6, 0.8
"""Share of growing them that is done when they were grown once, with what lies flat, and with what borders on them."""


@dataclass(frozen=True)
class GrownMasks:
    """What came of it."""

    folder: Path | None
    """Holds the masks; None: they are unreliable, and were not written."""
    said: tuple[str, ...]
    """How they came about, or why there are none, in sentences."""
    doubted: Path | None = None
    """Holds masks that are unreliable, if there are any."""
    incomplete: str = ""
    """Why masks do not show all of the photographed object, in a clause; empty: they do."""
    beside: str = ""
    """What stands on the floor beside what they show, in sentences; empty: nothing is known of it, or a person
    corrected them."""
    contradict: bool = False
    """Whether they are unreliable because their outlines contradict each other."""


def grown_masks(
    source: Path,
    folder: Path,
    pointed: MaskPrompt | None = None,
    progress: Progress = no_progress,
    testing: bool = False,
    doubted: bool = False,
) -> GrownMasks:
    """Grow masks of posed photographs, and write them.

    Args:
        source: A folder of photographs with poses. Masks that it has are not looked at.
        folder: Gets ``masks`` and ``masks.json``, or ``doubted/masks``. Masks of the same that lie there are kept, with
            their corrections.
        pointed: At what, in which photograph; None: at what all cameras look at.
        progress: Called with the fraction done and a description.
        testing: Whether poses are tested by them: places of the floor, which these poses know, are asked less.
        doubted: Whether something else speaks against these poses, too: where outlines then contradict each other,
            growing ends.

    Raises:
        UserError: The photographs cannot be used, or nothing is at the place that is pointed at.
    """
    made_by = store.result_key(
        f"grown masks {MASKS_METHOD_VERSION}", (pointed, testing, *("doubted",) * doubted), [store.path_digest(source)]
    )
    if (kept := _load_kept_masks(folder, made_by)) is not None:
        return kept
    progress(0.0, "reading photographs")
    shown = read_posed_photos(source, MASK_PICTURE_PX, bare=True)
    rough = reduce_views(shown.views, ROUND_PICTURE_PX)
    seeds = _seeds_of_growing(source, shown, rough, pointed)
    alone = pointed is not None
    growing, unsure = (subprogress(progress, 0.0, GROWN_PROGRESS), 1.0 if testing else UNSURE_OVERLAP_FRACTION)
    grown, more = _grow_and_describe(shown.views, seeds, alone, growing, unsure, doubted)
    why = mask_doubt(grown)
    lacks = (
        incompleteness_reason(grown)
        or ("" if alone or why else lacking_attachment_reason(grown) or thinness_reason(grown))
        or ""
    )
    for name in (MASK_FOLDERS[0], DOUBTED_FOLDER, MASK_RECORD_FILE):
        _remove_masks(folder / name)
    if grown is None or (why is not None and pointed is None):
        said = (f"No masks were grown from what all photographs show: {why}.",)
        if grown is not None:
            _write_masks(source, shown, grown, folder / DOUBTED_FOLDER, progress)
        apart = outlines_contradict(grown)
        write_mask_record(folder, made_by, said, lacks, contradict=apart)
        return GrownMasks(None, said, _doubted_folder(folder), lacks, contradict=apart)
    _write_masks(source, shown, grown, folder, progress)
    said = (_mask_statements(grown, pointed), *more, *(f"Check them: {w}." for w in (why, lacks) if w))
    other = _beside_sentence(grown, shown.names) if pointed is None else ""
    write_mask_record(folder, made_by, said, lacks, other)
    return GrownMasks(folder, said, incomplete=lacks, beside=other)


def _load_kept_masks(folder: Path, made_by: str) -> GrownMasks | None:
    """Return masks that lie there and were made so, with what was corrected; None: others."""
    record = read_mask_record(folder)
    if record is None or record.made_by != made_by:
        return None
    changes = _corrections(folder)
    lacks, other = ("", "") if changes else (record.incomplete, record.beside)
    believed = folder if record.digest_of else None
    said = (*record.said, *changes)
    return GrownMasks(believed, said, _doubted_folder(folder), lacks, other, record.contradict)


def _seeds_of_growing(source: Path, shown: PosedPhotos, rough: Views, pointed: MaskPrompt | None) -> MaskSeeds:
    if pointed is None:
        return seeds_from_cameras(rough, shown.points)
    return seeds_from_prompt(rough, shown.points, picture_prompt(source, shown, rough, pointed))


def _grow_and_describe(
    views: Views,
    seeds: MaskSeeds,
    alone: bool,
    progress: Progress,
    unsure: float = UNSURE_OVERLAP_FRACTION,
    doubted_poses: bool = False,
) -> tuple[RegionGrowingResult | None, list[str]]:
    """Grow masks, and say what is in them beside what has their colours and stands.

    Plates are as flat as print on paper, which is no object. Where so much of the colours of objects lies beside them,
    colours decide, if masks are complete and not doubted then. What hangs on it in other colours is taken in unless it
    is asked for alone. Where masks are then still doubted, or lack what has other colours, or are near to being doubted
    for their colours, the floor has the colours of the object, and how well these fit it at their place counts, too, if
    masks are right by it, and better than masks that were not doubted. None of that mends outlines that contradict each
    other under poses that something else speaks against, too.
    """
    grown, flat = grow_masks(views, seeds, subprogress(progress, 0.0, GROWN_ONCE_PROGRESS)), False
    if doubted_poses and outlines_contradict(grown):
        return grown, []
    if incompleteness_reason(grown) is not None:
        again = subprogress(progress, GROWN_ONCE_PROGRESS, GROWN_TWICE_PROGRESS, ", with what lies flat on the floor")
        wider = grow_masks(views, seeds, again, flat=True)
        flat = mask_doubt(wider) is None and incompleteness_reason(wider) is None
        grown = wider if flat else grown
    said = [FLAT_TAKEN_STATEMENT] if flat else []
    if grown is not None and alone:
        return grown, [*said, *_part_sentence(bordering_fraction(grown))]
    last = subprogress(
        progress, GROWN_TWICE_PROGRESS, GROWN_THRICE_PROGRESS, ", with what borders on it in other colours"
    )
    whole = grown and merge_attachments(views, seeds, grown, last, flat)
    said = said if whole is grown else [*said, OTHER_COLOURS_STATEMENT]
    doubted = mask_doubt(whole) is not None
    if incompleteness_reason(whole) is not None and not doubted:
        return whole, said
    bad = doubted or lacking_attachment_reason(whole) is not None
    if whole is None or bad or whole.alike > unsure * MAX_COLOUR_OVERLAP:
        by_floor = subprogress(progress, GROWN_THRICE_PROGRESS, 1.0, ", by what the floor shows at each place")
        fitted = grow_masks(views, seeds, by_floor, fitting=True)
        if fitted is not None and _is_sound(fitted):
            if whole is None or bad or _is_better(fitted, whole):
                return fitted, [BY_FLOOR_STATEMENT]
    return whole, said


def _is_sound(grown: RegionGrowingResult) -> bool:
    return (
        mask_doubt(grown) is None and incompleteness_reason(grown) is None and lacking_attachment_reason(grown) is None
    )


def _is_better(one: RegionGrowingResult, other: RegionGrowingResult) -> bool:
    """Return whether colours are separated better, and masks agree better with their hull."""
    return one.alike < other.alike and one.coherence > other.coherence


def _part_sentence(much: float) -> list[str]:
    """State that what was pointed at may be a part of something."""
    if not much:
        return []
    return [
        f"It may be a part: {much:.0%} as much in other colours stands on the floor and borders "
        "on it. If that is meant, too, give a box around all of it (--box), or paint it white."
    ]


def _write_masks(
    source: Path, shown: PosedPhotos, grown: RegionGrowingResult, folder: Path, progress: Progress
) -> None:
    shots = list_posed_photos(source).shots
    file_of = dict(zip((shot.name for shot in shots), mask_file_names(shots), strict=True))
    shot_of = {shot.name: shot for shot in shots}
    with store.disk_errors(folder):
        for k, (name, inside) in enumerate(zip(shown.names, grown.inside, strict=True)):
            progress(GROWN_PROGRESS + (1 - GROWN_PROGRESS) * k / len(shown.names), "writing masks")
            own = mask_in_photo_pixels(inside, shot_of[name])
            if own is not None:
                write_mask(folder, file_of[name], own)


def _mask_statements(grown: RegionGrowingResult, pointed: MaskPrompt | None) -> str:
    what = "what all cameras look at" if pointed is None else "what was pointed at"
    return (
        f"Masks were grown from colours and the visual hull of {what}; {grown.coherence:.0%} of "
        "them and of the silhouettes of their hull agree."
    )


def _beside_sentence(grown: RegionGrowingResult, names: Sequence[str]) -> str:
    if (other := grown.beside) is None:
        return ""
    return (
        f"Something else stands on the floor beside it and was left out: about {other.as_large:.0%}"
        f" as large in the pictures, in {names[other.view]} at {other.across:.0%} of the width from"
        f" the left and {other.down:.0%} of the height from the top. {PAINT_MASKS_HINT}"
    )


def _corrections(folder: Path) -> list[str]:
    count = len(edited_masks(folder))
    return [f"{count} of the masks were corrected manually."] * bool(count)


def describe_masks_in(folder: Path | None) -> str:
    """Say in a sentence where masks lie that were grown, for correction; "": there are none."""
    if folder is None:
        return ""
    place = folder if (folder / MASK_FOLDERS[0]).is_dir() else _doubted_folder(folder)
    if place is None:
        return ""
    how = "" if place == folder else ", and rejected,"
    return (
        f"Masks that were grown from colours{how} lie in {place / MASK_FOLDERS[0]}: check and "
        f"correct them, and use them with --masks {place}."
    )


def _doubted_folder(folder: Path) -> Path | None:
    return folder / DOUBTED_FOLDER if (folder / DOUBTED_FOLDER / MASK_FOLDERS[0]).is_dir() else None


def _remove_masks(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)

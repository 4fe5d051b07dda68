"""Masks of photographs that have none, grown, and written where people can correct them."""

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from corporeal.core import store
from corporeal.core.progress import Progress, within
from corporeal.core.types import Views
from corporeal.io.mask_files import (
    RECORD,
    corrected,
    file_names,
    in_own_pixels,
    read_record,
    write_mask,
    write_record,
)
from corporeal.io.photographs import MASKS, Photographs, listed, read_photographs
from corporeal.reconstruction.masks.doubt import (
    ALIKE,
    bordering,
    contradict,
    doubt,
    incomplete,
    lacking,
    too_thin,
)
from corporeal.reconstruction.masks.grow import FINE, ROUGH, Grown, grow
from corporeal.reconstruction.masks.pointed import Pointed, pointed_at, spot_of
from corporeal.reconstruction.masks.reduced import reduced
from corporeal.reconstruction.masks.seeds import Seeds, looked_at
from corporeal.reconstruction.masks.taken_in import taken_in

FLAT = "What has their colours and lies flat on the floor was taken for objects, too."
OTHER_COLOURS = "What stands there and borders on it in other colours was taken in."
BY_FLOOR = "It was told from a floor of its colours by what the floor shows at each of its places."
DOUBTED = "doubted"
"""Folder of masks that are not to be believed: what colours alone would take for objects."""
METHOD = 15
"""Raised when other masks would be grown: those of an older method are grown again."""
HAVE_IT = (
    "If it is meant, too, paint it white in the masks, or give masks of all (a folder 'masks' with "
    "the names of the pictures); 'corporeal masks' with --at grows masks of it alone."
)
UNSURE = 0.5
"""Share of the overlap of colours that is doubted, from which on the floor is asked, too. Not where
masks test poses: outlines of what was turned over leave some of it in what is around it."""
GROWN = 0.8
"""Share of the work that is done when masks are grown."""
ONCE, TWICE, THRICE = 0.4, 0.6, 0.8
"""Share of growing them that is done when they were grown once, with what lies flat, and with what
borders on them."""


@dataclass(frozen=True)
class GrownMasks:
    """What came of it."""

    folder: Path | None
    """Holds the masks; None: they are not to be believed, and were not written."""
    said: tuple[str, ...]
    """How they came about, or why there are none, in sentences."""
    doubted: Path | None = None
    """Holds masks that are not to be believed, if there are any."""
    incomplete: str = ""
    """Why nobody can tell all of what the photographs are of, in a clause; empty: masks do."""
    beside: str = ""
    """What stands on the floor beside what they show, in sentences; empty: nothing is known of it,
    or somebody corrected them."""
    contradict: bool = False
    """Whether they are not to be believed because their outlines contradict each other."""


def grown_masks(
    source: Path,
    folder: Path,
    pointed: Pointed | None = None,
    progress: Progress = lambda fraction, words: None,
    testing: bool = False,
    doubted: bool = False,
) -> GrownMasks:
    """Grow masks of posed photographs, and write them.

    Args:
        source: A folder of photographs with poses. Masks that it has are not looked at.
        folder: Gets ``masks`` and ``masks.json``, or ``doubted/masks``. Masks of the same that lie
            there are kept, and what somebody corrected in them.
        pointed: At what, in which photograph; None: at what all cameras look at.
        progress: Told the fraction done and what is being done.
        testing: Whether poses are tested by them: places of the floor, which these poses know, are
            asked less.
        doubted: Whether something else speaks against these poses, too: where outlines then
            contradict each other, growing ends.

    Raises:
        UserError: The photographs cannot be used, or nothing is at the place that is pointed at.

    """
    made_by = store.key(
        f"grown masks {METHOD}", (pointed, testing, *("doubted",) * doubted), [store.digest(source)]
    )
    if (kept := _kept(folder, made_by)) is not None:
        return kept
    progress(0.0, "reading photographs")
    shown = read_photographs(source, FINE, bare=True)
    rough = reduced(shown.views, ROUGH)
    seeds = _seeds(source, shown, rough, pointed)
    alone = pointed is not None
    growing, unsure = within(progress, 0.0, GROWN), 1.0 if testing else UNSURE
    grown, more = _grown(shown.views, seeds, alone, growing, unsure, doubted)
    why = doubt(grown)
    lacks = incomplete(grown) or ("" if alone or why else lacking(grown) or too_thin(grown)) or ""
    for name in (MASKS[0], DOUBTED, RECORD):
        _forget(folder / name)
    if grown is None or (why is not None and pointed is None):
        said = (f"No masks were grown from what all photographs show: {why}.",)
        if grown is not None:
            _written(source, shown, grown, folder / DOUBTED, progress)
        apart = contradict(grown)
        write_record(folder, made_by, said, lacks, contradict=apart)
        return GrownMasks(None, said, _doubted(folder), lacks, contradict=apart)
    _written(source, shown, grown, folder, progress)
    said = (
        _told(grown, pointed),
        *more,
        *(f"Check them: {w}." for w in (why, lacks) if w),
    )
    other = _beside(grown, shown.names) if pointed is None else ""
    write_record(folder, made_by, said, lacks, other)
    return GrownMasks(folder, said, incomplete=lacks, beside=other)


def _kept(folder: Path, made_by: str) -> GrownMasks | None:
    """Return masks that lie there and were made so, with what somebody corrected; None: others."""
    record = read_record(folder)
    if record is None or record.made_by != made_by:
        return None
    changes = _changes(folder)
    lacks, other = ("", "") if changes else (record.incomplete, record.beside)
    believed = folder if record.digest_of else None
    said = (*record.said, *changes)
    return GrownMasks(believed, said, _doubted(folder), lacks, other, record.contradict)


def _seeds(source: Path, shown: Photographs, rough: Views, pointed: Pointed | None) -> Seeds:
    if pointed is None:
        return looked_at(rough, shown.points)
    return pointed_at(rough, shown.points, spot_of(source, shown, rough, pointed))


def _grown(
    views: Views,
    seeds: Seeds,
    alone: bool,
    progress: Progress,
    unsure: float = UNSURE,
    doubted_poses: bool = False,
) -> tuple[Grown | None, list[str]]:
    """Grow masks, and say what is in them beside what has their colours and stands.

    Plates are as flat as print on paper, which is no object. Where so much of the colours of
    objects lies beside them, colours decide, if masks are complete and not doubted then.
    What hangs on it in other colours is taken in unless it is asked for alone. Where masks are then
    still doubted, or lack what has other colours, or are near to being doubted for their colours,
    the floor has the colours of the thing, and how well these fit it at their place counts, too, if
    masks are right by it, and better than masks that were not doubted. None of that mends outlines
    that contradict each other under poses that something else speaks against, too.
    """
    grown, flat = grow(views, seeds, within(progress, 0.0, ONCE)), False
    if doubted_poses and contradict(grown):
        return grown, []
    if incomplete(grown) is not None:
        again = within(progress, ONCE, TWICE, ", with what lies flat on the floor")
        wider = grow(views, seeds, again, flat=True)
        flat = doubt(wider) is None and incomplete(wider) is None
        grown = wider if flat else grown
    said = [FLAT] if flat else []
    if grown is not None and alone:
        return grown, [*said, *_part(bordering(grown))]
    last = within(progress, TWICE, THRICE, ", with what borders on it in other colours")
    whole = grown and taken_in(views, seeds, grown, last, flat)
    said = said if whole is grown else [*said, OTHER_COLOURS]
    doubted = doubt(whole) is not None
    if incomplete(whole) is not None and not doubted:
        return whole, said
    bad = doubted or lacking(whole) is not None
    if whole is None or bad or whole.alike > unsure * ALIKE:
        by_floor = within(progress, THRICE, 1.0, ", by what the floor shows at each place")
        fitted = grow(views, seeds, by_floor, fitting=True)
        if fitted is not None and _sound(fitted):
            if whole is None or bad or _better(fitted, whole):
                return fitted, [BY_FLOOR]
    return whole, said


def _sound(grown: Grown) -> bool:
    return doubt(grown) is None and incomplete(grown) is None and lacking(grown) is None


def _better(one: Grown, other: Grown) -> bool:
    """Tell whether colours are told apart better, and masks agree better with their hull."""
    return one.alike < other.alike and one.coherence > other.coherence


def _part(much: float) -> list[str]:
    """Say that what was pointed at may be a part of something."""
    if not much:
        return []
    return [
        f"It may be a part: {much:.0%} as much in other colours stands on the floor and borders "
        "on it. If that is meant, too, give a box around all of it (--box), or paint it white."
    ]


def _written(
    source: Path, shown: Photographs, grown: Grown, folder: Path, progress: Progress
) -> None:
    shots = listed(source).shots
    file_of = dict(zip((shot.name for shot in shots), file_names(shots), strict=True))
    shot_of = {shot.name: shot for shot in shots}
    with store.writing(folder):
        for k, (name, inside) in enumerate(zip(shown.names, grown.inside, strict=True)):
            progress(GROWN + (1 - GROWN) * k / len(shown.names), "writing masks")
            own = in_own_pixels(inside, shot_of[name])
            if own is not None:
                write_mask(folder, file_of[name], own)


def _told(grown: Grown, pointed: Pointed | None) -> str:
    what = "what all cameras look at" if pointed is None else "what was pointed at"
    return (
        f"Masks were grown from colours and the visual hull of {what}; {grown.coherence:.0%} of "
        "them and of the silhouettes of their hull agree."
    )


def _beside(grown: Grown, names: Sequence[str]) -> str:
    if (other := grown.beside) is None:
        return ""
    return (
        f"Something else stands on the floor beside it and was left out: about {other.as_large:.0%}"
        f" as large in the pictures, in {names[other.view]} at {other.across:.0%} of the width from"
        f" the left and {other.down:.0%} of the height from the top. {HAVE_IT}"
    )


def _changes(folder: Path) -> list[str]:
    count = len(corrected(folder))
    return [f"{count} of the masks were corrected by hand."] * bool(count)


def lying_in(folder: Path | None) -> str:
    """Say in a sentence where masks lie that were grown, for correction; "": there are none."""
    if folder is None:
        return ""
    place = folder if (folder / MASKS[0]).is_dir() else _doubted(folder)
    if place is None:
        return ""
    how = "" if place == folder else ", and not believed,"
    return (
        f"Masks that were grown from colours{how} lie in {place / MASKS[0]}: look at them, correct "
        f"what is wrong, and give them with --masks {place}."
    )


def _doubted(folder: Path) -> Path | None:
    return folder / DOUBTED if (folder / DOUBTED / MASKS[0]).is_dir() else None


def _forget(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)

"""Find where photographs were taken from, in up to three attempts, or say why that cannot be."""

import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from corporeal.core import store
from corporeal.core.errors import BadFileError, noticed
from corporeal.core.progress import Progress, within
from corporeal.core.typed import typed
from corporeal.core.types import Note, NoteKind, kinds_of, with_kinds
from corporeal.io.colmap import read_colmap
from corporeal.io.photographs import MASKS, read_photographs
from corporeal.io.sources import FILMS
from corporeal.multiview.silhouettes import FILLED
from corporeal.multiview.unseen_side import unseen_side
from corporeal.reconstruction.sfm.attempt import Attempt, Way, attempt, require, without_pictures
from corporeal.reconstruction.sfm.blur import blurred
from corporeal.reconstruction.sfm.by_masks import checked_by_masks, filled_share, strangers
from corporeal.reconstruction.sfm.cameras_figure import cameras_figure
from corporeal.reconstruction.sfm.film_frames import write_frames
from corporeal.reconstruction.sfm.gather import (
    IMAGES,
    TAKE,
    Gathered,
    as_gathered,
    gather,
    sized_alone,
)
from corporeal.reconstruction.sfm.groups import (
    SORT_THEM,
    WALK,
    groups_of,
    hopeless,
    look,
    not_found,
    told_apart,
    well_joined,
    without,
)
from corporeal.reconstruction.sfm.judge import (
    HOLD_STILL,
    MOST_BLURRED,
    WHAT_TO_DO,
    doubt_of_masks,
    doubt_of_neighbours,
    doubts,
    in_vain,
    names_of,
    too_few,
)
from corporeal.reconstruction.sfm.look_alikes import borne_out, checked_by_neighbours
from corporeal.reconstruction.sfm.middles import (
    AS_TAKEN,
    CROPPED,
    SLIGHTLY_CROPPED,
    apart,
    clause,
    sentence,
)
from corporeal.reconstruction.sfm.mirrored import TWO_KINDS, mirrored
from corporeal.reconstruction.sfm.pairs import partners_of

POSES = "poses"
"""Folder of a reconstruction in which they are kept."""
SAID: dict[Way, str] = {
    "plain": "",
    "masked": ", from points on objects alone",
    "thorough": ", at the thorough attempt",
}
LEAST = 6
"""Photographs: fewer that were taken all around are more than 60° apart, and share nothing."""
FOUND, BEGUN, FIGURE = "poses.json", "begun.json", "cameras.png"
METHOD = 9
"""Raised when other poses would be found: those of an older method are looked for again."""
GATHERED = 0.1
"""Share of the work that is done when photographs are read."""
LOOKED = 0.15
"""The same, when it is known whether they show one place."""
SPARSE = (
    "Points that pictures share are few, but they agree with what neighbours show. A search for "
    "more was not believed."
)
LOOKING = "looking whether all show one place"
UNTIL: dict[Way, float] = {"plain": 0.5, "masked": 0.7, "thorough": 1.0}
"""The same, after each attempt, in their order."""


@dataclass(frozen=True)
class Posed:
    """Photographs whose poses are known now."""

    folder: Path
    """Holds ``images`` and a COLMAP model, ``sparse/0``."""
    statements: tuple[str, ...]
    warnings: tuple[str, ...]
    doubt: str = ""
    """Why they are to be believed only if masks agree with them, in a clause."""


@dataclass(frozen=True)
class _Kept:
    """What ``poses.json`` holds."""

    statements: tuple[str, ...]
    warnings: tuple[str, ...]
    refused: str
    """Why there are no poses; "": there are."""
    attempts: tuple[Attempt, ...]
    what_to_do: str = WHAT_TO_DO
    doubt: str = ""
    kind_of_warning: tuple[NoteKind, ...] = ()


def _keep(folder: Path, found: _Kept) -> None:
    store.write_json(folder / FOUND, replace(found, kind_of_warning=kinds_of(found.warnings)))


def _kept(folder: Path) -> _Kept:
    found = typed(_Kept, store.read_json(folder / FOUND))
    return replace(found, warnings=with_kinds(found.warnings, found.kind_of_warning))


def pose(source: Path, folder: Path, progress: Progress) -> Posed:
    """Find the poses of photographs, or of frames of a film.

    Args:
        source: A folder of photographs, or a film.
        folder: Gets pictures and model. What is there of the same source is not done again.
        progress: Told the fraction done and what is being done.

    Raises:
        UserError: pycolmap is not installed, or the poses cannot be found or not be believed.

    """
    if not source.exists():
        raise BadFileError(source, "there is no such file or folder.", "Check the path.")
    require()
    begun = {"source": store.digest(source), "method": METHOD}
    if not (folder / BEGUN).exists() or store.read_json(folder / BEGUN) != begun:
        shutil.rmtree(folder, ignore_errors=True)
        store.write_json(folder / BEGUN, begun)
    if (folder / FOUND).exists():
        kept = _kept(folder)
    else:
        kept = _found(source, folder, progress)
        _keep(folder, kept)
    if kept.refused:
        with noticed(kept.warnings):
            raise BadFileError(source, kept.refused, kept.what_to_do)
    return Posed(folder, kept.statements, kept.warnings, kept.doubt)


def moved_within(posed: Posed, masks: Path) -> str | None:
    """Say in a clause that an object did not keep its place in what is around it; None: it did.

    Args:
        posed: Poses that were found from whole pictures.
        masks: Of the object, under the names of these.

    """
    share = filled_share(posed.folder / "sparse" / "0", masks)
    if share >= FILLED:
        return None
    wrong = "they were put in wrong places, as where a pattern repeats, " if posed.doubt else ""
    return (
        "the pictures fit together by what is around the object, but its outlines contradict one "
        f"another (together they leave {share:.0%} of what each shows): {wrong}some of them show "
        "something else, or it was moved or turned over between the pictures"
    )


def without_strangers(posed: Posed, masks: Path) -> Posed:
    """Leave out pictures that show something else where the others show the object, and say so.

    What stood on the same floor is placed by this, as well as the object is. It is kept with the
    poses that they were left out.

    Args:
        posed: Poses that were found from whole pictures.
        masks: Of the object, grown under these, with the names of its pictures.

    """
    place = posed.folder / "sparse" / "0"
    names = strangers(place, masks)
    if not names:
        return posed
    without_pictures(place, names)
    said = Note(
        f"{len(names)} photographs show something else where the others show the object, or show "
        "it moved: their outlines contradict those of the others. They were left out: "
        f"{names_of(names)}.",
        NoteKind.LEFT_OUT,
    )
    kept = _kept(posed.folder)
    kept = replace(kept, warnings=(*kept.warnings, said))
    _keep(posed.folder, kept)
    return replace(posed, warnings=kept.warnings)


def pose_object(posed: Posed, masks: Path, folder: Path, progress: Progress) -> Posed | None:
    """Find the poses again, from points on the object alone.

    Args:
        posed: What was found from whole pictures.
        masks: Of the object, under the names of these.
        folder: Gets pictures and model. What is there of the same is not done again.
        progress: Told the fraction done and what is being done.

    Returns:
        Poses that can be believed and that masks agree with; None: there are none.

    """
    begun = {"source": store.digest(posed.folder), "masks": store.digest(masks), "method": METHOD}
    if not (folder / BEGUN).exists() or store.read_json(folder / BEGUN) != begun:
        shutil.rmtree(folder, ignore_errors=True)
        store.write_json(folder / BEGUN, begun)
    if (folder / FOUND).exists():
        kept = _kept(folder)
    else:
        for name, place in ((IMAGES, posed.folder / IMAGES), (MASKS[0], masks)):
            shutil.copytree(place, folder / name, dirs_exist_ok=True)
        gathered = as_gathered(folder)
        told = _checked(
            attempt(folder, folder / "masked", gathered, "masked", progress), folder, gathered
        )
        why = [*doubts(told), *filter(None, [doubt_of_masks(told)])]
        shutil.rmtree(folder / MASKS[0])  # they were grown under other poses
        if why:
            kept = _Kept((), (), "; ".join(why), (told,))
        else:
            kept = _told(folder, gathered, (), (told,), told)
        _keep(folder, kept)
    return None if kept.refused else Posed(folder, kept.statements, kept.warnings)


def _found(source: Path, folder: Path, progress: Progress) -> _Kept:
    said, gathered = _gathered(source, folder, within(progress, 0.0, GATHERED))
    if (count := len(gathered.names)) < LEAST:
        few = f"{count} photographs are too few to find where they were taken from."
        return _Kept((), gathered.said, few, (), TAKE)
    looked = _places(folder, gathered, within(progress, GATHERED, LOOKED))
    if isinstance(looked, _Kept):
        return looked
    gathered, others = looked
    tried, smeared = _tried(folder, gathered, progress)
    best = _best_of(tried, folder, gathered)
    if best is not None:
        if (why := too_few(best, others)) is not None:
            return _refused([why], gathered, smeared, tried=tuple(tried))
        place = folder / best.way / "sparse" / "0"
        if (why := mirrored(read_colmap(place))) is not None:
            return _Kept((), gathered.said, not_found([why], others), tuple(tried), TWO_KINDS)
        if (spread := apart(place)) >= CROPPED:
            why = not_found([clause(spread)], others)
            return _Kept((), gathered.said, why, tuple(tried), AS_TAKEN)
        if spread >= SLIGHTLY_CROPPED:
            gathered = replace(gathered, said=(*gathered.said, sentence(spread)))
        return _told(folder, gathered, tuple(said), tuple(tried), best)
    best = max(tried, key=lambda told: told.registered)
    return _refused(doubts(best), gathered, smeared, others, tuple(tried))


def _refused(
    why: list[str],
    gathered: Gathered,
    smeared: tuple[str, ...],
    others: int = 0,
    tried: tuple[Attempt, ...] = (),
) -> _Kept:
    """Refuse, and say which pictures are blurred, if that may be why."""
    total = len(gathered.names)
    if smeared:
        why = [*why, f"{len(smeared)} of {total} pictures are blurred ({names_of(smeared)})"]
    what_to_do = HOLD_STILL if len(smeared) >= MOST_BLURRED * total else WHAT_TO_DO
    what_to_do = AS_TAKEN if sized_alone(gathered.sizes) else what_to_do
    return _Kept((), gathered.said, not_found(why, others), tried, what_to_do)


def _tried(
    folder: Path, gathered: Gathered, progress: Progress
) -> tuple[list[Attempt], tuple[str, ...]]:
    """Attempt until one is believed; return all, and which pictures are blurred if one was not."""
    tried: list[Attempt] = []
    smeared: tuple[str, ...] = ()
    before = LOOKED
    for way, until in UNTIL.items():
        share, before = (before, until), until
        if not _worth_trying(way, folder, tried, len(smeared)):
            continue
        told = attempt(folder, folder / way, gathered, way, within(progress, *share))
        tried.append(_checked(told, folder, gathered))
        if not doubts(tried[-1]) and doubt_of_masks(tried[-1]) is None:
            break
        smeared = smeared or blurred(folder / IMAGES, gathered.names)
    return tried, smeared


def _places(folder: Path, gathered: Gathered, progress: Progress) -> tuple[Gathered, int] | _Kept:
    """Look at small copies: which photographs show one place, or why the long search is in vain.

    Returns:
        What is searched, and how many photographs show another place.

    """
    if (folder / MASKS[0]).is_dir():  # what was turned over shares nothing, and masks help
        return gathered, 0
    looked = look(folder, gathered, lambda f: progress(f, LOOKING))
    if (why := hopeless(looked.shared)) is not None:
        return _refused([why], gathered, blurred(folder / IMAGES, gathered.names))
    if (why := looked.stood_still) is not None:
        return _Kept((), gathered.said, not_found([why], 0), (), WALK)
    gathered = replace(gathered, said=(*gathered.said, *filter(None, [looked.said])))
    groups = groups_of(looked.shared)
    if groups.mixed:
        return _Kept((), gathered.said, told_apart(groups, gathered.names), (), SORT_THEM)
    kept = np.setdiff1d(np.arange(len(gathered.names)), groups.beside)
    if groups.beside:
        gathered = without(gathered, groups)
    shared = looked.shared[np.ix_(kept, kept)]
    fine = not well_joined(shared, gathered.sizes)
    pairs = tuple(partners_of(shared))
    return replace(gathered, doubled=fine, pairs=pairs), len(groups.beside)


def _checked(told: Attempt, folder: Path, gathered: Gathered) -> Attempt:
    """Take out of a model which pictures cannot be where it has them, by neighbours and masks."""
    place = folder / told.way / "sparse" / "0"
    return checked_by_masks(checked_by_neighbours(told, place, gathered), folder, place)


def _best_of(tried: list[Attempt], folder: Path, gathered: Gathered) -> Attempt | None:
    """Return the first attempt of those that masks agree with best, as masks may be poor; or None.

    Where its neighbours contradict, one that was doubted for few points alone, and with which
    neighbours and masks agree, is taken.
    """
    believed = [told for told in tried if not doubts(told)]
    best = max(believed, key=lambda told: told.filled, default=None)
    if best is None or not best.parted:
        return best
    for told in tried:
        place = folder / told.way / "sparse" / "0"
        if doubt_of_masks(told) is None and borne_out(told, place, gathered):
            return told
    return best


def _worth_trying(way: Way, folder: Path, tried: list[Attempt], smeared: int) -> bool:
    """Tell whether an attempt can better those before: thorough where none is believed."""
    if way == "masked":
        return (folder / MASKS[0]).is_dir()
    if way == "plain":
        return True
    return all(doubts(told) for told in tried) and not in_vain(tried[0], smeared)


def _gathered(source: Path, folder: Path, progress: Progress) -> tuple[list[str], Gathered]:
    if source.suffix.lower() not in FILMS:
        return [], gather(source, folder, progress)
    frames = folder / "frames"
    said = write_frames(source, frames, within(progress, 0.0, 0.7))
    gathered = gather(frames, folder, within(progress, 0.7, 1.0))
    shutil.rmtree(frames)
    return said, gathered


def _accept(out: Path, folder: Path) -> None:
    """Put the model where it is looked for, and drop what it was made of."""
    shutil.rmtree(folder / "sparse", ignore_errors=True)
    shutil.move(out / "sparse", folder / "sparse")
    for way in UNTIL:
        shutil.rmtree(folder / way, ignore_errors=True)


def _told(
    folder: Path,
    gathered: Gathered,
    said: tuple[str, ...],
    tried: tuple[Attempt, ...],
    last: Attempt,
) -> _Kept:
    _accept(folder / last.way, folder)
    statement = (
        f"Where {last.registered} of {last.pictures} photographs were taken from was found by "
        f"COLMAP{SAID[last.way]}: {last.points:,} points, "
        f"{last.reprojection:.2f} px reprojection error, focal length {last.focal:.2f} × the "
        "longer side."
    )
    if doubts(last):
        said = (*said, SPARSE)
    warnings = list(gathered.said)
    if last.left_out:
        warnings.append(
            Note(
                f"{len(last.left_out)} of {last.pictures} photographs do not fit the others and "
                f"were left out: {names_of(last.left_out)}.",
                NoteKind.LEFT_OUT,
            )
        )
    if last.misplaced:
        warnings.append(
            Note(
                f"{len(last.misplaced)} photographs look like others that were taken from another "
                f"side of what looks alike, and were left out: {names_of(last.misplaced)}.",
                NoteKind.LEFT_OUT,
            )
        )
    if last.astray:
        warnings.append(
            Note(
                f"{len(last.astray)} photographs fit the others by what is around the object, but "
                f"not by their masks, and were left out: {names_of(last.astray)}. The floor's "
                "pattern repeats, or the mask shows something else.",
                NoteKind.LEFT_OUT,
            )
        )
    warnings += filter(None, [doubt_of_masks(last)])
    seen = read_photographs(folder, longest=64)
    cameras_figure(seen, folder / FIGURE)
    unseen = unseen_side(seen.views.cameras, seen.names)
    warnings += filter(None, [unseen])
    doubt = doubt_of_neighbours(last)
    return _Kept((*said, statement), tuple(warnings), "", tried, doubt=doubt)

"""Masks by a model that finds objects in one picture, and whether they are of one thing at all.

A model sees one picture at a time and may take something else for the object in each. What it
found is asked what grown masks are asked: whether pictures hold it, and whether its outlines are
those of one thing. Nobody asks that of what a person drew.
"""

from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from corporeal.core.errors import BadFileError, noticed
from corporeal.core.progress import Progress
from corporeal.core.types import Camera, Note, NoteKind
from corporeal.io.photographs import MASKS, read_photographs
from corporeal.multiview.agreement import INCOHERENT, SIDE
from corporeal.multiview.cropped import cropped
from corporeal.multiview.silhouettes import coherence
from corporeal.reconstruction.features.learned_masks import learned_masks
from corporeal.reconstruction.features.maskers import connect_masker
from corporeal.reconstruction.gaussians.intake import ON
from corporeal.reconstruction.masks.doubt import CROPPED
from corporeal.reconstruction.reconstruct_config import ReconstructConfig

DISPUTED = 0.5
"""Share of a mask that is of all masks' hull, below which more is in dispute than agreed on: masks
by random weights that fill half of the pictures have .36, right ones of a guitar .84."""
CORRECT = (
    "They lie in 0-reconstruct/masks of the run: what is corrected there is taken by the next run."
)


def masks_by_model(
    config: ReconstructConfig, source: Path, place: Path, progress: Progress
) -> tuple[Path, tuple[str, ...], tuple[str, ...]]:
    """Ask a model for masks, and ask of them whether they are of one thing.

    Args:
        config: Names model and words.
        source: A folder of photographs with poses.
        place: Gets the masks.
        progress: Told the fraction done and what is being done.

    Returns:
        A folder that holds them, how they came about, and what is to be doubted.

    Raises:
        UserError: There is no such model, or what it found is no thing.

    """
    masker = connect_masker(config.masks)
    learned = learned_masks(source, place, masker, config.things, progress)
    said = (*learned.said, CORRECT)
    shown = read_photographs(source, SIDE, learned.folder)
    assert shown.masks is not None, "they were written"
    with noticed(said):
        why, share = of_no_thing(shown.masks, shown.views.cameras)
        if why is not None and not config.force:
            what = f"masks by {masker.name()} are of no one thing: {why}."
            advice = (
                f"Look at {learned.folder / MASKS[0]} and correct them, take other weights or "
                "words, or leave --masks out, and masks are grown. --force goes on all the same."
            )
            raise BadFileError(source, what, advice)
    doubts = [] if why is None else [Note(f"Masks are of no one thing: {why}.", NoteKind.GRAVE)]
    if why is None and share < INCOHERENT:
        doubts = [Note(f"Masks may be wrong: {_contradict(share)}. Look at them.", NoteKind.GRAVE)]
    return learned.folder, said, tuple(doubts)


def of_no_thing(
    masks: UInt8[np.ndarray, "V H W"], cameras: tuple[Camera, ...]
) -> tuple[str | None, float]:
    """Say in a clause why masks are not of one thing; None: they may be.

    Returns:
        The clause, and which share of a mask the hull of all fills.

    """
    over = int(cropped(masks >= ON).sum())
    share = coherence(masks, cameras)
    if over > CROPPED * len(masks):
        return f"in {over} of {len(masks)} photographs they end at the border", share
    return (_contradict(share) if share < DISPUTED else None), share


def _contradict(share: float) -> str:
    return f"they contradict one another (together they leave {share:.0%} of what each shows)"

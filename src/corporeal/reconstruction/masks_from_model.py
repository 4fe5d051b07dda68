"""Masks by a learned segmentation model, and their consistency.

A model sees one picture at a time and may take something else for the object in each. What it
found is asked what grown masks are asked: whether pictures hold it, and whether its outlines are
those of one object. Masks that a person drew are not tested.
"""

from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from corporeal.core.errors import BadFileError, notes_on_error
from corporeal.core.progress import Progress
from corporeal.core.types import Camera, Note, NoteKind
from corporeal.io.photos.posed_photos import MASK_FOLDERS, read_posed_photos
from corporeal.multiview.pose_consistency import FEATURE_IMAGE_SIDE_PX, INCOHERENT_HULL_FRACTION
from corporeal.multiview.silhouette_coherence import silhouette_coherence
from corporeal.multiview.silhouette_outliers import find_cropped_masks
from corporeal.reconstruction.features.learned_masks import learned_masks
from corporeal.reconstruction.features.mask_models import connect_mask_model
from corporeal.reconstruction.gaussians.gaussian_scene import MASK_MIN_U8
from corporeal.reconstruction.masks.mask_quality import MAX_CROPPED_FRACTION
from corporeal.reconstruction.reconstruct_config import ReconstructConfig

MIN_AGREED_FRACTION = 0.5
"""Share of a mask that is of all masks' hull, below which more is in dispute than agreed on: masks by random weights
that fill half of the pictures have .36, right ones of a guitar .84."""
CORRECT_MASKS_HINT = "They lie in 0-reconstruct/masks of the run: what is corrected there is taken by the next run."


def masks_from_model(
    config: ReconstructConfig, source: Path, place: Path, progress: Progress
) -> tuple[Path, tuple[str, ...], tuple[str, ...]]:
    """Ask a model for masks, and ask of them whether they are of one object.

    Returns:
        A folder that holds them, how they came about, and what is to be doubted.

    Raises:
        UserError: There is no such model, or what it found is no object.
    """
    masker = connect_mask_model(config.masks)
    learned = learned_masks(source, place, masker, config.object_names, progress)
    said = (*learned.said, CORRECT_MASKS_HINT)
    shown = read_posed_photos(source, FEATURE_IMAGE_SIDE_PX, learned.folder)
    assert shown.masks is not None, "they were written"
    with notes_on_error(said):
        why, share = several_objects_reason(shown.masks, shown.views.cameras)
        if why is not None and not config.force:
            what = f"masks by {masker.name()} are not of one object: {why}."
            advice = (
                f"Check and correct {learned.folder / MASK_FOLDERS[0]}, use other weights or "
                "words, or omit --masks to grow masks. --force continues anyway."
            )
            raise BadFileError(source, what, advice)
    doubts = [] if why is None else [Note(f"Masks are not of one object: {why}.", NoteKind.GRAVE)]
    if why is None and share < INCOHERENT_HULL_FRACTION:
        doubts = [Note(f"Masks may be wrong: {_contradiction_clause(share)}. Look at them.", NoteKind.GRAVE)]
    return learned.folder, said, tuple(doubts)


def several_objects_reason(masks: UInt8[np.ndarray, "V H W"], cameras: tuple[Camera, ...]) -> tuple[str | None, float]:
    """Return in a clause why masks are not of one object; None: they may be.

    Returns:
        The clause, and which share of a mask the hull of all fills.
    """
    over = int(find_cropped_masks(masks >= MASK_MIN_U8).sum())
    share = silhouette_coherence(masks, cameras)
    if over > MAX_CROPPED_FRACTION * len(masks):
        return f"in {over} of {len(masks)} photographs they end at the border", share
    return (_contradiction_clause(share) if share < MIN_AGREED_FRACTION else None), share


def _contradiction_clause(share: float) -> str:
    return f"they contradict one another (together they leave {share:.0%} of what each shows)"

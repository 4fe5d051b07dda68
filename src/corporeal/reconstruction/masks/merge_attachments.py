"""Merging of attached parts of other colours into grown masks.

What stands on the floor and borders on masks is an example of what objects look like, as they are. Growing decides
about it as about any seed: what has the colours of its surroundings too, a shadow or a piece of wall, does not last.
New masks are taken if they hold all of the old ones and more, most of which hangs on these, and agree with their hull
as well as before.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from corporeal.core.progress import Progress
from corporeal.core.types import Views
from corporeal.reconstruction.masks.floor_parallax import MIN_PIECE_TO_MASK_RATIO, pixels_to_mask_ratio
from corporeal.reconstruction.masks.mask_attachments import MaskAttachments
from corporeal.reconstruction.masks.mask_quality import incompleteness_reason, mask_doubt
from corporeal.reconstruction.masks.mask_seeds import MaskSeeds
from corporeal.reconstruction.masks.region_growing import (
    COLOUR_BAND_WIDTHS,
    RegionGrowingResult,
    grow_masks,
    widen_silhouettes,
)

MIN_KEPT_FRACTION = 0.95
"""Share of the masks before that new ones must hold, in the median view."""
MIN_ATTACHED_FRACTION = 0.5
"""Of what new masks hold beside these, how much must hang on them, in all views together."""
MAX_AGREEMENT_LOSS = 0.01
"""Agreement of masks with their hull that may be lost: where growing again changes nothing to
speak of it moves by .001."""
MAX_PART_AGREEMENT_LOSS = 0.05
"""The same of a part for itself, below that of the rest: a large part has outlines of its own. A hammer's head agreed
by .04 less, a ball that stands apart by .08, a wall by .16."""


def merge_attachments(
    views: Views, seeds: MaskSeeds, grown: RegionGrowingResult, progress: Progress, flat: bool = False
) -> RegionGrowingResult:
    """Return masks of what was found and of what hangs on it, or those that were given.

    Args:
        views: The pictures.
        seeds: Where the given masks began.
        grown: What came of them.
        progress: Called with the fraction done and a description.
        flat: As in ``grow_masks``.
    """
    if grown.hanging is None:
        return grown
    wider = grow_masks(views, _seeds_from_masks(seeds, grown.masks, grown.hanging), progress, flat)
    if wider is None or mask_doubt(wider) is not None or incompleteness_reason(wider) is not None:
        return grown
    return wider if _is_merge_better(wider, grown, grown.hanging) else grown


def _is_merge_better(wider: RegionGrowingResult, grown: RegionGrowingResult, more: MaskAttachments) -> bool:
    before = np.maximum(grown.masks.sum(axis=(1, 2)), 1)
    held = (wider.masks & grown.masks).sum(axis=(1, 2)) / before
    new = wider.masks & ~grown.masks
    hangs = (new & widen_silhouettes(more.shown)).sum() / max(new.sum(), 1)
    gained = pixels_to_mask_ratio(new, grown.masks)
    lost = grown.coherence - wider.coherence
    return bool(
        np.median(held) >= MIN_KEPT_FRACTION
        and gained >= MIN_PIECE_TO_MASK_RATIO
        and hangs >= MIN_ATTACHED_FRACTION
        and lost <= max(MAX_AGREEMENT_LOSS, MAX_PART_AGREEMENT_LOSS * gained / (1 + gained))
    )


def _seeds_from_masks(seeds: MaskSeeds, masks: Bool[np.ndarray, "V H W"], more: MaskAttachments) -> MaskSeeds:
    """Begin at what is known to be inside, distinguished from what is near it, and do not go far beyond.

    What is farther off has its colours by chance: the grey of a head is a wall's, too.
    """
    inside, cone = masks | more.shown, widen_silhouettes(masks | more.within)
    outside = widen_silhouettes(inside, COLOUR_BAND_WIDTHS) & ~inside
    return replace(
        seeds,
        inside=inside.astype(np.float32),
        outside=outside.astype(np.float32),
        cone=cone if seeds.cone is None else cone & seeds.cone,
        piece=MIN_PIECE_TO_MASK_RATIO**1.5,  # what covers that share of pixels has that of the volume
    )

"""Masks of one colour, grown again with what hangs on them in others.

What stands on the floor and borders on masks is an example of what objects look like, as they are.
Growing decides about it as about any seed: what has the colours of its surroundings too, a shadow
or a piece of wall, does not last. New masks are taken if they hold all of the old ones and more,
most of which hangs on these, and agree with their hull as well as before.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Bool

from corporeal.core.types import Views
from corporeal.reconstruction.masks.doubt import doubt, incomplete
from corporeal.reconstruction.masks.grow import NEARBY, Grown, grow, widened
from corporeal.reconstruction.masks.hanging import Hanging
from corporeal.reconstruction.masks.parallax import AS_LARGE, as_large
from corporeal.reconstruction.masks.seeds import Seeds

Progress = Callable[[float, str], None]

HELD = 0.95
"""Share of the masks before that new ones must hold, in the median view."""
HANGS = 0.5
"""Of what new masks hold beside these, how much must hang on them, in all views together."""
AS_WELL = 0.01
"""Agreement of masks with their hull that may be lost: where growing again changes nothing to
speak of it moves by .001."""
PART = 0.05
"""The same of a part for itself, below that of the rest: a large part has outlines of its own. A
hammer's head agreed by .04 less, a ball that stands apart by .08, a wall by .16."""


def taken_in(
    views: Views, seeds: Seeds, grown: Grown, progress: Progress, flat: bool = False
) -> Grown:
    """Return masks of what was found and of what hangs on it, or those that were given.

    Args:
        views: The pictures.
        seeds: Where the given masks began.
        grown: What came of them.
        progress: Told the fraction done and what is being done.
        flat: As in ``grow``.

    """
    if grown.hanging is None:
        return grown
    wider = grow(views, _begun_again(seeds, grown.masks, grown.hanging), progress, flat)
    if wider is None or doubt(wider) is not None or incomplete(wider) is not None:
        return grown
    return wider if _better(wider, grown, grown.hanging) else grown


def _better(wider: Grown, grown: Grown, more: Hanging) -> bool:
    before = np.maximum(grown.masks.sum(axis=(1, 2)), 1)
    held = (wider.masks & grown.masks).sum(axis=(1, 2)) / before
    new = wider.masks & ~grown.masks
    hangs = (new & widened(more.shown)).sum() / max(new.sum(), 1)
    gained = as_large(new, grown.masks)
    lost = grown.coherence - wider.coherence
    return bool(
        np.median(held) >= HELD
        and gained >= AS_LARGE
        and hangs >= HANGS
        and lost <= max(AS_WELL, PART * gained / (1 + gained))
    )


def _begun_again(seeds: Seeds, masks: Bool[np.ndarray, "V H W"], more: Hanging) -> Seeds:
    """Begin at what is known to be inside, told from what is near it, and do not go far beyond.

    What is farther off has its colours by chance: the grey of a head is a wall's, too.
    """
    inside, cone = masks | more.shown, widened(masks | more.within)
    outside = widened(inside, NEARBY) & ~inside
    return replace(
        seeds,
        inside=inside.astype(np.float32),
        outside=outside.astype(np.float32),
        cone=cone if seeds.cone is None else cone & seeds.cone,
        piece=AS_LARGE**1.5,  # what covers that share of pixels has that of the volume
    )

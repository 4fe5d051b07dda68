"""Plausibility of automatic masks."""

from corporeal.reconstruction.masks.floor_parallax import MIN_TOP_HEIGHT_RADII, pixels_to_mask_ratio
from corporeal.reconstruction.masks.region_growing import SETTLED_AGREEMENT, RegionGrowingResult

MAX_COLOUR_OVERLAP = 0.2
"""Overlap of the colours of objects and of what is around them, of evened pictures, above which the
outline is unreliable. It parts little: right masks have up to .23, .42 on a print before
the floor is asked, wrong ones .02 to .64 (decision masks-acceptance).
"""
MIN_HULL_AGREEMENT = 0.7
"""Masks and the silhouettes of their hull must agree by so much; those of the last two rounds by SETTLED."""
MAX_OUTER_HULL_FRACTION = 0.25
"""Share of the hull at the edge of what all cameras look at, above which it goes on beyond."""
MAX_CROPPED_FRACTION = 0.5
"""Share of the photographs in which objects may be cropped."""
MIN_OBJECT_FRACTION, MAX_OBJECT_FRACTION = 0.005, 0.7
"""Shares of the photographs that objects may fill."""
MAX_RESIDUAL_FRACTION = 0.25
"""As much again as masks hold, with their colours and on the floor in the middle, above which masks are not of all of
the object: they would overlap with right ones by less than .8.
"""

MAX_ATTACHED_FRACTION = 0.5
"""The same of what stands there in other colours and borders on it. Of its pixels .4 to .85 were the object's, the rest
shadows and edges beside it, so that masks lack as much.
"""
MAX_FAINT_OUTLINE_FRACTION = 0.1
"""Share of the outlines along which no edge is seen, above which they are chance: as large as what hulls forgive of
views."""
MAX_RIM_FRACTION = 0.2
"""Share of masks that are their outermost pixels: if masks are but a pixel too wide, as they were where colours tell
best, they overlap with right ones by less than .8."""
TAKEN_FOR_OBJECT = "what was taken for the object"


def mask_doubt(grown: RegionGrowingResult | None) -> str | None:
    """Return in a clause why masks are unreliable; None: they are."""
    if grown is None:
        return "no place in space looks like the middle of all photographs"
    why = _doubt_before_outlines(grown)
    if why is None and _outlines_disagree(grown):
        agree = f"its outlines contradict each other ({grown.coherence:.0%} agree)"
        return f"{agree}, as where some photographs show something else, or it was moved"
    return why


def outlines_contradict(grown: RegionGrowingResult | None) -> bool:
    """Return whether masks are unreliable because their outlines contradict each other."""
    return grown is not None and _doubt_before_outlines(grown) is None and _outlines_disagree(grown)


def _outlines_disagree(grown: RegionGrowingResult) -> bool:
    return grown.coherence < MIN_HULL_AGREEMENT or grown.settled < SETTLED_AGREEMENT


def _doubt_before_outlines(grown: RegionGrowingResult) -> str | None:
    """Return in a clause what speaks against masks before their outlines are compared."""
    if grown.alike > MAX_COLOUR_OVERLAP:
        what = f"{grown.alike:.0%} of the colours of what is in their middle"
        return f"what is around it has {what}, too"
    if not MIN_OBJECT_FRACTION <= grown.share <= MAX_OBJECT_FRACTION:
        return f"it would fill {grown.share:.1%} of the photographs"
    if grown.outer > MAX_OUTER_HULL_FRACTION or grown.cropped > MAX_CROPPED_FRACTION:
        return "it reaches beyond the cameras' common focus"
    if grown.faint > MAX_FAINT_OUTLINE_FRACTION:
        return f"along {grown.faint:.0%} of its outline the photographs show no edge"
    return None


def incompleteness_reason(grown: RegionGrowingResult | None) -> str | None:
    """Return in a clause why masks do not show all of the photographed object; None: they do."""
    if grown is None or grown.left_over <= MAX_RESIDUAL_FRACTION:
        return None
    more = "with its colours is seen on the floor in the middle"
    return _incompleteness_clause(TAKEN_FOR_OBJECT, grown.left_over, more)


def lacking_attachment_reason(grown: RegionGrowingResult | None) -> str | None:
    """Return in a clause what borders on masks and is not of them; None: not much does.

    Nothing hovers: what stands under masks that do is of the object, and no shadow beside it.
    """
    if grown is None:
        return None
    hovers = grown.lowest > MIN_TOP_HEIGHT_RADII
    if (much := bordering_fraction(grown)) <= (MAX_RESIDUAL_FRACTION if hovers else MAX_ATTACHED_FRACTION):
        return None
    taken = f"{TAKEN_FOR_OBJECT}, which hovers above the floor" if hovers else TAKEN_FOR_OBJECT
    return _incompleteness_clause(taken, much, "in other colours stands on the floor and borders on it")


def _incompleteness_clause(taken: str, much: float, more: str) -> str:
    ground = "not all of it can be separated from its ground"
    return f"{ground}: beside {taken}, {much:.1f} times as much {more}"


def thinness_reason(grown: RegionGrowingResult | None) -> str | None:
    """Return in a clause why masks do not tell how thick objects are; None: they do."""
    if grown is None or grown.thinness <= MAX_RIM_FRACTION:
        return None
    return (
        f"it is too thin in the photographs: of {TAKEN_FOR_OBJECT} "
        f"{grown.thinness:.0%} are the pixels along its outline, and these are not sure, so "
        "photograph it from nearer"
    )


def bordering_fraction(grown: RegionGrowingResult | None) -> float:
    """Return how large what borders on masks and is not of them is, over what they hold."""
    if grown is None or grown.hanging is None:
        return 0.0
    return pixels_to_mask_ratio(grown.hanging.shown, grown.masks)

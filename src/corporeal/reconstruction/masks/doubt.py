"""Whether masks that nobody drew are of what the photographs are of."""

from corporeal.reconstruction.masks.grow import SETTLED, Grown
from corporeal.reconstruction.masks.parallax import HIGH, as_large

ALIKE = 0.2
"""Overlap of the colours of objects and of what is around them, of evened pictures, above which the
outline is not to be believed. It parts little: right masks have up to .23, .42 on a print before
the floor is asked, wrong ones .02 to .64 (decision 139)."""
COHERENT = 0.7
"""Masks and the silhouettes of their hull must agree by so much; those of the last two rounds by
SETTLED."""
OUTER = 0.25
"""Share of the hull at the edge of what all cameras look at, above which it goes on beyond."""
CROPPED = 0.5
"""Share of the photographs in which objects may be cropped."""
SMALLEST, LARGEST = 0.005, 0.7
"""Shares of the photographs that objects may fill."""
LEFT_OVER = 0.25
"""As much again as masks hold, with their colours and on the floor in the middle, above which masks
are not of all of the thing: they would overlap with right ones by less than .8."""

HANGING = 0.5
"""The same of what stands there in other colours and borders on it. Of its pixels .4 to .85 were
the thing's, the rest shadows and edges beside it, so that masks lack as much."""
FAINT = 0.1
"""Share of the outlines along which no edge is seen, above which they are chance: as large as what
hulls forgive of views."""
THINNEST = 0.2
"""Share of masks that are their outermost pixels: if masks are but a pixel too wide, as they were
where colours tell best, they overlap with right ones by less than .8."""
TAKEN = "what was taken for the thing"


def doubt(grown: Grown | None) -> str | None:
    """Return in a clause why masks are not to be believed; None: they are."""
    if grown is None:
        return "no place in space looks like the middle of all photographs"
    why = _otherwise(grown)
    if why is None and _outlines_disagree(grown):
        agree = f"its outlines contradict each other ({grown.coherence:.0%} agree)"
        return f"{agree}, as where some photographs show something else, or it was moved"
    return why


def contradict(grown: Grown | None) -> bool:
    """Tell whether masks are not to be believed because their outlines contradict each other."""
    return grown is not None and _otherwise(grown) is None and _outlines_disagree(grown)


def _outlines_disagree(grown: Grown) -> bool:
    return grown.coherence < COHERENT or grown.settled < SETTLED


def _otherwise(grown: Grown) -> str | None:
    """Return in a clause what speaks against masks before their outlines are compared."""
    if grown.alike > ALIKE:
        what = f"{grown.alike:.0%} of the colours of what is in their middle"
        return f"what is around it has {what}, too"
    if not SMALLEST <= grown.share <= LARGEST:
        return f"it would fill {grown.share:.1%} of the photographs"
    if grown.outer > OUTER or grown.cropped > CROPPED:
        return "it reaches beyond what all cameras look at"
    if grown.faint > FAINT:
        return f"along {grown.faint:.0%} of its outline the photographs show no edge"
    return None


def incomplete(grown: Grown | None) -> str | None:
    """Return in a clause why nobody can tell all of what the photographs are of; None: masks do."""
    if grown is None or grown.left_over <= LEFT_OVER:
        return None
    more = "with its colours is seen on the floor in the middle"
    return _not_all(TAKEN, grown.left_over, more)


def lacking(grown: Grown | None) -> str | None:
    """Return in a clause what borders on masks and is not of them; None: not much does.

    Nothing hovers: what stands under masks that do is of the thing, and no shadow beside it.
    """
    if grown is None:
        return None
    hovers = grown.lowest > HIGH
    if (much := bordering(grown)) <= (LEFT_OVER if hovers else HANGING):
        return None
    taken = f"{TAKEN}, which hovers above the floor" if hovers else TAKEN
    return _not_all(taken, much, "in other colours stands on the floor and borders on it")


def _not_all(taken: str, much: float, more: str) -> str:
    ground = "not all of it can be told from its ground"
    return f"{ground}: beside {taken}, {much:.1f} times as much {more}"


def too_thin(grown: Grown | None) -> str | None:
    """Return in a clause why masks do not tell how thick things are; None: they do."""
    if grown is None or grown.thinness <= THINNEST:
        return None
    return (
        f"it is too thin in the photographs: of {TAKEN} "
        f"{grown.thinness:.0%} are the pixels along its outline, and these are not sure, so "
        "photograph it from nearer"
    )


def bordering(grown: Grown | None) -> float:
    """Return how large what borders on masks and is not of them is, over what they hold."""
    if grown is None or grown.hanging is None:
        return 0.0
    return as_large(grown.hanging.shown, grown.masks)

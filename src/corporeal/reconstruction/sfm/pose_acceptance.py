"""Acceptance tests of COLMAP models, with advice.

A wrong model looks like a model: low reprojection error says nothing. What speaks against one was found on right and
wrong models of the same pictures, docs/reference/input-files.md, "Photographs without poses".
"""

from dataclasses import replace

from corporeal.core.types import Note, NoteKind
from corporeal.multiview.silhouette_coherence import MIN_MASK_FILLED_FRACTION
from corporeal.reconstruction.sfm.sfm_run import MIN_REGISTERED_FRACTION, SfmRun

MIN_POINTS_PER_PICTURE = 30
"""Points per registered picture, at least."""
FOCAL_RANGE_RATIO = 0.45, 3.0
"""Focal lengths over the longer side that lenses have."""
MAX_RADIAL_DISTORTION = 0.25
"""Largest |k1| of a lens that is no fisheye."""
RIVAL_GROUP_FRACTION = 1 / 3
"""Share of the first group from which on a second one rivals it."""
MIN_PLACED_FRACTION = 0.5
"""Share of all photographs of a folder that must be placed, those counted, too, that were left out before the search:
of a television 8 of 18 were, from a fifth of the circle."""
MIN_JOINED_BY_PLAIN_FRACTION = 0.4
"""Share of the pictures that the plain attempt must join by points, or the thorough one is in vain: of sets that it
posed alone all 15, 20 and 24 were joined."""
MAX_BLURRED_FRACTION = 0.5
"""Share of heavily blurred pictures from which on there is no use in looking longer."""
HOLD_STILL_HINT = (
    "Hold the camera still, in more light, let it focus on the object, and look at the pictures at "
    "full size before you leave."
)
MAX_NAMED_PICTURES = 8
MORE_OVERLAP_HINT = (
    "Neighbouring pictures share too few points. Put the object on something with a pattern, such "
    "as a newspaper; take 40 to 80 pictures at most 15° apart; move neither object nor light."
)


def model_doubts(attempt: SfmRun) -> list[str]:
    """Return what speaks against a model, in clauses; nothing: it can be accepted."""
    if not attempt.registered and 0 < (attempt.joined or 0) < MIN_REGISTERED_FRACTION * attempt.pictures:
        return [f"only {attempt.joined} of {attempt.pictures} pictures share points with one another"]
    if not attempt.registered:
        return ["no two pictures share enough points"]
    found = []
    if attempt.registered < MIN_REGISTERED_FRACTION * attempt.pictures:
        beside = ""
        if attempt.misplaced:
            beside = f" ({len(attempt.misplaced)} more only where another side looks alike)"
        found.append(f"only {attempt.registered} of {attempt.pictures} pictures fit together{beside}")
    if attempt.points < MIN_POINTS_PER_PICTURE * attempt.registered:
        each = attempt.points / attempt.registered
        found.append(f"there are {each:.0f} points per picture, too few to trust")
    if not FOCAL_RANGE_RATIO[0] < attempt.focal < FOCAL_RANGE_RATIO[1] or attempt.bent > MAX_RADIAL_DISTORTION:
        lens = f"focal length {attempt.focal:g} × the longer side, k1 {attempt.bent:g}"
        found.append(f"it needs an implausible lens ({lens})")
    if attempt.others and attempt.others[0] > RIVAL_GROUP_FRACTION * attempt.registered:
        groups = " and ".join(str(n) for n in (attempt.registered, *attempt.others)[:3])
        found.append(f"the pictures fall into groups of {groups} that share nothing")
    return found


def only_sparse(attempt: SfmRun) -> bool:
    """Return whether nothing speaks against a model but that its points are few."""
    enough = replace(attempt, points=MIN_POINTS_PER_PICTURE * attempt.registered)
    return bool(model_doubts(attempt)) and not model_doubts(enough)


def too_few_placed(attempt: SfmRun, others: int) -> str | None:
    """Return in a clause that most of a folder was not placed, if so."""
    total = attempt.pictures + others
    if attempt.registered >= MIN_PLACED_FRACTION * total:
        return None
    return f"only {attempt.registered} of {total} pictures fit together"


def thorough_in_vain(attempt: SfmRun, blurred: int) -> bool:
    """Return whether a thorough attempt cannot mend what was doubted."""
    if blurred >= MAX_BLURRED_FRACTION * attempt.pictures:
        return True
    return attempt.joined is not None and attempt.joined < MIN_JOINED_BY_PLAIN_FRACTION * attempt.pictures


def neighbour_doubt(attempt: SfmRun) -> str:
    """Return in a clause that pictures stand side by side that share too little; "": they do not."""
    if not attempt.parted:
        return ""
    sizes = " and ".join(str(n) for n in attempt.parted[:3])
    return (
        f"pictures that would have been taken side by side, in groups of {sizes}, share too little "
        "of what both show: they were put in wrong places, as where a pattern repeats or two sides "
        "look alike; or they show several objects, or one that was moved"
    )


def mask_contradiction_doubt(attempt: SfmRun) -> str | None:
    """State that masks contradict one another, if they do: right poses and poor masks do that, too.

    Args:
        attempt: An attempt at the poses, after its outliers were left out.
    """
    if attempt.filled >= MIN_MASK_FILLED_FRACTION:
        return None
    placed = "some pictures were put in wrong places, " if attempt.parted else ""
    return Note(
        f"All masks together leave {attempt.filled:.0%} of what each shows: {placed}the object was "
        "moved or turned over between the pictures, or masks miss parts of it. Check the masks.",
        NoteKind.GRAVE,
    )


def some_names(left_out: tuple[str, ...]) -> str:
    """Return up to eight names and how many more there are."""
    more = f" and {len(left_out) - MAX_NAMED_PICTURES} more" if len(left_out) > MAX_NAMED_PICTURES else ""
    return ", ".join(left_out[:MAX_NAMED_PICTURES]) + more

"""Plants: crowns of leaves, and parts that do not visibly bend.

With true wood a plant hardly flexes: what sways is its root ball in soft potting soil and its
leaves on their stalks. So where everything but the leaves stays rigid, the crown is a body of its
own without stress, each of its particles on a damped spring to the wood, and the give of the soil
is in a sprung joint at the root. Where the wood does bend, none of this applies.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from corporeal.discretization.part_geometry import PartGeometry, RigidityVerdict
from corporeal.mpm.laws import CONSTITUTIVE_LAWS

MIN_FOLIAGE_LEAVES = 20
"""A part of fewer separate leaves is no crown."""
POTTED_SOIL_REASON = "a rigid pot holds it, and its compliance is in the spring at the plant's root"
FOLIAGE_REASON = "A crown of leaves without stress of its own, each on a damped spring to the wood"


@dataclass(frozen=True)
class PartVerdicts:
    """Verdicts on all parts of a scene, and which of them are crowns of leaves."""

    verdicts: Sequence[RigidityVerdict]
    """One per part."""
    foliage_parts: frozenset[int] = frozenset()
    """Numbers of parts."""


def judge_plants(
    parts: Sequence[PartGeometry], verdicts: Sequence[RigidityVerdict]
) -> PartVerdicts:
    """Make potted soil rigid, and find the crowns of leaves.

    Args:
        parts: All parts of the scene.
        verdicts: One per part.

    """
    judged = list(verdicts)
    foliage_parts: set[int] = set()
    leafy = {k for k, p in enumerate(parts) if p.leaves >= MIN_FOLIAGE_LEAVES and not p.prescribed}
    for number in sorted({parts[k].object for k in leafy}):
        mine = [k for k, p in enumerate(parts) if p.object == number]
        rest = [k for k in mine if k not in leafy]
        soil = [k for k in rest if CONSTITUTIVE_LAWS[parts[k].material.law].granular]
        firm = [k for k in rest if k not in soil]
        if firm and all(judged[k].rigid for k in firm):
            for k in soil:
                judged[k] = replace(judged[k], rigid=True, reason=POTTED_SOIL_REASON)
            foliage_parts |= leafy & set(mine)
    return PartVerdicts(judged, frozenset(foliage_parts))

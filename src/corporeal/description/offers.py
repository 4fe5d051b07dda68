"""Each part in all its ways, offered to a model with the ranges of its open values."""

from collections.abc import Mapping

from corporeal.core.types import (
    PartWords,
    Placement,
    in_way,
)
from corporeal.materials.offer import Choice
from corporeal.materials.placement import (
    Judgement,
    from_fractions,
    from_values,
)
from corporeal.vlm.answers import FractionAnswer, ValueAnswer
from corporeal.vlm.interview import Offer
from corporeal.vlm.words import (
    Asked,
    another,
)

Placed = FractionAnswer | ValueAnswer
Offered = Mapping[str, Mapping[str, Choice]]
"""Part → quantity → what it can be."""


def in_all_ways(words: PartWords) -> dict[str, PartWords]:
    """Return the part in each of its ways under the name it is asked about; the first is itself."""
    others = enumerate(words.hypotheses[1:], 1)
    return {words.name: words} | {another(words.name, k): in_way(words, w) for k, w in others}


def offer(name: str, words: PartWords, look: str, offered: Mapping[str, Choice]) -> Offer:
    """Return what a model is told of one part before it places its values."""
    made = [str(words.material), *([words.structure] if words.structure else [])]
    if words.contents is not None:
        made.append(f"{words.fill or 1.0:.0%} full of {words.contents}")
    if words.solidity is not None:
        made.append(f"{words.solidity:.0%} of it matter")
    seen = f" (it looks: {look})" if look else ""
    return Offer(
        f"{name}: {', '.join(made)}{seen}",
        {field: c.words for field, c in offered.items()},
        {field: c.bounds for field, c in offered.items()},
    )


def places_of(answer: Placed, by: Asked, offered: Offered) -> dict[str, dict[str, Placement]]:
    """Read an answer: part → quantity → where in its range the value lies."""
    read = from_values if isinstance(answer, ValueAnswer) else from_fractions
    return {
        p.part: read(
            {v.quantity: Judgement(v.number, v.reason) for v in p.values}, by, offered[p.part]
        )
        for p in answer.parts
    }

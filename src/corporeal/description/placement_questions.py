"""Questions for a model on values in measured ranges, for all hypotheses of each part."""

from collections.abc import Mapping

from corporeal.core.types import (
    PartDescription,
    RangePlacement,
    apply_hypothesis,
)
from corporeal.materials.material_candidates import QuantityChoice
from corporeal.materials.range_placement import (
    QuantityJudgement,
    placements_from_fractions,
    placements_from_values,
)
from corporeal.vlm.answer_schemas import FractionAnswer, ValueAnswer
from corporeal.vlm.interpret_answers import (
    LookingSource,
    hypothesis_name,
)
from corporeal.vlm.interview import PlacementOffer

PlacementAnswer = FractionAnswer | ValueAnswer
OfferedChoices = Mapping[str, Mapping[str, QuantityChoice]]
"""Part → quantity → its range."""


def hypotheses_by_name(words: PartDescription) -> dict[str, PartDescription]:
    """Return the hypotheses of a part by the names used in questions; the first is the part."""
    others = enumerate(words.hypotheses[1:], 1)
    return {words.name: words} | {
        hypothesis_name(words.name, k): apply_hypothesis(words, w) for k, w in others
    }


def make_placement_offer(
    name: str, words: PartDescription, look: str, offered: Mapping[str, QuantityChoice]
) -> PlacementOffer:
    """Return the facts on one part that precede the question on its values."""
    made = [str(words.material), *([words.structure] if words.structure else [])]
    if words.contents is not None:
        made.append(f"{words.fill or 1.0:.0%} full of {words.contents}")
    if words.solidity is not None:
        made.append(f"{words.solidity:.0%} of it matter")
    seen = f" (it looks: {look})" if look else ""
    return PlacementOffer(
        f"{name}: {', '.join(made)}{seen}",
        {field: c.words for field, c in offered.items()},
        {field: c.bounds for field, c in offered.items()},
    )


def placements_from_answer(
    answer: PlacementAnswer, by: LookingSource, offered: OfferedChoices
) -> dict[str, dict[str, RangePlacement]]:
    """Read an answer: part → quantity → where in its range the value lies."""
    read = placements_from_values if isinstance(answer, ValueAnswer) else placements_from_fractions
    return {
        p.part: read(
            {v.quantity: QuantityJudgement(v.number, v.reason) for v in p.values},
            by,
            offered[p.part],
        )
        for p in answer.parts
    }

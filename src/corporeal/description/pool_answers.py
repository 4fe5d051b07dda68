"""Pooling of several answers on one object with equal weights.

Wang, Wei, Schuurmans, Le, Chi, Narang, Chowdhery and Zhou (2022), *Self-consistency improves chain of thought reasoning
in language models*, arXiv:2203.11171, sample several answers and take a vote. Answers here are distributions, so they
are mixed instead: a linear opinion pool (Stone 1961) with equal weights. Draws take one answer whole, with its own
values; what is pooled here is the description that is shown, and that the scene is computed with.
"""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import exp, hypot, log

import numpy as np

from corporeal.core.types import (
    Hypothesis,
    MassEvidence,
    ObjectAnswer,
    ObjectDescription,
    PartDescription,
    PrintedFact,
    RangePlacement,
    ScanThickening,
    apply_hypothesis,
)
from corporeal.discretization.part_model import NORMAL_90_PERCENT_WIDTH_SIGMAS
from corporeal.vlm.interpret_answers import merge_pieces

LOOKING_SOURCES = ("model", "recording")
FIELDS_NOT_ANSWERED = ("stated", "values", "inflation", "rebound")
"""Fields of a part that come from the file or an annotation, not from answers."""
SHARE_FIELDS = ("volume_share", "surface_share", "inner_share")


@dataclass(frozen=True)
class JudgedInterval:
    """Estimate of a positive quantity in one answer: 90 % interval and mode."""

    low: float
    likely: float
    high: float


def pool_answers(thing: ObjectDescription, answers: Sequence[ObjectAnswer]) -> ObjectDescription:
    """Describe an object by several answers, whose parts and pieces have the same names."""
    answers = [replace(one, parts=_in_piece_order(one.parts, answers[0].parts)) for one in answers]
    parts = tuple(_pool_part(same) for same in zip(*(one.parts for one in answers), strict=True))
    said = [one.evidence for one in answers if one.evidence]
    evidence = _pool_evidence(said) if said else None
    return replace(thing, parts=parts, evidence=evidence, answers=tuple(answers))


def _in_piece_order(parts: Sequence[PartDescription], like: Sequence[PartDescription]) -> tuple[PartDescription, ...]:
    """Put every part's pieces in the order of the first answer's."""
    found = []
    for part, first in zip(parts, like, strict=True):
        by_name = {p.name: p for p in part.pieces}
        found.append(replace(part, pieces=tuple(by_name[p.name] for p in first.pieces)))
    return tuple(found)


def _pool_part(same: Sequence[PartDescription]) -> PartDescription:
    """Pool one part over the answers, or the pieces that share its mesh."""
    if not same[0].pieces:
        return _pool_leaf(same)
    layouts = [tuple((p.inside, p.missing) for p in one.pieces) for one in same]
    commonest = Counter(layouts).most_common(1)[0][0]
    agreed = [one for one, layout in zip(same, layouts, strict=True) if layout == commonest]
    pieces = [
        replace(
            _pool_leaf([one.pieces[k] for one in same]),
            inside=commonest[k][0],
            missing=commonest[k][1],
            **{name: _mean([getattr(one.pieces[k], name) for one in agreed]) for name in SHARE_FIELDS},
        )
        for k in range(len(commonest))
    ]
    kept = {name: getattr(same[0], name) for name in FIELDS_NOT_ANSWERED}
    return replace(merge_pieces(same[0].name, pieces), **kept)


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values))


def _pool_leaf(same: Sequence[PartDescription]) -> PartDescription:
    """Pool the hypotheses of one part, or of one piece of a mesh, over all answers."""
    first = same[0]
    said = [one.swelling for one in same if one.swelling]
    first = replace(first, swelling=_pool_swelling(said) if said else None)
    if not all(one.hypotheses for one in same):  # annotated: only values differ
        places = [one.placements for one in same]
        return replace(first, placements=_pool_placements(places, [1.0] * len(same)))
    ways = _merge_hypotheses([way for one in same for way in one.hypotheses], len(same))
    led = next((one for one in same if _hypothesis_key(one.hypotheses[0]) == _hypothesis_key(ways[0])), first)
    kept = {name: getattr(first, name) for name in ("swelling", *SHARE_FIELDS, "inside", "missing")}
    found = replace(apply_hypothesis(led, ways[0]), hypotheses=ways, **kept)
    if found.answered_by in LOOKING_SOURCES or ways[0].material is None:
        found = replace(found, margin=ways[0].probability if ways[0].material else 0.0)
    return found


def _hypothesis_key(way: Hypothesis) -> tuple[str | None, ...]:
    """Return the key of a hypothesis: equal keys differ in values only."""
    return way.material, way.structure, way.contents


def _merge_hypotheses(ways: Sequence[Hypothesis], count: int) -> tuple[Hypothesis, ...]:
    """Merge equal hypotheses; each of ``count`` answers has equal weight. Likeliest first."""
    groups: dict[tuple, list[Hypothesis]] = {}
    for way in ways:
        groups.setdefault(_hypothesis_key(way), []).append(way)
    merged = [_merge_group(group, count) for group in groups.values()]
    return tuple(sorted(merged, key=lambda way: -way.probability))


def _merge_group(group: Sequence[Hypothesis], count: int) -> Hypothesis:
    best = max(group, key=lambda way: way.probability)
    return replace(
        best,
        probability=sum(way.probability for way in group) / count,
        fill=_weighted_mean(group, lambda way: way.fill),
        solidity=_weighted_mean(group, lambda way: way.solidity),
        placements=_pool_placements([way.placements for way in group], [way.probability for way in group]),
    )


def _weighted_mean(group: Sequence[Hypothesis], share: Callable[[Hypothesis], float | None]) -> float | None:
    """Return the mean of a field over the hypotheses that state it, weighted by probability."""
    known = [(value, way.probability) for way in group if (value := share(way)) is not None]
    if not known:
        return None
    return sum(value * weight for value, weight in known) / sum(weight for _, weight in known)


def _pool_placements(
    said: Sequence[Mapping[str, RangePlacement]], weights: Sequence[float]
) -> dict[str, RangePlacement]:
    """Average the placements of every quantity on its range's scale."""
    found = {}
    for name in dict.fromkeys(name for places in said for name in places):
        own = [k for k, places in enumerate(said) if name in places]
        total = sum(weights[k] for k in own)
        leading = max(own, key=lambda k: weights[k])
        fraction = sum(said[k][name].fraction * weights[k] for k in own) / total
        found[name] = replace(said[leading][name], fraction=fraction)
    return found


def _pool_evidence(said: Sequence[MassEvidence]) -> MassEvidence:
    """Pool judgements of one mass, and keep printed facts that at least half of the answers read."""
    whole = _pool_intervals([JudgedInterval(e.low, e.likely, e.high) for e in said])
    nearest = min(said, key=lambda e: abs(log(e.likely / whole.likely)))
    printed: tuple[PrintedFact, ...] = tuple(
        fact
        for one in said
        for fact in one.printed
        if 2 * sum(any(f.kind == fact.kind for f in e.printed) for e in said) >= len(said)
    )
    return replace(nearest, low=whole.low, likely=whole.likely, high=whole.high, printed=printed)


def _pool_swelling(said: Sequence[ScanThickening]) -> ScanThickening:
    """Pool judgements of the ratio of real to scanned volume."""
    whole = _pool_intervals([JudgedInterval(s.low, s.likely, s.high) for s in said])
    nearest = min(said, key=lambda s: abs(log(s.likely / whole.likely)))
    return replace(nearest, low=whole.low, likely=whole.likely, high=whole.high)


def _pool_intervals(said: Sequence[JudgedInterval]) -> JudgedInterval:
    """Pool N judgements, each log-normal, by the first two moments of their mixture.

    ln m = mean(ln m_k)  and, by the law of total variance,  σ² = mean(σ_k²) + var(ln m_k): the
    geometric mean, with the variance within and between answers. It does not shrink with N, since
    the answers of one model share errors.
    """
    logs = np.log([s.likely for s in said])
    widths = [log(s.high / s.low) / NORMAL_90_PERCENT_WIDTH_SIGMAS for s in said]
    likely = exp(float(logs.mean()))
    width = hypot(float(np.sqrt(np.mean(np.square(widths)))), float(logs.std()))
    reach = exp(width * NORMAL_90_PERCENT_WIDTH_SIGMAS / 2)
    return JudgedInterval(likely / reach, likely, likely * reach)

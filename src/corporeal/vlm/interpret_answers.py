"""Conversion of a model's answers to descriptions of parts and placements in ranges."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import exp, hypot, log
from typing import Literal

from corporeal.core.types import (
    NO_USAGE,
    Hypothesis,
    MassEvidence,
    ModelUsage,
    Note,
    NoteKind,
    ObjectDescription,
    PartDescription,
    PrintedFact,
    RangePlacement,
    ScanThickening,
    SceneObject,
    apply_hypothesis,
)
from corporeal.discretization.part_model import swelling_log_sigma
from corporeal.vlm.answer_schemas import (
    CUBIC_METRES_OF_PRINTED_UNIT,
    KILOGRAMS_OF_PRINTED_UNIT,
    METRES_OF_PRINTED_UNIT,
    AllowedNames,
    MassAnswer,
    MaterialsAnswer,
    PartAnswer,
    ThicknessAnswer,
)
from corporeal.vlm.token_prices import price_usd, prices_date

LookingSource = Literal["model", "recording"]
LOOKING_SOURCE_NAMES = {"model": "the model", "recording": "a recorded answer"}
"""Sources that use pictures."""
WALL_AGREEMENT_RATIO = 1.25
"""By what factor a wall's thickness may differ from the stated one before it is reported."""
STRANGE_SHARE_STD_COUNT = 3.0
"""Number of standard deviations that is reported."""
SIZE_DISAGREEMENT_RATIO = 2.5
"""By what factor a size may differ from the usual one before it is reported."""


def parts_from_answer(answer: MaterialsAnswer, by: LookingSource, names: AllowedNames) -> list[PartDescription]:
    """Convert a validated answer to descriptions, one per part; unknown parts have no material."""
    outside = [p for p in answer.parts if p.inside is None and not p.missing]
    total = [sum(getattr(p, what) or 0.0 for p in outside) for what in ("volume_share", "surface_share")]
    within = {
        part.part: sum(p.volume_share or 0.0 for p in answer.parts if p.inside == part.part) for part in answer.parts
    }
    return [
        replace(
            with_likeliest_hypothesis(PartDescription(part.part, None), part_hypotheses(part, names), by),
            volume_share=_normalised_share(part.volume_share, total[0]),
            surface_share=_normalised_share(part.surface_share, total[1]),
            inside=part.inside or "",
            inner_share=_normalised_share(within[part.part], total[0]) if within[part.part] else 0.0,
            missing=part.missing,
        )
        for part in answer.parts
    ]


def part_hypotheses(answer: PartAnswer, names: AllowedNames) -> tuple[Hypothesis, ...]:
    """Return the hypotheses of a part, likeliest first; probabilities sum to 1 at most."""
    total = max(sum(way.probability for way in answer.ways), 1.0)
    ways = [
        Hypothesis(
            material=None if way.material is None else names.material(way.material),
            structure=way.built,
            probability=way.probability / total,
            contents=names.contents(way.contents) if way.contents else None,
            fill=way.fill if way.built == "filled" else None,
            solidity=way.solidity if way.built == "packed" else None,
            reading=way.reading.strip().lower(),
            reason=way.reason,
        )
        for way in answer.ways
        if way.probability > 0
    ]
    return tuple(sorted(ways, key=lambda way: -way.probability))


def with_likeliest_hypothesis(
    words: PartDescription, ways: tuple[Hypothesis, ...], by: LookingSource
) -> PartDescription:
    """Describe a part by its likeliest hypothesis, and keep all."""
    return replace(
        apply_hypothesis(words, ways[0]),
        answered_by=by if ways[0].material else "unknown",
        margin=ways[0].probability if ways[0].material else 0.0,
        hypotheses=ways,
        built_by=by,
    )


def _normalised_share(stated: float | None, total: float) -> float:
    """Make shares add up to 1 exactly; a part by itself has the whole."""
    return 1.0 if stated is None or total <= 0 else stated / total


def merge_pieces(name: str, pieces: Sequence[PartDescription]) -> PartDescription:
    """Describe a mesh that several pieces share by the largest one whose material is known."""
    if len(pieces) == 1:
        return replace(pieces[0], name=name)
    known = [p for p in pieces if p.material is not None] or list(pieces)
    main = max(known, key=lambda p: (p.volume_share - p.inner_share, p.surface_share))
    share = main.volume_share
    others = ", ".join(p.name for p in pieces if p is not main)
    reason = f"{main.name}, {share:.0%} of the volume, beside {others}. {main.reason}"
    return replace(
        main,
        name=name,
        reason=reason,
        volume_share=1.0,
        surface_share=1.0,
        inside="",
        inner_share=0.0,
        missing=False,
        pieces=tuple(pieces),
    )


def complete_from_file(
    answered: PartDescription, file: PartDescription, walled: Callable[[str], bool]
) -> PartDescription:
    """Take the material from the file if the model could not name it."""
    if answered.material is not None:
        return answered
    why = f"{answered.reason.rstrip('. ')}. " if answered.reason else ""
    own = file
    if answered.structure == "solid":
        own = replace(file, structure="solid", thickness=None, contents=None, fill=None)
        own = replace(own, built_by=answered.built_by)
    elif answered.structure and (file.thickness or file.material is None or walled(file.material)):
        kept = {"structure": answered.structure, "contents": answered.contents, "fill": answered.fill}
        own = replace(file, **kept, built_by=answered.built_by)
    return replace(
        own,
        name=answered.name,
        reason=f"The pictures do not show what it is made of: {why}{file.reason}",
        hypotheses=_complete_hypotheses(answered.hypotheses, own),
        volume_share=answered.volume_share,
        surface_share=answered.surface_share,
        inside=answered.inside,
        inner_share=answered.inner_share,
        missing=answered.missing,
        pieces=tuple(complete_from_file(piece, file, walled) for piece in answered.pieces),
    )


def _complete_hypotheses(ways: Sequence[Hypothesis], file: PartDescription) -> tuple[Hypothesis, ...]:
    """Set the file's material in hypotheses without one."""
    return tuple(
        replace(way, material=file.material, structure=file.structure, contents=file.contents, fill=file.fill)
        if way.material is None
        else way
        for way in ways
    )


def evidence_from_answer(answer: MassAnswer, by: LookingSource) -> MassEvidence:
    """Convert an answer about an object's mass to SI."""
    printed = tuple(PrintedFact(fact.kind, _si_value(fact.number, fact.unit), fact.words) for fact in answer.printed)
    return MassEvidence(answer.low_kg, answer.likely_kg, answer.high_kg, answer.reason, printed, by)


def _si_value(number: float | None, unit: str) -> float | None:
    factor = (KILOGRAMS_OF_PRINTED_UNIT | CUBIC_METRES_OF_PRINTED_UNIT | METRES_OF_PRINTED_UNIT).get(unit)
    return None if number is None or factor is None else number * factor


def contradiction_with_file(words: PartDescription, material: str | None, wall: float | None, put: float | None) -> str:
    """Describe in a clause where a model contradicts the file; "" if it does not.

    Args:
        words: The accepted description of a part.
        material: What the file states it is made of.
        wall: How thick the file states its wall is [m]; 0: stated solid; None: unknown.
        put: How thick the model put its wall [m].
    """
    stated, answered = [], []
    if material not in (None, words.material) and words.answered_by in LOOKING_SOURCE_NAMES:
        stated, answered = [str(material)], [str(words.material)]
    other = words.structure == "solid" if wall else words.structure != "solid"
    apart = bool(wall and put and not 1 / WALL_AGREEMENT_RATIO <= put / wall <= WALL_AGREEMENT_RATIO)
    if wall is not None and words.built_by in LOOKING_SOURCE_NAMES and (other or apart):
        stated.append(f"a wall {wall * 1e3:.3g} mm thick" if wall else "solid")
        answered.append(f"a wall {put * 1e3:.3g} mm thick" if apart and put else str(words.structure))
    if not stated:
        return ""
    who = LOOKING_SOURCE_NAMES[words.answered_by if words.answered_by in LOOKING_SOURCE_NAMES else words.built_by]
    return f"the file states {', '.join(stated)} for {words.name}, {who} said {', '.join(answered)}"


def hypothesis_name(name: str, number: int) -> str:
    """Return the name of a hypothesis in questions; the first is the part."""
    return name if number == 0 else f"{name}, way {number + 1}"


def apply_placements(words: PartDescription, placements: Mapping[str, Mapping[str, RangePlacement]]) -> PartDescription:
    """Set the placements of a part, its hypotheses and its pieces by their names."""
    own = dict(placements.get(words.name, {}))
    ways = tuple(
        replace(way, placements=dict(placements.get(hypothesis_name(words.name, k), {})))
        for k, way in enumerate(words.hypotheses)
    )
    words = replace(words, hypotheses=ways)
    pieces = tuple(apply_placements(piece, placements) for piece in words.pieces)
    if pieces:
        main = max(pieces, key=lambda p: (p.material == words.material, p.volume_share))
        own = dict(main.placements)
    return replace(words, placements=own, pieces=pieces)


def parts_filling_scan(words: Sequence[PartDescription]) -> list[PartDescription]:
    """Parts whose material fills the scan at its surface, in some hypothesis."""
    return [
        leaf
        for leaf in leaf_parts(words)
        if not (leaf.inside or leaf.missing) and any(w in ("solid", "packed", None) for w in _possible_structures(leaf))
    ]


def _possible_structures(words: PartDescription) -> list[str | None]:
    return [way.structure for way in words.hypotheses] or [words.structure]


def apply_real_shares(words: PartDescription, answer: ThicknessAnswer, by: LookingSource) -> PartDescription:
    """Set the ratio of real to scanned volume of a part, or its pieces."""
    said = {p.part: ScanThickening(p.low, p.likely, p.high, p.reason, by) for p in answer.parts}
    pieces = tuple(replace(p, swelling=said.get(p.name)) for p in words.pieces)
    main = max(
        (p for p in pieces if p.material == words.material),
        key=lambda p: (p.volume_share - p.inner_share, p.surface_share),
        default=None,
    )
    own = main.swelling if main else said.get(words.name)
    return replace(words, swelling=own, pieces=pieces)


def leaf_parts(words: Sequence[PartDescription]) -> list[PartDescription]:
    """Parts, or their pieces where they have some."""
    return [leaf for part in words for leaf in (part.pieces or (part,))]


def box_sides_text(lengths: Sequence[float]) -> str:
    """Write the sides of a box, longest first, as a person would."""
    ordered = sorted(lengths, reverse=True)
    unit, factor = ("m", 1.0) if ordered[0] >= 1 else ("cm", 100.0)
    return " × ".join(f"{factor * side:.3g}" for side in ordered) + f" {unit}"


def strange_share_notes(answer: ThicknessAnswer, doubt: float) -> list[str]:
    """Return warnings of parts whose real volume is judged far from the scan's.

    Args:
        answer: Of how much of what it draws is real.
        doubt: How far its edges leave its volume open: deviation of the logarithm [-].
    """
    found = []
    for part in answer.parts:
        said = ScanThickening(part.low, part.likely, part.high, part.reason)
        away = abs(log(part.likely) + doubt / 2) / hypot(doubt, swelling_log_sigma(said))
        if away > STRANGE_SHARE_STD_COUNT:
            found.append(
                Note(
                    f"{part.part} was judged to have {part.likely:.0%} of its scan's volume, whose "
                    f"resolution suggests {exp(-doubt / 2):.0%} ± {doubt:.0%}. The former was "
                    "accepted; --annotations decides.",
                    NoteKind.ASSUMED,
                )
            )
    return found


def millimetres_text(metres: float) -> str:
    """Write a small length to two digits."""
    return f"{float(f'{1e3 * metres:.2g}'):g} mm"


def extent_text(metres: float) -> str:
    """Write a length as a person would."""
    if metres >= 1000:
        return f"{metres:.0f} m"
    return f"{metres:.3g} m" if metres >= 1 else f"{100 * metres:.3g} cm"


def with_usual_extents(
    things: Sequence[SceneObject], objects: Sequence[ObjectDescription], usual: Mapping[str, float]
) -> tuple[list[ObjectDescription], list[str]]:
    """Set usual extents of objects [m], and warn of objects far from them."""
    sized, doubts = [], []
    for thing, words in zip(things, objects, strict=True):
        kind = thing.class_name or thing.name
        size, usually = thing.real_extent, usual.get(kind)
        sized.append(replace(words, usual_extent=usually))
        if usually and not 1 / SIZE_DISAGREEMENT_RATIO <= size / usually <= SIZE_DISAGREEMENT_RATIO:
            doubts.append(
                Note(
                    f"{thing.name} is {extent_text(size)} large, but the model says that an object like "
                    f"that ({kind}) is usually about {extent_text(usually)}. Set its size with --extent "
                    f"{thing.name}={float(f'{usually:.3g}'):g}.",
                    NoteKind.ASSUMED,
                )
            )
    return sized, doubts


def sum_usage(transcript: Sequence[Mapping]) -> ModelUsage:
    """Sum the cost of questions; no price is given if one model's price is unknown."""
    rows = [r for r in transcript if r.get("answer") is not None]
    if not rows:
        return NO_USAGE
    costs = [price_usd(r["model"], r["input_tokens"], r["output_tokens"]) if r["calls"] else 0.0 for r in rows]
    known = None if None in costs else round(sum(c or 0.0 for c in costs), 6)
    return ModelUsage(
        models=tuple(sorted({r["model"] for r in rows})),
        questions=len(transcript),
        calls=sum(r["calls"] for r in rows),
        input_tokens=sum(r["input_tokens"] for r in rows),
        output_tokens=sum(r["output_tokens"] for r in rows),
        seconds=sum(r["seconds"] for r in rows),
        dollars=known,
        prices_of=prices_date(),
    )

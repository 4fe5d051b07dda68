"""Validation of a model's answers: names and bounds, checked against the question."""

from collections.abc import Collection, Mapping, Sequence
from math import isclose

from corporeal.recognition.typical_extents import typical_extent
from corporeal.vlm.answer_schemas import (
    KILOGRAMS_OF_PRINTED_UNIT,
    AllowedNames,
    ExtentsAnswer,
    FractionAnswer,
    MassAnswer,
    MaterialsAnswer,
    ObjectsAnswer,
    PartAnswer,
    PartHypothesis,
    PartsAnswer,
    PrintedStatement,
    QuantityValue,
    RankingAnswer,
    RegionsAnswer,
    SizeAnswer,
    ThicknessAnswer,
    ValueAnswer,
)

MAX_PARTS = 6
MAX_OBJECTS_IN_SCENE = 12
MAX_HYPOTHESES_PER_PART = 6
PACKED_SOLIDITY_RANGE = (0.1, 0.95)
"""Between these is packed what is packed of parts and air."""
REAL_VOLUME_SHARE_RANGE = (0.1, 1.25)
"""Volume of a real part over the volume that a scan draws of it [-]: scans thicken."""
BOX_DENSITY_RANGE_KG_M3 = (0.3, 25_000.0)
"""Mass of an object over the volume of its smallest box [kg/m³]: from a paper lampshade to gold."""
SHARE_SUM_TOLERANCE = 0.05
"""By how much shares may miss 1."""
MIN_OBJECT_EXTENT_M, MAX_OBJECT_EXTENT_M = 1e-3, 100.0
"""Extents of what may stand in a scene [m]."""
UNIT_SLIP_RATIO = 10.0
"""A size this many times beyond the known ones is in another unit."""


def parts_complaints(answer: PartsAnswer) -> list[str]:
    """Check that there are parts, and that names tell them apart."""
    found = []
    if not answer.decompositions:
        found.append("Give at least one decomposition.")
    if any(not 1 <= len(d.parts) <= MAX_PARTS for d in answer.decompositions):
        found.append(f"A decomposition has 1 to {MAX_PARTS} parts.")
    for decomposition in answer.decompositions:
        names = [p.name for p in decomposition.parts]
        if len({n.lower() for n in names}) < len(names):
            found.append(f"Part names must differ within a decomposition: {', '.join(names)}.")
        if names and all(p.seen == "missing" for p in decomposition.parts):
            found.append("At least one part of a decomposition must be in the pictures.")
    return found


def ranking_complaints(answer: RankingAnswer, count: int) -> list[str]:
    """Check that every alternative is ranked once."""
    if sorted(r.number for r in answer.ranking) == list(range(1, count + 1)):
        return []
    return [f"Rank each of the decompositions 1 to {count} exactly once."]


def materials_complaints(answer: MaterialsAnswer, parts: Sequence[str], names: AllowedNames, shared: bool) -> list[str]:
    """Check names, builds, probabilities and, where parts share one mesh, what they take up."""
    found = name_complaints([p.part for p in answer.parts], parts)
    for part in answer.parts:
        found += [f"{part.part}: {problem}" for problem in _part_problems(part, names)]
    found = found or _contents_problems(answer, names)
    return found if found or not shared else _share_problems(answer)


def name_complaints(got: Sequence[str], wanted: Sequence[str]) -> list[str]:
    """Check that exactly the names asked about are answered for, each once."""
    if sorted(got) == sorted(wanted):
        return []
    return [
        f"Answer for exactly these names, each once: {'; '.join(wanted)}. You answered for: {'; '.join(got) or 'none'}."
    ]


def _part_problems(part: PartAnswer, names: AllowedNames) -> list[str]:
    if not 1 <= len(part.ways) <= MAX_HYPOTHESES_PER_PART:
        return [f"Give 1 to {MAX_HYPOTHESES_PER_PART} ways it may be; you gave {len(part.ways)}."]
    found = [
        f"{way.material!r} is not in the list of materials."
        for way in part.ways
        if way.material is not None and names.material(way.material) is None
    ]
    if sum(way.probability for way in part.ways) <= 0:
        found.append("The probabilities of its ways must be above 0 and add up to 1.")
    return found or [problem for way in part.ways for problem in _structure_problems(way, names)]


def _structure_problems(way: PartHypothesis, names: AllowedNames) -> list[str]:
    found = []
    walled = way.built in ("sheet", "hollow", "filled")
    made = names.material(way.material) if way.material is not None else None
    if walled and made is not None and not names.walled(made):
        found.append(f"Nobody makes walls of {way.material}: it is built 'solid' or 'packed', never {way.built!r}.")
    if way.built != "filled":
        if way.contents is not None:
            found.append("Only what is built 'filled' has contents.")
    elif way.contents is None or not way.fill:
        found.append("What is filled needs contents, and a fill above 0.")
    elif names.contents(way.contents) is None:
        found.append(f"{way.contents!r} is not in the list of contents.")
    low, high = PACKED_SOLIDITY_RANGE
    if way.built == "packed" and not low <= (way.solidity or 0.0) <= high:
        found.append(f"What is packed needs a solidity, from {low:g} to {high:g}.")
    return found


def _contents_problems(answer: MaterialsAnswer, names: AllowedNames) -> list[str]:
    """Find what a container holds among the parts, where it would weigh twice."""
    found = []
    for box in answer.parts:
        held = {names.contents(w.contents) for w in box.ways if w.contents} - {None}
        for part in answer.parts:
            made = {names.contents(w.material) for w in part.ways if w.material}
            made.add(names.contents(part.part))
            if part is not box and held & made:
                found.append(
                    f"{part.part} is what {box.part} holds, and would weigh twice: as the contents "
                    f"of {box.part}, and as a part. Build {box.part} 'sheet' or 'hollow'."
                )
    return found


def _share_problems(answer: MaterialsAnswer) -> list[str]:
    found = [problem for part in answer.parts for problem in _own_shares(part, answer)]
    outside = [p for p in answer.parts if p.inside is None and not p.missing]
    if not found and not outside:
        return ["At least one part must lie at the surface: inside null, missing false."]
    return found or [*_sums(outside), *_nesting_problems(answer)]


def _own_shares(part: PartAnswer, answer: MaterialsAnswer) -> list[str]:
    found = []
    for what in ("volume_share", "surface_share"):
        if not getattr(part, what) and not (part.missing and what == "volume_share"):
            found.append(f"{part.part}: give {what}, above 0: of its own shape, wherever it lies.")
    others = [p.part for p in answer.parts if p is not part]
    if part.inside is not None and part.inside not in others:
        found.append(f"{part.part}: there is no other part {part.inside!r} for it to lie in.")
    return found


def _sums(outside: Sequence[PartAnswer]) -> list[str]:
    found = []
    for what in ("volume_share", "surface_share"):
        total = sum(getattr(p, what) for p in outside)
        if not isclose(total, 1.0, abs_tol=SHARE_SUM_TOLERANCE):
            found.append(f"{what} of the parts that lie at the surface must add up to 1, not {total:.2f}.")
    return found


def _nesting_problems(answer: MaterialsAnswer) -> list[str]:
    found = []
    for part in answer.parts:
        within = sum(p.volume_share or 0.0 for p in answer.parts if p.inside == part.part)
        if within >= (part.volume_share or 0.0) > 0:
            found.append(f"What lies inside {part.part} must take up less volume than it does.")
    return found


def weakness_notes(answer: MaterialsAnswer) -> list[str]:
    """Describe corrections and weaknesses of an answer, in clauses."""
    found = []
    for part in answer.parts:
        total = sum(way.probability for way in part.ways)
        if total > 1 + SHARE_SUM_TOLERANCE:
            found.append(f"the probabilities of {part.part} add up to {total:.3g} and were divided by it")
    if all(len(p.ways) == 1 and p.ways[0].probability > 1 - SHARE_SUM_TOLERANCE for p in answer.parts):
        found.append(
            "one way only was given for every part, as certain: the interval of its mass covers "
            "measured ranges and no other build"
        )
    return found


def thickness_complaints(answer: ThicknessAnswer, parts: Sequence[str]) -> list[str]:
    """Check the names, the order and the bounds of how much of a scan is real."""
    found = name_complaints([p.part for p in answer.parts], parts)
    low, high = REAL_VOLUME_SHARE_RANGE
    for part in answer.parts:
        if not part.low <= part.likely <= part.high:
            found.append(f"{part.part}: low, likely and high must be in this order.")
        if part.low < low or part.high > high:
            found.append(
                f"{part.part}: {part.low:g} to {part.high:g} is not between {low:g} and {high:g}. "
                "Give the volume of the real part over the volume that the model draws, not a "
                "thickness and not a percentage."
            )
    return found


def mass_complaints(answer: MassAnswer, box: float) -> list[str]:
    """Check the order, and that masses, judged and printed, are in the units they are stated in.

    Args:
        answer: What was answered.
        box: Volume of the smallest box around the object [m³]; 0: not known.
    """
    if not answer.low_kg <= answer.likely_kg <= answer.high_kg:
        return ["low_kg, likely_kg and high_kg must be in this order."]
    said = [(answer.likely_kg, "Answer in kilograms.")]
    said += [(_printed_weight(fact), f"Check the unit of {fact.words!r}.") for fact in answer.printed]
    return [problem for mass, advice in said if (problem := _too_dense(mass, box, advice))]


def _printed_weight(fact: PrintedStatement) -> float | None:
    """Weight [kg] that is printed on an object, or None where it is something else."""
    factor = KILOGRAMS_OF_PRINTED_UNIT.get(fact.unit) if fact.kind in ("net weight", "total weight") else None
    return fact.number * factor if fact.number and factor else None


def _too_dense(mass: float | None, box: float, advice: str) -> str:
    """Describe why a mass [kg] is implausible for a box [m³]; "": plausible."""
    low, high = BOX_DENSITY_RANGE_KG_M3
    mean = mass / box if mass is not None and box > 0 else low
    if low <= mean <= high:
        return ""
    return (
        f"{mass:g} kg in a box of {1e6 * box:.4g} cm³ would be {mean:.3g} kg/m³, which "
        f"no object has ({low:g} to {high:g}). {advice}"
    )


def placement_complaints(
    answer: FractionAnswer | ValueAnswer,
    wanted: Mapping[str, Collection[str]],
    bounds: Mapping[tuple[str, str], tuple[float, float]],
) -> list[str]:
    """Check that every quantity of every part is placed once, and values inside their bounds.

    Args:
        answer: Places, or values.
        wanted: Part → its quantities.
        bounds: (part, quantity) → low and high in the unit the question named.
    """
    found = name_complaints([p.part for p in answer.parts], list(wanted))
    if found:
        return found
    for part in answer.parts:
        got = [v.quantity for v in part.values]
        if sorted(got) != sorted(wanted[part.part]):
            found.append(
                f"{part.part}: give exactly these quantities, each once: "
                f"{', '.join(wanted[part.part])}. You gave: {', '.join(got) or 'none'}."
            )
            continue
        for place in part.values:
            low, high = bounds[part.part, place.quantity]
            if isinstance(place, QuantityValue) and not _within(place.value, low, high):
                found.append(
                    f"{part.part}: {place.quantity} is {place.value:g}, outside the measured range "
                    f"{low:g} to {high:g}. Choose a value inside it."
                )
    return found


def _within(value: float, low: float, high: float) -> bool:
    """Return whether a value lies inside, the last digit of a printed bound aside."""
    slack = 1e-6 * max(abs(low), abs(high))
    return low - slack <= value <= high + slack


def extents_complaints(answer: ExtentsAnswer, classes: Sequence[str]) -> list[str]:
    """Check that exactly the classes asked about are answered for."""
    return name_complaints([c.class_name for c in answer.classes], classes)


def size_complaints(answer: SizeAnswer, class_name: str) -> list[str]:
    """Check that sizes are lengths of objects, in order, and no slip of a unit."""
    sizes = (answer.smallest, answer.usual, answer.largest)
    if not all(MIN_OBJECT_EXTENT_M <= size <= MAX_OBJECT_EXTENT_M for size in sizes):
        return [f"Sizes must lie between {MIN_OBJECT_EXTENT_M:g} and {MAX_OBJECT_EXTENT_M:g} metres."]
    if not answer.smallest <= answer.usual <= answer.largest:
        return ["smallest, usual and largest must be in this order."]
    known = typical_extent(class_name)
    if known is None or known.low / UNIT_SLIP_RATIO <= answer.usual <= known.high * UNIT_SLIP_RATIO:
        return []
    return [
        f"You said that an ordinary {class_name} is {answer.usual:g} metres long. That is "
        f"{UNIT_SLIP_RATIO:g} times beyond what such things are known to be. Answer in metres."
    ]


def things_complaints(answer: ObjectsAnswer) -> list[str]:
    """Check that there are objects, and not more than can be separated."""
    if 1 <= len(answer.things) <= MAX_OBJECTS_IN_SCENE:
        return []
    return [f"Name 1 to {MAX_OBJECTS_IN_SCENE} things; you named {len(answer.things)}."]


def regions_complaints(answer: RegionsAnswer, colours: Collection[str], things: int) -> list[str]:
    """Check that every colour is answered for once, with an object that exists, each at most once."""
    said = [r.colour for r in answer.regions]
    numbers = [r.thing for r in answer.regions if r.thing is not None]
    found = []
    if sorted(said) != sorted(colours):
        found.append(f"Answer once for each of these colours: {', '.join(colours)}.")
    if any(not 1 <= n <= things for n in numbers):
        found.append(f"Things have numbers from 1 to {things}.")
    if len(set(numbers)) < len(numbers):
        found.append("A thing can be one region only.")
    return found

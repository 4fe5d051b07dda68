"""The shapes of the answers to the house's questions, and what can be wrong with them.

The shapes do not change with the library or the scene, so that a recorded answer outlives both;
names and bounds are checked against what was asked.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from math import isclose
from typing import Annotated, Literal

from pydantic import BaseModel, Field

from corporeal.formats.typical_extents import typical_extent

Share = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
Lookup = Callable[[str], str | None]
"""Returns the library's spelling of a name, or None."""


@dataclass(frozen=True)
class Vocabulary:
    """The names that an answer may use."""

    material: Lookup
    contents: Lookup
    """Of what something is filled with."""
    walled: Callable[[str], bool]
    """Tells whether walls of a material were ever measured."""


MOST_PARTS = 6
MOST_THINGS = 12
SLACK = 0.05
"""By how much shares may miss 1."""
SMALLEST_THING, LARGEST_THING = 1e-3, 100.0
"""Extents of what may stand in a scene [m]."""
SLIP = 10.0
"""A size this many times beyond the known ones is in another unit."""


class SeenPart(BaseModel):
    """One part, as it looks."""

    name: str = Field(min_length=1, max_length=60)
    look: str
    """Colour, what it seems to be made of, shape."""
    visible: bool


class Decomposition(BaseModel):
    """One way of taking an object apart."""

    parts: list[SeenPart]
    why: str


class PartsAnswer(BaseModel):
    """Question 1: what it is, and the ways of taking it apart."""

    object: str
    decompositions: list[Decomposition]


class Rank(BaseModel):
    """The critic's word on one decomposition."""

    number: int
    reason: str


class RankingAnswer(BaseModel):
    """The critic's order, best first."""

    ranking: list[Rank]


class OtherMaterial(BaseModel):
    """What a part may be made of instead."""

    material: str
    probability: Share


class PartAnswer(BaseModel):
    """What one part is made of, and how it is built."""

    part: str
    material: str | None
    probability: Share
    alternatives: list[OtherMaterial] = []
    structure: Literal["solid", "shell", "filled"] | None
    contents: str | None = None
    fill: Share | None = None
    volume_share: Share | None = None
    surface_share: Share | None = None
    reason: str


class MaterialsAnswer(BaseModel):
    """Question 2: every part of one object."""

    parts: list[PartAnswer]


class FractionPlace(BaseModel):
    """A place in one quantity's range."""

    quantity: str
    fraction: Share
    reason: str

    @property
    def number(self) -> float:
        """What was answered."""
        return self.fraction


class FractionPart(BaseModel):
    """The places of one part's quantities."""

    part: str
    values: list[FractionPlace]


class FractionAnswer(BaseModel):
    """Question 3, asked for places in ranges."""

    parts: list[FractionPart]


class Value(BaseModel):
    """A value of one quantity, in the unit it was asked in."""

    quantity: str
    value: float = Field(allow_inf_nan=False)
    reason: str

    @property
    def number(self) -> float:
        """What was answered."""
        return self.value


class ValuePart(BaseModel):
    """The values of one part's quantities."""

    part: str
    values: list[Value]


class ValueAnswer(BaseModel):
    """Question 3, asked for values."""

    parts: list[ValuePart]


class Extent(BaseModel):
    """How large one class of things usually is."""

    class_name: str
    metres: float = Field(gt=0, lt=1000, allow_inf_nan=False)


class ExtentsAnswer(BaseModel):
    """Question 4: every class of things in the scene."""

    classes: list[Extent]


class SizeAnswer(BaseModel):
    """How large one class of things is along its longest side, in metres."""

    smallest: float = Field(gt=0, allow_inf_nan=False)
    usual: float = Field(gt=0, allow_inf_nan=False)
    largest: float = Field(gt=0, allow_inf_nan=False)
    reason: str


class SeenThing(BaseModel):
    """One of the things that pictures of a scene show."""

    class_name: str = Field(min_length=1, max_length=60)
    look: str
    metres: float = Field(ge=1e-3, le=100.0, allow_inf_nan=False)
    """Length of its longest side in reality."""


class ThingsAnswer(BaseModel):
    """Which things stand in a scene that was photographed."""

    things: list[SeenThing]


class PaintedRegion(BaseModel):
    """Which thing a painted region is."""

    colour: str
    thing: int | None


class RegionsAnswer(BaseModel):
    """Which thing each painted region is."""

    regions: list[PaintedRegion]


# ---------------------------------------------------------------- what can be wrong


def parts_complaints(answer: PartsAnswer) -> list[str]:
    """Check that the alternatives are real ones and that names tell parts apart."""
    counts = [len(d.parts) for d in answer.decompositions]
    found = []
    if not counts:
        found.append("Give at least one decomposition.")
    if len(set(counts)) < len(counts):
        found.append("Decompositions must differ in their number of parts.")
    if any(not 1 <= count <= MOST_PARTS for count in counts):
        found.append(f"A decomposition has 1 to {MOST_PARTS} parts.")
    for decomposition in answer.decompositions:
        names = [p.name for p in decomposition.parts]
        if len({n.lower() for n in names}) < len(names):
            found.append(f"Part names must differ within a decomposition: {', '.join(names)}.")
    return found


def ranking_complaints(answer: RankingAnswer, count: int) -> list[str]:
    """Check that every alternative is ranked once."""
    if sorted(r.number for r in answer.ranking) == list(range(1, count + 1)):
        return []
    return [f"Rank each of the decompositions 1 to {count} exactly once."]


def materials_complaints(
    answer: MaterialsAnswer,
    parts: Sequence[str],
    names: Vocabulary,
    shared: bool,
) -> list[str]:
    """Check names, structure, probabilities and, where parts share one mesh, shares."""
    found = name_complaints([p.part for p in answer.parts], parts)
    for part in answer.parts:
        found += [f"{part.part}: {problem}" for problem in _part_problems(part, names)]
    return found if found or not shared else _share_problems(answer)


def name_complaints(got: Sequence[str], wanted: Sequence[str]) -> list[str]:
    """Check that exactly the names asked about are answered for, each once."""
    if sorted(got) == sorted(wanted):
        return []
    return [
        f"Answer for exactly these names, each once: {'; '.join(wanted)}. You answered for: "
        f"{'; '.join(got) or 'none'}."
    ]


def _part_problems(part: PartAnswer, names: Vocabulary) -> list[str]:
    said = [part.material, *(a.material for a in part.alternatives)]
    found = [
        f"{name!r} is not in the list of materials."
        for name in said
        if name is not None and names.material(name) is None
    ]
    if sum(a.probability for a in part.alternatives) + part.probability > 1 + SLACK:
        found.append("The probabilities of the material and its alternatives exceed 1.")
    return found or _structure_problems(part, names)


def _structure_problems(part: PartAnswer, names: Vocabulary) -> list[str]:
    found = []
    walled = part.structure in ("shell", "filled")
    made = names.material(part.material) if part.material is not None else None
    if walled and made is not None and not names.walled(made):
        found.append(f"Nobody makes walls of {part.material}: the structure must be solid.")
    if part.structure != "filled":
        if part.contents is not None:
            found.append("Only a part whose structure is 'filled' has contents.")
    elif part.contents is None or not part.fill:
        found.append("What is filled needs contents, and a fill above 0.")
    elif names.contents(part.contents) is None:
        found.append(f"{part.contents!r} is not in the list of contents.")
    return found


def _share_problems(answer: MaterialsAnswer) -> list[str]:
    found = []
    for what in ("volume_share", "surface_share"):
        shares = [getattr(p, what) for p in answer.parts]
        if None in shares:
            found.append(f"Give {what} for every part: they share one mesh.")
        elif not isclose(sum(shares), 1.0, abs_tol=SLACK):
            found.append(f"{what} must add up to 1, not {sum(shares):.2f}.")
    return found


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
            if isinstance(place, Value) and not _within(place.value, low, high):
                found.append(
                    f"{part.part}: {place.quantity} is {place.value:g}, outside the measured range "
                    f"{low:g} to {high:g}. Choose a value inside it."
                )
    return found


def _within(value: float, low: float, high: float) -> bool:
    """Tell whether a value lies inside, the last digit of a printed bound aside."""
    slack = 1e-6 * max(abs(low), abs(high))
    return low - slack <= value <= high + slack


def extents_complaints(answer: ExtentsAnswer, classes: Sequence[str]) -> list[str]:
    """Check that exactly the classes asked about are answered for."""
    return name_complaints([c.class_name for c in answer.classes], classes)


def size_complaints(answer: SizeAnswer, class_name: str) -> list[str]:
    """Check that sizes are lengths of things, in order, and no slip of a unit."""
    sizes = (answer.smallest, answer.usual, answer.largest)
    if not all(SMALLEST_THING <= size <= LARGEST_THING for size in sizes):
        return [f"Sizes must lie between {SMALLEST_THING:g} and {LARGEST_THING:g} metres."]
    if not answer.smallest <= answer.usual <= answer.largest:
        return ["smallest, usual and largest must be in this order."]
    known = typical_extent(class_name)
    if known is None or known.low / SLIP <= answer.usual <= known.high * SLIP:
        return []
    return [
        f"You said that an ordinary {class_name} is {answer.usual:g} metres long. That is "
        f"{SLIP:g} times beyond what such things are known to be. Answer in metres."
    ]


def things_complaints(answer: ThingsAnswer) -> list[str]:
    """Check that there are things, and not more than can be told apart."""
    if 1 <= len(answer.things) <= MOST_THINGS:
        return []
    return [f"Name 1 to {MOST_THINGS} things; you named {len(answer.things)}."]


def regions_complaints(answer: RegionsAnswer, colours: Collection[str], things: int) -> list[str]:
    """Check that every colour is answered for once, with a thing that exists, each at most once."""
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

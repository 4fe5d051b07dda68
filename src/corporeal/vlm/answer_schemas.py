"""The schemas of a model's answers.

They do not change with the library or the scene, so that a recorded answer outlives both; names
and bounds are checked against what was asked (``answer_checks``). Names and docstrings of classes
may change freely; a change of fields needs a new version in ``SCHEMA``.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, Field, model_validator

from corporeal.vlm import AnswerSchema

UnitShare = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
NameLookup = Callable[[str], str | None]
"""Returns the library's spelling of a name, or None."""


@dataclass(frozen=True)
class AllowedNames:
    """The names that an answer may use."""

    material: NameLookup
    contents: NameLookup
    """Of what something is filled with."""
    walled: Callable[[str], bool]
    """Tells whether walls of a material were ever measured."""


KILOGRAMS_OF_PRINTED_UNIT = {"g": 1e-3, "kg": 1.0, "oz": 0.028349523, "lb": 0.45359237}
CUBIC_METRES_OF_PRINTED_UNIT = {"ml": 1e-6, "l": 1e-3, "fl oz": 2.9573530e-5}
METRES_OF_PRINTED_UNIT = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}
"""Units of what is printed (NIST Handbook 44, Appendix C; fluid ounces are those of the US)."""
LISTED_FORM_OF_UNIT = {"cl": ("ml", 10.0), "dl": ("ml", 100.0), "mg": ("g", 1e-3), "lbs": ("lb", 1.0)}
"""Units that answers give, too: a listed one, and how many of it. To list them would need a new
version of the schema, and so end every recorded answer about a mass."""


class SeenPart(BaseModel):
    """One part, as it looks."""

    name: str = Field(min_length=1, max_length=60)
    look: str
    """Colour, what it seems to be made of, shape."""
    seen: Literal["yes", "hidden", "missing"]
    """Whether the pictures show it; "missing": the model lacks it, as a scan lacks glass."""


class Decomposition(BaseModel):
    """One way of taking an object apart."""

    parts: list[SeenPart]
    why: str


class PartsAnswer(AnswerSchema):
    """Question 1: what it is, and the ways of taking it apart."""

    SCHEMA: ClassVar[str] = "parts/1"
    object: str
    decompositions: list[Decomposition]


class DecompositionRank(BaseModel):
    """The critic's word on one decomposition."""

    number: int
    reason: str


class RankingAnswer(AnswerSchema):
    """The critic's order, best first."""

    SCHEMA: ClassVar[str] = "ranking/1"
    ranking: list[DecompositionRank]


class PartHypothesis(BaseModel):
    """One way a part may be."""

    material: str | None
    built: Literal["solid", "sheet", "hollow", "filled", "packed"] | None
    contents: str | None = None
    fill: UnitShare | None = None
    solidity: UnitShare | None = None
    reading: str = ""
    probability: UnitShare
    reason: str


class PartAnswer(BaseModel):
    """The ways one part may be, and what it takes up."""

    part: str
    ways: list[PartHypothesis]
    inside: str | None = None
    missing: bool = False
    volume_share: UnitShare | None = None
    surface_share: UnitShare | None = None


class MaterialsAnswer(AnswerSchema):
    """Question 2: every part of one object."""

    SCHEMA: ClassVar[str] = "materials/1"
    parts: list[PartAnswer]


class RealVolumeShare(BaseModel):
    """How much of what a scan draws of one part is real."""

    part: str
    low: float = Field(gt=0, allow_inf_nan=False)
    likely: float = Field(gt=0, allow_inf_nan=False)
    high: float = Field(gt=0, allow_inf_nan=False)
    reason: str


class ThicknessAnswer(AnswerSchema):
    """How far a scan of something thin is thicker than the real thing."""

    SCHEMA: ClassVar[str] = "thickness/1"
    parts: list[RealVolumeShare]


class QuantityFraction(BaseModel):
    """A place in one quantity's range."""

    quantity: str
    fraction: UnitShare
    reason: str

    @property
    def number(self) -> float:
        """What was answered."""
        return self.fraction


class PartFractions(BaseModel):
    """The places of one part's quantities."""

    part: str
    values: list[QuantityFraction]


class FractionAnswer(AnswerSchema):
    """Question 3, asked for places in ranges."""

    SCHEMA: ClassVar[str] = "placement-fractions/1"
    parts: list[PartFractions]


class QuantityValue(BaseModel):
    """A value of one quantity, in the unit it was asked in."""

    quantity: str
    value: float = Field(allow_inf_nan=False)
    reason: str

    @property
    def number(self) -> float:
        """What was answered."""
        return self.value


class PartValues(BaseModel):
    """The values of one part's quantities."""

    part: str
    values: list[QuantityValue]


class ValueAnswer(AnswerSchema):
    """Question 3, asked for values."""

    SCHEMA: ClassVar[str] = "placement-values/1"
    parts: list[PartValues]


class PrintedStatement(BaseModel):
    """Something printed on an object that says how much of it there is."""

    kind: Literal["net weight", "total weight", "volume", "size", "count", "other"]
    number: float | None = Field(default=None, ge=0, allow_inf_nan=False)
    unit: Literal["g", "kg", "oz", "lb", "ml", "l", "fl oz", "mm", "cm", "m", "in", ""] = ""
    words: str

    @model_validator(mode="before")
    @classmethod
    def _in_a_listed_unit(cls, said: Any) -> Any:
        if not isinstance(said, dict) or not isinstance(said.get("unit"), str):
            return said
        unit, number = said["unit"].strip(" .").casefold(), said.get("number")
        listed, factor = LISTED_FORM_OF_UNIT.get(unit, (unit, 1.0))
        if isinstance(number, int | float):
            return said | {"unit": listed, "number": number * factor}
        return said | {"unit": listed} if factor == 1.0 else said


class MassAnswer(AnswerSchema):
    """What is printed on an object, and what it weighs, judged without any library."""

    SCHEMA: ClassVar[str] = "mass/1"
    printed: list[PrintedStatement] = Field(default=[])
    low_kg: float = Field(gt=0, lt=1e9, allow_inf_nan=False)
    likely_kg: float = Field(gt=0, lt=1e9, allow_inf_nan=False)
    high_kg: float = Field(gt=0, lt=1e9, allow_inf_nan=False)
    reason: str


class ClassExtent(BaseModel):
    """How large one class of things usually is."""

    class_name: str
    metres: float = Field(gt=0, lt=1000, allow_inf_nan=False)


class ExtentsAnswer(AnswerSchema):
    """Question 4: every class of things in the scene."""

    SCHEMA: ClassVar[str] = "extents/1"
    classes: list[ClassExtent]


class SizeAnswer(AnswerSchema):
    """How large one class of things is along its longest side, in metres."""

    SCHEMA: ClassVar[str] = "size/1"
    smallest: float = Field(gt=0, allow_inf_nan=False)
    usual: float = Field(gt=0, allow_inf_nan=False)
    largest: float = Field(gt=0, allow_inf_nan=False)
    reason: str


class ListedObject(BaseModel):
    """One of the things that pictures of a scene show."""

    class_name: str = Field(min_length=1, max_length=60)
    look: str
    metres: float = Field(ge=1e-3, le=100.0, allow_inf_nan=False)
    """Length of its longest side in reality."""


class ObjectsAnswer(AnswerSchema):
    """Which things stand in a scene that was photographed."""

    SCHEMA: ClassVar[str] = "things/1"
    things: list[ListedObject]


class PaintedRegion(BaseModel):
    """Which thing a painted region is."""

    colour: str
    thing: int | None


class RegionsAnswer(AnswerSchema):
    """Which thing each painted region is."""

    SCHEMA: ClassVar[str] = "regions/1"
    regions: list[PaintedRegion]

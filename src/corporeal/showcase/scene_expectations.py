"""Expected outcomes of the showcase scenes, and their comparison.

The measures are those of ``findings.Outcome``: per object, per pair, and who met whom in order. Each expectation bounds
a measure from both sides where too much is as wrong as too little, and names a run that must not meet it: the same
scene with one known fault, ``FaultName``.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from math import inf, pi
from operator import attrgetter
from typing import Any, Literal

from corporeal.core.audit_data import Expectation, ObjectOutcome, Outcome

OutcomeMeasure = Callable[[Outcome], float | None]
FaultName = Literal["single", "capped", "wrong", "halfgravity", "frozen", "squashed", "toppled", "shifted"]
"""A fault of a run: one velocity field for all, capped moduli, stiff and soft exchanged, half of gravity, nothing
moves; or every object ends at seven tenths of its height, on its side, or a tenth of its length aside."""


@dataclass(frozen=True)
class MeasureExpectation:
    """A measure that must lie between two bounds."""

    sentence: str
    measure: OutcomeMeasure
    low: float
    """-inf: only the upper bound counts."""
    high: float
    """inf: only the lower bound counts."""
    unit: Literal["%", "mm", "m", "grid cells", "degrees", "lengths of the duck", ""]
    spoiled_by: FaultName
    """A run that must not meet it."""

    def compare(self, outcome: Outcome) -> Expectation:
        """Measure and judge; what did not happen is not met."""
        value = self.measure(outcome)
        if value is None:
            return Expectation(self.sentence, "it did not happen", self._target(), False)
        met = self.low < value < self.high
        return Expectation(self.sentence, self._said(value), self._target(), met)

    def _target(self) -> str:
        if self.low == -inf:
            return f"below {self._said(self.high)}"
        if self.high == inf:
            return f"above {self._said(self.low)}"
        return f"{self._number(self.low)} to {self._said(self.high)}"

    def _number(self, value: float) -> str:
        return f"{value * {'%': 100, 'mm': 1000}.get(self.unit, 1):.3g}"

    def _said(self, value: float) -> str:
        number = self._number(value)
        return f"{number} {self.unit.removesuffix('s') if number == '1' else self.unit}".strip()


@dataclass(frozen=True)
class FactExpectation:
    """Something that is either so or not."""

    sentence: str
    holds: Callable[[Outcome], bool | float | None]
    spoiled_by: FaultName
    """A run in which it must not be so."""

    def compare(self, outcome: Outcome) -> Expectation:
        """Look whether it is so."""
        met = bool(self.holds(outcome))
        return Expectation(self.sentence, "yes" if met else "no", "yes", met)


def compare_with_expectations(name: str, outcome: Outcome) -> list[Expectation]:
    """Compare what happened with what must be seen in a scene; empty for scenes of others."""
    return [demand.compare(outcome) for demand in SCENE_EXPECTATIONS.get(name, ())]


def only_object(outcome: Outcome, thing: str) -> ObjectOutcome:
    """Return what happened to the only object of its kind."""
    return outcome.objects[f"{thing}_0"]


def measure_of_object(thing: str, measure: str) -> OutcomeMeasure:
    """Read one field of ``ObjectOutcome`` of the only object of its kind."""
    return lambda outcome: attrgetter(measure)(only_object(outcome, thing))


def heap_fill_ratio(thing: str, volume: float) -> OutcomeMeasure:
    """Return height times round area of what lies in a heap, over its volume [m³]; 1: a cake."""

    def measure(outcome: Outcome) -> float | None:
        found = only_object(outcome, thing)
        if found.height_m is None or found.reach_m is None:
            return None
        return found.height_m * pi * found.reach_m**2 / volume

    return measure


def measure_of_named(thing: str, measure: str) -> OutcomeMeasure:
    """Read one field of ``ObjectOutcome`` of an object by its whole name; None: there is none."""

    def found(outcome: Outcome) -> float | None:
        one = outcome.objects.get(thing)
        return None if one is None else attrgetter(measure)(one)

    return found


def spilled_fraction(contents: str) -> OutcomeMeasure:
    """Measure how much of what lay in a vessel has left it [-]."""
    return measure_of_named(contents, "left_vessel")


def measure_between(first: str, second: str, measure: str) -> Callable[[Outcome], Any]:
    """Read one field of ``PairOutcome`` of the only objects of their kinds."""
    return lambda outcome: attrgetter(measure)(outcome.pair(f"{first}_0", f"{second}_0"))


def separated_after_contact(first: str, second: str) -> Callable[[Outcome], bool]:
    """Return whether two met, parted for 0.1 s, and are more than a cell apart at the end."""

    def judge(outcome: Outcome) -> bool:
        pair = outcome.pair(f"{first}_0", f"{second}_0")
        return bool(pair.separated) and pair.gap_end_dx is not None and pair.gap_end_dx > 1

    return judge


def are_met_in_order(*things: str) -> Callable[[Outcome], bool]:
    """Return whether neighbours in a row met one after the other, before any other pair."""
    pairs = [{f"{a}_0", f"{b}_0"} for a, b in pairwise(things)]
    return lambda outcome: [set(p) for p in outcome.order][: len(pairs)] == pairs


def dent_from_impact(outcome: Outcome) -> float | None:
    """Distance of the can's dent from the first contact, as a share of the duck's length [-]."""
    distance = only_object(outcome, "soda_can").dent_from_contact_m.get("rubber_duck_0")
    return None if distance is None else distance / only_object(outcome, "rubber_duck").length_m


def dent_depth(thing: str) -> OutcomeMeasure:
    """Measure how deep a dent is left [m]; None: none that is deeper than a grid cell."""

    def depth(outcome: Outcome) -> float | None:
        mine = only_object(outcome, thing)
        return mine.dent_depth_m if mine.dent_depth_dx > 1 else None

    return depth


def rubber_rebound_excess(outcome: Outcome) -> float | None:
    """How much higher the rubber ball rebounds than the steel one, as shares of their falls [-]."""
    steel = only_object(outcome, "steel_ball").rebound_ratio
    rubber = only_object(outcome, "rubber_ball").rebound_ratio
    return None if steel is None or rubber is None else rubber - steel


def residual_shape_ratio(thing: str) -> OutcomeMeasure:
    """Measure the shape error at the end over the largest one [-]; None: it never deformed."""

    def share(outcome: Outcome) -> float | None:
        mine = only_object(outcome, thing)
        return mine.shape_error_end / mine.shape_error_max if mine.shape_error_max > 0 else None

    return share


FALL_HEIGHT_TOLERANCE = 0.1
"""A fall must be as high as the scene says to this share [-]: what a step misses of a contact."""


def expect_fall(thing: str, height: float, words: str) -> MeasureExpectation:
    """Demand that an object strikes as after a free fall of some height [m]."""
    low, high = (1 - FALL_HEIGHT_TOLERANCE) * height, (1 + FALL_HEIGHT_TOLERANCE) * height
    return MeasureExpectation(words, measure_of_object(thing, "fall_m"), low, high, "m", "halfgravity")


SCENE_EXPECTATIONS: dict[str, tuple[MeasureExpectation | FactExpectation, ...]] = {
    "duck-on-mud": (
        expect_fall("rubber_duck", 1.2, "The duck strikes as after its fall"),
        # Deeper than 0.06 m, half of the duck's height, the mud would have swallowed it.
        MeasureExpectation(
            "The mud keeps an imprint (deeper than a grid cell)", dent_depth("mud_pile"), 0, 0.06, "mm", "frozen"
        ),
        MeasureExpectation(
            "The duck ends undeformed (shape error)",
            measure_of_object("rubber_duck", "shape_error_end"),
            -inf,
            0.02,
            "%",
            "squashed",
        ),
    ),
    "duck-on-can": (
        expect_fall("rubber_duck", 2.0, "The duck strikes as after its fall"),
        MeasureExpectation(
            "The can keeps a dent", measure_of_object("soda_can", "dent_depth_dx"), 1, inf, "grid cells", "wrong"
        ),
        # The can is 0.066 m across.
        MeasureExpectation(
            "The dent is shallower than the can is wide",
            measure_of_object("soda_can", "dent_depth_m"),
            -inf,
            0.066,
            "mm",
            "capped",
        ),
        MeasureExpectation(
            "The dent is where the duck struck", dent_from_impact, -inf, 1 / 3, "lengths of the duck", "single"
        ),
        # A body that is squashed flat has a shape error of some 10 %.
        MeasureExpectation(
            "The duck gives way (largest shape error)",
            measure_of_object("rubber_duck", "shape_error_max"),
            0.005,
            0.1,
            "%",
            "wrong",
        ),
        MeasureExpectation(
            "The duck recovers (shape error at the end)",
            measure_of_object("rubber_duck", "shape_error_end"),
            -inf,
            0.03,
            "%",
            "squashed",
        ),
        MeasureExpectation(
            "The duck recovers (shape error at the end over the largest)",
            residual_shape_ratio("rubber_duck"),
            -inf,
            0.5,
            "%",
            "wrong",
        ),
    ),
    "vase-ball-armchair": (
        FactExpectation(
            "The vase meets the ball, then the ball meets the armchair",
            are_met_in_order("vase", "ball", "armchair"),
            "single",
        ),
        FactExpectation("Vase and ball part again", separated_after_contact("vase", "ball"), "single"),
        FactExpectation("Ball and armchair part again", separated_after_contact("ball", "armchair"), "capped"),
        MeasureExpectation(
            "The vase keeps its shape (largest shape error)",
            measure_of_object("vase", "shape_error_max"),
            -inf,
            0.005,
            "%",
            "squashed",
        ),
        MeasureExpectation(
            "The armchair keeps its shape (largest shape error)",
            measure_of_object("armchair", "shape_error_max"),
            -inf,
            0.005,
            "%",
            "capped",
        ),
    ),
    "lamp-on-couch": (
        # Its cushions are 0.2 m thick.
        MeasureExpectation(
            "The cushions give far", measure_of_object("couch", "deepest_squeeze_m"), 0.02, 0.2, "mm", "frozen"
        ),
        MeasureExpectation(
            "The lamp keeps its shape (shape error)",
            measure_of_object("floor_lamp", "shape_error_end"),
            -inf,
            0.02,
            "%",
            "squashed",
        ),
        FactExpectation("The lamp lifts off again", measure_between("couch", "floor_lamp", "separated"), "frozen"),
    ),
    "ficus-pushed": (
        # Leaves that swing by a third of its height would be torn off.
        MeasureExpectation(
            "The plant sways", measure_of_object("potted_ficus", "deepest_squeeze_m"), 0.001, 0.3, "mm", "frozen"
        ),
        MeasureExpectation(
            "The pot stays put", measure_of_object("potted_ficus", "moved_level_m"), -inf, 0.01, "mm", "shifted"
        ),
    ),
    "tree-and-ball-in-sand": (
        expect_fall("ball", 1.2, "The ball strikes as after its fall"),
        # At 0.1 m half of the ball would be below the surface.
        MeasureExpectation(
            "The sand keeps a mark (deeper than a grid cell)", dent_depth("sand_pile"), 0, 0.1, "mm", "frozen"
        ),
        MeasureExpectation(
            "The tree stands", measure_of_object("small_tree", "turned_deg"), -inf, 15, "degrees", "toppled"
        ),
    ),
    "steel-and-rubber": (
        expect_fall("steel_ball", 0.5, "The steel ball strikes as after its fall"),
        expect_fall("rubber_ball", 0.5, "The rubber ball strikes as after its fall"),
        MeasureExpectation(
            "The rubber ball rebounds higher, as shares of the fall", rubber_rebound_excess, 0.1, 0.8, "%", "wrong"
        ),
        # Steel on concrete: e between 0.3 and 0.8.
        MeasureExpectation(
            "The steel ball rebounds (share of the fall)",
            measure_of_object("steel_ball", "rebound_ratio"),
            0.1,
            0.65,
            "%",
            "capped",
        ),
        MeasureExpectation(
            "The steel ball keeps its shape (largest shape error)",
            measure_of_object("steel_ball", "shape_error_max"),
            -inf,
            0.005,
            "%",
            "capped",
        ),
    ),
    "water-knocked-over": (
        # The impact has one and a half times what tips it over (``showcase.scenes``).
        MeasureExpectation(
            "The glass falls over", measure_of_object("tumbler", "turned_deg"), 60, 120, "degrees", "frozen"
        ),
        # What lies below the lower rim of a glass on its side stays: a tenth at most.
        MeasureExpectation("The water leaves it (share)", spilled_fraction("tumbler_0_water"), 0.6, 1.0, "%", "frozen"),
        # A ball that came back as fast as it came would give 0.37 kg m/s to 0.38 kg.
        MeasureExpectation(
            "The impact carries the water no farther than its momentum can (mean way)",
            measure_of_named("tumbler_0_water", "moved_level_m"),
            0.05,
            0.95,
            "m",
            "frozen",
        ),
    ),
    "honey-poured": (
        # Huppert 1982: 0.063 m after 1 s.
        MeasureExpectation(
            "The honey spreads (radius)", measure_of_object("honey", "reach_m"), 0.04, 0.068, "mm", "frozen"
        ),
        MeasureExpectation(
            "It lies flat: its height", measure_of_object("honey", "height_m"), 0.006, 0.03, "mm", "toppled"
        ),
    ),
    "ketchup-stops": (
        # 0.0625 m where it is let down slowly (``showcase.scenes``); what falls goes on by its own momentum, so less of
        # it by a twelfth at most, and more by a fifth.
        MeasureExpectation(
            "The ketchup slumps as far as its yield stress lets it (radius)",
            measure_of_object("ketchup", "reach_m"),
            0.058,
            0.075,
            "mm",
            "halfgravity",
        ),
        # 1.19 for the profile of ``showcase.scenes``: 98 % of it lie within 16.5 mm of its 21 mm and 61.3 mm of its
        # middle. A tenth to either side; squashed to seven tenths it is below 1.
        MeasureExpectation(
            "The ketchup keeps its volume (height times area, over its volume)",
            heap_fill_ratio("ketchup", 1.64e-4),
            1.07,
            1.31,
            "",
            "squashed",
        ),
    ),
}
"""Scene → what must be seen in it."""

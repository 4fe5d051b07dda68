"""What must be seen in each showcase scene, as numbers: data, and a function that compares.

The measures are those of ``findings.Outcome``: per object, per pair, and who met whom in order.
Each expectation bounds a measure from both sides where too much is as wrong as too little, and
names a run that must not meet it: one of ``SPOILERS``, each the same scene with one known fault.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from math import inf, pi
from operator import attrgetter
from typing import Any, Literal

from corporeal.core.findings import Expectation, ObjectOutcome, Outcome

Measure = Callable[[Outcome], float | None]
Spoiler = Literal[
    "single", "capped", "wrong", "halfgravity", "frozen", "squashed", "toppled", "shifted"
]
SPOILERS: dict[Spoiler, str] = {
    "single": "one velocity field for all objects",
    "capped": "Young's moduli capped by the published rule",
    "wrong": "stiff and soft materials exchanged",
    "halfgravity": "half of gravity",
    "frozen": "nothing moves",
    "squashed": "every object ends at seven tenths of its height",
    "toppled": "every object ends on its side",
    "shifted": "every object ends a tenth of its length aside",
}
"""Runs with one fault: four are simulated, the others made from the frames of a sound run."""


@dataclass(frozen=True)
class Demand:
    """A measure that must lie between two bounds."""

    sentence: str
    measure: Measure
    low: float
    """-inf: only the upper bound counts."""
    high: float
    """inf: only the lower bound counts."""
    unit: Literal["%", "mm", "m", "grid cells", "degrees", "lengths of the duck", ""]
    spoiled_by: Spoiler
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
class Fact:
    """Something that is either so or not."""

    sentence: str
    holds: Callable[[Outcome], bool | float | None]
    spoiled_by: Spoiler
    """A run in which it must not be so."""

    def compare(self, outcome: Outcome) -> Expectation:
        """Look whether it is so."""
        met = bool(self.holds(outcome))
        return Expectation(self.sentence, "yes" if met else "no", "yes", met)


def expect(name: str, outcome: Outcome) -> list[Expectation]:
    """Compare what happened with what must be seen in a scene; empty for scenes of others.

    Args:
        name: The scene's name.
        outcome: What happened in it.

    """
    return [demand.compare(outcome) for demand in EXPECTED.get(name, ())]


# ---------------------------------------------------------------- measures


def only(outcome: Outcome, thing: str) -> ObjectOutcome:
    """Return what happened to the only object of its kind."""
    return outcome.objects[f"{thing}_0"]


def of(thing: str, measure: str) -> Measure:
    """Read one field of ``ObjectOutcome`` of the only object of its kind."""
    return lambda outcome: attrgetter(measure)(only(outcome, thing))


def heaped(thing: str, volume: float) -> Measure:
    """Return height times round area of what lies in a heap, over its volume [m³]; 1: a cake."""

    def measure(outcome: Outcome) -> float | None:
        found = only(outcome, thing)
        if found.height_m is None or found.reach_m is None:
            return None
        return found.height_m * pi * found.reach_m**2 / volume

    return measure


def named(thing: str, measure: str) -> Measure:
    """Read one field of ``ObjectOutcome`` of an object by its whole name; None: there is none."""

    def found(outcome: Outcome) -> float | None:
        one = outcome.objects.get(thing)
        return None if one is None else attrgetter(measure)(one)

    return found


def left(contents: str) -> Measure:
    """Measure how much of what lay in a vessel has left it [-]."""
    return named(contents, "left_vessel")


def between(first: str, second: str, measure: str) -> Callable[[Outcome], Any]:
    """Read one field of ``PairOutcome`` of the only objects of their kinds."""
    return lambda outcome: attrgetter(measure)(outcome.pair(f"{first}_0", f"{second}_0"))


def apart(first: str, second: str) -> Callable[[Outcome], bool]:
    """Say whether two met, parted for 0.1 s, and are more than a cell apart at the end."""

    def judge(outcome: Outcome) -> bool:
        pair = outcome.pair(f"{first}_0", f"{second}_0")
        return bool(pair.separated) and pair.gap_end_dx is not None and pair.gap_end_dx > 1

    return judge


def met_in_order(*things: str) -> Callable[[Outcome], bool]:
    """Say whether neighbours in a row met one after the other, before any other pair."""
    pairs = [{f"{a}_0", f"{b}_0"} for a, b in pairwise(things)]
    return lambda outcome: [set(p) for p in outcome.order][: len(pairs)] == pairs


def dent_from_impact(outcome: Outcome) -> float | None:
    """Distance of the can's dent from the first contact, as a share of the duck's length [-]."""
    distance = only(outcome, "soda_can").dent_from_contact_m.get("rubber_duck_0")
    return None if distance is None else distance / only(outcome, "rubber_duck").length_m


def mark_left(thing: str) -> Measure:
    """Measure how deep a dent is left [m]; None: none that is deeper than a grid cell."""

    def depth(outcome: Outcome) -> float | None:
        mine = only(outcome, thing)
        return mine.dent_depth_m if mine.dent_depth_dx > 1 else None

    return depth


def rubber_above_steel(outcome: Outcome) -> float | None:
    """How much higher the rubber ball rebounds than the steel one, as shares of their falls [-]."""
    steel = only(outcome, "steel_ball").rebound_ratio
    rubber = only(outcome, "rubber_ball").rebound_ratio
    return None if steel is None or rubber is None else rubber - steel


def still_squashed(thing: str) -> Measure:
    """Measure the shape error at the end over the largest one [-]; None: it never deformed."""

    def share(outcome: Outcome) -> float | None:
        mine = only(outcome, thing)
        return mine.shape_error_end / mine.shape_error_max if mine.shape_error_max > 0 else None

    return share


FALLS_BY = 0.1
"""A fall must be as high as the scene says to this share [-]: what a step misses of a contact."""


def falls(thing: str, height: float, words: str) -> Demand:
    """Demand that an object strikes as after a free fall of some height [m]."""
    low, high = (1 - FALLS_BY) * height, (1 + FALLS_BY) * height
    return Demand(words, of(thing, "fall_m"), low, high, "m", "halfgravity")


EXPECTED: dict[str, tuple[Demand | Fact, ...]] = {
    "duck-on-mud": (
        falls("rubber_duck", 1.2, "The duck strikes as after its fall"),
        # Deeper than 0.06 m, half of the duck's height, the mud would have swallowed it.
        Demand(
            "The mud keeps an imprint (deeper than a grid cell)",
            mark_left("mud_pile"),
            0,
            0.06,
            "mm",
            "frozen",
        ),
        Demand(
            "The duck ends undeformed (shape error)",
            of("rubber_duck", "shape_error_end"),
            -inf,
            0.02,
            "%",
            "squashed",
        ),
    ),
    "duck-on-can": (
        falls("rubber_duck", 2.0, "The duck strikes as after its fall"),
        Demand(
            "The can keeps a dent",
            of("soda_can", "dent_depth_dx"),
            1,
            inf,
            "grid cells",
            "wrong",
        ),
        # The can is 0.066 m across.
        Demand(
            "The dent is shallower than the can is wide",
            of("soda_can", "dent_depth_m"),
            -inf,
            0.066,
            "mm",
            "capped",
        ),
        Demand(
            "The dent is where the duck struck",
            dent_from_impact,
            -inf,
            1 / 3,
            "lengths of the duck",
            "single",
        ),
        # A body that is squashed flat has a shape error of some 10 %.
        Demand(
            "The duck gives way (largest shape error)",
            of("rubber_duck", "shape_error_max"),
            0.005,
            0.1,
            "%",
            "wrong",
        ),
        Demand(
            "The duck recovers (shape error at the end)",
            of("rubber_duck", "shape_error_end"),
            -inf,
            0.03,
            "%",
            "squashed",
        ),
        Demand(
            "The duck recovers (shape error at the end over the largest)",
            still_squashed("rubber_duck"),
            -inf,
            0.5,
            "%",
            "wrong",
        ),
    ),
    "vase-ball-armchair": (
        Fact(
            "The vase meets the ball, then the ball meets the armchair",
            met_in_order("vase", "ball", "armchair"),
            "single",
        ),
        Fact("Vase and ball part again", apart("vase", "ball"), "single"),
        Fact("Ball and armchair part again", apart("ball", "armchair"), "capped"),
        Demand(
            "The vase keeps its shape (largest shape error)",
            of("vase", "shape_error_max"),
            -inf,
            0.005,
            "%",
            "squashed",
        ),
        Demand(
            "The armchair keeps its shape (largest shape error)",
            of("armchair", "shape_error_max"),
            -inf,
            0.005,
            "%",
            "capped",
        ),
    ),
    "lamp-on-couch": (
        # Its cushions are 0.2 m thick.
        Demand(
            "The cushions give far",
            of("couch", "deepest_squeeze_m"),
            0.02,
            0.2,
            "mm",
            "frozen",
        ),
        Demand(
            "The lamp keeps its shape (shape error)",
            of("floor_lamp", "shape_error_end"),
            -inf,
            0.02,
            "%",
            "squashed",
        ),
        Fact("The lamp lifts off again", between("couch", "floor_lamp", "separated"), "frozen"),
    ),
    "ficus-pushed": (
        # Leaves that swing by a third of its height would be torn off.
        Demand(
            "The plant sways",
            of("potted_ficus", "deepest_squeeze_m"),
            0.001,
            0.3,
            "mm",
            "frozen",
        ),
        Demand(
            "The pot stays put",
            of("potted_ficus", "moved_level_m"),
            -inf,
            0.01,
            "mm",
            "shifted",
        ),
    ),
    "tree-and-ball-in-sand": (
        falls("ball", 1.2, "The ball strikes as after its fall"),
        # At 0.1 m half of the ball would be below the surface.
        Demand(
            "The sand keeps a mark (deeper than a grid cell)",
            mark_left("sand_pile"),
            0,
            0.1,
            "mm",
            "frozen",
        ),
        Demand("The tree stands", of("small_tree", "turned_deg"), -inf, 15, "degrees", "toppled"),
    ),
    "steel-and-rubber": (
        falls("steel_ball", 0.5, "The steel ball strikes as after its fall"),
        falls("rubber_ball", 0.5, "The rubber ball strikes as after its fall"),
        Demand(
            "The rubber ball rebounds higher, as shares of the fall",
            rubber_above_steel,
            0.1,
            0.8,
            "%",
            "wrong",
        ),
        # Steel on concrete: e between 0.3 and 0.8.
        Demand(
            "The steel ball rebounds (share of the fall)",
            of("steel_ball", "rebound_ratio"),
            0.1,
            0.65,
            "%",
            "capped",
        ),
        Demand(
            "The steel ball keeps its shape (largest shape error)",
            of("steel_ball", "shape_error_max"),
            -inf,
            0.005,
            "%",
            "capped",
        ),
    ),
    "water-knocked-over": (
        # The blow has one and a half times what tips it over (``showcase.scenes``).
        Demand(
            "The glass falls over",
            of("tumbler", "turned_deg"),
            60,
            120,
            "degrees",
            "frozen",
        ),
        # What lies below the lower rim of a glass on its side stays: a tenth at most.
        Demand(
            "The water leaves it (share)",
            left("tumbler_0_water"),
            0.6,
            1.0,
            "%",
            "frozen",
        ),
        # A ball that came back as fast as it came would give 0.37 kg m/s to 0.38 kg.
        Demand(
            "The blow carries the water no farther than its momentum can (mean way)",
            named("tumbler_0_water", "moved_level_m"),
            0.05,
            0.95,
            "m",
            "frozen",
        ),
    ),
    "honey-poured": (
        # Huppert 1982: 0.063 m after 1 s.
        Demand(
            "The honey spreads (radius)",
            of("honey", "reach_m"),
            0.04,
            0.068,
            "mm",
            "frozen",
        ),
        Demand(
            "It lies flat: its height",
            of("honey", "height_m"),
            0.006,
            0.03,
            "mm",
            "toppled",
        ),
    ),
    "ketchup-stops": (
        # 0.0625 m where it is let down slowly (``showcase.scenes``); what falls goes on by its own
        # momentum, so less of it by a twelfth at most, and more by a fifth.
        Demand(
            "The ketchup slumps as far as its yield stress lets it (radius)",
            of("ketchup", "reach_m"),
            0.058,
            0.075,
            "mm",
            "halfgravity",
        ),
        # 1.19 for the profile of ``showcase.scenes``: 98 % of it lie within 16.5 mm of its 21 mm
        # and 61.3 mm of its middle. A tenth to either side; squashed to seven tenths it is below 1.
        Demand(
            "The ketchup keeps its volume (height times area, over its volume)",
            heaped("ketchup", 1.64e-4),
            1.07,
            1.31,
            "",
            "squashed",
        ),
    ),
}
"""Scene → what must be seen in it."""

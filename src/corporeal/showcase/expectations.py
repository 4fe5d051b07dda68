"""What must be seen in each showcase scene, as numbers: data, and a function that compares.

The measures are those of ``findings.Outcome``: per object, per pair, and who met whom in order.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from operator import attrgetter
from typing import Any, Literal

from corporeal.findings import Expectation, ObjectOutcome, Outcome

Measure = Callable[[Outcome], float | None]


@dataclass(frozen=True)
class Demand:
    """One object that must be seen in a scene."""

    sentence: str
    measure: Measure
    relation: Literal["below", "above"]
    limit: float
    unit: Literal["%", "mm", "grid cells", "degrees", "lengths of the duck", ""] = ""

    def compare(self, outcome: Outcome) -> Expectation:
        """Measure and judge; what did not happen is not met."""
        value = self.measure(outcome)
        if value is None:
            return Expectation(self.sentence, "it did not happen", self._target(), False)
        met = value < self.limit if self.relation == "below" else value > self.limit
        return Expectation(self.sentence, self._said(value), self._target(), met)

    def _target(self) -> str:
        return f"{self.relation} {self._said(self.limit)}"

    def _said(self, value: float) -> str:
        scale = {"%": 100, "mm": 1000}.get(self.unit, 1)
        number = f"{value * scale:.3g}"
        return f"{number} {self.unit.removesuffix('s') if number == '1' else self.unit}".strip()


@dataclass(frozen=True)
class Fact:
    """Something that is either so or not."""

    sentence: str
    holds: Callable[[Outcome], bool | float | None]

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


def rebounds_differ(outcome: Outcome) -> float | None:
    """Difference of two rebound heights, each as a share of its fall [-]."""
    steel = only(outcome, "steel_ball").rebound_ratio
    rubber = only(outcome, "rubber_ball").rebound_ratio
    return None if steel is None or rubber is None else abs(steel - rubber)


EXPECTED: dict[str, tuple[Demand | Fact, ...]] = {
    "duck-on-mud": (
        Demand(
            "The mud keeps an imprint", of("mud_pile", "dent_depth_dx"), "above", 1, "grid cells"
        ),
        Demand(
            "The duck ends undeformed (shape error)",
            of("rubber_duck", "shape_error_end"),
            "below",
            0.02,
            "%",
        ),
    ),
    "duck-on-can": (
        Demand("The can keeps a dent", of("soda_can", "dent_depth_dx"), "above", 1, "grid cells"),
        Demand(
            "The dent is where the duck struck",
            dent_from_impact,
            "below",
            1 / 3,
            "lengths of the duck",
        ),
        Demand(
            "The duck gives way (largest shape error)",
            of("rubber_duck", "shape_error_max"),
            "above",
            0.005,
            "%",
        ),
        Demand(
            "The duck recovers (shape error at the end)",
            of("rubber_duck", "shape_error_end"),
            "below",
            0.03,
            "%",
        ),
    ),
    "vase-ball-armchair": (
        Fact(
            "The vase meets the ball, then the ball meets the armchair",
            met_in_order("vase", "ball", "armchair"),
        ),
        Fact("Vase and ball part again", apart("vase", "ball")),
        Fact("Ball and armchair part again", apart("ball", "armchair")),
    ),
    "lamp-on-couch": (
        Demand("The cushions give far", of("couch", "deepest_squeeze_m"), "above", 0.02, "mm"),
        Demand(
            "The lamp keeps its shape (shape error)",
            of("floor_lamp", "shape_error_end"),
            "below",
            0.02,
            "%",
        ),
        Fact("The lamp lifts off again", between("couch", "floor_lamp", "separated")),
    ),
    "ficus-pushed": (
        Demand("The plant sways", of("potted_ficus", "deepest_squeeze_m"), "above", 0.001, "mm"),
        Demand("The pot stays put", of("potted_ficus", "moved_level_m"), "below", 0.01, "mm"),
    ),
    "tree-and-ball-in-sand": (
        Demand("The sand keeps a mark", of("sand_pile", "dent_depth_dx"), "above", 1, "grid cells"),
        Demand("The tree stands", of("small_tree", "turned_deg"), "below", 15, "degrees"),
    ),
    "steel-and-rubber": (
        Demand("The rebounds differ, as shares of the fall", rebounds_differ, "above", 0.1, "%"),
    ),
}
"""Scene → what must be seen in it."""

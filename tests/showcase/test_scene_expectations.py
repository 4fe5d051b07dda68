"""What must be seen is a number with a target on both sides, and it can fail."""

from dataclasses import replace
from math import inf, pi
from typing import get_args

import numpy as np
import pytest
from scipy.optimize import brentq

from corporeal.showcase.scene_expectations import (
    SCENE_EXPECTATIONS,
    FaultName,
    MeasureExpectation,
    compare_with_expectations,
)
from corporeal.showcase.showcase_scenes import SHOWCASE_SCENE_BUILDERS
from corporeal.simulation.outcome import level_reach, vertical_extent
from sample_findings import object_outcome, outcome, pair_outcome


def pair(separated=True, gap=3.0):
    return pair_outcome(separated=separated, gap_end_dx=gap)


def chain(order, vase=0.0, chair=0.0, **pairs):
    names = ("vase_0|ball_0", "vase_0|armchair_0", "ball_0|armchair_0")
    objects = {"vase_0": object_outcome(shape_error_max=vase), "armchair_0": object_outcome(shape_error_max=chair)}
    return outcome(objects, {n: pairs.get(n, pair()) for n in names}, order)


VASE_BALL, BALL_CHAIR = ("vase_0", "ball_0"), ("ball_0", "armchair_0")


def met(name, happened):
    return [e.met for e in compare_with_expectations(name, happened)]


def test_every_scene_says_what_must_be_seen():
    assert set(SCENE_EXPECTATIONS) == set(SHOWCASE_SCENE_BUILDERS)


def test_every_expectation_names_a_run_that_must_not_meet_it():
    demands = [d for row in SCENE_EXPECTATIONS.values() for d in row]
    assert {d.spoiled_by for d in demands} <= set(get_args(FaultName))
    assert all(d.low < d.high for d in demands if isinstance(d, MeasureExpectation))
    assert all((d.low, d.high) != (-inf, inf) for d in demands if isinstance(d, MeasureExpectation))


def test_sentences_are_distinguished():
    for row in SCENE_EXPECTATIONS.values():
        assert len({d.sentence for d in row}) == len(row)


def test_nothing_is_expected_of_other_peoples_scenes():
    assert compare_with_expectations("my kitchen", outcome({})) == []


def test_a_chain_that_meets_in_order_and_parts_is_as_expected():
    assert all(met("vase-ball-armchair", chain([VASE_BALL, BALL_CHAIR])))


def test_a_chain_in_another_order_is_not():
    assert met("vase-ball-armchair", chain([BALL_CHAIR, VASE_BALL]))[0] is False
    assert met("vase-ball-armchair", chain([VASE_BALL]))[0] is False


def test_objects_that_stick_together_have_not_parted():
    stuck = chain([VASE_BALL, BALL_CHAIR], **{"vase_0|ball_0": pair(False, 0.0)})
    assert met("vase-ball-armchair", stuck)[:3] == [True, False, True]
    close = chain([VASE_BALL, BALL_CHAIR], **{"ball_0|armchair_0": pair(True, 0.5)})
    assert met("vase-ball-armchair", close)[:3] == [True, True, False]


def test_a_vase_or_a_chair_that_gives_way_is_none():
    assert met("vase-ball-armchair", chain([VASE_BALL, BALL_CHAIR], vase=0.01))[3] is False
    assert met("vase-ball-armchair", chain([VASE_BALL, BALL_CHAIR], chair=0.01))[4] is False


# ---------------------------------------------------------------- balls, one as it was measured


def balls(steel=None, rubber=None):
    """What happens at draft, but for what is said of either ball."""
    as_it_was = object_outcome(fall_m=0.50, rebound_ratio=0.384)
    high = object_outcome(fall_m=0.50, rebound_ratio=0.670)
    made = {"steel_ball_0": replace(as_it_was, **(steel or {})), "rubber_ball_0": replace(high, **(rubber or {}))}
    return {e.sentence: e.met for e in compare_with_expectations("steel-and-rubber", outcome(made))}


def test_balls_as_measured_meet_all():
    assert all(balls().values())


@pytest.mark.parametrize("fall", [0.40, 0.75, None])
def test_a_fall_must_be_as_high_as_the_scene_says(fall):
    assert balls(steel={"fall_m": fall})["The steel ball strikes as after its fall"] is False


@pytest.mark.parametrize(("steel", "rubber"), [(0.67, 0.38), (0.5, 0.55), (0.11, 0.95), (0.0, 0.56), (None, 0.67)])
def test_exchanged_level_or_impossible_rebounds_fail(steel, rubber):
    found = balls({"rebound_ratio": steel}, {"rebound_ratio": rubber})
    assert not all(found.values())


# ---------------------------------------------------------------- the duck


def duck_on_can(depth=0.027, distance=0.004, largest=0.015, end=0.0008, fall=2.0):
    duck = object_outcome(length_m=0.117, shape_error_max=largest, shape_error_end=end, fall_m=fall)
    can = object_outcome(
        dent_depth_m=depth, dent_depth_dx=depth / 0.0083, dent_from_contact_m={"rubber_duck_0": distance}
    )
    found = compare_with_expectations("duck-on-can", outcome({"rubber_duck_0": duck, "soda_can_0": can}))
    return {e.sentence for e in found if not e.met}


def test_a_can_as_measured_meets_all():
    assert duck_on_can() == set()


@pytest.mark.parametrize(
    ("what", "sentence"),
    [
        ({"depth": 0.005}, "The can keeps a dent"),
        ({"depth": 1.0}, "The dent is shallower than the can is wide"),
        ({"distance": 0.05}, "The dent is where the duck struck"),
        ({"distance": None}, "The dent is where the duck struck"),
        ({"largest": 0.2}, "The duck gives way (largest shape error)"),
        ({"fall": 3.8}, "The duck strikes as after its fall"),
        ({"end": 0.014}, "The duck recovers (shape error at the end over the largest)"),
    ],
)
def test_each_fault_alone_fails_its_own_expectation(what, sentence):
    assert duck_on_can(**what) == {sentence}


def test_a_duck_of_metal_neither_gives_way_nor_recovers():
    assert duck_on_can(largest=4e-6, end=3.5e-6) == {
        "The duck gives way (largest shape error)",
        "The duck recovers (shape error at the end over the largest)",
    }
    assert "The duck recovers (shape error at the end)" in duck_on_can(largest=0.08, end=0.05)


def test_an_expectation_reads_as_words():
    objects = {
        "steel_ball_0": object_outcome(fall_m=0.5, rebound_ratio=0.384),
        "rubber_ball_0": object_outcome(fall_m=0.5, rebound_ratio=None),
    }
    said = compare_with_expectations("steel-and-rubber", outcome(objects))
    assert (said[0].value, said[0].target) == ("0.5 m", "0.45 to 0.55 m")
    assert (said[2].value, said[2].met) == ("it did not happen", False)
    assert said[4].target == "below 0.5 %"
    can = compare_with_expectations("duck-on-can", outcome({
        "soda_can_0": object_outcome(dent_depth_dx=2.5), "rubber_duck_0": object_outcome(),
    }))  # fmt: skip
    assert (can[1].value, can[1].target) == ("2.5 grid cells", "above 1 grid cell")


@pytest.mark.parametrize(("depth", "cell", "seen"), [(0.03, 0.011, True), (0.01, 0.011, False), (0.07, 0.011, False)])
def test_an_imprint_is_deeper_than_a_cell_and_swallows_no_object(depth, cell, seen):
    objects = {
        "mud_pile_0": object_outcome(dent_depth_m=depth, dent_depth_dx=depth / cell),
        "rubber_duck_0": object_outcome(fall_m=1.2),
    }
    assert met("duck-on-mud", outcome(objects)) == [True, seen, True]


def heap(squashed=1.0):
    """Sample Nye's profile of 164 cm³ of ketchup of 25 Pa, as ``showcase.scenes`` has it."""
    b, volume = 25 / 1120 / 9.81, 1.64e-4
    k = 0.5 * pi * b

    def profile(r, radius):
        return k + np.sqrt(k**2 + 2 * b * (radius - r))

    def excess(radius):
        r = np.linspace(0, radius, 1000)
        return np.trapezoid(2 * pi * r * profile(r, radius), r) - volume

    radius = brentq(excess, 0.03, 0.12)
    dice = np.random.default_rng(0)
    x, y = dice.uniform(-radius, radius, (2, 200_000))
    z = dice.uniform(0, profile(0, radius), len(x))
    inside = (np.hypot(x, y) < radius) & (z < profile(np.minimum(np.hypot(x, y), radius), radius))
    return np.column_stack([x, y, squashed * z])[inside]


@pytest.mark.parametrize(("squashed", "met"), [(1.0, True), (0.7, False)])
def test_the_heap_of_theory_meets_what_is_expected_of_ketchup_and_a_flat_one_does_not(squashed, met):
    points = heap(squashed)
    found = object_outcome(reach_m=level_reach(points, 0.0), height_m=vertical_extent(points, points, 0.0))
    radius, volume = compare_with_expectations("ketchup-stops", outcome({"ketchup_0": found}, {}, []))
    assert radius.met and volume.met is met


@pytest.mark.parametrize("flat", [1.0, 0.2])
def test_a_column_that_lies_flat_is_as_high_as_its_matter(flat):
    """Sixteen rows, half a cell each: 8 cells high, of which 98 % count."""
    x, y, z = np.meshgrid(*3 * [(np.arange(16) + 0.5) * 0.5], indexing="ij")
    column = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    lying = column * [flat**-0.5, flat**-0.5, flat]
    assert vertical_extent(lying, column, 1.0) == pytest.approx(8.0 * flat, rel=1e-9)


def test_a_glass_whose_water_does_not_move_by_itself_spills_none():
    one = compare_with_expectations("water-knocked-over", outcome({"tumbler_0": object_outcome()}, {}, []))
    assert [(e.value, e.met) for e in one[1:]] == [("it did not happen", False)] * 2

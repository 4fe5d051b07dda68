"""What must be seen is a number with a target, and it can fail."""

import pytest

from corporeal.showcase.expectations import EXPECTED, expect
from corporeal.showcase.scenes import SCENES
from made_findings import object_outcome, outcome, pair_outcome


def pair(separated=True, gap=3.0):
    return pair_outcome(separated=separated, gap_end_dx=gap)


def chain(order, **pairs):
    names = ("vase_0|ball_0", "vase_0|armchair_0", "ball_0|armchair_0")
    return outcome({}, {n: pairs.get(n, pair()) for n in names}, order)


VASE_BALL, BALL_CHAIR = ("vase_0", "ball_0"), ("ball_0", "armchair_0")


def met(name, happened):
    return [e.met for e in expect(name, happened)]


def test_every_scene_says_what_must_be_seen():
    assert set(EXPECTED) == set(SCENES)


def test_nothing_is_expected_of_other_peoples_scenes():
    assert expect("my kitchen", outcome({})) == []


def test_a_chain_that_meets_in_order_and_parts_is_as_expected():
    assert met("vase-ball-armchair", chain([VASE_BALL, BALL_CHAIR])) == [True, True, True]


def test_a_chain_in_another_order_is_not():
    assert met("vase-ball-armchair", chain([BALL_CHAIR, VASE_BALL]))[0] is False
    assert met("vase-ball-armchair", chain([VASE_BALL]))[0] is False


def test_things_that_stick_together_have_not_parted():
    stuck = chain([VASE_BALL, BALL_CHAIR], **{"vase_0|ball_0": pair(False, 0.0)})
    assert met("vase-ball-armchair", stuck) == [True, False, True]
    close = chain([VASE_BALL, BALL_CHAIR], **{"ball_0|armchair_0": pair(True, 0.5)})
    assert met("vase-ball-armchair", close) == [True, True, False]


@pytest.mark.parametrize(
    ("imprint", "error", "seen"),
    [(2.5, 0.004, [True, True]), (0.0, 0.004, [False, True]), (2.5, 0.021, [True, False])],
)
def test_mud_must_keep_an_imprint_and_the_duck_its_shape(imprint, error, seen):
    objects = {
        "mud_pile_0": object_outcome(dent_depth_dx=imprint),
        "rubber_duck_0": object_outcome(shape_error_end=error),
    }
    assert met("duck-on-mud", outcome(objects)) == seen


@pytest.mark.parametrize(("distance", "seen"), [(0.03, True), (0.05, False), (None, False)])
def test_a_dent_must_lie_within_a_third_of_the_duck_from_where_it_struck(distance, seen):
    duck = object_outcome(length_m=0.126, shape_error_max=0.05, shape_error_end=0.01)
    can = object_outcome(dent_depth_dx=2.0, dent_from_contact_m={"rubber_duck_0": distance})
    found = expect("duck-on-can", outcome({"rubber_duck_0": duck, "soda_can_0": can}))
    assert [e.met for e in found] == [True, seen, True, True]


def test_an_expectation_reads_as_words():
    objects = {
        "mud_pile_0": object_outcome(dent_depth_dx=2.5),
        "rubber_duck_0": object_outcome(shape_error_end=0.004),
    }
    imprint, shape = expect("duck-on-mud", outcome(objects))
    assert (imprint.value, imprint.target) == ("2.5 grid cells", "above 1 grid cell")
    assert (shape.value, shape.target) == ("0.4 %", "below 2 %")

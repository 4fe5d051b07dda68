"""What a judgement that errs with the ways says of draws; scores of weighted draws."""

import numpy as np
import pytest
from answer_rules import Drawn
from shared_errors import SHARED, TOGETHER, ranked, weights

from corporeal.core.types import MassEvidence, PrintedFact

RNG = np.random.default_rng(0)


def bell(middle, spread, judged, printed=()):
    """Draws of a log-normal mass, whose ways are placed at its median, and one judgement."""
    masses = np.exp(np.log(middle) + spread * np.sort(RNG.normal(size=4000)))
    said = MassEvidence(judged / 1.1, judged, judged * 1.1, "It looks so.", printed)
    return Drawn(middle, masses, said, (), np.full(len(masses), middle))


def moments(thing, rule):
    logs, w = np.log(thing.masses), weights(thing, rule)
    return w @ logs, np.sqrt(w @ (logs - w @ logs) ** 2)


def test_a_shared_error_moves_draws_beyond_the_judgement_as_a_normal_pair_does():
    """Prior N(0, .4²), J lower by .3: the posterior of two correlated normal errors."""
    thing = bell(1.0, 0.4, float(np.exp(-0.3)))
    width = 0.25 * np.sqrt(1 - TOGETHER**2) / (1 - SHARED)
    seen = -0.3 / (1 - SHARED)
    gain = 0.4**2 / (0.4**2 + width**2)
    middle, spread = moments(thing, "shared")
    assert middle == pytest.approx(gain * seen, abs=0.02)
    assert spread == pytest.approx(0.4 * np.sqrt(1 - gain), rel=0.1)
    assert middle < moments(thing, "product")[0] - 0.05
    assert moments(thing, "without")[0] == pytest.approx(0, abs=0.03)


def test_a_judgement_of_what_the_ways_say_moves_nothing():
    thing = bell(1.0, 0.4, 1.0)
    for rule in ("product", "t", "shared", "shared within ways"):
        assert moments(thing, rule)[0] == pytest.approx(0, abs=0.03)


def test_print_counts_by_every_rule():
    thing = bell(1.0, 0.4, 1.0, (PrintedFact("total weight", 0.7, "700 g"),))
    for rule in ("product", "t", "shared", "shared within ways"):
        assert moments(thing, rule)[0] < -0.2


def test_the_ranked_score_of_one_draw_is_its_distance_and_of_a_normal_the_known_one():
    assert ranked(np.array([2.0]), np.array([1.0]), 3.5) == 1.5
    x = RNG.normal(size=20_000)
    even = np.full(len(x), 1 / len(x))
    at_zero = np.sqrt(2 / np.pi) - 1 / np.sqrt(np.pi)
    assert ranked(x, even, 0.0) == pytest.approx(at_zero, rel=0.03)

"""Rules for several answers about masses: what they do to draws whose answers are known."""

import numpy as np
import pytest
from answer_rules import Drawn, Scored, each, scored, verdict
from scipy.stats import norm, t

from corporeal.core.types import MassEvidence

NARROW = np.exp(1e-3 * norm.ppf((np.arange(100) + 0.5) / 100))
"""Draws of one answer [kg], about 1 kg."""


def drawn(*about, own=(None, None, None)):
    """Draws taken in turn from answers that each lie narrowly about a mass [kg]."""
    masses = np.stack([mass * NARROW for mass in about], axis=1).ravel()
    return Drawn(1.0, masses, None, own)


def test_answers_that_agree_keep_their_interval():
    one = drawn(2.0, 2.0, 2.0)
    even = one.weights(False, False)
    assert one.interval(even, few=True) == pytest.approx(one.interval(even, few=False))


def test_answers_that_differ_are_as_wide_as_a_further_one_would_lie():
    one = drawn(0.5, 1.0, 2.0)
    even = one.weights(False, False)
    low, middle, high = one.interval(even, few=False)
    down, _, up = one.interval(even, few=True)
    further = (t.ppf(0.95, 2) ** 2 * 4 / 3 - norm.ppf(0.95) ** 2 * 2 / 3) * np.log(2) ** 2
    assert np.log(middle / down) == pytest.approx(np.sqrt(np.log(middle / low) ** 2 + further))
    assert np.log(up / middle) == pytest.approx(np.sqrt(np.log(high / middle) ** 2 + further))


def test_an_answer_that_contradicts_its_own_judgement_counts_less():
    says = MassEvidence(0.9, 1.0, 1.1, "So it looks.")
    one = drawn(1.0, 1.0, 9.0, own=(says, says, says))
    weights = one.weights(True, by_its_own=True)
    each = [weights[k::3].sum() for k in range(3)]
    assert each[0] == pytest.approx(each[1])
    assert each[2] < 0.05


def intervals(*things):
    """Scores of things: (width, how far outside)."""
    width, outside = np.array(things, float).T
    return Scored(0 * width, width, outside == 0, width + 20 * outside)


def test_an_interval_scores_its_width_and_twenty_times_what_it_misses_by():
    one = drawn(0.5, 0.5, 0.5)
    found = scored([one], False, False, False)
    middle = np.log(2) - found.width[0] / 2
    assert found.score[0] == pytest.approx(found.width[0] + 20 * middle, rel=1e-3)
    assert not found.inside[0]
    assert found.error[0] == pytest.approx(np.log(2), rel=1e-3)


def test_what_decides_about_rule_b_holds_one_by_one():
    plain = intervals((0.3, 0.1), (0.3, 0.1), (0.3, 0))
    better = intervals((0.5, 0), (0.5, 0), (0.4, 0))
    assert list(verdict(plain, better).values()) == [True] * 4
    one_thing = intervals((0.5, 0), (0.5, 0.1), (0.4, 0))
    assert list(verdict(plain, one_thing).values()) == [True, True, False, True]
    for_nothing = intervals((0.9, 0.1), (0.9, 0.1), (0.9, 0))
    assert list(verdict(plain, for_nothing).values()) == [True, False, False, False]
    fewer = intervals((0.3, 0.1), (0.3, 0.1), (0.3, 0.1))
    assert not verdict(plain, fewer)["share inside no farther from 90 %"]


def test_each_interval_is_reported_over_the_scales():
    said = each(drawn(0.5, 0.5, 0.5))
    assert said.split("; ")[3] == "without, B 0.50 < 0.50 < 0.50"
    assert said.startswith("with evidence 0.50 < 0.50 < 0.50; with evidence, B ")

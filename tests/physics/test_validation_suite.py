"""The validation suite as a program."""

import json

import detail
import pytest
import validation
from laws.outcome import Check, Outcome, absolute, at_least, relative
from laws.suite import CASES

ROW = {"case", "title", "reference", "value", "error", "target", "met", "control"}


def test_every_case_is_there_and_twelve_counts_once():
    numbers = [str(n) for n in range(1, 30) if n != 12]
    assert sorted(CASES) == sorted([*numbers, "12a", "12b"])
    check = Check("q", 1.0, 1.0, 0.0, 1.0)
    found = [Outcome(n, "t", "s", (check,)) for n in CASES]
    assert validation.tally(found) == (29, 29)
    missed = Outcome("12b", "t", "s", (absolute("q", 3.0, 1.0, 1.0),))
    assert validation.tally([*found, missed]) == (28, 29)


def test_a_check_is_met_within_its_target_and_not_by_a_nan():
    assert relative("q", 1.02, 1.0, 2.1).met and not relative("q", 1.03, 1.0, 2.1).met
    assert at_least("q", 0.96, 1.0, 0.95).met and not at_least("q", 0.94, 1.0, 0.95).met
    assert not absolute("q", float("nan"), 1.0, 5.0).met


def test_a_row_leads_with_the_first_check_that_misses():
    good, bad = relative("good", 1.0, 1.0, 1.0), relative("bad", 2.0, 1.0, 1.0)
    row = Outcome("1", "t", "s", (good, bad)).row()
    assert set(row) >= ROW and not row["met"]
    assert row["quantity"] == "bad" and row["error"] > row["target"]
    assert json.loads(json.dumps(row)) == row


@pytest.mark.parametrize(("word", "cells"), [("draft", 8), ("normal", 12), ("fine", 20)])
def test_what_detail_changes_is_measured_on_the_grid_that_the_policy_gives(word, cells):
    _, cell = detail.planned(detail.FOAM, (0.1, 0.1, 0.1), 0.5, 2.0, word)
    assert 0.1 / cell == pytest.approx(cells)


def test_what_differs_too_much_from_fine_is_missed():
    good, bad = ({"draft": 0.8, "normal": 0.95, "fine": 1.0}, {"draft": 0.8, "normal": 1.11, "fine": 1})
    met, missed = detail.lines([("good", good), ("bad", bad)])[2:]
    assert met.endswith("| -20 % | -5 % | met |") and "**missed**" in missed


FINE_RUNOUT = 1.33
"""Of 98 % of the sand on 20 cells across the radius, where the policy's fine grid has them."""


@pytest.mark.slow
@pytest.mark.parametrize(("word", "aim"), [("draft", 0.3), pytest.param("normal", 0.1, marks=pytest.mark.slow)])
def test_sand_runs_out_on_coarse_grids_about_as_far_as_on_a_fine_one(word, aim):
    (far,) = detail.collapse(word)
    assert far == pytest.approx(FINE_RUNOUT, rel=aim)
    assert far < FINE_RUNOUT

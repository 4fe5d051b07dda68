"""Masses of scanned things, recognised from pictures alone by recorded answers, on the scales.

The answers were written from anonymous pictures before anybody looked the masses up.
"""

from pathlib import Path

import pytest

from corporeal.evaluation.mass import MassConfig, compare, predict_all
from corporeal.evaluation.truth import read_truth
from corporeal.stages.describe import DescribeConfig
from corporeal.stages.ground import GroundConfig

RECORDINGS = Path(__file__).parents[1] / "recordings"


@pytest.mark.slow
def test_the_ladder_of_what_is_known_on_scanned_things(shared_assets):
    things = read_truth(shared_assets / "ycb", shared_assets / "mass_truth.csv")
    answered = DescribeConfig(vlm=f"replay:{RECORDINGS / 'scanned_a'}")
    config = MassConfig(anonymous=True, samples=200)
    result = compare(predict_all(things, answered, GroundConfig(), config))
    every = result.metrics["all"]
    assert every["mass"].count == 19
    ladder = ["hull_fit", "solid_usual", "built_usual", "placed", "mixture", "mass"]
    errors = [every[step].alde for step in ladder]
    assert errors == sorted(errors, reverse=True)
    assert every["hull_fit"].alde == pytest.approx(0.747, abs=0.03)
    assert every["mixture"].alde <= 0.22
    assert every["mass"].alde <= 0.18
    assert every["mass"].ape <= 0.18
    assert every["mass"].within_2 == 1.0
    assert result.coverage["all"] >= 0.85
    assert result.coverage_without["all"] >= 0.85
    assert result.width["all"] <= 2.2
    assert result.width_without["all"] <= 2.2

"""Masses of scanned things, recognised from pictures alone by recorded answers, on the scales.

The answers were written from anonymous pictures before anybody looked the masses up.
"""

from dataclasses import dataclass
from pathlib import Path

import pytest

from corporeal.description.describe_config import DescribeConfig
from corporeal.lab.evaluation.mass_evaluation import MassConfig, compare_masses, predict_masses
from corporeal.lab.evaluation.measured_masses import read_measured_masses
from corporeal.pipeline.stages.ground import GroundConfig

RECORDINGS = Path(__file__).parents[1] / "recordings"
LIKELIEST = ("hull_fit", "solid_usual", "built_usual", "placed", "mass")


@dataclass(frozen=True)
class Measured:
    """What a set of answers must not fall behind, as docs/reference/mass-evaluation.md has it."""

    recordings: str
    mixture: float
    """ALDE of all ways a part may be, without outside evidence."""
    mass: float
    """ALDE with outside evidence."""
    ape: float
    covered: float
    """Share of the measured masses inside the 90 % interval."""
    covered_without: float
    within_2: float
    """Share of the masses that are right within a factor of two."""
    ladder: tuple[str, ...]
    """Steps of which each has less error than the one before."""


SETS = [
    # Both miss the targets (.22 without evidence, .18 with, 85 %); all ways together do not beat
    # the likeliest one: the page says so, and why.
    Measured(
        "scanned_c",
        mixture=0.28,
        mass=0.22,
        ape=0.20,
        covered=0.6,
        covered_without=0.85,
        within_2=0.89,
        ladder=LIKELIEST,
    ),
    Measured(
        "scanned_d",
        mixture=0.26,
        mass=0.20,
        ape=0.18,
        covered=0.7,
        covered_without=0.85,
        within_2=0.89,
        ladder=LIKELIEST,
    ),
]


@pytest.mark.slow
@pytest.mark.parametrize("measured", SETS, ids=[one.recordings for one in SETS])
def test_the_ladder_of_what_is_known_on_scanned_objects(shared_assets, measured):
    things = read_measured_masses(shared_assets / "ycb", shared_assets / "mass_truth.csv")
    answered = DescribeConfig(vlm=f"replay:{RECORDINGS / measured.recordings}")
    config = MassConfig(anonymous=True)
    result = compare_masses(predict_masses(things, answered, GroundConfig(), config))
    every = result.metrics["all"]
    assert every["mass"].count == 19
    errors = [every[step].alde for step in measured.ladder]
    assert errors == sorted(errors, reverse=True)
    assert every["hull_fit"].alde == pytest.approx(0.747, abs=0.03)
    assert every["mixture"].alde <= measured.mixture
    assert every["mass"].alde <= measured.mass
    assert every["mass"].ape <= measured.ape
    assert every["mass"].within_2 >= measured.within_2
    assert result.coverage["all"] >= measured.covered
    assert result.coverage_without["all"] >= measured.covered_without
    assert result.width["all"] <= 2.2
    assert result.width_without["all"] <= 2.2

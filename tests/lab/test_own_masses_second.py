"""Twelve further things on the scales, each of three answers pooled, written blind.

What shows least of how it is built was made for this batch; two of its masses are missed, and why
is in decision mass-pooled-answers.
"""

from pathlib import Path

import pytest
from own_props import write

from corporeal.core import store
from corporeal.lab.evaluation.mass_evaluation import MassComparison, MassConfig, compare_masses, predict_masses
from corporeal.lab.evaluation.measured_masses import read_measured_masses
from corporeal.pipeline.stages.describe import DescribeConfig
from corporeal.pipeline.stages.ground import GroundConfig

RECORDINGS = Path(__file__).parents[1] / "recordings" / "own_second"
SCATTER = 0.01
"""By how much ALDE of a median scatters with its draws: .006 between 200 and 1,600 of them."""
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def on_the_scales(tmp_path_factory) -> MassComparison:
    folder = tmp_path_factory.mktemp("things")
    write(folder, batch=2)
    things = read_measured_masses(folder / "models", folder / "truth" / "masses.csv")
    recorded = {path.read_text(encoding="utf-8") for path in RECORDINGS.glob("*.json")}
    names = [f"object-{store.path_digest(t.file)[:6]}" for t in things]
    if not all(any(name in text for text in recorded) for name in names):
        pytest.skip("other versions of what draws and joins meshes made files of other bytes here")
    answered = DescribeConfig(vlm=f"replay:{RECORDINGS}", answers=3)
    return compare_masses(predict_masses(things, answered, GroundConfig(), MassConfig(anonymous=True)))


def test_of_what_hides_how_it_is_built_grounded_is_no_worse_than_asked_directly(on_the_scales):
    every = on_the_scales.metrics["all"]
    assert every["mass"].count == 12
    assert every["mass"].alde <= every["direct"].alde
    assert every["mixture"].alde <= 0.22 + SCATTER
    assert every["mixture"].alde < every["solid_usual"].alde / 3


def test_an_imitation_taken_for_real_and_a_wood_taken_for_another_are_all_that_is_missed(on_the_scales):
    rows = on_the_scales.rows
    outside = {r.object for r in rows if r.mass_true and not r.low <= r.mass_true <= r.high}
    assert outside <= {"thing_14", "thing_15"}
    assert on_the_scales.coverage_without["all"] >= 0.9

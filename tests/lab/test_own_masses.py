"""Ten things that no data set publishes, on the scales: three sets of answers, written blind.

Whoever answered saw anonymous pictures and nothing of how the things are built.
"""

from pathlib import Path

import pytest
from own_props import write

from corporeal.core import store
from corporeal.lab.evaluation.mass_evaluation import MassComparison, MassConfig, compare_masses, predict_masses
from corporeal.lab.evaluation.measured_masses import read_measured_masses
from corporeal.pipeline.stages.describe import DescribeConfig
from corporeal.pipeline.stages.ground import GroundConfig

RECORDINGS = Path(__file__).parents[1] / "recordings"
SETS = ("own_a", "own_b", "own_d")
SCATTER = 0.01
"""By how much ALDE of a median scatters with its draws: .006 between 200 and 1,600 of them."""


@pytest.fixture(scope="module", params=SETS)
def on_the_scales(request, tmp_path_factory) -> MassComparison:
    folder = tmp_path_factory.mktemp("things")
    write(folder)
    things = read_measured_masses(folder / "models", folder / "truth" / "masses.csv")
    recorded = {p.read_text(encoding="utf-8") for p in (RECORDINGS / request.param).glob("*.json")}
    names = [f"object-{store.path_digest(t.file)[:6]}" for t in things]
    if not all(any(name in text for text in recorded) for name in names):
        pytest.skip("other versions of what draws and joins meshes made files of other bytes here")
    answered = DescribeConfig(vlm=f"replay:{RECORDINGS / request.param}")
    config = MassConfig(anonymous=True)
    return compare_masses(predict_masses(things, answered, GroundConfig(), config))


@pytest.mark.slow
def test_where_memory_cannot_help_grounded_is_no_worse_than_asked_directly(on_the_scales):
    every = on_the_scales.metrics["all"]
    assert every["mass"].count == 10
    assert every["mass"].alde <= every["direct"].alde + SCATTER
    assert every["mass"].alde <= 0.18
    assert every["mixture"].alde <= 0.22
    assert every["mixture"].alde < every["solid_usual"].alde / 3


@pytest.mark.slow
def test_intervals_hold_the_masses_and_are_narrow(on_the_scales):
    assert on_the_scales.coverage["all"] >= 0.85
    assert on_the_scales.coverage_without["all"] >= 0.85
    assert on_the_scales.width_without["all"] <= 2.2

"""Every expectation fails in the run that must fail it, and is met by the run as it should be.

A scene is simulated once for all faults that are planted in its frames. Faults that are simulated
themselves are tried in scenes of some seconds; `benchmarks/judge.py` makes all of them.
"""

from typing import get_args

import pytest
from faulty_runs import PLANTED, happened, spoiled
from video_judge.simulated_controls import SIMULATED_CONTROLS

from corporeal.pipeline import run_pipeline
from corporeal.showcase.scene_expectations import SCENE_EXPECTATIONS, FaultName, compare_with_expectations

SHORT = ("steel-and-rubber", "ketchup-stops", "honey-poured")


def test_faults_are_simulated_or_planted():
    assert set(PLANTED) | set(SIMULATED_CONTROLS) >= {d.spoiled_by for row in SCENE_EXPECTATIONS.values() for d in row}
    assert set(PLANTED) < set(get_args(FaultName))


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENE_EXPECTATIONS)
def test_a_sound_run_meets_all_and_each_fault_fails_what_it_must(sound, name):
    ours = sound(name)
    seen = compare_with_expectations(name, happened(run_pipeline.read_run(ours).played))
    assert [e for e in seen if not e.met] == []
    for fault in {d.spoiled_by for d in SCENE_EXPECTATIONS[name]}:
        if fault in PLANTED or name in SHORT:
            seen = compare_with_expectations(name, happened(spoiled(fault, ours)))
            for demand, found in zip(SCENE_EXPECTATIONS[name], seen, strict=True):
                assert demand.spoiled_by != fault or not found.met, (fault, found)

"""Every expectation fails in the run that must fail it, and is met by the run as it should be.

A scene is simulated once for all faults that are planted in its frames. Faults that are simulated
themselves are tried in scenes of some seconds; `corporeal evaluate judge` makes all of them.
"""

import pytest
from spoiled_runs import PLANTED, happened, spoiled

from corporeal.lab.evaluation.judge.simulated_controls import SIMULATED
from corporeal.pipeline import runner
from corporeal.showcase.expectations import EXPECTED, SPOILERS, expect

SHORT = ("steel-and-rubber", "ketchup-stops", "honey-poured")


def test_faults_are_simulated_or_planted():
    assert set(PLANTED) | set(SIMULATED) >= {d.spoiled_by for row in EXPECTED.values() for d in row}
    assert set(PLANTED) < set(SPOILERS)


@pytest.mark.slow
@pytest.mark.parametrize("name", EXPECTED)
def test_a_sound_run_meets_all_and_each_fault_fails_what_it_must(sound, name):
    ours = sound(name)
    seen = expect(name, happened(runner.read_back(ours).played))
    assert [e for e in seen if not e.met] == []
    for fault in {d.spoiled_by for d in EXPECTED[name]}:
        if fault in PLANTED or name in SHORT:
            seen = expect(name, happened(spoiled(fault, ours)))
            for demand, found in zip(EXPECTED[name], seen, strict=True):
                assert demand.spoiled_by != fault or not found.met, (fault, found)

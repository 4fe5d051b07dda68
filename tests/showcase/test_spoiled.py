"""Every expectation fails in the run that must fail it, and is met by the run as it should be."""

import pytest
from spoiled_runs import PLANTED, happened, sound_run, spoiled

from corporeal import pipeline
from corporeal.showcase.expectations import EXPECTED, SPOILERS, expect

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def ours(tmp_path_factory):
    """Simulate a scene at draft, once."""
    kept = {}

    def run(name):
        if name not in kept:
            kept[name] = sound_run(name, tmp_path_factory.mktemp(name))
        return kept[name]

    return run


FAULTS = [
    (name, fault) for name, row in EXPECTED.items() for fault in {d.spoiled_by: 0 for d in row}
]


def test_faults_are_simulated_or_planted():
    assert set(PLANTED) < set(SPOILERS)


@pytest.mark.parametrize("name", EXPECTED)
def test_a_run_as_it_should_be_meets_all(ours, name):
    seen = expect(name, happened(pipeline.read_back(ours(name)).played))
    assert [e for e in seen if not e.met] == []


@pytest.mark.parametrize(("name", "fault"), FAULTS)
def test_the_run_with_the_fault_fails_what_it_must(ours, name, fault):
    seen = expect(name, happened(spoiled(fault, ours(name))))
    for demand, found in zip(EXPECTED[name], seen, strict=True):
        assert demand.spoiled_by != fault or not found.met, found

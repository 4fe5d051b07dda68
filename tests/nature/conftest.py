"""Every law of nature is asked of every engine."""

import pytest
from laws.suite import CASES

from corporeal.backends import load
from corporeal.mpm.problem import MENU

ROUND_OFF = {"reference": 1e-12, "warp": 1e-5}


@pytest.fixture(params=["reference", "warp"])
def engine(request):
    """Give a function that builds an engine from a problem."""
    chosen = load("engine", request.param, MENU)
    chosen.round_off = ROUND_OFF[request.param]
    return chosen


@pytest.fixture(params=["warp", pytest.param("reference", marks=pytest.mark.slow)])
def patient_engine(request):
    """Give either engine, the reference only in slow runs: for experiments of many steps."""
    chosen = load("engine", request.param, MENU)
    chosen.round_off = ROUND_OFF[request.param]
    return chosen


@pytest.fixture
def fast_engine():
    """Only the production engine: for experiments of many steps."""
    return load("engine", "warp", MENU)


@pytest.fixture
def holds():
    """Run a case of the validation suite and show every check that misses its target."""

    def check(number, quick):
        found = CASES[number].run(quick)
        missed = [c for c in found.checks if not c.met]
        assert not missed, "\n".join(
            f"{c.quantity}: {c.value:.5g}, error {c.error:.3g} {c.unit}" for c in missed
        )
        return found

    return check

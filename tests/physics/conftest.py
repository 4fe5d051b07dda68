"""Every law of nature is asked of every engine."""

from functools import cache, partial

import jaxtyping
import pytest
from laws.asked import CARD, on_device
from laws.suite import CASES

from corporeal.core.registry import load_backend
from corporeal.mpm.problem import ENGINES

ROUND_OFF = {"reference": 1e-12, "cpu": 1e-5, "cuda": 1e-5}
SLOW = () if CARD else (pytest.mark.slow,)
SLOWLY = {name: pytest.param(name, marks=SLOW) for name in ROUND_OFF}


@pytest.fixture(autouse=True)
def unchecked():
    """Leave shapes to the tests of each function: here the same ones come in every step.

    A quarter of the reference's time went to checking them thousands of times.
    """
    jaxtyping.config.update("jaxtyping_disable", True)
    yield
    jaxtyping.config.update("jaxtyping_disable", False)


@cache
def built(name):
    """Give a function that builds an engine; the one for cards is on the processor, or on CARD."""
    chosen = load_backend("engine", name, ENGINES)
    chosen.round_off = ROUND_OFF[name]
    if name != "cuda":
        return chosen
    here = partial(on_device)
    here.round_off = ROUND_OFF[name]
    return here


def asked(name):
    """Give the engine that a test is to ask; a card that is named is asked alone."""
    if CARD and name != "cuda":
        pytest.skip(f"{CARD} is asked alone: CORPOREAL_CARD")
    return built(name)


@pytest.fixture(params=["reference", "cpu", SLOWLY["cuda"]])
def engine(request):
    """Give a function that builds an engine from a problem."""
    return asked(request.param)


@pytest.fixture(params=["cpu", SLOWLY["reference"], SLOWLY["cuda"]])
def patient_engine(request):
    """Give any engine, most only in slow runs: for experiments of many steps."""
    return asked(request.param)


@pytest.fixture
def fast_engine():
    """Only the production engine, or the card: for experiments of many steps."""
    return built("cuda" if CARD else "cpu")


@pytest.fixture
def holds():
    """Run a case of the validation suite and show every check that misses its target."""

    def check(number, quick):
        found = CASES[number].run(quick)
        missed = [c for c in found.checks if not c.met]
        assert not missed, "\n".join(f"{c.quantity}: {c.value:.5g}, error {c.error:.3g} {c.unit}" for c in missed)
        return found

    return check


@pytest.fixture
def engines():
    """Give the function that builds an engine of a name."""
    return built

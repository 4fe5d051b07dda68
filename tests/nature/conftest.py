"""Every law of nature is asked of every engine."""

import sys
from pathlib import Path

import pytest

from corporeal.backends import load
from corporeal.mpm.problem import MENU

sys.path.insert(0, str(Path(__file__).parent))

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

"""How much room the 3D view may take in a report."""

import pytest

from corporeal.pipeline import run_files
from corporeal.pipeline.run_pipeline import read_run
from sample_findings import run_audit


@pytest.fixture(scope="module")
def made(small_run):
    return read_run(small_run)


def view(made, max_bytes=run_files.MAX_VIEW_BYTES):
    happened = made.played.outcome
    return run_files._view(made, run_audit(outcome=happened), max_bytes)


def test_what_is_too_large_has_half_the_pictures_and_then_none(made):
    whole = len(view(made))
    assert whole < run_files.MAX_VIEW_BYTES
    thin = view(made, whole - 1)
    assert 0 < len(thin) < whole and "<script" in thin
    said = view(made, 1000)
    assert "is larger than" in said and "corporeal view RUN" in said


def test_a_view_of_two_balls_with_three_js_takes_less_than_two_and_a_half_megabytes(made):
    assert len(view(made)) < 2_500_000

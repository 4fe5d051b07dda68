"""How much room the 3D view may take in a report."""

import pytest

from corporeal.pipeline import run_files
from corporeal.pipeline.run_pipeline import read_run
from corporeal.pipeline.viewer_data import audit_summary
from sample_findings import audit_finding, run_audit


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


def test_a_grave_finding_is_told_apart_from_warnings_and_shows_its_part(made):
    name = made.scene.objects[0].name
    found = audit_finding(object=name, sentence=f"{name}: it is softer.")
    audit = run_audit(findings=(found,), warnings=(found.sentence, "It may be wrong."))
    told = audit_summary(audit, made.prepared)
    assert [w["text"] for w in told["grave"]] == [found.sentence]
    assert [w["text"] for w in told["warnings"]] == ["It may be wrong."]
    assert [made.parts.catalogue[k].object for k in told["grave"][0]["parts"]] == [0]

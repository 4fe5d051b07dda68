"""What a run found is kept as JSON by the names of its fields, and read back as it was."""

import json
from dataclasses import fields, replace

import pytest

from corporeal.core import store
from corporeal.core.audit_data import Expectation, SettledObjectOutcome, SettlingOutcome
from corporeal.core.deserialize import from_plain
from corporeal.core.errors import BadFileError
from corporeal.core.types import ModelUsage, Note, NoteKind
from corporeal.simulation.audit_file import AUDIT_FILE, read_audit, read_run_audit, write_audit
from sample_findings import object_outcome, outcome, pair_outcome, part_audit, run_audit

WHOLE = run_audit(
    parts=(part_audit(), part_audit(object=None, real_mass_kg=None)),
    settling=SettlingOutcome(0.5, True, (SettledObjectOutcome("a_0", (0.0, 0.0, -0.01), 1.0, 0.02),)),
    warnings=("Objects sink.", Note("a.jpg was left out.", NoteKind.LEFT_OUT)),
    outcome=outcome(
        {"a_0": object_outcome(dent_place=(0.0, 1.0, 2.0), dent_from_contact_m={"floor": None})},
        {"a_0|floor": pair_outcome(first_contact_s=0.25, contact_point=(0.0, 0.0, 0.0))},
        [("a_0", "b_0")],
    ),
    expectations=(Expectation("It falls", "2 mm", "above 1 mm", True),),
    questions=ModelUsage(("openai:x",), 9, 11, 20500, 1200, 43.2, None, "2026-11-21"),
)


def test_an_audit_is_read_back_as_it_was(tmp_path):
    write_audit(tmp_path, WHOLE)
    assert read_run_audit(tmp_path) == WHOLE
    assert read_audit(tmp_path).settling == WHOLE.settling
    assert [n.kind for n in read_run_audit(tmp_path).notes] == [NoteKind.DOUBT, NoteKind.LEFT_OUT]
    plain = json.loads((tmp_path / AUDIT_FILE).read_text())
    assert plain["warnings"] == ["Objects sink.", "a.jpg was left out."]
    assert plain["kind_of_warning"] == ["doubt", "left_out"]


def test_a_kind_that_there_is_not_is_refused(tmp_path):
    store.write_json(tmp_path / AUDIT_FILE, store.to_plain(WHOLE) | {"kind_of_warning": ["dire", "doubt"]})
    with pytest.raises(BadFileError, match="'dire' is not a NoteKind"):
        read_run_audit(tmp_path)


def test_what_is_not_finite_comes_back_as_not_a_number(tmp_path):
    write_audit(tmp_path, replace(WHOLE, momentum_residual=float("inf")))
    found = read_audit(tmp_path).momentum_residual
    assert found != found


@pytest.mark.parametrize("harm", [{"steps": ...}, {"parts": 3}, {"settling": {"seconds": 1.0}}])
def test_what_cannot_be_read_says_how_to_make_it_again(tmp_path, harm):
    plain = store.to_plain(WHOLE) | harm
    data = {key: value for key, value in plain.items() if value is not ...}
    (tmp_path / AUDIT_FILE).write_text(json.dumps(data))
    with pytest.raises(BadFileError, match=r"audit\.json.*corporeal report"):
        read_run_audit(tmp_path)
    with pytest.raises(BadFileError, match=r"audit\.json.*corporeal simulate"):
        read_audit(tmp_path)


def test_keys_of_a_newer_version_are_passed_over():
    thing = {f.name: getattr(WHOLE.settling.objects[0], f.name) for f in fields(SettledObjectOutcome)}
    assert from_plain(SettledObjectOutcome, thing | {"colour": "red"}) == WHOLE.settling.objects[0]

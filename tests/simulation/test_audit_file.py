"""What a run found is kept as JSON by the names of its fields, and read back as it was."""

import json
from dataclasses import fields, replace

import pytest

from corporeal.core import store
from corporeal.core.audit_data import Expectation, SettledObjectOutcome, SettlingOutcome
from corporeal.core.deserialize import from_plain
from corporeal.core.errors import BadFileError
from corporeal.core.types import NO_USAGE, ModelUsage, Note, NoteKind
from corporeal.simulation.audit_file import AUDIT_FILE, read_audit, read_run_audit, write_audit
from sample_findings import object_outcome, outcome, pair_outcome, part_audit, run_audit

WHOLE = run_audit(
    parts=(part_audit(), part_audit(object=None, real_mass_kg=None)),
    settling=SettlingOutcome(
        0.5, True, (SettledObjectOutcome("a_0", (0.0, 0.0, -0.01), 1.0, 0.02),)
    ),
    warnings=("Objects sink.", Note("a.jpg was left out.", NoteKind.LEFT_OUT)),
    outcome=outcome(
        {"a_0": object_outcome(dent_place=(0.0, 1.0, 2.0), dent_from_contact_m={"floor": None})},
        {"a_0|floor": pair_outcome(first_contact_s=0.25, contact_point=(0.0, 0.0, 0.0))},
        [("a_0", "b_0")],
    ),
    expectations=(Expectation("It falls", "2 mm", "above 1 mm", True),),
    questions=ModelUsage(("openai:x",), 9, 11, 20500, 1200, 43.2, None, "2026-11-21"),
)
BEFORE = {
    "particles": 4, "objects": 1, "frames": 2, "cell_m": 0.01, "steps": 7, "dt_min": 0.001,
    "dt_max": 0.001, "nan_count": 0, "particles_out_of_domain": 0, "momentum_residual": 1e-07,
    "energy_growth": 0.0, "mechanical_growth": 0.0, "mass_error": 0.0, "max_penetration_m": 0.002,
    "max_penetration_dx": 0.2, "floor_penetration_m": 0.002, "pair_penetration_m": 0.0,
    "parts": [{
        "name": "can", "object": "can_0", "material": "steel", "law": "von_mises",
        "treatment": "rigid", "structure": "filled", "young_pa": 2e11, "simulated_young_pa": 2e11, "nu": 0.3,
        "density": 7850.0, "density_sim": 7850.0, "yield_stress": 3e8, "yield_stress_sim": 3e8,
        "thickness_m": 0.0002, "contents": "soup", "fill": 0.9, "thickness_sim_m": None,
        "mass_kg": 0.4, "real_mass_kg": 0.4, "reason": "Rigid.",
    }],
    "settling": {"seconds": 0.5, "found": True, "objects": [
        {"name": "can_0", "moved_m": [0.0, 0.0, -0.01], "moved_dx": 1.0, "farthest_m": 0.02}]},
    "outcome": {
        "objects": {"can_0": {
            "at_rest": True, "rms_speed_end": 0.0, "shape_error_end": 0.0, "shape_error_max": 0.0,
            "dent_depth_m": 0.0, "dent_depth_dx": 0.0, "dent_place": None, "dent_share": 0.0,
            "dent_from_contact_m": {"floor": None}, "deepest_squeeze_m": 0.0,
            "moved_m": [0.0, 0.0, -0.1], "moved_level_m": 0.0, "turned_deg": 0.0,
            "rest_drift_m": 0.0, "length_m": 0.12, "fall_m": 0.1, "rebound_m": 0.02,
            "rebound_ratio": 0.2}},
        "pairs": {"can_0|floor": {
            "first_contact_s": 0.14, "contact_point": [0.0, 0.0, 0.0], "separated": None,
            "gap_start_dx": None, "gap_end_m": None, "gap_end_dx": None,
            "largest_gap_after_m": None, "impulse": 0.8}},
        "order": [], "cell_m": 0.01, "duration_s": 1.0},
    "expectations": [{"sentence": "It falls", "value": "2 mm", "target": "above 1 mm",
                      "met": True}],
    "seconds": {"simulate": 4.0, "total": 6.0}, "peak_memory_mb": 400.5,
    "settings": {"detail": "draft", "engine": "warp"}, "questions": {}, "warnings": ["It sinks."],
}  # fmt: skip
"""As a run of version 0.1.0 wrote it, when it was a dictionary."""


def test_an_audit_is_read_back_as_it_was(tmp_path):
    write_audit(tmp_path, WHOLE)
    assert read_run_audit(tmp_path) == WHOLE
    assert read_audit(tmp_path).settling == WHOLE.settling
    assert [n.kind for n in read_run_audit(tmp_path).notes] == [NoteKind.DOUBT, NoteKind.LEFT_OUT]
    plain = json.loads((tmp_path / AUDIT_FILE).read_text())
    assert plain["warnings"] == ["Objects sink.", "a.jpg was left out."]
    assert plain["kind_of_warning"] == ["doubt", "left_out"]


def test_a_kind_that_there_is_not_is_refused(tmp_path):
    store.write_json(
        tmp_path / AUDIT_FILE, store.to_plain(WHOLE) | {"kind_of_warning": ["dire", "doubt"]}
    )
    with pytest.raises(BadFileError, match="'dire' is not a NoteKind"):
        read_run_audit(tmp_path)


def test_a_run_from_before_opens_and_its_keys_are_still_those(tmp_path):
    store.write_json(tmp_path / AUDIT_FILE, BEFORE)
    found = read_run_audit(tmp_path)
    assert found.parts[0].young_pa == 2e11 and found.parts[0].contents == "soup"
    assert found.outcome.pair("floor", "can_0").contact_point == (0.0, 0.0, 0.0)
    assert found.outcome.objects["can_0"].moved_m == (0.0, 0.0, -0.1)
    assert found.questions == NO_USAGE
    assert [(str(n), n.kind) for n in found.notes] == [("It sinks.", NoteKind.DOUBT)]
    write_audit(tmp_path, found)
    again = json.loads((tmp_path / AUDIT_FILE).read_text())
    assert again.pop("questions")["models"] == []
    since = "energy_gain unbooked_loss impact_loss impact_gain start_penetration_m".split()
    for kept_since in since:
        assert again.pop(kept_since) is None
    for kept_since in ("left_vessel", "reach_m", "height_m", "rim_height_m"):
        assert again["outcome"]["objects"]["can_0"].pop(kept_since) is None
    assert again.pop("breakage") == []
    assert again.pop("surfaces") == []
    assert again.pop("hints") == []
    assert again.pop("kind_of_warning") == []
    assert again == {key: value for key, value in BEFORE.items() if key != "questions"}


def test_what_is_not_finite_comes_back_as_not_a_number(tmp_path):
    write_audit(tmp_path, replace(WHOLE, momentum_residual=float("inf")))
    found = read_audit(tmp_path).momentum_residual
    assert found != found


@pytest.mark.parametrize("harm", [{"steps": ...}, {"parts": 3}, {"settling": {"seconds": 1.0}}])
def test_what_cannot_be_read_says_how_to_make_it_again(tmp_path, harm):
    data = {key: value for key, value in (BEFORE | harm).items() if value is not ...}
    (tmp_path / AUDIT_FILE).write_text(json.dumps(data))
    with pytest.raises(BadFileError, match=r"audit\.json.*corporeal report"):
        read_run_audit(tmp_path)
    with pytest.raises(BadFileError, match=r"audit\.json.*corporeal simulate"):
        read_audit(tmp_path)


def test_keys_of_a_newer_version_are_passed_over():
    thing = {
        f.name: getattr(WHOLE.settling.objects[0], f.name) for f in fields(SettledObjectOutcome)
    }
    assert from_plain(SettledObjectOutcome, thing | {"colour": "red"}) == WHOLE.settling.objects[0]
